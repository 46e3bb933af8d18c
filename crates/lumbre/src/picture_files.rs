//! Writes traced pictures: an OpenEXR file with auxiliary pictures as layers, or a PNG file for each.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::Context;
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer, LayerAttributes,
    LineOrder, Text, Vec2, WritableImage,
};
use glam::DVec3;
use lumbre::optics::encode_srgb;
use lumbre::render::Display;
use lumbre::trace::{Aov, AovPicture, AovValues, Picture, heat_color, shown};

use crate::output::write_file;

/// How radiance is converted to pixel values.
#[derive(Clone, Copy, Debug)]
pub struct Development {
    pub display: Display,
    /// The factor on radiance.
    pub exposure: f64,
}

impl Development {
    fn color(self, radiance: DVec3) -> DVec3 {
        let color = radiance * self.exposure;
        match self.display {
            Display::Linear => color,
            Display::Clamp => color.clamp(DVec3::ZERO, DVec3::ONE),
            Display::Srgb => shown(color),
        }
    }
}

/// Writes one file in which R, G and B are the picture, and every auxiliary picture is a layer `NAME.R` and
/// so on. Light is converted as the picture is, so that under linear display its sums still hold; albedo,
/// normals, metres and counts are written as they are.
pub fn write_open_exr(path: &Path, picture: &Picture, how: Development) -> anyhow::Result<()> {
    let mut channels = Vec::new();
    let mut taken = BTreeSet::new();
    let mut add = |layer: Option<&str>, names: &[&str], values: &dyn Fn(usize, usize) -> f64| {
        for (channel, name) in names.iter().enumerate() {
            let full = layer.map_or((*name).to_owned(), |layer| format!("{layer}.{name}"));
            let samples = (0..picture.radiance.len()).map(|at| values(at, channel) as f32).collect();
            channels.push((full, FlatSamples::F32(samples)));
        }
    };
    add(None, &["R", "G", "B"], &|at, channel| how.color(picture.radiance[at])[channel]);
    for found in &picture.aovs {
        let layer = layer_name(&found.aov, &mut taken);
        match &found.values {
            AovValues::Colors(values) if is_light(&found.aov) => {
                add(Some(&layer), &["R", "G", "B"], &|at, channel| how.color(values[at])[channel]);
            }
            AovValues::Colors(values) => {
                add(Some(&layer), &["R", "G", "B"], &|at, channel| values[at][channel]);
            }
            AovValues::Directions(values) => {
                add(Some(&layer), &["X", "Y", "Z"], &|at, channel| values[at][channel]);
            }
            AovValues::Numbers(values) => {
                let name = if found.aov == Aov::Depth { "Z" } else { "Y" };
                add(Some(&layer), &[name], &|at, _| values[at]);
            }
        }
    }
    // Names are UTF-8, as OpenEXR requires.
    let named = |(name, samples): (String, FlatSamples)| {
        AnyChannel::new(Text::from_slice_unchecked(name.as_bytes()), samples)
    };
    let size = Vec2(picture.width as usize, picture.height as usize);
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let channels = AnyChannels::sort(channels.into_iter().map(named).collect());
    let image = Image::from_layer(Layer::new(size, LayerAttributes::default(), encoding, channels));
    write_file(path, |path| Ok(image.write().non_parallel().to_file(path)?))
}

/// Writes the picture, and every auxiliary picture to a file of its own: `room.png`, `room.albedo.png`,
/// `room.light-lamp.png`. Returns the paths of the auxiliary pictures, each with the meaning of its colours
/// unless it shows light or albedo.
pub fn write_png(
    path: &Path,
    picture: &Picture,
    how: Development,
) -> anyhow::Result<Vec<(PathBuf, Option<String>)>> {
    let size = (picture.width, picture.height);
    write_bytes(path, size, picture.radiance.iter().map(|pixel| bytes(how.color(*pixel))))?;
    let mut taken = BTreeSet::new();
    let mut written = Vec::new();
    for found in &picture.aovs {
        let beside = path_beside(path, &found.aov, &mut taken)?;
        let meaning = write_auxiliary(&beside, size, found, how)?;
        written.push((beside, meaning));
    }
    Ok(written)
}

