//! Study of the difference between a frame and physically correct light: frames with more and more effects,
//! the ray tree and paths, compared with a converged picture of all light.

use std::sync::{Arc, Mutex};
use std::time::Instant;

use bevy_ecs::prelude::*;
use lumbre_bake::{BakeOptions, Probes};
use lumbre_optics::{BakeMode, Light, Shading};
use lumbre_render::FrameOptions;
use lumbre_scene::DynamicObject;
use lumbre_trace::{Integrator, TraceOptions};

use super::bake::{ERROR, QUICK_ERROR, texels_of_room};
use super::over_scenes;
use crate::bake_once::bake_once;
use crate::baked::{bake_arguments, bake_options, bake_world, few_bakes, nothing_to_bake_in};
use crate::findings::{cheapest_by_error, error_of, milliseconds, percent, rounded, rounds, times_of};
use crate::frame::Frame;
use crate::frames::draw_frames;
use crate::measured::Measured;
use crate::picture::Picture;
use crate::rounds::{Repeated, milliseconds_since, repeated};
use crate::scene_file::SceneFile;
use crate::scenes::Air;
use crate::traced::{ray_tree, traced};
use crate::{Conditions, CostError, ErrorOf, ErrorOver, Plot, Point, Quantity, Spread, Study};

/// Numbers of paths per pixel, which come in fours. The second one is that of paths that are cut short.
const PATHS: &[u32] = &[4, 8, 16];
const FEW_PATHS: &[u32] = &[4, 8];
/// Numbers of reflections after which paths are cut short.
const BOUNCES: &[u32] = &[0, 1, 2, 4];
const FEW_BOUNCES: &[u32] = &[0, 2];
const REFLECTIONS: &str = "reflections on the way";
/// Factor by which pictures are smaller along each side than in other studies, as path tracing takes long.
const SMALLER: u32 = 3;
const SECONDS: f64 = 4.0;
const FRAME: &str = "frame";
const AT_VERTICES: &str = "Gouraud frame";
const PATH_SERIES: &str = "paths";
const CUT: &str = "paths cut short";
const BAKE: &str = "baked before, ms";
/// How bright a frame is on average.
const BRIGHTNESS: &str = "mean beside the reference's, %";

/// Runs the study.
///
/// # Errors
/// [`CostError`].
pub fn run(conditions: &Conditions<'_>) -> Result<Measured, CostError> {
    let (width, height) = conditions.size;
    let size = [width, height].map(|side| (side / SMALLER).max(8));
    let smaller = Conditions { size: (size[0], size[1]), ..*conditions };
    let mut measured = over_scenes(conditions, study(), ("room", Air::Clear), |scene, told, measured| {
        of_scene(&smaller, scene, told, measured)
    })?;
    let note = "The reference's own noise adds to the squares of all errors but those of paths, which are its own first paths and seem closer to it than they are. The findings take that into account; plots and tables show the plain differences, with what that leaves open of them.";
    measured.study.notes.push(note.into());
    Ok(measured)
}

fn study() -> Study {
    Study {
        name: "transport".into(),
        title: "Frames compared with all light".into(),
        question: "Where does the error of a frame come from: shadows, samples, or light that surfaces exchange? And how long do rays take to reach the same error?".into(),
        reference: "all light, computed by path tracing with many samples per pixel".into(),
        plots: vec![Plot {
            title: "Error over time".into(),
            across: Quantity::Milliseconds,
            up: Quantity::Error,
            joined: true,
            front: true,
            ..Plot::default()
        }],
        ..Study::default()
    }
}

