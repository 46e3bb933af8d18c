//! Study of bakes for smaller and smaller errors, and with larger and smaller patches: how long they take,
//! which error they state, and which error they have, compared with a converged bake of the same texels.

use std::collections::BTreeMap;
use std::time::Duration;

use lumbre_bake::{BakeOptions, Quality};
use lumbre_render::FrameOptions;

use super::over_scenes;
use crate::baked::{
    bake_arguments, bake_direct_light, bake_options, bake_scene, few_bakes, maps_of, nothing_to_bake,
    picture_of_maps, texel_error,
};
use crate::converged_bake::{converged, converged_bake};
use crate::findings::{cheapest_by_error, counted, error_of, listed, percent, rounded, short, times_of};
use crate::frames::draw_picture;
use crate::measured::Measured;
use crate::rounds::{Repeated, repeated};
use crate::scene_file::SceneFile;
use crate::scenes::Air;
use crate::{Conditions, CostError, ErrorOf, Plot, Point, Quantity, Spread, Study};

/// The requested errors.
const ERRORS: &[f64] = &[0.08, 0.04, 0.02, 0.01];
const FEW_ERRORS: &[f64] = &[0.08, 0.03];
/// The error requested from the bakes of other studies, in a full and in a quick report.
pub(super) const ERROR: f64 = 0.02;
pub(super) const QUICK_ERROR: f64 = 0.06;
/// Approximate number of texels of a room, in a full and in a quick report, the same as in other studies, so that they
/// share bakes and the converged bake.
const TEXELS: f64 = 2_500.0;
const FEW_TEXELS: f64 = 700.0;
/// Time limits of the converged bake, in a full and in a quick report.
const REFERENCE_SECONDS: f64 = 12.0;
const QUICK_REFERENCE_SECONDS: f64 = 1.5;
/// The same where each bake takes seconds, of which this one would otherwise have none left for its rays.
const SECONDS_OF_MANY_TRIANGLES: f64 = 6.0;
/// Sides of patches in texels; the default of this quality is 4.
const PATCHES: &[f32] = &[16.0, 8.0, 2.0];
const FEW_PATCHES: &[f32] = &[16.0, 2.0];
/// The series of the bake in which no surface reflects light.
const WITHOUT_BOUNCES: &str = "without bounces";
const PATCH: &str = "texels along a patch";
const ASKED: &str = "error asked for, %";
const STATED: &str = "error stated, % of the mean";
/// The statement that a request is about: the larger one of the whole level's error and that in its worst view.
const STATED_AT_MOST: &str = "error stated, whole or in the worst view, %";
const FOUND: &str = "error found, % of the mean";

/// The time limit of a converged bake in a quick report, which may make few bakes because each takes seconds.
pub(super) fn quick_reference_seconds(few: bool) -> f64 {
    if few { SECONDS_OF_MANY_TRIANGLES } else { QUICK_REFERENCE_SECONDS }
}

/// The number of texels of a bake that studies share.
pub(super) fn texels_of_room(conditions: &Conditions<'_>) -> f64 {
    conditions.unless_quick(TEXELS, FEW_TEXELS)
}

/// The time limit of the converged bake with these texels.
pub(super) fn reference_time(conditions: &Conditions<'_>, few: bool) -> Duration {
    conditions.reference_time(REFERENCE_SECONDS, quick_reference_seconds(few))
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
        name: "bake".into(),
        title: "Bakes over the requested error".into(),
        question: "How much longer does a bake take for a smaller error, how much time does smoothing save, what do bounces take, and is the error that a bake states the true one?".into(),
        reference: "a converged bake of the same texels with other random numbers and without smoothing, whose own noise is subtracted; errors are relative to its mean".into(),
        plots: vec![
            Plot {
                title: "Error over time".into(),
                across: Quantity::Milliseconds,
                up: Quantity::Error,
                joined: true,
                front: true,
                ..Plot::default()
            },
            Plot {
                title: "The error found over the error stated".into(),
                across: Quantity::Figure(STATED.into()),
                up: Quantity::Figure(FOUND.into()),
                equal: true,
                ..Plot::default()
            },
        ],
        ..Study::default()
    }
}

/// A bake to be measured.
struct Asked {
    series: &'static str,
    label: String,
    options: BakeOptions,
    more: &'static str,
    /// Whether surfaces reflect light on each other. If they do not, the lightmaps hold direct light alone.
    bounces: bool,
}

