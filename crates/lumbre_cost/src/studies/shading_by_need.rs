//! Study of shading by need over the allowed error: how many objects are drawn without Phong shading, how
//! much time this saves, and how large the error is. The bounds themselves are computed by the renderer.

use lumbre_optics::{ErrorBound, Shading};
use lumbre_render::{FrameOptions, ShadingNeeds};

use super::over_scenes_made;
use crate::findings::{cheapest_by_error, factor, percent, ratio_of, short};
use crate::frame::Frame;
use crate::frames::{DrawnFrame, draw_frames};
use crate::measured::Measured;
use crate::scene_file::SceneFile;
use crate::scenes::assorted_balls;
use crate::{Conditions, CostError, ErrorOver, Plot, Point, Quantity, Study};

/// Allowed errors, in displayed light between 0 and 1.
const BOUNDS: &[f32] = &[0.001, 0.003, 0.01, 0.03, 0.1, 0.3];
const FEW_BOUNDS: &[f32] = &[0.01, 0.1];
const SECONDS: f64 = 6.0;
const BOUND: &str = "error allowed";
const BY_NEED: &str = "by need";

/// Runs the study.
///
/// # Errors
/// [`CostError`].
pub fn run(conditions: &Conditions<'_>) -> Result<Measured, CostError> {
    over_scenes_made(conditions, study(), ("assorted-balls", assorted_balls), |scene, told, measured| {
        of_scene(conditions, scene, told, measured)
    })
}

fn study() -> Study {
    Study {
        name: "need".into(),
        title: "Shading by need".into(),
        question: "Each object takes the cheapest shading that is known in advance to keep within an error. How much time does this save, and how large is the error of the picture?".into(),
        reference: "the frame with Phong shading of all objects; the largest difference is that of a single channel of a pixel".into(),
        plots: vec![Plot {
            title: "Error over time".into(),
            across: Quantity::Milliseconds,
            up: Quantity::Error,
            front: true,
            ..Plot::default()
        }],
        ..Study::default()
    }
}

fn of_scene(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    told: [f64; 2],
    measured: &mut Measured,
) -> Result<(), CostError> {
    let bounds = conditions.unless_quick(BOUNDS, FEW_BOUNDS).iter().copied().filter_map(ErrorBound::new);
    let by_need = bounds.map(|max_error| Shading::Auto { max_error });
    let all: Vec<Shading> =
        [Shading::Phong, Shading::Gouraud, Shading::Flat].into_iter().chain(by_need).collect();
    let mut frames = Vec::new();
    for shading in &all {
        let options = FrameOptions { shading: Some(*shading), ..FrameOptions::default() };
        frames.push(Frame::new(scene.open(conditions.aspect())?, options).sharing("need"));
    }
    let drawn = draw_frames(conditions, frames, SECONDS, told)?;
    let reference = measured.keep_reference(&format!("{} Phong", scene.name), drawn[0].picture.clone());
    let first = measured.study.points.len();
    for (shading, frame) in all.iter().zip(&drawn) {
        let point = point(conditions, scene, *shading, frame);
        measured.add_picture(point, frame.picture.clone(), &reference, ErrorOver::Picture)?;
    }
    let findings = findings(&scene.name, &measured.study.points[first..], &drawn);
    measured.study.findings.extend(findings);
    Ok(())
}

fn point(conditions: &Conditions<'_>, scene: &SceneFile, shading: Shading, frame: &DrawnFrame) -> Point {
    let (series, label, bound) = match shading {
        Shading::Flat => ("flat", "flat".to_owned(), None),
        Shading::Gouraud => ("Gouraud", "Gouraud".to_owned(), None),
        Shading::Phong => ("Phong", "Phong".to_owned(), None),
        Shading::Auto { max_error } => {
            let bound = f64::from(max_error.get());
            (BY_NEED, format!("within {}", short(bound)), Some(bound))
        }
    };
    let mut counts = frame.counts();
    if bound.is_some() {
        let ShadingNeeds { flat, gouraud, phong, .. } = frame.statistics.shading_by_need;
        for (name, count) in [("flat", flat), ("Gouraud", gouraud), ("Phong", phong)] {
            counts.insert(format!("objects with {name} shading"), count as f64);
        }
    }
    Point {
        series: scene.series(conditions, series),
        label,
        parameters: bound.map(|bound| (BOUND.to_owned(), bound)).into_iter().collect(),
        milliseconds: frame.spread(),
        counts,
        command: conditions.drawing(scene.in_commands(), &format!(" --shading {shading}")),
        ..Point::default()
    }
}

fn findings(scene: &str, points: &[Point], drawn: &[DrawnFrame]) -> Vec<String> {
    let Some(phong) = drawn.first() else { return Vec::new() };
    let mut findings = Vec::new();
    for (point, frame) in points.iter().zip(drawn) {
        let Some(bound) = point.parameters.get(BOUND) else { continue };
        let ShadingNeeds { flat, gouraud, phong: every_fragment, .. } = frame.statistics.shading_by_need;
        let all = flat + gouraud + every_fragment;
        let Some(ratio) = ratio_of(&frame.times, &phong.times) else { continue };
        let Some(error) = point.error else { continue };
        findings.push(format!(
            "With an allowed error of {}, {flat} of the {all} objects in view of the {scene} have flat and {gouraud} have Gouraud shading. The frame takes {} times as long as with Phong shading of all objects; its error is {}, and {} in the worst pixel.",
            short(*bound),
            factor(&ratio),
            percent(error.relative_rmse),
            short(error.largest)
        ));
    }
    findings.extend(cheapest_by_error(&points.iter().collect::<Vec<_>>(), &format!(" of the {scene}")));
    findings
}
