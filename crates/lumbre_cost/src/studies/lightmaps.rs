//! Study of the density and the format of lightmaps: their sizes and times against what a frame loses.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use lumbre_bake::{BakeOptions, Density};
use lumbre_render::FrameOptions;
use lumbre_scene::{
    Lightmap, LightmapEncoding, LightmapImage, Mesh, PackedFormat, Supercompression, lightmap_to_ktx2,
    lightmap_to_open_exr,
};

use super::bake::{ERROR, QUICK_ERROR};
use super::over_scenes;
use crate::baked::{Baked, bake_arguments, bake_options, bake_scene, nothing_to_bake};
use crate::findings::{listed, percent, rounded, short};
use crate::frame::Frame;
use crate::frames::draw_frames;
use crate::fronts::pareto_front;
use crate::measured::Measured;
use crate::scene_file::SceneFile;
use crate::scenes::Air;
use crate::{Conditions, CostError, ErrorOver, Plot, Point, Quantity, Spread, Study};

/// Approximate number of texels of the reference; each lower density has a quarter of the texels of the one
/// before.
const TEXELS: f64 = 20_000.0;
const FEW_TEXELS: f64 = 4_000.0;
/// Reductions of the density relative to the densest.
const PARTS: &[f64] = &[1.0, 2.0, 4.0, 8.0];
const FEW_PARTS: &[f64] = &[1.0, 2.0, 4.0];
const DENSITY: &str = "texels along a metre";
const BYTES: &str = "bytes of textures in that format";
const BAKE: &str = "baked before, ms";
const SECONDS: f64 = 5.0;

/// The format of texels on the GPU and in a file.
#[derive(Clone, Copy)]
enum Format {
    Halves,
    Packed(PackedFormat),
}

impl Format {
    const ALL: [Self; 3] =
        [Self::Halves, Self::Packed(PackedFormat::Rgb9E5), Self::Packed(PackedFormat::B10G11R11)];

    fn name(self) -> &'static str {
        match self {
            Self::Halves => "half floats",
            Self::Packed(PackedFormat::Rgb9E5) => "RGB9E5",
            Self::Packed(PackedFormat::B10G11R11) => "B10G11R11",
        }
    }

    /// Returns the bytes of a texel on the GPU.
    fn bytes(self) -> f64 {
        match self {
            Self::Halves => 8.0,
            Self::Packed(_) => 4.0,
        }
    }

    /// Returns a map after it was encoded and decoded, and the size of its file in bytes. Frames store all
    /// maps as half floats, which represent every value of the packed formats.
    fn kept(self, map: &LightmapImage) -> Result<(LightmapImage, usize), CostError> {
        Ok(match self {
            Self::Halves => {
                let encoding = LightmapEncoding::Rgb16Float;
                (LightmapImage { encoding, ..map.clone() }, lightmap_to_open_exr(map, encoding)?.0.len())
            }
            Self::Packed(format) => {
                let file = lightmap_to_ktx2(map, format, Supercompression::Zstandard)?.0;
                let through =
                    |texel: &glam::Vec3| format.encode(*texel).map_or(*texel, |bits| format.decode(bits));
                let texels = map.texels.iter().map(through).collect();
                (LightmapImage { texels, ..map.clone() }, file.len())
            }
        })
    }
}

/// Runs the study.
///
/// # Errors
/// [`CostError`].
pub fn run(conditions: &Conditions<'_>) -> Result<Measured, CostError> {
    over_scenes(conditions, study(), ("room", Air::Clear), |scene, told, measured| {
        of_scene(conditions, scene, told, measured)
    })
}

fn study() -> Study {
    Study {
        name: "lightmaps".into(),
        title: "Density and format of lightmaps".into(),
        question: "How do the density of lightmaps and the bytes per texel affect the error and the time of a frame?".into(),
        reference: "the frame with the densest lightmaps, in half floats".into(),
        notes: vec![
            "Lightmaps are unpacked when they are uploaded. On the device every format becomes half floats, so that all formats should take the same time. Bytes are those of the format itself."
                .into(),
        ],
        plots: vec![Plot {
            title: "Error over bytes".into(),
            across: Quantity::Count(BYTES.into()),
            up: Quantity::Error,
            joined: true,
            front: true,
            ..Plot::default()
        }],
        ..Study::default()
    }
}