/// The bakes that are compared; fewer if each of them takes seconds in a quick report.
fn asked(conditions: &Conditions<'_>, options: BakeOptions, few: bool) -> Vec<Asked> {
    let errors = conditions.unless_quick(ERRORS, FEW_ERRORS);
    let errors = if few { &errors[..1] } else { errors };
    let label = |error: f64| format!("error {} %", short(100.0 * error));
    let mut all: Vec<Asked> = Vec::new();
    for &error in errors {
        all.push(Asked {
            series: "final",
            label: label(error),
            options: BakeOptions { error, ..options },
            more: "",
            bounces: true,
        });
    }
    let draft = BakeOptions { quality: Quality::Draft, error: errors[0], ..options };
    all.push(Asked {
        series: "draft",
        label: label(errors[0]),
        options: draft,
        more: " --quality draft",
        bounces: true,
    });
    // With the least requested error, the remaining error is due to the patches.
    let least = errors.last().copied().unwrap_or(options.error);
    let patches = conditions.unless_quick(PATCHES, FEW_PATCHES);
    for &texels in if few { &[] } else { patches } {
        let options = BakeOptions { error: least, patch_texels: Some(texels), ..options };
        all.push(Asked {
            series: "patches",
            label: format!("{texels} texels a side"),
            options,
            more: "",
            bounces: true,
        });
    }
    // The command line has no option for bakes without smoothing.
    for &error in errors.iter().take(if few { 0 } else { conditions.unless_quick(2, 1) }) {
        let options = BakeOptions { error, denoise: false, ..options };
        all.push(Asked {
            series: "without smoothing",
            label: label(error),
            options,
            more: "",
            bounces: true,
        });
    }
    let options = BakeOptions { error: least, ..options };
    all.push(Asked { series: WITHOUT_BOUNCES, label: label(least), options, more: "", bounces: false });
    all
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
    let few = few_bakes(conditions, scene)?;
    measured.study.notes.extend(few.iter().map(|why| {
        format!("{why} It bakes for one error only, each bake once, and not with other patches or without smoothing.")
    }));
    let options = bake_options(conditions, scene, texels_of_room(conditions))?;
    let part = |share: f64| before + share * (after - before);
    let options_of_truth = converged(conditions, &options, reference_time(conditions, few.is_some()));
    let truth = converged_bake(conditions, scene, &options_of_truth, [part(0.0), part(0.4)])?;
    measured.study.notes.push(format!(
        "The converged bake of the {} took {:.0} s and states an error of {} of its mean.",
        scene.name,
        truth.report.seconds,
        percent(truth.report.error_of_mean)
    ));
    let reference = measured.keep_reference(&format!("{} converged", scene.name), truth.picture.clone());
    let reference_maps =
        measured.keep_reference(&format!("{} converged maps", scene.name), picture_of_maps(&truth.maps));

    let all = asked(conditions, options, few.is_some());
    let repetitions = if few.is_some() { 1 } else { conditions.repetitions() };
    let done = repeated(all.len(), repetitions, |place, [from, to]| {
        let told = [from, to].map(|share| part(0.4 + 0.6 * share));
        let asked = &all[place];
        let baked = match asked.bounces {
            true => bake_scene(conditions, scene, &asked.options, told)?,
            false => bake_direct_light(conditions, scene, &asked.options, told)?,
        };
        Ok((1e3 * baked.report.seconds, baked))
    })?;
    let first = measured.study.points.len();
    for (asked, Repeated { times, made: mut baked }) in all.iter().zip(done) {
        let maps = maps_of(&mut baked.world);
        let error = texel_error(&maps, &truth.maps);
        let picture = draw_picture(conditions, &mut baked.world, &FrameOptions::default())?;
        let report = &baked.report;
        let mut figures: Vec<(&str, f64)> = Vec::new();
        if asked.bounces {
            // A bake without bounces states the error of direct light, which is not the error found here.
            figures.push((STATED, 100.0 * report.error_of_mean));
            figures.push((STATED_AT_MOST, 100.0 * report.estimated_error.max(report.error_in_worst_view)));
        }
        figures.extend(error.map(|error| (FOUND, 100.0 * error.relative_rmse)));
        let counts = [
            ("rays", report.rays as f64),
            ("texels", report.texels as f64),
            ("patches", report.patches as f64),
            ("form factors", report.form_factors as f64),
        ];
        let point = Point {
            series: scene.series(conditions, asked.series),
            label: asked.label.clone(),
            parameters: parameters(asked),
            milliseconds: Spread::of(&times),
            error,
            counts: counts.map(|(name, count)| (name.to_owned(), count)).into(),
            figures: figures.into_iter().map(|(name, value)| (name.to_owned(), value)).collect(),
            command: command(conditions, scene, asked),
            picture: None,
        };
        measured.add_maps(point, (picture, &reference), (picture_of_maps(&maps), &reference_maps))?;
    }
    let points: Vec<&Point> = measured.study.points[first..].iter().collect();
    let findings = findings(scene, &points);
    measured.study.findings.extend(findings);
    Ok(())
}

fn parameters(asked: &Asked) -> BTreeMap<String, f64> {
    let error = (ASKED.to_owned(), 100.0 * asked.options.error);
    let patch = asked.options.patch_texels.map(|texels| (PATCH.to_owned(), f64::from(texels)));
    [error].into_iter().chain(patch).collect()
}

