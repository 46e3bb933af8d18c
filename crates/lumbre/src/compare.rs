//! `lumbre compare`: measures the difference of two pictures, in radiance and as perceived (FLIP).

use std::io::Write;
use std::path::Path;

use anyhow::{Context, bail};
use glam::DVec3;
use lumbre::optics::decode_srgb;
use lumbre::trace::{compare, heat_color, shown};

use crate::arguments::Compare;
use crate::loading::extension;
use crate::output::write_file;

/// A picture from a file.
struct Read {
    width: u32,
    height: u32,
    pixels: Vec<DVec3>,
    /// Whether the pixels are radiance in floats; otherwise they are sRGB-encoded.
    is_light: bool,
}

/// Runs the command.
pub fn run(asked: &Compare) -> anyhow::Result<()> {
    let (reference, test) = (read(&asked.reference)?, read(&asked.test)?);
    if (reference.width, reference.height) != (test.width, test.height) {
        bail!(
            "{} has {} x {} pixels and {} {} x {}: only pictures of one size can be compared",
            asked.reference.display(),
            reference.width,
            reference.height,
            asked.test.display(),
            test.width,
            test.height
        );
    }
    if let Some(output) = &asked.output
        && extension(output)? != "png"
    {
        bail!("{}: the heat map is written as .png", output.display());
    }
    let shown = [&reference, &test]
        .map(|picture| picture.pixels.iter().map(|p| picture.shown(*p)).collect::<Vec<_>>());
    // If both hold radiance, it is compared as it is; otherwise both are compared as displayed.
    let both_light = reference.is_light && test.is_light;
    let light = |picture: &Read, shown: &[DVec3]| match both_light {
        true => picture.pixels.clone(),
        false => shown.iter().map(|color| decoded(*color)).collect(),
    };
    let linear = [light(&reference, &shown[0]), light(&test, &shown[1])];
    let found = compare(reference.width as usize, [&linear[0], &linear[1]], shown);
    if let Some(output) = &asked.output {
        let bytes: Vec<u8> = found.map.iter().flat_map(|value| heat_color(*value)).collect();
        let image = image::RgbImage::from_raw(reference.width, reference.height, bytes);
        let image = image.context("the heat map has another size than the pictures")?;
        write_file(output, |path| Ok(image.save(path)?))?;
    }
    let mut out = std::io::stdout().lock();
    if asked.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&found)?)?;
        return Ok(());
    }
    let [x, y] = found.largest_at;
    writeln!(
        out,
        "relative error {:.3} %, bias {:+.3} %",
        100.0 * found.relative_error,
        100.0 * found.relative_bias
    )?;
    writeln!(out, "largest difference {:.4e} of a channel, at pixel {x},{y}", found.largest)?;
    match found.psnr {
        Some(psnr) => writeln!(out, "as shown: PSNR {psnr:.1} dB, FLIP {:.4}", found.flip)?,
        None => writeln!(out, "as shown: the same")?,
    }
    Ok(())
}

impl Read {
    fn shown(&self, pixel: DVec3) -> DVec3 {
        if self.is_light { shown(pixel) } else { pixel }
    }
}

fn read(path: &Path) -> anyhow::Result<Read> {
    let image = image::ImageReader::open(path)
        .with_context(|| format!("{} cannot be read", path.display()))?
        .with_guessed_format()
        .with_context(|| format!("{} cannot be read", path.display()))?
        .decode()
        .with_context(|| {
            format!("{} is no picture that can be read; give .png, .jpg or .exr", path.display())
        })?;
    let is_light =
        matches!(image, image::DynamicImage::ImageRgb32F(_) | image::DynamicImage::ImageRgba32F(_));
    let (width, height) = (image.width(), image.height());
    let pixels = image.to_rgb32f().pixels().map(|pixel| glam::Vec3::from(pixel.0).as_dvec3()).collect();
    Ok(Read { width, height, pixels, is_light })
}

/// Decodes sRGB.
fn decoded(color: DVec3) -> DVec3 {
    color.map(decode_srgb)
}