fn of_scene(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    [before, after]: [f64; 2],
    measured: &mut Measured,
) -> Result<(), CostError> {
    let part = |share: f64| before + share * (after - before);
    let series = |name: &str| scene.series(conditions, name);
    let size = conditions.size_text();
    let paths = |samples| TraceOptions {
        size: conditions.size,
        integrator: Integrator::Path,
        samples: Some(samples),
        ..TraceOptions::default()
    };
    let most = conditions.unless_quick(128, 48);
    let (picture, report) = traced(conditions, scene, &paths(most))?;
    // The tracer states the error relative to the mean; errors in reports are relative to the root mean
    // square.
    let (brightness, truth) = (mean(&picture), picture.clone());
    let open = report.standard_error.unwrap_or(0.0) * mean_over_root_mean_square(&picture);
    let reference = measured.keep_reference(&format!("{} by {most} paths", scene.name), picture);
    let uncertain = Some(ErrorOf { uncertainty: open, ..ErrorOf::default() });
    conditions.tell(part(0.5))?;

    let first = measured.study.points.len();
    let steps = steps(conditions, scene, [part(0.5), part(0.6)], measured)?;
    let mut frames = Vec::new();
    for step in &steps {
        frames.push(Frame::of(&step.world, step.options.clone()).sharing("transport"));
    }
    let drawn = draw_frames(conditions, frames, SECONDS, [part(0.6), part(0.7)])?;
    let pictured: Vec<&Picture> = steps
        .iter()
        .zip(&drawn)
        .filter(|(step, _)| step.series == FRAME)
        .map(|(_, frame)| &frame.picture)
        .collect();
    let told_apart: Vec<bool> = pictured.windows(2).map(|pair| differ(pair[0], pair[1], &truth)).collect();
    for (step, frame) in steps.into_iter().zip(&drawn) {
        let relative = 100.0 * mean(&frame.picture) / brightness.max(f64::MIN_POSITIVE);
        let bake = step.bake_ms.map(|ms| (BAKE.to_owned(), ms));
        let point = Point {
            series: series(step.series),
            label: step.label.to_owned(),
            milliseconds: frame.spread(),
            error: uncertain,
            counts: frame.counts(),
            figures: bake.into_iter().chain([(BRIGHTNESS.to_owned(), relative)]).collect(),
            command: step.command,
            ..Point::default()
        };
        measured.add_picture(point, frame.picture.clone(), &reference, ErrorOver::Picture)?;
    }

    let tree = |samples| TraceOptions { samples: Some(samples), ..ray_tree(conditions) };
    let trees = [1, 4].map(|samples| ("ray tree", tree(samples), samples, format!("--samples {samples}")));
    let numbers = conditions.unless_quick(PATHS, FEW_PATHS).iter();
    let all = numbers.map(|n| (PATH_SERIES, paths(*n), *n, format!("--integrator path --samples {n}")));
    let samples = conditions.unless_quick(PATHS, FEW_PATHS)[1];
    let bounces = conditions.unless_quick(BOUNCES, FEW_BOUNCES).iter().map(|&depth| {
        let asked = format!("--integrator path --samples {samples} --depth {depth}");
        (CUT, TraceOptions { depth: Some(depth), ..paths(samples) }, samples, asked)
    });
    let all: Vec<_> = trees.into_iter().chain(all).chain(bounces).collect();
    let done = repeated(all.len(), conditions.repetitions(), |place, [from, _]| {
        conditions.tell(part(0.7 + 0.3 * from))?;
        let begun = Instant::now();
        let traced = traced(conditions, scene, &all[place].1)?;
        Ok((milliseconds_since(begun), traced))
    })?;
    for ((name, options, samples, asked), Repeated { times, made: (picture, report) }) in all.iter().zip(done)
    {
        let point = Point {
            series: series(name),
            label: match options.depth.filter(|_| *name == CUT) {
                Some(depth) => format!("{samples} a pixel, {depth} reflections"),
                None => format!("{samples} a pixel"),
            },
            parameters: match options.depth.filter(|_| *name == CUT) {
                Some(depth) => [(REFLECTIONS.to_owned(), f64::from(depth))].into(),
                None => Default::default(),
            },
            milliseconds: Spread::of(&times),
            error: uncertain,
            counts: [("rays".to_owned(), report.rays as f64)].into(),
            command: format!("lumbre trace {} -o picture.exr --size {size} {asked}", scene.in_commands()),
            ..Point::default()
        };
        measured.add_picture(point, picture, &reference, ErrorOver::Picture)?;
    }
    for point in &mut measured.study.points[first..] {
        let apart = from_all_light(point, open).zip(point.error);
        if let Some((all_light, plain)) = apart.filter(|_| !point.series.starts_with(CUT)) {
            let uncertainty = (plain.relative_rmse - all_light.relative_rmse).abs() + all_light.uncertainty;
            point.error = Some(ErrorOf { uncertainty, ..plain });
        }
    }
    let points: Vec<&Point> = measured.study.points[first..].iter().collect();
    let findings = findings(&points, &told_apart, open);
    measured.study.findings.extend(findings);
    Ok(())
}

/// A frame that has more of the light than the one before.
struct Step {
    series: &'static str,
    label: &'static str,
    world: Arc<Mutex<World>>,
    options: FrameOptions,
    /// How long its bake took, in milliseconds.
    bake_ms: Option<f64>,
    command: String,
}

