//! Study of what the three documents say about cost and loss and what no other study measures: the viewer and the
//! lamps infinitely far away, what a highlight adds, the three shadings on table 1.1's sphere, radiosity beside
//! ray tracing, and form factors of all pairs of patches.

use std::collections::BTreeMap;
use std::time::Instant;

use lumbre_bake::{BakeOptions, BakeReport};
use lumbre_optics::{Lobe, ReflectionModel, Shading};
use lumbre_render::FrameOptions;

use super::bake::{ERROR, QUICK_ERROR, reference_time, texels_of_room};
use super::shading::series_of;
use crate::all_pairs::CubeOfPatches;
use crate::baked::{Baked, bake_arguments, bake_options, bake_scene, maps_of, picture_of_maps, texel_error};
use crate::converged_bake::{converged, converged_bake};
use crate::findings::{
    counted, error_of, factor, listed, milliseconds, percent, ratio_of, rounded, short, times_of,
};
use crate::frame::Frame;
use crate::frames::{DrawnFrame, draw_frames, draw_picture};
use crate::measured::Measured;
use crate::picture::Picture;
use crate::rounds::{Repeated, milliseconds_since, repeated};
use crate::scene_file::SceneFile;
use crate::scenes::{Air, Ball, LAMPS, LitSphere, ball_of_table, exact_ball, lit_sphere, room};
use crate::traced::{lighting_of, ray_tree, traced, traced_world};
use crate::{Conditions, CostError, ErrorOver, Plot, Point, Quantity, Spread, Study};

/// Distances of the eye and of the lamps from the centre of the sphere, in radii.
const DISTANCES: &[f64] = &[1.5, 3.0, 6.0, 12.0];
const FEW_DISTANCES: &[f64] = &[1.5, 6.0];
const DISTANCE: &str = "distance, radii";
/// Distances at which the others are while one varies.
const EYE: f64 = 4.0;
const LAMP: f64 = 3.0;
const BRIGHTEST: &str = "brightest pixel, % of the exact sphere's";
/// Patches along a side of the cube: about 1, 2, 4 and 8 times as many patches.
const SIDES: &[u32] = &[8, 11, 16, 23];
const FEW_SIDES: &[u32] = &[4, 6, 8, 11];
const OPPOSITE: &str = "form factor of opposite sides";
const ADJACENT: &str = "form factor of adjacent sides";
const OFF: &str = "farthest sum of form factors from 1, %";
/// Sides of the baker's patches in texels, coarse to fine.
const PATCHES: &[f32] = &[16.0, 4.0, 2.0, 1.0];
const FEW_PATCHES: &[f32] = &[16.0, 2.0];
const PAIRS: &str = "form factors of all pairs";
const BAKES: &str = "bakes by size of patches";
const BAKE: &str = "radiosity";
const ITERATIONS: &str = "solver iterations";
const PICTURE: &str = "ray tracing";
/// Seconds for the frames of a full report.
const SECONDS: f64 = 12.0;

/// Runs the study.
///
/// # Errors
/// [`CostError`].
pub fn run(conditions: &Conditions<'_>) -> Result<Measured, CostError> {
    let mut measured = Measured::of(study());
    if !conditions.files.is_empty() {
        let note = "The scene files were not used: this study always measures scenes of its own.";
        measured.study.notes.push(note.into());
    }
    of_frames(conditions, [0.0, 0.5], &mut measured)?;
    of_radiosity(conditions, [0.5, 0.9], &mut measured)?;
    of_all_pairs(conditions, [0.9, 1.0], &mut measured)?;
    Ok(measured)
}

fn study() -> Study {
    let plot = |title: &str, across: Quantity, up: Quantity, series: &[&str]| Plot {
        title: title.into(),
        across,
        up,
        series: series.iter().map(|name| (*name).to_owned()).collect(),
        joined: true,
        ..Plot::default()
    };
    let count = |name: &str| Quantity::Count(name.into());
    Study {
        name: "documents".into(),
        title: "What the documents say about cost".into(),
        question: "A viewer and light sources infinitely far away are said to be cheaper, highlights to add little, flat shading to be the simplest, radiosity to be slower than ray tracing, and form factors to cost the square of the number of patches. How much are these, and what do they lose?".into(),
        reference: "the same frame with a local viewer, with point lamps, or with highlights; for table 1.1's sphere, the exact sphere traced in f64, over the pixels that show it in both pictures; for bakes, a converged bake of the same texels, whose own noise is subtracted; for the picture by the ray tree, which has no interreflected light, the ray tree's picture of the baked room; for form factors of all pairs, those between the sides of a cube in closed form (Howell, C-11 and C-14)".into(),
        plots: vec![
            plot(
                "What is lost if the viewer or the lamps are infinitely far away",
                Quantity::Parameter(DISTANCE.into()),
                Quantity::Error,
                &["infinite viewer", "distant sources"],
            ),
            plot("Form factors", count("patches"), count("form factors"), &[PAIRS, BAKES]),
            plot("Time by patches", count("patches"), Quantity::Milliseconds, &[PAIRS, BAKES]),
        ],
        ..Study::default()
    }
}

