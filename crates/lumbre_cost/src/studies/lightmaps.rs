//! Study of the density of lightmaps and of their format on the device: their sizes and times against what a frame
//! loses.

use std::sync::{Arc, Mutex, PoisonError};

use bevy_ecs::prelude::*;
use lumbre_bake::{BakeOptions, BakeReport, Density};
use lumbre_render::{FrameOptions, LightmapMemory};
use lumbre_scene::{FrameSettings, LightmapEncoding, SceneSettings, reduce_lightmaps, shown_lightmaps};
use lumbre_trace::relative_error;

use super::bake::{ERROR, QUICK_ERROR, quick_reference_seconds};
use super::over_scenes;
use crate::bake_once::bake_once;
use crate::baked::{bake_arguments, bake_options, few_bakes, nothing_to_bake};
use crate::converged_bake::{converged, converged_bake};
use crate::findings::{counted, factor, listed, percent, ratio_of, rounded, short, times_of};
use crate::frame::Frame;
use crate::frames::{DrawnFrame, draw_frames};
use crate::fronts::front_of;
use crate::measured::Measured;
use crate::picture::Picture;
use crate::scene_file::SceneFile;
use crate::scenes::Air;
use crate::{Conditions, CostError, ErrorOf, ErrorOver, Plot, Point, Quantity, Study};

/// Approximate number of texels of the reference; each lower density has a quarter of the texels of the one
/// before.
const TEXELS: f64 = 20_000.0;
const FEW_TEXELS: f64 = 4_000.0;
/// The same where each bake takes seconds, as in other studies, so that they share the bake.
const FEWEST_TEXELS: f64 = 700.0;
/// Reductions of the density relative to the densest.
const PARTS: &[f64] = &[1.0, 2.0, 4.0, 8.0];
const FEW_PARTS: &[f64] = &[1.0, 2.0, 4.0];
const DENSITY: &str = "texels along a metre";
const BYTES: &str = "bytes of lightmaps";
const BAKE: &str = "baked before, ms";
/// The error that is due to the format alone.
const OF_FORMAT: &str = "error against rgb32f at the same density, %";
const SECONDS: f64 = 5.0;

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
    let plot = |title: &str, across: Quantity, up: Quantity| Plot {
        title: title.into(),
        across,
        up,
        joined: true,
        front: true,
        ..Plot::default()
    };
    let bytes = || Quantity::Count(BYTES.into());
    Study {
        name: "lightmaps".into(),
        title: "Density and format of lightmaps".into(),
        question: "How do the density of lightmaps and their format on the device affect the error and the time of a frame?".into(),
        reference: "the frame with the lightmaps of a converged bake of the highest density; the noise that this bake states is allowed for. What the format alone loses is the difference from the same lightmaps as 32-bit floats".into(),
        plots: vec![
            plot("Error over bytes", bytes(), Quantity::Error),
            plot("What the format alone loses, over bytes", bytes(), Quantity::Figure(OF_FORMAT.into())),
            plot("Error over time", Quantity::Milliseconds, Quantity::Error),
        ],
        ..Study::default()
    }
}

