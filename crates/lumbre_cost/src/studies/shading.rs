//! Study of flat, Gouraud and Phong shading on meshes from coarse to fine, compared with the exact surface:
//! which of them reaches which error in the least time.

use lumbre_optics::{Lobe, ReflectionModel, Shading};
use lumbre_render::FrameOptions;

use crate::findings::{cheapest_by_error, is_above_one, percent, ratio_of, rounded};
use crate::frame::Frame;
use crate::frames::{DrawnFrame, draw_frames};
use crate::measured::Measured;
use crate::picture::Picture;
use crate::scene_file::SceneFile;
use crate::scenes::{Ball, ball, exact_ball};
use crate::traced::lighting_of;
use crate::{Conditions, CostError, ErrorOver, Plot, Point, Quantity, Study};

/// Subdivision depths of the spheres.
const DEPTHS: std::ops::RangeInclusive<u32> = 0..=7;
/// Seconds for the frames of a full report.
const SECONDS: f64 = 14.0;
const DEPTH: &str = "depth of subdivision";

/// Runs the study.
///
/// # Errors
/// [`CostError`].
pub fn run(conditions: &Conditions<'_>) -> Result<Measured, CostError> {
    let subjects = if conditions.files.is_empty() { spheres(conditions)? } else { given(conditions)? };
    let whole = !conditions.files.is_empty();
    let mut measured = Measured::of(study(whole));
    let mut frames = Vec::new();
    for subject in &subjects {
        for &shading in Shading::ALL {
            let world = subject.scene.open(conditions.aspect())?;
            let options = FrameOptions { shading: Some(shading), shadows: false, ..FrameOptions::default() };
            frames.push(Frame::new(world, options).sharing(shading.name()));
        }
    }
    let drawn = draw_frames(conditions, frames, SECONDS, [0.1, 1.0])?;
    let references = references(conditions, &subjects, &mut measured)?;
    for ((subject, reference), drawn) in subjects.iter().zip(references).zip(drawn.chunks(Shading::ALL.len()))
    {
        for (&shading, frame) in Shading::ALL.iter().zip(drawn) {
            let point = point(conditions, subject, shading, frame);
            let over = if whole { ErrorOver::Picture } else { ErrorOver::WhereBothAreLit };
            measured.add_picture(point, frame.picture.clone(), &reference, over)?;
        }
    }
    if !whole {
        add_silhouettes(&mut measured);
    }
    measured.study.findings = findings(&measured.study, &drawn, whole);
    Ok(measured)
}

/// What is shaded.
struct Subject {
    scene: SceneFile,
    label: String,
    depth: Option<u32>,
}

fn spheres(conditions: &Conditions<'_>) -> Result<Vec<Subject>, CostError> {
    let sphere = |depth| {
        let scene = SceneFile::made(conditions, &format!("ball-{depth}"), ball(shiny(depth)))?;
        Ok(Subject { scene, label: format!("depth {depth}"), depth: Some(depth) })
    };
    DEPTHS.map(sphere).collect()
}

fn shiny(depth: u32) -> Ball {
    Ball { depth, shininess: 40.0, reflection: ReflectionModel::Phong, lobe: Lobe::Bare }
}

fn given(conditions: &Conditions<'_>) -> Result<Vec<Subject>, CostError> {
    let subject = |scene: SceneFile| Subject { label: scene.name.clone(), scene, depth: None };
    Ok(SceneFile::given(conditions)?.into_iter().map(subject).collect())
}

/// Returns the name of each subject's reference: one exact sphere for all spheres, and a picture of its own
/// for every file.
fn references(
    conditions: &Conditions<'_>,
    subjects: &[Subject],
    measured: &mut Measured,
) -> Result<Vec<String>, CostError> {
    if conditions.files.is_empty() {
        let scene = SceneFile::made(conditions, "exact-ball", exact_ball(shiny(0)))?;
        let exact = measured.keep_reference("exact sphere", lighting_of(conditions, &scene)?);
        return Ok(vec![exact; subjects.len()]);
    }
    let mut names = Vec::new();
    for subject in subjects {
        let picture = lighting_of(conditions, &subject.scene)?;
        names.push(measured.keep_reference(&format!("traced {}", subject.label), picture));
    }
    Ok(names)
}