/// The maps of one density.
struct Maps {
    baked: Baked,
    options: BakeOptions,
    density: f64,
}

fn of_scene(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    [before, after]: [f64; 2],
    measured: &mut Measured,
) -> Result<(), CostError> {
    if let Some(why) = nothing_to_bake(conditions, scene)? {
        measured.study.notes.push(why);
        return Ok(());
    }
    let part = |share: f64| before + share * (after - before);
    let options = bake_options(conditions, scene, conditions.unless_quick(TEXELS, FEW_TEXELS))?;
    let Density::TexelsPerMeter(densest) = options.density else { return Ok(()) };
    let mut all = Vec::new();
    let parts = conditions.unless_quick(PARTS, FEW_PARTS);
    let error = conditions.unless_quick(ERROR, QUICK_ERROR);
    for (place, halved) in parts.iter().enumerate() {
        let density = densest / halved;
        let options = BakeOptions { density: Density::TexelsPerMeter(density), error, ..options };
        let told = [place, place + 1].map(|place| part(0.6 * place as f64 / parts.len() as f64));
        all.push(Maps { baked: bake_scene(conditions, scene, &options, told)?, options, density });
    }
    let mut frames = Vec::new();
    let mut points = Vec::new();
    for (place, maps) in all.iter_mut().enumerate() {
        for format in Format::ALL {
            // Formats make the same difference at every density, so only the two highest densities are
            // measured in all formats, or only the highest.
            if place > conditions.unless_quick(1, 0) && !matches!(format, Format::Halves) {
                continue;
            }
            let (world, sizes) = in_format(conditions, scene, &mut maps.baked.world, format)?;
            frames.push(Frame::new(world, FrameOptions::default()).sharing("lightmaps"));
            points.push(point(conditions, scene, maps, format, sizes));
        }
    }
    let drawn = draw_frames(conditions, frames, SECONDS, [part(0.6), part(1.0)])?;
    let reference = measured.keep_reference(&format!("{} densest", scene.name), drawn[0].picture.clone());
    let first = measured.study.points.len();
    for (mut point, frame) in points.into_iter().zip(&drawn) {
        point.milliseconds = frame.spread();
        point.counts.extend(frame.counts());
        measured.add_picture(point, frame.picture.clone(), &reference, ErrorOver::Picture)?;
    }
    let finding = finding(&scene.name, &measured.study.points[first..]);
    measured.study.findings.extend(finding);
    Ok(())
}

/// Bytes of the textures on the GPU, bytes of their files, and number of texels.
struct Sizes {
    textures: f64,
    files: f64,
    texels: f64,
}

/// Creates the scene with the maps of a bake after they were encoded in a format and decoded.
fn in_format(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    baked: &mut World,
    format: Format,
) -> Result<(World, Sizes), CostError> {
    let mut kept: Vec<(Arc<LightmapImage>, Arc<LightmapImage>)> = Vec::new();
    let mut sizes = Sizes { textures: 0.0, files: 0.0, texels: 0.0 };
    let mut maps = baked.query::<&Lightmap>();
    for map in maps.iter(baked) {
        if kept.iter().any(|(known, _)| Arc::ptr_eq(known, &map.image)) {
            continue;
        }
        let (image, file) = format.kept(&map.image)?;
        sizes.files += file as f64;
        sizes.texels += image.texels.len() as f64;
        sizes.textures += format.bytes() * image.texels.len() as f64;
        kept.push((Arc::clone(&map.image), Arc::new(image)));
    }
    // The scene is read again and has the same entities. They get the results of the bake, with other maps.
    let mut world = scene.open(conditions.aspect())?;
    let mut lit = baked.query::<(Entity, &Mesh, &Lightmap)>();
    for (entity, mesh, map) in lit.iter(baked) {
        let Some((_, image)) = kept.iter().find(|(known, _)| Arc::ptr_eq(known, &map.image)) else {
            continue;
        };
        if let Ok(mut entity) = world.get_entity_mut(entity) {
            entity.insert((mesh.clone(), Lightmap { image: Arc::clone(image) }));
        }
    }
    Ok((world, sizes))
}

