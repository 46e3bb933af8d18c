//! Finds the settings with which to draw a level. The choices are measured stage by stage at every camera,
//! and what another way beats is dropped. Of the remaining ways, the one that reaches a goal best is chosen.

mod candidates;
mod draw_settings;
mod goal;

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use bevy_ecs::prelude::*;
use lumbre_optics::Shading;
use lumbre_render::{FrameOptions, Gpu, Renderer};
use lumbre_scene::{ActiveCamera, Camera, Lightmap, Name};

pub(crate) use self::candidates::Candidates;
pub use self::draw_settings::DrawSettings;
pub(crate) use self::draw_settings::{Choices, Stage};
pub use self::goal::Goal;
pub(crate) use self::goal::choose;
use crate::compile_ahead::device_ahead;
use crate::converged::ConvergedBakes;
use crate::findings::{cost_of, percent, short};
use crate::folder::Folder;
use crate::frame::Frame;
use crate::frames::{DrawnFrame, draw_frames};
use crate::machine::machine;
use crate::measured::Measured;
use crate::scene_file::SceneFile;
use crate::{
    Conditions, CostError, CostReport, ErrorOver, Listener, Plot, Point, Quantity, Settings, Spread, Study,
    pareto_front,
};

/// The result of tuning.
#[derive(Clone, Debug, Default)]
pub struct Tuned {
    /// All settings with their times and errors, and the findings. The settings on the front were measured in
    /// more rounds.
    pub study: Study,
    /// The settings of each point of the study.
    pub settings: Vec<DrawSettings>,
    /// Indices of the points that no other one beats, from the cheapest to the most accurate.
    pub front: Vec<usize>,
    /// Index of the point that reaches the goal best; `None` if none does.
    pub chosen: Option<usize>,
    pictures: Measured,
}

/// Seconds for the frames of all settings, and for the final measurement of those on the front.
const SECONDS: [f64; 2] = [10.0, 15.0];

/// The options of [`tune`].
#[derive(Clone, Debug)]
pub struct TuneOptions {
    /// The level.
    pub file: PathBuf,
    /// The limits that the settings have to keep.
    pub goal: Goal,
    /// Whether to measure fewer rounds.
    pub quick: bool,
    /// Width and height of the frames in pixels.
    pub size: (u32, u32),
}

/// Measures every way to draw a file at each of its cameras, and chooses the one that reaches the goal best:
/// the least error within a time, or the least time within an error. If `report` names a folder, a report
/// like that of `lumbre cost` is written there.
///
/// # Errors
/// [`CostError`]; [`CostError::Interrupted`] if the listener asks to stop.
pub fn tune(
    gpu: &Gpu,
    options: &TuneOptions,
    report: Option<&Path>,
    listener: &Listener<'_>,
) -> Result<Tuned, CostError> {
    let begun = Instant::now();
    let files = [options.file.clone()];
    let (pictures, converged) = (RefCell::new(Renderer::new(gpu)), ConvergedBakes::default());
    let ahead = device_ahead(gpu);
    let conditions = Conditions {
        gpu,
        ahead: ahead.as_ref(),
        pictures: &pictures,
        converged: &converged,
        quick: options.quick,
        counts_only: false,
        counts_lights: false,
        size: options.size,
        size_of_report: options.size,
        as_shown: true,
        seed: 0,
        folder: report.unwrap_or(Path::new(".")),
        files: &files,
        listener,
    };
    let mut tuned = tuned(&conditions, options.goal)?;
    tuned.study.seconds = begun.elapsed().as_secs_f64();
    if let Some(folder) = report {
        let folder = Folder::open(folder)?;
        let measured = Measured { study: tuned.study.clone(), ..std::mem::take(&mut tuned.pictures) };
        folder.write_pictures(&measured)?;
        let files = vec![options.file.display().to_string()];
        let settings =
            Settings { quick: options.quick, counts_only: false, size: options.size, seed: 0, files };
        folder.write(&CostReport { machine: machine(gpu), settings, studies: vec![measured.study] })?;
    }
    Ok(tuned)
}