/// A frame, and the one that it is compared with.
struct Asked {
    series: &'static str,
    label: String,
    /// Distance of the eye or of the lamps, where that varies.
    distance: Option<f64>,
    scene: SceneFile,
    shading: Shading,
    /// Index of the frame that is its reference; `None` for the exact sphere.
    reference: Option<usize>,
}

fn asked(conditions: &Conditions<'_>) -> Result<Vec<Asked>, CostError> {
    let plain = LitSphere { eye: EYE, local_viewer: true, lamps: LAMP, distant: false, highlights: true };
    let mut all: Vec<Asked> = Vec::new();
    let mut add = |series, label: String, distance, sphere: LitSphere, of_first: bool| {
        let name = format!("{series} {label}").replace([' ', '.'], "-");
        let scene = SceneFile::made(conditions, &name, lit_sphere(sphere))?;
        let reference = if of_first { all.len() } else { all.len() - 1 };
        all.push(Asked {
            series,
            label,
            distance,
            scene,
            shading: Shading::Phong,
            reference: Some(reference),
        });
        Ok::<_, CostError>(())
    };
    for &eye in conditions.unless_quick(DISTANCES, FEW_DISTANCES) {
        let label = || format!("eye at {} radii", short(eye));
        add("local viewer", label(), Some(eye), LitSphere { eye, ..plain }, true)?;
        let infinite = LitSphere { eye, local_viewer: false, ..plain };
        add("infinite viewer", label(), Some(eye), infinite, false)?;
    }
    for &lamps in conditions.unless_quick(DISTANCES, FEW_DISTANCES) {
        let label = || format!("lamps at {} radii", short(lamps));
        add("point lamps", label(), Some(lamps), LitSphere { lamps, ..plain }, true)?;
        add("distant sources", label(), Some(lamps), LitSphere { lamps, distant: true, ..plain }, false)?;
    }
    add("highlights", "with".into(), None, plain, true)?;
    add("highlights", "without".into(), None, LitSphere { highlights: false, ..plain }, false)?;
    let table = SceneFile::made(conditions, "sphere-of-table-1-1", ball_of_table(shiny()))?;
    for &shading in Shading::ALL {
        let label = "990 triangles".to_owned();
        let (series, scene) = (series_of(shading), table.clone());
        all.push(Asked { series, label, distance: None, scene, shading, reference: None });
    }
    Ok(all)
}

fn shiny() -> Ball {
    Ball { depth: 0, shininess: 40.0, reflection: ReflectionModel::Phong, lobe: Lobe::Bare }
}

fn of_frames(conditions: &Conditions<'_>, told: [f64; 2], measured: &mut Measured) -> Result<(), CostError> {
    let all = asked(conditions)?;
    let mut frames = Vec::new();
    for one in &all {
        let options = FrameOptions { shading: Some(one.shading), ..FrameOptions::default() };
        frames.push(Frame::new(one.scene.open(conditions.aspect())?, options).sharing(one.series));
    }
    let drawn = draw_frames(conditions, frames, SECONDS, told)?;
    let exact = SceneFile::made(conditions, "exact-sphere", exact_ball(shiny()))?;
    let exact = lighting_of(conditions, &exact)?;
    let brightest_of_exact = brightest(&exact);
    let exact = measured.keep_reference("exact sphere", exact);
    for (one, frame) in all.iter().zip(&drawn) {
        let (reference, over) = match one.reference {
            Some(place) => {
                let name = format!("reference {} {}", all[place].series, all[place].label);
                (measured.keep_reference(&name, drawn[place].picture.clone()), ErrorOver::Picture)
            }
            None => (exact.clone(), ErrorOver::WhereBothAreLit),
        };
        let mut point = Point {
            series: one.series.to_owned(),
            label: one.label.clone(),
            parameters: one.distance.map(|distance| (DISTANCE.to_owned(), distance)).into_iter().collect(),
            milliseconds: frame.spread(),
            counts: frame.counts(),
            command: conditions
                .drawing(one.scene.in_commands(), &format!(" --shading {}", one.shading.name())),
            ..Point::default()
        };
        if one.reference.is_none() {
            let share = 100.0 * brightest(&frame.picture) / brightest_of_exact.max(f64::MIN_POSITIVE);
            point.figures.insert(BRIGHTEST.to_owned(), share);
        }
        measured.add_picture(point, frame.picture.clone(), &reference, over)?;
    }
    let findings = findings_of_frames(&measured.study.points, &drawn);
    measured.study.findings.extend(findings);
    Ok(())
}