fn write_auxiliary(
    path: &Path,
    size: (u32, u32),
    found: &AovPicture,
    how: Development,
) -> anyhow::Result<Option<String>> {
    match &found.values {
        AovValues::Colors(values) if is_light(&found.aov) => {
            write_bytes(path, size, values.iter().map(|value| bytes(how.color(*value))))?;
            Ok(None)
        }
        AovValues::Colors(values) => {
            let encoded = |value: &DVec3| value.clamp(DVec3::ZERO, DVec3::ONE).map(encode_srgb);
            write_bytes(path, size, values.iter().map(|value| bytes(encoded(value))))?;
            let meaning = "white is a radiance of 1 or more, or an error that is not known yet";
            Ok((found.aov == Aov::StandardError).then(|| meaning.to_owned()))
        }
        AovValues::Directions(values) => {
            write_bytes(path, size, values.iter().map(|value| bytes((*value + 1.0) * 0.5)))?;
            Ok(Some("red, green, blue are x, y, z from -1 to 1".to_owned()))
        }
        AovValues::Numbers(values) if found.aov == Aov::Depth => {
            let surfaces = || values.iter().copied().filter(|value| value.is_finite());
            let nearest = surfaces().fold(f64::INFINITY, f64::min);
            let farthest = surfaces().fold(0.0, f64::max);
            // Black is reserved for the background.
            let grey = |depth: &f64| match depth.is_finite() {
                true => 1.0 - 0.9 * (depth - nearest) / (farthest - nearest).max(f64::MIN_POSITIVE),
                false => 0.0,
            };
            write_bytes(path, size, values.iter().map(|value| bytes(DVec3::splat(grey(value)))))?;
            Ok(nearest.is_finite().then(|| {
                format!("white is {nearest:.3} m away, a tenth of it {farthest:.3} m, black nothing")
            }))
        }
        AovValues::Numbers(values) => {
            let most = values.iter().copied().fold(0.0, f64::max);
            write_bytes(path, size, values.iter().map(|value| heat_color(value / f64::max(most, 1.0))))?;
            Ok(Some(format!("black is none, white {most:.0}")))
        }
    }
}

/// Returns true if the picture holds radiance, which has to be converted for display.
fn is_light(aov: &Aov) -> bool {
    matches!(aov, Aov::Light(_) | Aov::Source { .. } | Aov::EverySource { .. })
}

/// Returns the path of an auxiliary picture beside the main one, without characters that file systems
/// reserve.
fn path_beside(path: &Path, aov: &Aov, taken: &mut BTreeSet<String>) -> anyhow::Result<PathBuf> {
    let stem = path.file_stem().and_then(|stem| stem.to_str());
    let stem = stem.with_context(|| format!("{}: this names no file", path.display()))?;
    let kept = |letter: char| match letter {
        ':' => '-',
        '/' | '\\' | '*' | '?' | '"' | '<' | '>' | '|' => '_',
        letter if letter.is_control() => '_',
        letter => letter,
    };
    let plain: String = aov.to_string().chars().map(kept).collect();
    Ok(path.with_file_name(format!("{stem}.{}.png", free(plain, taken))))
}

/// Longest name of a layer in bytes, which leaves room for the suffix of its channels.
const LONGEST_LAYER: usize = 240;

fn layer_name(aov: &Aov, taken: &mut BTreeSet<String>) -> String {
    let mut name = aov.to_string();
    name.truncate(name.floor_char_boundary(LONGEST_LAYER));
    free(name, taken)
}

/// Returns a name that is not taken yet, ignoring case, by adding a number if necessary.
fn free(plain: String, taken: &mut BTreeSet<String>) -> String {
    let mut name = plain.clone();
    let mut number = 2;
    while !taken.insert(name.to_lowercase()) {
        name = format!("{plain}-{number}");
        number += 1;
    }
    name
}

fn bytes(color: DVec3) -> [u8; 3] {
    color.to_array().map(|value| (value.clamp(0.0, 1.0) * 255.0).round() as u8)
}

fn write_bytes(
    path: &Path,
    (width, height): (u32, u32),
    pixels: impl Iterator<Item = [u8; 3]>,
) -> anyhow::Result<()> {
    let image = image::RgbImage::from_raw(width, height, pixels.flatten().collect());
    let image = image.context("the picture has another size than was asked for")?;
    write_file(path, |path| Ok(image.save(path)?))
}