fn point(conditions: &Conditions<'_>, scene: &SceneFile, maps: &Maps, format: Format, sizes: Sizes) -> Point {
    let counts = [(BYTES, sizes.textures), ("bytes of the files", sizes.files), ("texels", sizes.texels)];
    let series = scene.series(conditions, format.name());
    // Frames read the half floats that are stored beside a packed file.
    let command = match format {
        Format::Halves => format!(
            "lumbre bake {} -o baked.glb {} --exr half && {}",
            scene.in_commands(),
            bake_arguments(&maps.options),
            conditions.drawing("baked.glb", "")
        ),
        Format::Packed(_) => conditions.again("lightmaps"),
    };
    Point {
        series,
        label: format!("{} a metre", short(maps.density)),
        parameters: [(DENSITY.to_owned(), maps.density)].into(),
        counts: counts.map(|(name, count)| (name.to_owned(), count)).into(),
        figures: [(BAKE.to_owned(), 1e3 * maps.baked.report.seconds)].into(),
        command,
        ..Point::default()
    }
}

/// Reports what formats and densities lose, and whether their times differ.
fn finding(scene: &str, points: &[Point]) -> Vec<String> {
    let [reference, others @ ..] = points else { return Vec::new() };
    let errors = |points: &[&Point]| {
        points.iter().filter_map(|p| p.error).map(|e| e.relative_rmse).fold(0.0, f64::max)
    };
    let same_density: Vec<&Point> = others.iter().filter(|point| point.label == reference.label).collect();
    let coarser: Vec<&Point> = others.iter().filter(|point| point.label != reference.label).collect();
    let mut findings = Vec::new();
    if let Some(next) =
        coarser.iter().filter_map(|point| point.error).map(|e| e.relative_rmse).min_by(f64::total_cmp)
    {
        let formats: Vec<String> = same_density
            .iter()
            .filter_map(|point| {
                Some(format!("{} loses {}", point.series, percent(point.error?.relative_rmse)))
            })
            .collect();
        let formats: Vec<&str> = formats.iter().map(String::as_str).collect();
        let less = if errors(&same_density) < next { "less than" } else { "not less than" };
        findings.push(format!(
            "In the {scene}, {}: {less} half the density, which loses {}.",
            listed(&formats, "and"),
            percent(next)
        ));
    }
    // The front is one of bytes and errors, so the bytes replace the times.
    let by_bytes: Vec<Point> = points
        .iter()
        .filter_map(|point| {
            let bytes = *point.counts.get(BYTES)?;
            let milliseconds = Spread::of(&[bytes]);
            Some(Point { milliseconds, ..point.clone() })
        })
        .collect();
    let front: Vec<String> = pareto_front(&by_bytes)
        .iter()
        .filter_map(|point| {
            let bytes = point.milliseconds?.median;
            Some(format!(
                "{} at {} ({} MB, {})",
                point.series,
                point.label,
                rounded(bytes / 1e6),
                percent(point.error?.relative_rmse)
            ))
        })
        .collect();
    let front: Vec<&str> = front.iter().map(String::as_str).collect();
    findings.push(format!(
        "The lightmaps of the {scene} with the fewest bytes for their error: {}.",
        listed(&front, "and")
    ));
    let told_apart = others.iter().any(|point| match (point.milliseconds, reference.milliseconds) {
        (Some(time), Some(whole)) => time.is_below(&whole) || whole.is_below(&time),
        _ => false,
    });
    if !told_apart {
        findings
            .push(format!("The times of the {scene}'s frames with these lightmaps are not distinguishable."));
    }
    findings
}