fn study(whole: bool) -> Study {
    let sphere = "the exact sphere, traced in f64 with the same lighting equation at every pixel; errors are computed over the pixels that show the ball in both pictures";
    let traced = "the same scene, traced in f64 without shadows and mirrors, with the same lighting equation at every pixel";
    let mut plots = vec![Plot {
        title: "Error over time".into(),
        across: Quantity::Milliseconds,
        up: Quantity::Error,
        joined: !whole,
        front: true,
        ..Plot::default()
    }];
    if !whole {
        plots.push(Plot {
            title: "Error over the mesh".into(),
            across: Quantity::Count("triangles".into()),
            up: Quantity::Error,
            joined: true,
            front: true,
            ..Plot::default()
        });
    }
    Study {
        name: "shading".into(),
        title: "Flat, Gouraud and Phong shading".into(),
        question: "The lighting equation is evaluated once per polygon, once per vertex or once per fragment. Which of these reaches which error in the least time, and what does a finer mesh gain?".into(),
        reference: if whole { traced } else { sphere }.into(),
        plots,
        ..Study::default()
    }
}

/// Returns the name of the series for a shading.
pub(super) fn series_of(shading: Shading) -> &'static str {
    match shading {
        Shading::Flat => "flat",
        Shading::Gouraud => "Gouraud",
        Shading::Phong => "Phong",
        Shading::Auto { .. } => "by need",
    }
}

fn point(conditions: &Conditions<'_>, subject: &Subject, shading: Shading, frame: &DrawnFrame) -> Point {
    let asked = format!(" --shading {shading} --no-shadows");
    let command = conditions.drawing(subject.scene.in_commands(), &asked);
    Point {
        series: series_of(shading).into(),
        label: subject.label.clone(),
        parameters: subject.depth.map(|depth| (DEPTH.to_owned(), f64::from(depth))).into_iter().collect(),
        milliseconds: frame.spread(),
        counts: frame.counts(),
        command,
        ..Point::default()
    }
}

/// Notes the error that no shading can remove: pixels that show the ball in only one of the two pictures.
fn add_silhouettes(measured: &mut Measured) {
    let lit = |picture: &Picture| -> Vec<bool> {
        picture.radiance.iter().map(|pixel| pixel.max_element() > 0.0).collect()
    };
    for point in &mut measured.study.points {
        let Some(files) = &point.picture else { continue };
        let pair = measured.pictures.get(&files.picture).zip(measured.pictures.get(&files.reference));
        let Some((picture, reference)) = pair else { continue };
        let (shown, wanted) = (lit(picture), lit(reference));
        let apart = shown.iter().zip(&wanted).filter(|(a, b)| a != b).count();
        let all = wanted.iter().filter(|lit| **lit).count().max(1);
        point.figures.insert("silhouette off, % of the ball".into(), 100.0 * apart as f64 / all as f64);
    }
}

fn findings(study: &Study, drawn: &[DrawnFrame], whole: bool) -> Vec<String> {
    let points: Vec<&Point> = study.points.iter().collect();
    let mut findings: Vec<String> = Vec::new();
    if whole {
        for (three, times) in study.points.chunks(3).zip(drawn.chunks(3)) {
            findings.extend(of_one_mesh(three, times));
        }
        return findings;
    }
    findings.extend(cheapest_by_error(&points, ""));
    // The errors are most alike on the finest mesh.
    if let Some((three, times)) = study.points.chunks(3).zip(drawn.chunks(3)).next_back() {
        findings.extend(of_one_mesh(three, times));
    }
    findings
}

/// Compares Gouraud shading with Phong shading on one mesh.
pub(super) fn of_one_mesh(three: &[Point], times: &[DrawnFrame]) -> Option<String> {
    let ([_, gouraud, phong], [_, per_vertex, per_fragment]) = (three, times) else { return None };
    let ratio = ratio_of(&per_vertex.times, &per_fragment.times)?;
    let range = format!("{} to {}", rounded(ratio.lower), rounded(ratio.upper));
    let cost = match is_above_one(&ratio) {
        Some(above) => {
            let which = if above { "more" } else { "less" };
            format!("Gouraud takes {} of Phong's time ({range}), which is {which}", rounded(ratio.median))
        }
        None => {
            format!("the times do not decide whether Gouraud takes more or less than Phong ({range} of it)")
        }
    };
    let [a, b] = [gouraud, phong].map(|point| point.error.map_or(f64::NAN, |error| error.relative_rmse));
    Some(format!("At {} {cost}; its error is {}, Phong's {}.", phong.label, percent(a), percent(b)))
}
