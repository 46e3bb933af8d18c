//! Study of the difference between a frame and physically correct light: frames with more and more effects,
//! the ray tree and paths, compared with a converged picture of all light.

use std::time::Instant;

use lumbre_bake::BakeOptions;
use lumbre_render::FrameOptions;
use lumbre_trace::{Integrator, TraceOptions};

use super::bake::{ERROR, QUICK_ERROR};
use super::over_scenes;
use crate::baked::{Baked, bake_arguments, bake_options, bake_scene, nothing_to_bake};
use crate::findings::{cheapest_by_error, error_of, milliseconds, percent, rounds, times_of};
use crate::frame::Frame;
use crate::frames::draw_frames;
use crate::measured::Measured;
use crate::picture::Picture;
use crate::rounds::{Repeated, milliseconds_since, repeated};
use crate::scene_file::SceneFile;
use crate::scenes::Air;
use crate::traced::{ray_tree, traced};
use crate::{Conditions, CostError, ErrorOf, ErrorOver, Plot, Point, Quantity, Spread, Study};

/// Numbers of paths per pixel. The second one is that of paths that are cut short.
const PATHS: &[u32] = &[4, 8, 16];
const FEW_PATHS: &[u32] = &[2, 6];
/// Numbers of reflections after which paths are cut short.
const BOUNCES: &[u32] = &[0, 1, 2, 4];
const FEW_BOUNCES: &[u32] = &[0, 2];
const REFLECTIONS: &str = "reflections on the way";
/// Factor by which pictures are smaller along each side than in other studies, as path tracing takes long.
const SMALLER: u32 = 3;
const SECONDS: f64 = 4.0;
const CUT: &str = "paths cut short";
const BAKE: &str = "baked before, ms";
const WITH_LIGHTMAPS: &str = "and lightmaps";

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
    let open = report.standard_error.unwrap_or(0.0) * mean_over_root_mean_square(&picture);
    let reference = measured.keep_reference(&format!("{} by {most} paths", scene.name), picture);
    let uncertain = Some(ErrorOf { uncertainty: open, ..ErrorOf::default() });
    conditions.tell(part(0.5))?;

    let bake = bake_options(conditions, scene, conditions.unless_quick(4_000.0, 700.0))?;
    let bake = BakeOptions { error: conditions.unless_quick(ERROR, QUICK_ERROR), ..bake };
    let baked: Option<Baked> = match nothing_to_bake(conditions, scene)? {
        None => Some(bake_scene(conditions, scene, &bake, [part(0.5), part(0.6)])?),
        Some(why) => {
            measured.study.notes.push(why);
            None
        }
    };
    let light = |shadows, multisample| FrameOptions {
        shadows,
        multisample: Some(multisample),
        ..FrameOptions::default()
    };
    let steps = [
        ("lamps alone", light(false, false), " --no-shadows"),
        ("with shadows", light(true, false), ""),
        ("and four samples", light(true, true), " --msaa"),
    ];
    let mut frames = Vec::new();
    for (_, options, _) in &steps {
        frames.push(Frame::new(scene.open(conditions.aspect())?, options.clone()).sharing("transport"));
    }
    let bake_time = baked.as_ref().map_or(0.0, |baked| 1e3 * baked.report.seconds);
    frames.extend(baked.map(|baked| Frame::new(baked.world, light(true, true)).sharing("transport")));
    let drawn = draw_frames(conditions, frames, SECONDS, [part(0.6), part(0.7)])?;
    let labels = steps.iter().map(|(label, ..)| *label).chain([WITH_LIGHTMAPS]);
    let more = steps.iter().map(|(.., more)| *more).chain([" --msaa"]);
    let first = measured.study.points.len();
    for ((label, more), frame) in labels.zip(more).zip(&drawn) {
        let with_lightmaps = label == WITH_LIGHTMAPS;
        let file = if with_lightmaps { "baked.glb" } else { scene.in_commands() };
        let draw = conditions.drawing(file, more);
        let point = Point {
            series: series("frame"),
            label: label.to_owned(),
            milliseconds: frame.spread(),
            error: uncertain,
            counts: frame.counts(),
            figures: if with_lightmaps { [(BAKE.to_owned(), bake_time)].into() } else { Default::default() },
            command: match with_lightmaps {
                true => format!(
                    "lumbre bake {} -o baked.glb {} && {draw}",
                    scene.in_commands(),
                    bake_arguments(&bake)
                ),
                false => draw,
            },
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
    let findings = findings(&points, open);
    measured.study.findings.extend(findings);
    Ok(())
}

/// Returns the mean of all channels divided by their root mean square; 0 for a black picture.
fn mean_over_root_mean_square(picture: &Picture) -> f64 {
    let numbers = 3.0 * picture.radiance.len().max(1) as f64;
    let mean = picture.radiance.iter().map(|pixel| pixel.element_sum()).sum::<f64>() / numbers;
    let squares = picture.radiance.iter().map(|pixel| pixel.length_squared()).sum::<f64>() / numbers;
    if squares > 0.0 { mean / squares.sqrt() } else { 0.0 }
}

fn findings(points: &[&Point], open: f64) -> Vec<String> {
    let mut findings = Vec::new();
    let frames: Vec<&&Point> = points.iter().filter(|point| point.series.starts_with("frame")).collect();
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
        let change = match (was.relative_rmse - is.relative_rmse).abs() > open {
            true => format!(
                "changes the error from {} to {}",
                percent(was.relative_rmse),
                percent(is.relative_rmse)
            ),
            false => "changes the error by less than the uncertainty of the reference".to_owned(),
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
        let bake = frame.figures.get(BAKE).map_or(String::new(), |ms| {
            format!(", after a bake of {} s", crate::findings::rounded(ms / 1e3))
        });
        findings.push(format!(
            "The best frame (\"{}\") has an error of {} and takes {}{bake}; {paths}. The uncertainty of the reference is {}.",
            frame.label,
            percent(error),
            milliseconds(&time),
            percent(open)
        ));
    }
    findings.extend(of_bounces(points));
    findings.extend(cheapest_by_error(points, ""));
    findings
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
