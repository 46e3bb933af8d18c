//! Study of every effect of a scene, switched off in turn: how much time a frame saves, and how much its
//! picture changes.

use lumbre_bake::{BakeOptions, Probes};
use lumbre_render::{FrameOptions, removable_effects};
use lumbre_scene::Census;

use crate::baked::{bake_options, bake_scene};
use crate::command_line::quoted;
use crate::findings::{is_above_one, listed, listed_with, percent, ratio_of, rounded, rounds};
use crate::frame::Frame;
use crate::frames::{DrawnFrame, draw_frames};
use crate::measured::Measured;
use crate::scene_file::SceneFile;
use crate::scenes::{Air, every_effect, room};
use crate::{Conditions, CostError, ErrorOver, Plot, Point, Quantity, Spread, Study};

/// Seconds for the frames of each scene in a full report.
const SECONDS: f64 = 9.0;
/// Approximate number of texels of the room's lightmaps.
const TEXELS: f64 = 4_000.0;
/// Number of the most expensive effects that the findings name.
const MAX_NAMED: usize = 3;
const SAVED: &str = "saved, ms";

/// Runs the study.
///
/// # Errors
/// [`CostError`].
pub fn run(conditions: &Conditions<'_>) -> Result<Measured, CostError> {
    // There are frames for many effects, most of which need shaders of their own, so the pictures are
    // smaller.
    let size = [conditions.size.0, conditions.size.1].map(|side| (2 * side / 3).max(8));
    let conditions = &Conditions { size: (size[0], size[1]), ..*conditions };
    let mut measured = Measured::of(study());
    let scenes = match conditions.files.is_empty() {
        true => vec![of_its_own(conditions)?],
        false => SceneFile::given(conditions)?,
    };
    let count = scenes.len() as f64;
    for (place, scene) in scenes.iter().enumerate() {
        of_scene(conditions, scene, [place, place + 1].map(|place| place as f64 / count), &mut measured)?;
    }
    Ok(measured)
}

/// Creates a room with every effect that can be left out, baked for its lightmaps and volumes; in a quick
/// report, a room with half of the effects.
fn of_its_own(conditions: &Conditions<'_>) -> Result<SceneFile, CostError> {
    if conditions.quick {
        return SceneFile::made(conditions, "hazy-room", room(Air::Hazy));
    }
    let name = "room-with-all-effects";
    let scene = SceneFile::made(conditions, name, every_effect())?;
    let options =
        BakeOptions { probes: Probes::Always, error: 0.05, ..bake_options(conditions, &scene, TEXELS)? };
    let baked = bake_scene(conditions, &scene, &options, [0.0, 0.05])?;
    SceneFile::made(conditions, &format!("baked-{name}"), baked.world)
}