/// The maps of one density.
struct Maps {
    world: Arc<Mutex<World>>,
    report: BakeReport,
    options: BakeOptions,
    density: f64,
    /// How many texels of the bake became one along each side.
    reduction: u32,
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
    let few = few_bakes(conditions, scene)?;
    let has_few = few.is_some();
    measured.study.notes.extend(few.map(|why| {
        format!("{why} It bakes the highest density only, with fewer texels; lower densities are means of its texels.")
    }));
    let texels = if has_few { FEWEST_TEXELS } else { conditions.unless_quick(TEXELS, FEW_TEXELS) };
    let options = bake_options(conditions, scene, texels)?;
    let Density::TexelsPerMeter(densest) = options.density else { return Ok(()) };
    let error = conditions.unless_quick(ERROR, QUICK_ERROR);
    let parts = conditions.unless_quick(PARTS, FEW_PARTS);
    let options_of_densest = options;
    let mut all = Vec::new();
    for (place, halved) in parts.iter().enumerate() {
        let density = densest / halved;
        let options = BakeOptions { density: Density::TexelsPerMeter(density), error, ..options };
        let told = [place, place + 1].map(|place| part(0.3 * place as f64 / parts.len() as f64));
        let mut baked = match has_few {
            true => bake_once(conditions, scene, &BakeOptions { error, ..options_of_densest }, told)?,
            false => bake_once(conditions, scene, &options, told)?,
        };
        let reduction = if has_few { *halved as u32 } else { 1 };
        reduce_lightmaps(&mut baked.world, reduction);
        let (world, report) = (Arc::new(Mutex::new(baked.world)), baked.report);
        all.push(Maps { world, report, options, density, reduction });
    }
    let time = conditions.reference_time(8.0, quick_reference_seconds(has_few));
    let options_of_truth = converged(conditions, &BakeOptions { error, ..options }, time);
    let truth = converged_bake(conditions, scene, &options_of_truth, [part(0.3), part(0.6)])?;
    let noise = truth.report.error_of_mean;
    measured.study.notes.push(format!(
        "The converged bake of the {} states an error of {} of its mean.",
        scene.name,
        percent(noise)
    ));
    let (mut frames, mut points) = (Vec::new(), Vec::new());
    for maps in &all {
        for &format in LightmapEncoding::ALL {
            let (settings, memory) = in_format(maps, format);
            let frame = Frame::of(&maps.world, FrameOptions::default()).with_settings(settings);
            frames.push(frame.sharing("lightmaps"));
            points.push(point(conditions, scene, maps, format, memory));
        }
    }
    let drawn = draw_frames(conditions, frames, SECONDS, [part(0.6), part(1.0)])?;
    let reference = measured.keep_reference(&format!("{} converged", scene.name), truth.picture.clone());
    let first = measured.study.points.len();
    for (number, (mut point, frame)) in points.into_iter().zip(&drawn).enumerate() {
        let floats = &drawn[number - number % LightmapEncoding::ALL.len()].picture;
        point.figures.insert(OF_FORMAT.to_owned(), 100.0 * apart(floats, &frame.picture));
        point.milliseconds = frame.spread();
        point.counts.extend(frame.counts());
        let uncertainty = explained_by(noise, apart(&truth.picture, &frame.picture));
        point.error = Some(ErrorOf { uncertainty, ..ErrorOf::default() });
        measured.add_picture(point, frame.picture.clone(), &reference, ErrorOver::Picture)?;
    }
    let findings = findings(&scene.name, &measured.study.points[first..], &drawn);
    measured.study.findings.extend(findings);
    Ok(())
}

/// Returns the relative RMSE of a picture.
fn apart(reference: &Picture, picture: &Picture) -> f64 {
    relative_error(&reference.radiance, &picture.radiance)
}

/// Returns how much of an error the reference's own noise, which is independent of it, may account for.
fn explained_by(noise: f64, error: f64) -> f64 {
    error - (error.powi(2) - noise.powi(2)).max(0.0).sqrt()
}

/// Returns the settings of a scene with its lightmaps in this format, and their memory.
fn in_format(maps: &Maps, lightmap_format: LightmapEncoding) -> (SceneSettings, LightmapMemory) {
    // A thread that panicked was only drawing; the World is intact.
    let mut world = maps.world.lock().unwrap_or_else(PoisonError::into_inner);
    let own = world.get_resource::<SceneSettings>().copied().unwrap_or_default();
    let settings = SceneSettings { frame: FrameSettings { lightmap_format, ..own.frame }, ..own };
    let sizes = shown_lightmaps(&mut world).into_iter().map(|image| [image.width, image.height]);
    (settings, LightmapMemory::of(lightmap_format, sizes))
}