fn tuned(conditions: &Conditions<'_>, goal: Goal) -> Result<Tuned, CostError> {
    let scenes = SceneFile::given(conditions)?;
    let Some(scene) = scenes.first() else { return Ok(Tuned::default()) };
    let mut world = scene.open(conditions.aspect())?;
    let cameras = cameras(&mut world);
    let choices = Choices::of(&mut world, None);
    let mut own = world.query::<&Shading>();
    let choosers = own.iter(&world).count();
    let lightmapped = world.query::<&Lightmap>().iter(&world).count();

    let mut measured = Measured { study: study(&scene.name), ..Measured::default() };
    let mut found = Candidates::default();
    let stages = Stage::ALL.len() as f64;
    for (place, stage) in Stage::ALL.into_iter().enumerate() {
        let share = |place: usize| 0.6 * place as f64 / stages;
        let ways = found.next(stage, &choices);
        if ways.len() > 1 {
            let told = [share(place), share(place + 1)];
            let drawn = draw_at_cameras(conditions, scene, &cameras, &ways, SECONDS[0] / stages, told)?;
            if found.settings.is_empty() {
                for (number, ((_, name), exact)) in cameras.iter().zip(drawn.iter().flatten()).enumerate() {
                    measured.keep_reference(&reference_name(number, name), exact.picture.clone());
                }
            }
            found.begin();
            for (way, drawn) in ways.into_iter().zip(&drawn) {
                found.take(way, longest(drawn), |label| {
                    point(conditions, scene, &cameras, (&way, label), drawn, &mut measured)
                })?;
            }
        }
    }
    // Only the ways that may be chosen are worth more rounds.
    let contenders = found.contenders();
    let ways: Vec<DrawSettings> = contenders.iter().map(|&one| found.settings[one]).collect();
    let again = draw_at_cameras(conditions, scene, &cameras, &ways, SECONDS[1], [0.6, 1.0])?;
    for (&place, again) in contenders.iter().zip(&again) {
        found.points[place].milliseconds = longest(again);
    }
    let Candidates { settings, points, .. } = found;
    let mut study = Study { points, ..std::mem::take(&mut measured.study) };
    if choosers > 0 {
        study.notes.push(format!(
            "{choosers} objects choose their own shading and keep it here; --shading in the commands overrides it."
        ));
    }
    if lightmapped > 0 {
        study.notes.push(
            "The density of lightmaps is not among the settings: it affects their error and size, but hardly the time of a frame; `lumbre cost --study lightmaps` shows by how much."
                .into(),
        );
    }
    // The other ways are beaten, and their times are from earlier rounds.
    let last: Vec<Point> = contenders.iter().map(|&place| study.points[place].clone()).collect();
    let place = |point: &Point| Some(contenders[last.iter().position(|other| std::ptr::eq(other, point))?]);
    let front: Vec<usize> = pareto_front(&last).into_iter().filter_map(place).collect();
    let chosen = choose(&last, goal).map(|place| contenders[place]);
    study.findings = findings(&study.points, &front, chosen, goal, cameras.len());
    Ok(Tuned { study, settings, front, chosen, pictures: measured })
}

/// Returns the name of a camera's reference picture.
fn reference_name(number: usize, camera: &str) -> String {
    format!("reference {number} {camera}")
}

/// Returns the time of the slowest camera, by its median.
fn longest(drawn: &[DrawnFrame]) -> Option<Spread> {
    let spreads = drawn.iter().filter_map(|drawn| Spread::of(&drawn.times));
    spreads.max_by(|a, b| a.median.total_cmp(&b.median))
}

/// Returns the cameras with their names. Entities are the same whenever the file is read.
fn cameras(world: &mut World) -> Vec<(Entity, String)> {
    let mut cameras = world.query_filtered::<(Entity, Option<&Name>, Has<ActiveCamera>), With<Camera>>();
    let mut found: Vec<(Entity, String, bool)> = cameras
        .iter(world)
        .map(|(entity, name, active)| (entity, name.map_or("camera", Name::as_str).to_owned(), active))
        .collect();
    // The active camera comes first.
    found.sort_by_key(|(entity, _, active)| (!active, *entity));
    found.into_iter().map(|(entity, name, _)| (entity, name)).collect()
}