fn study() -> Study {
    Study {
        name: "effects".into(),
        title: "What each effect costs and contributes".into(),
        question: "Every effect that a scene calls for is left out in turn. How much time does a frame save, and how large is the resulting error?".into(),
        reference: "the frame with all effects".into(),
        plots: vec![Plot {
            title: "Frames without one of their effects".into(),
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
    let mut whole = scene.open(conditions.aspect())?;
    let effects = removable_effects(&Census::of(&mut whole), &FrameOptions::default());
    let mut frames = vec![Frame::new(whole, FrameOptions::default()).sharing("effects")];
    for effect in &effects {
        let (mut world, mut options) = (scene.open(conditions.aspect())?, FrameOptions::default());
        effect.remove(&mut world, &mut options);
        frames.push(Frame::new(world, options).sharing("effects"));
    }
    let drawn = draw_frames(conditions, frames, SECONDS, told)?;
    let [whole, without @ ..] = &drawn[..] else { return Ok(()) };
    let reference = measured.keep_reference(&format!("{} with all", scene.name), whole.picture.clone());
    let left_out = std::iter::once(None).chain(effects.iter().map(|effect| Some(effect.effect)));
    for (without, frame) in left_out.zip(&drawn) {
        let point = point(conditions, scene, without, whole, frame);
        measured.add_picture(point, frame.picture.clone(), &reference, ErrorOver::Picture)?;
    }
    let points = &measured.study.points[measured.study.points.len() - without.len()..];
    let effects: Vec<&str> = effects.iter().map(|effect| effect.effect).collect();
    let findings = findings(&scene.name, &effects, whole, without, points);
    measured.study.findings.extend(findings);
    Ok(())
}

fn point(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    without: Option<&str>,
    whole: &DrawnFrame,
    frame: &DrawnFrame,
) -> Point {
    // Differences are taken between times of the same round, so that other load on the machine affects both.
    let saved = Spread::of(&whole.times.iter().zip(&frame.times).map(|(a, b)| a - b).collect::<Vec<_>>());
    let figures = saved.map(|saved| {
        [
            (SAVED.to_owned(), saved.median),
            ("saved, lower quartile, ms".to_owned(), saved.lower),
            ("saved, upper quartile, ms".to_owned(), saved.upper),
        ]
    });
    Point {
        series: scene.name.clone(),
        label: without.map_or_else(|| "with all effects".to_owned(), |effect| format!("without {effect}")),
        milliseconds: frame.spread(),
        counts: frame.counts(),
        figures: figures.into_iter().flatten().collect(),
        command: conditions.drawing(
            scene.in_commands(),
            &without.map_or_else(String::new, |effect| format!(" --without {}", quoted(effect))),
        ),
        ..Point::default()
    }
}

fn findings(
    scene: &str,
    effects: &[&str],
    whole: &DrawnFrame,
    without: &[DrawnFrame],
    points: &[Point],
) -> Vec<String> {
    let Some(time) = whole.spread() else { return Vec::new() };
    // Each effect with the factor by which the frame is slower with it, and the error without it.
    let known: Vec<(&str, Spread, f64)> = effects
        .iter()
        .zip(without)
        .zip(points)
        .filter_map(|((effect, frame), point)| {
            Some((*effect, ratio_of(&whole.times, &frame.times)?, point.error?.relative_rmse))
        })
        .collect();
    let mut costly: Vec<_> = known.iter().filter(|(_, ratio, _)| is_above_one(ratio) == Some(true)).collect();
    costly.sort_by(|a, b| b.1.median.total_cmp(&a.1.median));
    let mut findings = Vec::new();
    let share = |ratio: f64| 100.0 * (1.0 - 1.0 / ratio);
    let told: Vec<String> = costly
        .iter()
        .take(MAX_NAMED)
        .map(|(effect, ratio, error)| {
            format!(
                "without {effect} it takes {} % less time ({} to {}) and has an error of {}",
                rounded(share(ratio.median)),
                rounded(share(ratio.lower)),
                rounded(share(ratio.upper)),
                percent(*error)
            )
        })
        .collect();
    if !told.is_empty() {
        findings.push(format!(
            "The frame of the {scene} takes {}; {}.",
            crate::findings::milliseconds(&time),
            told.join("; ")
        ));
    }
    let open: Vec<&(&str, Spread, f64)> =
        known.iter().filter(|(_, ratio, _)| is_above_one(ratio).is_none()).collect();
    let names: Vec<&str> = open.iter().map(|(effect, ..)| *effect).collect();
    if let Some(fewest) = open.iter().map(|(_, ratio, _)| ratio.rounds).min() {
        findings.push(format!(
            "Whether {} any time in the {scene} is not distinguishable in {}.",
            listed_with(&names, "costs", "cost", "or"),
            rounds(fewest)
        ));
    }
    let spared: Vec<&str> = known
        .iter()
        .filter(|(_, ratio, _)| is_above_one(ratio) == Some(false))
        .map(|(effect, ..)| *effect)
        .collect();
    if !spared.is_empty() {
        findings.push(format!("The frame of the {scene} takes longer without {}.", listed(&spared, "or")));
    }
    // The effect with the highest cost relative to its contribution is the first to leave out.
    let worth = |(_, ratio, error): &&&(&str, Spread, f64)| (ratio.median - 1.0) / error.max(1e-9);
    if let Some((effect, ..)) = costly.iter().max_by(|a, b| worth(a).total_cmp(&worth(b)))
        && costly.len() > 1
    {
        findings
            .push(format!("The effect of the {scene} that saves the most time for its error is {effect}."));
    }
    let unseen: Vec<&str> =
        known.iter().filter(|(.., error)| *error == 0.0).map(|(effect, ..)| *effect).collect();
    if !unseen.is_empty() {
        findings.push(format!(
            "The picture of the {scene} is the same to the bit without {}.",
            listed(&unseen, "or without")
        ));
    }
    findings
}