fn command(conditions: &Conditions<'_>, scene: &SceneFile, asked: &Asked) -> String {
    // The command line has no option for these either.
    if !(asked.options.denoise && asked.bounces) {
        return conditions.again("bake");
    }
    let arguments = bake_arguments(&asked.options);
    format!("lumbre bake {} -o baked.glb {arguments}{}", scene.in_commands(), asked.more)
}

fn findings(scene: &SceneFile, points: &[&Point]) -> Vec<String> {
    let mut findings = Vec::new();
    findings.push(of_statements(scene, points));
    findings.extend(of_missed_requests(points));
    findings.extend(cheapest_by_error(points, ""));
    let finals: Vec<&&Point> = points.iter().filter(|point| point.series.starts_with("final")).collect();
    if let (Some(coarse), Some(fine)) = (finals.first(), finals.last())
        && let (Some(short), Some(long), Some(much), Some(little)) =
            (coarse.milliseconds, fine.milliseconds, coarse.error, fine.error)
        && much.relative_rmse - little.relative_rmse > much.uncertainty.max(little.uncertainty)
    {
        findings.push(format!(
            "From {} to {} the error falls from {} to {}, in {}.",
            coarse.label,
            fine.label,
            error_of(&much),
            error_of(&little),
            times_of(&long, &short)
        ));
    }
    findings.extend(of_patches(points));
    findings.extend(of_bounces(points));
    findings
}

/// Compares the errors that bakes state with those found, where the converged bake is exact enough to find them.
fn of_statements(scene: &SceneFile, points: &[&Point]) -> String {
    let stated = |point: &Point| point.figures.get(STATED).copied().filter(|stated| *stated > 0.0);
    let all: Vec<(f64, ErrorOf)> =
        points.iter().filter_map(|point| Some((stated(point)?, point.error?))).collect();
    let found: Vec<&(f64, ErrorOf)> = all.iter().filter(|(_, error)| !error.is_below_uncertainty()).collect();
    let ratios: Vec<f64> = found.iter().map(|(stated, error)| 100.0 * error.relative_rmse / stated).collect();
    let unknown = match all.len() - found.len() {
        0 => String::new(),
        count => format!(
            " Of {count} of {} bakes the reference's own noise leaves only the most that the error may be.",
            all.len()
        ),
    };
    match Spread::of(&ratios) {
        Some(ratio) => format!(
            "The true error of a bake of the {} is {} times the stated one in the median, and {} times at most.{unknown}",
            scene.name,
            rounded(ratio.median),
            rounded(ratios.iter().copied().fold(0.0, f64::max))
        ),
        None => format!("The true errors of bakes of the {} are not known.{unknown}", scene.name),
    }
}

/// Names the bakes that ended with a larger error than was requested.
fn of_missed_requests(points: &[&Point]) -> Option<String> {
    let finals = points.iter().filter(|point| point.series.starts_with("final"));
    let missed: Vec<String> = finals
        .filter_map(|point| {
            let (stated, requested) = (point.figures.get(STATED_AT_MOST)?, point.parameters.get(ASKED)?);
            (stated > requested).then(|| format!("{} ({} stated)", point.label, percent(stated / 100.0)))
        })
        .collect();
    let missed: Vec<&str> = missed.iter().map(String::as_str).collect();
    (!missed.is_empty()).then(|| {
        format!("Requests that a bake did not reach in every view, and says so: {}.", listed(&missed, "and"))
    })
}

/// Compares the bake without bounces with that of all of them for the same error.
fn of_bounces(points: &[&Point]) -> Option<String> {
    let without = points.iter().find(|point| point.series.starts_with(WITHOUT_BOUNCES))?;
    let all =
        points.iter().find(|point| point.series.starts_with("final") && point.label == without.label)?;
    let (short, long) = (without.milliseconds?, all.milliseconds?);
    Some(format!(
        "Without bounces, a bake for {} leaves an error of {} instead of {}, in {}.",
        without.label,
        error_of(&without.error?),
        error_of(&all.error?),
        times_of(&short, &long)
    ))
}

/// Compares the coarsest patches with the finest: their numbers, times and errors.
fn of_patches(points: &[&Point]) -> Option<String> {
    let all: Vec<&&Point> = points.iter().filter(|point| point.parameters.contains_key(PATCH)).collect();
    let (coarse, fine) = (all.first()?, all.last()?);
    let count = |point: &Point| point.counts.get("patches").copied().map(counted);
    let (long, short) = (fine.milliseconds?, coarse.milliseconds?);
    Some(format!(
        "{} patches of {} leave an error of {}; {} patches of {} leave {}, in {}.",
        count(coarse)?,
        coarse.label,
        error_of(&coarse.error?),
        count(fine)?,
        fine.label,
        error_of(&fine.error?),
        times_of(&long, &short)
    ))
}