fn brightest(picture: &Picture) -> f64 {
    picture.radiance.iter().map(|pixel| pixel.max_element()).fold(0.0, f64::max)
}

fn findings_of_frames(points: &[Point], drawn: &[DrawnFrame]) -> Vec<String> {
    let pair = |cheap: &str, dear: &str, what: &str| {
        let of = |series: &str| -> Vec<f64> {
            let own = points.iter().zip(drawn).filter(|(point, _)| point.series == series);
            own.flat_map(|(_, frame)| frame.times.iter().copied()).collect()
        };
        let ratio = ratio_of(&of(cheap), &of(dear))?;
        let errors: Vec<String> = points
            .iter()
            .filter(|point| point.series == cheap)
            .filter_map(|point| Some(format!("{} ({})", error_of(&point.error?), point.label)))
            .collect();
        let errors: Vec<&str> = errors.iter().map(String::as_str).collect();
        let time = factor(&ratio);
        Some(format!("{what} takes {time} times as long; the error is {}.", listed(&errors, "and")))
    };
    let viewer = pair("infinite viewer", "local viewer", "With the viewer infinitely far away a frame");
    let lamps = format!("With distant sources in place of {LAMPS} point lamps a frame");
    let lamps = pair("distant sources", "point lamps", &lamps);
    let at = |series: &str, label: &str| {
        let place = points.iter().position(|point| point.series == series && point.label == label)?;
        Some((&points[place], &drawn[place]))
    };
    let highlights = || {
        let ((_, with), (loses, without)) = (at("highlights", "with")?, at("highlights", "without")?);
        let ratio = ratio_of(&with.times, &without.times)?;
        Some(format!(
            "With the highlights of {LAMPS} lamps a frame takes {} times as long as without; without them the error is {}.",
            factor(&ratio),
            error_of(&loses.error?)
        ))
    };
    let shadings = || {
        let of = |shading: Shading| at(series_of(shading), "990 triangles");
        let (phong, times_of_phong) = of(Shading::Phong)?;
        let brightest = |point: &Point| Some(percent(point.figures.get(BRIGHTEST)? / 100.0));
        let mut told = Vec::new();
        for shading in [Shading::Flat, Shading::Gouraud] {
            let (point, frame) = of(shading)?;
            told.push(format!(
                "{} shading takes {} of Phong's time and has an error of {}, and its brightest pixel {} of the exact sphere's",
                series_of(shading),
                factor(&ratio_of(&frame.times, &times_of_phong.times)?),
                error_of(&point.error?),
                brightest(point)?
            ));
        }
        let [flat, gouraud] = &told[..] else { return None };
        Some(format!(
            "On the sphere of 990 triangles, {flat}; {gouraud}; under Phong shading the error is {}, and the brightest pixel {}.",
            error_of(&phong.error?),
            brightest(phong)?
        ))
    };
    [viewer, lamps, highlights(), shadings()].into_iter().flatten().collect()
}

/// What a work leaves: a baked room, or a picture with the number of its rays.
enum Made {
    Baked(Box<Baked>),
    Traced(Picture, u64),
}

/// What is done with the room: a bake, or a picture by the ray tree.
struct Work {
    series: &'static str,
    label: String,
    /// The options of the bake; `None` for the picture.
    bake: Option<BakeOptions>,
}