fn point(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    maps: &Maps,
    format: LightmapEncoding,
    memory: LightmapMemory,
) -> Point {
    let counts = [(BYTES, memory.bytes as f64), ("texels", memory.texels as f64)];
    let density = Density::TexelsPerMeter(maps.density * f64::from(maps.reduction));
    let baked_with = BakeOptions { density, ..maps.options };
    let reduced = match maps.reduction {
        1 => String::new(),
        reduction => format!(" --lightmap-reduction {reduction}"),
    };
    Point {
        series: scene.series(conditions, format.name()),
        label: format!("{} a metre", short(maps.density)),
        parameters: [(DENSITY.to_owned(), maps.density)].into(),
        counts: counts.map(|(name, count)| (name.to_owned(), count)).into(),
        figures: [(BAKE.to_owned(), 1e3 * maps.report.seconds)].into(),
        command: format!(
            "lumbre bake {} -o baked.glb {} && {}",
            scene.in_commands(),
            bake_arguments(&baked_with),
            conditions.drawing("baked.glb", &format!(" --lightmap-format {}{reduced}", format.name()))
        ),
        ..Point::default()
    }
}

/// Reports what formats and densities lose, and whether their times differ. `points` are all formats of the highest
/// density, then of the next one.
fn findings(scene: &str, points: &[Point], drawn: &[DrawnFrame]) -> Vec<String> {
    let count = LightmapEncoding::ALL.len();
    let (Some(densest), Some(halved)) = (points.get(..count), points.get(count..2 * count)) else {
        return Vec::new();
    };
    let lost = |point: &Point| point.figures.get(OF_FORMAT).copied();
    let error = |point: &Point| point.error.map(|error| error.relative_rmse);
    let mut findings = Vec::new();
    let formats: Vec<String> = densest
        .iter()
        .zip(LightmapEncoding::ALL)
        .skip(1)
        .filter_map(|(point, format)| {
            Some(format!("{} loses {}", format.name(), percent(lost(point)? / 100.0)))
        })
        .collect();
    let formats: Vec<&str> = formats.iter().map(String::as_str).collect();
    if let (Some(full), Some(half)) = (error(&densest[0]), error(&halved[0])) {
        findings.push(format!(
            "In the {scene}, {} of the light, compared with rgb32f at the same density; half the density has an error of {} instead of {}.",
            listed(&formats, "and"),
            percent(half),
            percent(full)
        ));
    }
    let front: Vec<String> = front_of(points, |point| Some((*point.counts.get(BYTES)?, error(point)?)))
        .iter()
        .filter_map(|point| {
            let megabytes = rounded(point.counts.get(BYTES)? / 1e6);
            let error = percent(error(point)?);
            Some(format!("{} at {} ({megabytes} MB, {error})", point.series, point.label))
        })
        .collect();
    let front: Vec<&str> = front.iter().map(String::as_str).collect();
    findings.push(format!(
        "The lightmaps of the {scene} with the fewest bytes for their error: {}.",
        listed(&front, "and")
    ));
    findings.extend(finding_of_times(scene, points, drawn));
    findings
}

/// Says how many times as long frames take in each format as in half floats, and with the fewest texels as with the
/// most.
fn finding_of_times(scene: &str, points: &[Point], drawn: &[DrawnFrame]) -> Option<String> {
    let of_format = |name: &str| -> Vec<f64> {
        let own = points.iter().zip(drawn).filter(|(point, _)| point.series.starts_with(name));
        own.flat_map(|(_, frame)| frame.times.iter().copied()).collect()
    };
    let halves = LightmapEncoding::Rgb16Float.name();
    let others = LightmapEncoding::ALL.iter().map(|format| format.name()).filter(|name| *name != halves);
    let ratio = |name: &str| ratio_of(&of_format(name), &of_format(halves));
    let ratios: Vec<String> =
        others.filter_map(|name| Some(format!("with {name} {}", factor(&ratio(name)?)))).collect();
    let ratios: Vec<&str> = ratios.iter().map(String::as_str).collect();
    let texels = |point: &Point| point.counts.get("texels").copied().unwrap_or_default();
    let of_halves = || points.iter().filter(|point| point.series.starts_with(halves));
    let most = of_halves().max_by(|a, b| texels(a).total_cmp(&texels(b)))?;
    let fewest = of_halves().min_by(|a, b| texels(a).total_cmp(&texels(b)))?;
    Some(format!(
        "A frame of the {scene} takes this many times as long as with {halves}: {}. With {} texels instead of {} it takes {}.",
        listed(&ratios, "and"),
        counted(texels(fewest)),
        counted(texels(most)),
        times_of(&fewest.milliseconds?, &most.milliseconds?)
    ))
}