/// Draws frames with some settings at every camera, and returns them by settings and camera. `told` are the
/// fractions that are done before and after.
fn draw_at_cameras(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    cameras: &[(Entity, String)],
    ways: &[DrawSettings],
    seconds: f64,
    told: [f64; 2],
) -> Result<Vec<Vec<DrawnFrame>>, CostError> {
    let mut frames = Vec::new();
    for settings in ways {
        let mut world = scene.open(conditions.aspect())?;
        settings.set(&mut world);
        let world = Arc::new(Mutex::new(world));
        for (camera, _) in cameras {
            let options = FrameOptions { camera: Some(*camera), ..settings.options() };
            frames.push(Frame::of(&world, options).sharing("tune"));
        }
    }
    let mut drawn = draw_frames(conditions, frames, seconds, told)?.into_iter();
    let mut found = Vec::new();
    while drawn.len() > 0 {
        found.push(drawn.by_ref().take(cameras.len()).collect());
    }
    Ok(found)
}

/// Creates the point of a way, with the picture and the error of the camera with the largest error. `None` if
/// there is no camera.
fn point(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    cameras: &[(Entity, String)],
    (way, label): (&DrawSettings, String),
    drawn: &[DrawnFrame],
    measured: &mut Measured,
) -> Result<Option<Point>, CostError> {
    let mut worst: Option<Measured> = None;
    for (number, ((_, camera), drawn)) in cameras.iter().zip(drawn).enumerate() {
        let mut one = Measured { study: study(&scene.name), ..Measured::default() };
        let reference = one.file_name(&reference_name(number, camera));
        let kept = measured.pictures.get(&reference).cloned();
        one.pictures.extend(kept.map(|picture| (reference.clone(), picture)));
        let point = Point {
            series: way.shading.name().to_owned(),
            label: label.clone(),
            counts: drawn.counts(),
            command: format!(
                "lumbre render {} -o frame.png --camera '{camera}' --size {} {}",
                scene.in_commands(),
                conditions.size_text(),
                way.arguments()
            ),
            ..Point::default()
        };
        one.add_picture(point, drawn.picture.clone(), &reference, ErrorOver::Picture)?;
        let error = |of: &Measured| {
            of.study.points.first().and_then(|point| point.error).map_or(0.0, |error| error.relative_rmse)
        };
        if worst.as_ref().is_none_or(|worst| error(&one) > error(worst)) {
            worst = Some(one);
        }
    }
    let Some(mut worst) = worst else { return Ok(None) };
    measured.pictures.append(&mut worst.pictures);
    measured.heat.append(&mut worst.heat);
    Ok(worst.study.points.pop())
}

fn study(scene: &str) -> Study {
    Study {
        name: "tune".into(),
        title: format!("Settings for {scene}"),
        question: "Which settings draw the level with the least error within a time, or in the least time within an error?".into(),
        reference: "the most accurate settings: Phong shading with soft shadows of twice the default resolution, lamps that do not end, and four samples per pixel; times are those of the slowest camera, and errors those of the camera with the largest error".into(),
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

fn findings(
    points: &[Point],
    front: &[usize],
    chosen: Option<usize>,
    goal: Goal,
    cameras: usize,
) -> Vec<String> {
    let within = [
        goal.milliseconds.map(|most| format!("{} ms", short(most))),
        goal.error.map(|most| format!("{} of error", percent(most))),
    ];
    let within = within.into_iter().flatten().collect::<Vec<_>>().join(" and ");
    let told = |place: &usize| format!("{} ({})", points[*place].label, cost_of(&points[*place]));
    let choice = match (chosen, front.first(), front.last()) {
        _ if within.is_empty() => None,
        (Some(place), ..) => Some(format!("Within {within}: {}.", told(&place))),
        (None, Some(cheapest), Some(best)) => Some(format!(
            "No settings keep within {within}; the cheapest settings are {}, the most accurate {}.",
            told(cheapest),
            told(best)
        )),
        _ => None,
    };
    let ways = format!(
        "{} settings were measured at {cameras} {}; {} of them are not beaten by any others in both time and error.",
        points.len(),
        if cameras == 1 { "camera" } else { "cameras" },
        front.len()
    );
    choice.into_iter().chain([ways]).collect()
}