/// Returns the frames of a scene, each with more of the light than the one before: first by lamps alone, then with
/// shadows, then with what can be baked. The last step bakes the bounces of lamps that the scene leaves out of its
/// bake, since all light includes them. The same light is drawn under Gouraud shading, too, which document \[M\]
/// (section 1.8) proposes for the game together with radiosity before it.
fn steps(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    [before, after]: [f64; 2],
    measured: &mut Measured,
) -> Result<Vec<Step>, CostError> {
    let light = |shadows, multisample| FrameOptions {
        shadows,
        multisample: Some(multisample),
        ..FrameOptions::default()
    };
    let mut steps = Vec::new();
    for (label, options, more) in [
        ("lamps alone", light(false, false), " --no-shadows"),
        ("and shadows", light(true, false), ""),
        ("and four samples", light(true, true), " --msaa"),
    ] {
        let world = Arc::new(Mutex::new(scene.open(conditions.aspect())?));
        let command = conditions.drawing(scene.in_commands(), more);
        steps.push(Step { series: FRAME, label, world, options, bake_ms: None, command });
    }
    let mut world = scene.open(conditions.aspect())?;
    let why_nothing = nothing_to_bake_in(&mut world, &scene.name);
    let is_bakeable = why_nothing.is_none();
    measured.study.notes.extend(why_nothing);
    let moves = world.query_filtered::<(), With<DynamicObject>>().iter(&world).next().is_some();
    let is_lit_by_unbaked =
        bake_every_lamp(&mut world) && nothing_to_bake_in(&mut world, &scene.name).is_none();
    let bake = bake_options(conditions, scene, texels_of_room(conditions))?;
    let bake = BakeOptions { error: conditions.unless_quick(ERROR, QUICK_ERROR), ..bake };
    let probed = BakeOptions { probes: Probes::Automatic, ..bake };
    let few = few_bakes(conditions, scene)?.filter(|_| is_lit_by_unbaked);
    let has_few = few.is_some();
    measured.study.notes.extend(few.map(|why| {
        format!("{why} There is no frame with the bounces of lamps that the file does not bake.")
    }));
    let bakes = [
        (is_bakeable, "and lightmaps", bake, false),
        (is_bakeable && moves, "and probes", probed, false),
        (is_lit_by_unbaked && !has_few, "and bounces of every lamp", probed, true),
    ];
    let bakes: Vec<_> = bakes.into_iter().filter(|(differs, ..)| *differs).collect();
    let part = |share: f64| before + share * (after - before);
    let count = bakes.len() as f64;
    let mut most_light = None;
    for (number, (_, label, options, of_every_lamp)) in (0..).zip(bakes) {
        let told = [part(f64::from(number) / count), part(f64::from(number + 1) / count)];
        let baked = match options.probes {
            Probes::Never => bake_once(conditions, scene, &options, told)?,
            _ => {
                let mut world = scene.open(conditions.aspect())?;
                if of_every_lamp {
                    bake_every_lamp(&mut world);
                }
                bake_world(conditions, world, &options, None, told)?.0
            }
        };
        let draw = conditions.drawing("baked.glb", " --msaa");
        let command = match options.probes {
            // Files hold probes in fewer bits, and the command line has no option that changes lamps.
            Probes::Automatic => conditions.again("transport"),
            _ => {
                let arguments = bake_arguments(&options);
                format!("lumbre bake {} -o baked.glb {arguments} && {draw}", scene.in_commands())
            }
        };
        let world = Arc::new(Mutex::new(baked.world));
        let bake_ms = Some(1e3 * baked.report.seconds);
        steps.push(Step {
            series: FRAME,
            label,
            world: Arc::clone(&world),
            options: light(true, true),
            bake_ms,
            command,
        });
        most_light = Some((world, bake_ms));
    }
    if let Some((world, bake_ms)) = most_light {
        let options = FrameOptions { shading: Some(Shading::Gouraud), ..light(true, true) };
        let (label, command) = ("with all of it", conditions.again("transport"));
        steps.push(Step { series: AT_VERTICES, label, world, options, bake_ms, command });
    }
    Ok(steps)
}

/// Has the bounces baked of every lamp that is left out of bakes. Returns whether there are such lamps.
fn bake_every_lamp(world: &mut World) -> bool {
    let mut changes = false;
    for mut light in world.query::<&mut Light>().iter_mut(world) {
        if light.bake == BakeMode::Dynamic {
            light.bake = BakeMode::Mixed;
            changes = true;
        }
    }
    changes
}

