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

use super::bake::{ERROR, QUICK_ERROR};
use super::over_scenes;
use crate::baked::{bake_arguments, bake_options, bake_world, nothing_to_bake};
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
    let note = "The paths of a picture are also the first paths of the reference. With an eighth of the reference's paths, the error appears smaller than it is by a sixteenth.";
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
    let brightness = mean(&picture);
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
    let all = numbers.map(|n| ("paths", paths(*n), *n, format!("--integrator path --samples {n}")));
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
    let points: Vec<&Point> = measured.study.points[first..].iter().collect();
    let pixels = f64::from(conditions.size.0) * f64::from(conditions.size.1);
    let findings = findings(&points, open, pixels);
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
    if let Some(why) = nothing_to_bake(conditions, scene)? {
        measured.study.notes.push(why);
        return Ok(steps);
    }
    let mut world = scene.open(conditions.aspect())?;
    let moves = world.query_filtered::<(), With<DynamicObject>>().iter(&world).next().is_some();
    let dynamic =
        |world: &mut World| world.query::<&Light>().iter(world).any(|light| light.bake == BakeMode::Dynamic);
    let is_lit_by_unbaked = dynamic(&mut world);
    let bake = bake_options(conditions, scene, conditions.unless_quick(4_000.0, 700.0))?;
    let bake = BakeOptions { error: conditions.unless_quick(ERROR, QUICK_ERROR), ..bake };
    let probed = BakeOptions { probes: Probes::Automatic, ..bake };
    let bakes = [
        (true, "and lightmaps", bake, false),
        (moves, "and probes", probed, false),
        (is_lit_by_unbaked, "and bounces of every lamp", probed, true),
    ];
    let bakes: Vec<_> = bakes.into_iter().filter(|(differs, ..)| *differs).collect();
    let part = |share: f64| before + share * (after - before);
    let count = bakes.len() as f64;
    let mut most_light = None;
    for (number, (_, label, options, of_every_lamp)) in (0..).zip(bakes) {
        let mut world = scene.open(conditions.aspect())?;
        if of_every_lamp {
            world.query::<&mut Light>().iter_mut(&mut world).for_each(|mut light| {
                if light.bake == BakeMode::Dynamic {
                    light.bake = BakeMode::Mixed;
                }
            });
        }
        let told = [part(f64::from(number) / count), part(f64::from(number + 1) / count)];
        let (baked, _) = bake_world(conditions, world, &options, None, told)?;
        let draw = conditions.drawing("baked.glb", " --msaa");
        let command = match of_every_lamp {
            // The command line has no option that changes lamps.
            true => conditions.again("transport"),
            false => {
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

/// Whether the errors of two pictures differ, as seen from the same reference of so many pixels, whose noise is `open`.
/// The noise adds the same to the squares of both errors, apart from its product with the pictures' difference, which
/// is at most the sum of their errors. Over all pixels the mean of that product has a standard deviation of
/// `open` times the difference over the root of their number; three of these count as chance.
fn differ([was, is]: [f64; 2], open: f64, pixels: f64) -> bool {
    (was * was - is * is).abs() > 3.0 * 2.0 * open * (was + is) / pixels.max(1.0).sqrt()
}

fn findings(points: &[&Point], open: f64, pixels: f64) -> Vec<String> {
    let mut findings = Vec::new();
    let frames: Vec<&&Point> = points.iter().filter(|point| point.series.starts_with(FRAME)).collect();
    let mut said = Vec::new();
    for pair in frames.windows(2) {
        let (Some(was), Some(is)) = (pair[0].error, pair[1].error) else { continue };
        let (Some(short), Some(long)) = (pair[0].milliseconds, pair[1].milliseconds) else { continue };
        let cost = match (short.is_below(&long), long.is_below(&short)) {
            (false, false) => {
                format!("for a time that is not distinguishable in {}", rounds(short.rounds.min(long.rounds)))
            }
            _ => format!("for {} instead of {}", milliseconds(&long), milliseconds(&short)),
        };
        let change = match differ([was.relative_rmse, is.relative_rmse], open, pixels) {
            true => format!(
                "changes the error from {} to {}",
                percent(was.relative_rmse),
                percent(is.relative_rmse)
            ),
            false => "changes the error by less than the reference can tell".to_owned(),
        };
        said.push(format!("\"{}\" {change} {cost}", pair[1].label));
    }
    if !said.is_empty() {
        findings.push(format!("In the frame, {}.", said.join("; ")));
    }
    let best =
        frames.iter().filter_map(|point| Some((point, point.error?.relative_rmse, point.milliseconds?)));
    if let Some((frame, error, time)) = best.min_by(|a, b| a.1.total_cmp(&b.1)) {
        let whole = |point: &&&Point| point.series.starts_with("paths") && !point.series.starts_with(CUT);
        let paths = points.iter().filter(whole);
        let reached = paths
            .filter_map(|point| Some((point, point.error?.relative_rmse, point.milliseconds?)))
            .filter(|(_, found, _)| *found <= error)
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
            "The best frame (\"{}\") has an error of {}{brightness}, and takes {}{bake}; {paths}. The uncertainty of the reference is {}.",
            frame.label,
            percent(error),
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
        "Under Gouraud shading, the frame with lightmaps and all of this has an error of {} instead of {}, in {}.",
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
    use super::*;

    #[test]
    fn errors_differ_if_the_reference_can_tell() {
        // The noise of the reference is as large as the difference of the errors, and still the same in both.
        assert!(differ([0.18, 0.10], 0.08, 1600.0));
        assert!(!differ([0.518, 0.5183], 0.08, 1600.0));
        assert!(!differ([0.18, 0.10], 0.08, 4.0), "four pixels say little");
        assert!(differ([0.518, 0.5183], 0.0, 1600.0), "an exact reference tells any difference");
    }
}