/// Bakes the room as usual and with patches of several sizes, and traces one picture of it.
fn of_radiosity(
    conditions: &Conditions<'_>,
    [before, after]: [f64; 2],
    measured: &mut Measured,
) -> Result<(), CostError> {
    let scene = SceneFile::made(conditions, "room", room(Air::Clear))?;
    let options = BakeOptions {
        error: conditions.unless_quick(ERROR, QUICK_ERROR),
        ..bake_options(conditions, &scene, texels_of_room(conditions))?
    };
    let by_patch = |&texels: &f32| Work {
        series: BAKES,
        label: format!("patches of {} texels a side", short(f64::from(texels))),
        bake: Some(BakeOptions { patch_texels: Some(texels), ..options }),
    };
    let usual = Work { series: BAKE, label: "a bake".into(), bake: Some(options) };
    let picture = Work { series: PICTURE, label: "one picture by the ray tree".into(), bake: None };
    let patches = conditions.unless_quick(PATCHES, FEW_PATCHES);
    let all: Vec<Work> = [usual, picture].into_iter().chain(patches.iter().map(by_patch)).collect();
    let part = |share: f64| before + share * (after - before);
    // The study of bakes has the same reference.
    let time = reference_time(conditions, false);
    let truth =
        converged_bake(conditions, &scene, &converged(conditions, &options, time), [part(0.0), part(0.3)])?;
    let done = repeated(all.len(), conditions.repetitions(), |place, told| {
        let Some(options) = &all[place].bake else {
            let (picture, report) = traced(conditions, &scene, &ray_tree(conditions))?;
            return Ok((1e3 * report.seconds, Made::Traced(picture, report.rays)));
        };
        let baked = bake_scene(conditions, &scene, options, told.map(|share| part(0.3 + 0.7 * share)))?;
        Ok((1e3 * baked.report.seconds, Made::Baked(Box::new(baked))))
    })?;
    let first = measured.study.points.len();
    let frame_of_truth = measured.keep_reference("room converged", truth.picture.clone());
    let maps_of_truth = measured.keep_reference("room converged maps", picture_of_maps(&truth.maps));
    let mut rays_of_baked = None;
    for (work, Repeated { times, made }) in all.iter().zip(done) {
        let file = scene.in_commands();
        let point = Point {
            series: work.series.to_owned(),
            label: work.label.clone(),
            milliseconds: Spread::of(&times),
            ..Point::default()
        };
        match made {
            Made::Baked(mut baked) => {
                let arguments = bake_arguments(work.bake.as_ref().unwrap_or(&options));
                let maps = maps_of(&mut baked.world);
                let point = Point {
                    counts: counts_of(&baked.report),
                    error: texel_error(&maps, &truth.maps),
                    command: format!("lumbre bake {file} -o baked.glb {arguments}"),
                    ..point
                };
                let frame = draw_picture(conditions, &mut baked.world, &FrameOptions::default())?;
                let maps = (picture_of_maps(&maps), maps_of_truth.as_str());
                measured.add_maps(point, (frame, &frame_of_truth), maps)?;
                if rays_of_baked.is_none() {
                    rays_of_baked =
                        Some(traced_world(conditions, &mut baked.world, &ray_tree(conditions))?.0);
                }
            }
            Made::Traced(picture, rays) => {
                let reference = rays_of_baked.clone().unwrap_or_else(|| picture.clone());
                let reference = measured.keep_reference("room baked by the ray tree", reference);
                let point = Point {
                    counts: [("rays".to_owned(), rays as f64)].into(),
                    command: format!("lumbre trace {file} -o traced.exr --size {}", conditions.size_text()),
                    ..point
                };
                measured.add_picture(point, picture, &reference, ErrorOver::Picture)?;
            }
        }
    }
    let points = &measured.study.points[first..];
    let findings = [finding_of_radiosity(points), finding_of_solver(points)];
    measured.study.findings.extend(findings.into_iter().flatten());
    Ok(())
}

fn counts_of(report: &BakeReport) -> BTreeMap<String, f64> {
    let counts = [
        ("rays", report.rays as f64),
        ("texels", report.texels as f64),
        ("patches", report.patches as f64),
        ("form factors", report.form_factors as f64),
        (ITERATIONS, f64::from(report.iterations.into_iter().max().unwrap_or_default())),
    ];
    counts.map(|(name, count)| (name.to_owned(), count)).into()
}

/// Compares the bake with one picture.
fn finding_of_radiosity(points: &[Point]) -> Option<String> {
    let of = |series: &str| points.iter().find(|point| point.series == series);
    let (of_bake, of_picture) = (of(BAKE)?, of(PICTURE)?);
    let (bake, picture) = (of_bake.milliseconds?, of_picture.milliseconds?);
    Some(format!(
        "Baking the room takes {}, one picture of it by the ray tree {}: {}. A bake is done once for any number of frames, while rays are cast again for each picture. The error of the baked light is {}, that of the picture, which lacks the light between surfaces, {}.",
        milliseconds(&bake),
        milliseconds(&picture),
        times_of(&bake, &picture),
        error_of(&of_bake.error?),
        error_of(&of_picture.error?)
    ))
}