/// Returns the mean of all channels; 0 for a picture without pixels.
fn mean(picture: &Picture) -> f64 {
    let numbers = 3.0 * picture.radiance.len().max(1) as f64;
    picture.radiance.iter().map(|pixel| pixel.element_sum()).sum::<f64>() / numbers
}

/// Returns the mean of all channels divided by their root mean square; 0 for a black picture.
fn mean_over_root_mean_square(picture: &Picture) -> f64 {
    let numbers = 3.0 * picture.radiance.len().max(1) as f64;
    let squares = picture.radiance.iter().map(|pixel| pixel.length_squared()).sum::<f64>() / numbers;
    if squares > 0.0 { mean(picture) / squares.sqrt() } else { 0.0 }
}

/// Whether one picture is distinguishably closer to a reference than another: the mean over all pixels of the
/// difference of their squared errors is more than three times its own standard error. The reference's noise adds the
/// same to both squares, however it is spread; what chance is left in their difference is a part of that scatter.
fn differ(was: &Picture, is: &Picture, reference: &Picture) -> bool {
    let pixels = was.radiance.iter().zip(&is.radiance).zip(&reference.radiance);
    let differences: Vec<f64> = pixels
        .map(|((was, is), truth)| (*was - *truth).length_squared() - (*is - *truth).length_squared())
        .collect();
    let count = differences.len().max(1) as f64;
    let mean = differences.iter().sum::<f64>() / count;
    let variance = differences.iter().map(|difference| (difference - mean).powi(2)).sum::<f64>() / count;
    mean.abs() > 3.0 * (variance / count).sqrt()
}

/// How well the reference's noise is known, as a fraction.
const NOISE_KNOWN_TO: f64 = 0.2;

/// The error from all light of a picture whose error from the reference is given. `open` is the reference's own noise,
/// which frames and ray trees know nothing of, so that it is a part of their squared errors; paths that are also the
/// reference's first ones share it, and it is missing there. Of paths that are cut short, which begin like them, the
/// whole noise is left open.
fn from_all_light(point: &Point, open: f64) -> Option<ErrorOf> {
    let error = point.error?;
    if point.series.starts_with(CUT) {
        return Some(ErrorOf { uncertainty: open, ..error });
    }
    let sign = if point.series.starts_with(PATH_SERIES) { 1.0 } else { -1.0 };
    let with = |noise: f64| (error.relative_rmse.powi(2) + sign * noise * noise).max(0.0).sqrt();
    let relative_rmse = with(open);
    let [low, high] = [1.0 - NOISE_KNOWN_TO, 1.0 + NOISE_KNOWN_TO].map(|part| with(open * part));
    let uncertainty = match relative_rmse > 0.0 {
        true => (low - relative_rmse).abs().max((high - relative_rmse).abs()),
        false => error.relative_rmse,
    };
    Some(ErrorOf { relative_rmse, uncertainty, ..error })
}

/// `told_apart` says of each frame after the first whether it is distinguishable from the one before.
fn findings(points: &[&Point], told_apart: &[bool], open: f64) -> Vec<String> {
    let from_all_light = |point: &&Point| Point { error: from_all_light(point, open), ..(*point).clone() };
    let points: Vec<Point> = points.iter().map(from_all_light).collect();
    let points: &[&Point] = &points.iter().collect::<Vec<_>>();
    let mut findings = Vec::new();
    let frames: Vec<&&Point> = points.iter().filter(|point| point.series.starts_with(FRAME)).collect();
    let mut said = Vec::new();
    for (pair, is_told) in frames.windows(2).zip(told_apart) {
        let (Some(was), Some(is)) = (pair[0].error, pair[1].error) else { continue };
        let (Some(short), Some(long)) = (pair[0].milliseconds, pair[1].milliseconds) else { continue };
        let cost = match (short.is_below(&long), long.is_below(&short)) {
            (false, false) => {
                format!("for a time that is not distinguishable in {}", rounds(short.rounds.min(long.rounds)))
            }
            _ => format!("for {} instead of {}", milliseconds(&long), milliseconds(&short)),
        };
        let [was, is] = [was, is].map(|error| error_of(&error));
        let change = match *is_told && was != is {
            true => format!("changes the error from {was} to {is}"),
            false => "changes the error by less than the reference can tell".to_owned(),
        };
        said.push(format!("\"{}\" {change} {cost}", pair[1].label));
    }
    if !said.is_empty() {
        findings.push(format!("In the frame, {}.", said.join("; ")));
    }
    let best = frames.iter().filter_map(|point| Some((point, point.error?, point.milliseconds?)));
    if let Some((frame, error, time)) = best.min_by(|a, b| a.1.relative_rmse.total_cmp(&b.1.relative_rmse)) {
        let whole = |point: &&&Point| point.series.starts_with(PATH_SERIES) && !point.series.starts_with(CUT);
        let paths = points.iter().filter(whole);
        let reached = paths
            .filter_map(|point| Some((point, point.error?.relative_rmse, point.milliseconds?)))
            .filter(|(_, found, _)| *found <= error.reached())
            .min_by(|a, b| a.2.median.total_cmp(&b.2.median));
        let paths = match reached {
            Some((point, _, slow)) => format!(
                "path tracing reaches this error with {}, in {}: {}",
                point.label,
                milliseconds(&slow),
                times_of(&slow, &time)
            ),
            None => {
                "path tracing does not reach this error with any number of paths that was tried".to_owned()
            }
        };
        let bake = frame
            .figures
            .get(BAKE)
            .map_or(String::new(), |ms| format!(", after a bake of {} s", rounded(ms / 1e3)));
        let brightness = frame.figures.get(BRIGHTNESS).map_or(String::new(), |relative| {
            format!(", is {} % as bright as all light on average", rounded(*relative))
        });
        findings.push(format!(
            "The best frame (\"{}\") has an error of {}{brightness}, and takes {}{bake}; {paths}. The reference's noise of {} is allowed for.",
            frame.label,
            error_of(&error),
            milliseconds(&time),
            percent(open)
        ));
    }
    findings.extend(of_gouraud(points));
    findings.extend(of_bounces(points));
    findings.extend(cheapest_by_error(points, ""));
    findings
}