/// Says how soon the radiosity system converges, for the fewest and the most patches.
fn finding_of_solver(points: &[Point]) -> Option<String> {
    let count = |point: &Point, name: &str| point.counts.get(name).copied();
    let known = points.iter().filter_map(|point| Some((count(point, "patches")?, count(point, ITERATIONS)?)));
    let known: Vec<(f64, f64)> = known.collect();
    let few = known.iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
    let many = known.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let also = if few.1 == many.1 { "also " } else { "" };
    (few.0 < many.0).then(|| {
        format!(
            "The solver needs {} iterations for the radiosity system of {} patches, and {also}{} for that of {}.",
            counted(few.1),
            counted(few.0),
            counted(many.1),
            counted(many.0)
        )
    })
}

/// Computes form factors of all pairs of patches in a cube.
fn of_all_pairs(
    conditions: &Conditions<'_>,
    [before, after]: [f64; 2],
    measured: &mut Measured,
) -> Result<(), CostError> {
    let sides = conditions.unless_quick(SIDES, FEW_SIDES);
    let cubes: Vec<CubeOfPatches> = sides.iter().map(|side| CubeOfPatches::new(*side)).collect();
    let done = repeated(cubes.len(), conditions.repetitions(), |place, [from, _]| {
        conditions.tell(before + from * (after - before))?;
        let begun = Instant::now();
        let found = cubes[place].exchange();
        Ok((milliseconds_since(begun), found))
    })?;
    for (cube, Repeated { times, made }) in cubes.iter().zip(done) {
        let counts = [("patches", cube.len() as f64), ("form factors", made.form_factors as f64)];
        measured.study.points.push(Point {
            series: PAIRS.to_owned(),
            label: format!("{} patches", cube.len()),
            milliseconds: Spread::of(&times),
            counts: counts.map(|(name, count)| (name.to_owned(), count)).into(),
            error: Some(made.error()),
            figures: [
                (OFF.to_owned(), 100.0 * made.off),
                (OPPOSITE.to_owned(), made.between_opposite),
                (ADJACENT.to_owned(), made.between_adjacent),
            ]
            .into(),
            command: conditions.again("documents"),
            ..Point::default()
        });
    }
    let findings = [PAIRS, BAKES].map(|series| finding_of_growth(&measured.study.points, series));
    measured.study.findings.extend(findings.into_iter().flatten());
    Ok(())
}

/// Says with which power of the number of patches the form factors and the time grow, from the fewest patches of a
/// series to the most.
fn finding_of_growth(points: &[Point], series: &str) -> Option<String> {
    let own: Vec<&Point> = points.iter().filter(|point| point.series == series).collect();
    let (few, many) = (own.first()?, own.last()?);
    let count = |point: &Point, name: &str| point.counts.get(name).copied();
    let patches = [count(few, "patches")?, count(many, "patches")?];
    let power = |from: f64, to: f64| (to / from).ln() / (patches[1] / patches[0]).ln();
    let factors = power(count(few, "form factors")?, count(many, "form factors")?);
    let (short, long) = (few.milliseconds?, many.milliseconds?);
    let [least, most] = [power(short.upper, long.lower), power(short.lower, long.upper)];
    Some(format!(
        "With {series}, from {} to {} patches, the number of form factors grows with their power {}, and the time with the power {} ({} to {}), from {} to {}.",
        counted(patches[0]),
        counted(patches[1]),
        rounded(factors),
        rounded(power(short.median, long.median)),
        rounded(least),
        rounded(most),
        milliseconds(&short),
        milliseconds(&long)
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_power_of_growth_is_found() {
        let point = |patches: f64, factors: f64, time: f64| Point {
            series: PAIRS.into(),
            milliseconds: Spread::of(&[time; 5]),
            counts: [("patches".to_owned(), patches), ("form factors".to_owned(), factors)].into(),
            ..Point::default()
        };
        let said = finding_of_growth(&[point(10.0, 100.0, 3.0), point(80.0, 6400.0, 24.0)], PAIRS);
        let said = said.expect("there are two points");
        assert!(
            said.contains("their power 2.00") && said.contains("the power 1.00 (1.00 to 1.00)"),
            "{said}"
        );
    }
}