/// Compares the frame with all of the light with the same under Gouraud shading.
fn of_gouraud(points: &[&Point]) -> Option<String> {
    let phong = points.iter().rev().find(|point| point.series.starts_with(FRAME))?;
    let gouraud = points.iter().find(|point| point.series.starts_with(AT_VERTICES))?;
    Some(format!(
        "The last of these frames has an error of {} under Gouraud shading, which document [M] proposes for the game, instead of {}, in {}.",
        error_of(&gouraud.error?),
        error_of(&phong.error?),
        times_of(&gouraud.milliseconds?, &phong.milliseconds?)
    ))
}

/// Reports how much light arrives after a number of reflections: the error of paths that are cut short there.
fn of_bounces(points: &[&Point]) -> Option<String> {
    let cut = points.iter().filter(|point| point.series.starts_with(CUT));
    let told: Vec<String> = cut
        .filter_map(|point| {
            let after = point.parameters.get(REFLECTIONS)?;
            let (error, time) = (point.error?, point.milliseconds?);
            Some(format!("{after}: {} in {}", error_of(&error), milliseconds(&time)))
        })
        .collect();
    let all = !told.is_empty();
    all.then(|| format!("Errors of paths that are cut short, by number of reflections: {}.", told.join("; ")))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    fn picture(radiance: impl Fn(usize) -> f64) -> Picture {
        Picture { width: 40, radiance: (0..1600).map(|pixel| DVec3::splat(radiance(pixel))).collect() }
    }

    #[test]
    fn pictures_differ_if_the_reference_can_tell() {
        // The reference's noise is as large as the difference of the two errors, and the same in both.
        let noise = |pixel: usize| if pixel.is_multiple_of(2) { 0.1 } else { -0.1 };
        let reference = picture(|pixel| 1.0 + noise(pixel));
        let [far, near] = [0.2, 0.1].map(|off| picture(|_| 1.0 + off));
        assert!(differ(&far, &near, &reference));
        // Errors of the same size on either side, within the noise.
        let [above, below] = [0.002, -0.002].map(|off| picture(|_| 1.0 + off));
        assert!(!differ(&above, &below, &reference));
        assert!(!differ(&near, &near, &reference));
    }

    #[test]
    fn the_references_noise_is_allowed_for() {
        let error = |series: &str, relative_rmse: f64| {
            let error = Some(ErrorOf { relative_rmse, ..ErrorOf::default() });
            from_all_light(&Point { series: series.into(), error, ..Point::default() }, 0.3).unwrap()
        };
        assert!((error(FRAME, 0.5).relative_rmse - 0.4).abs() < 1e-12);
        assert!((error(PATH_SERIES, 0.4).relative_rmse - 0.5).abs() < 1e-12);
        let unknown = error(FRAME, 0.2);
        assert!(unknown.relative_rmse == 0.0 && unknown.is_below_uncertainty() && unknown.reached() >= 0.2);
    }
}
