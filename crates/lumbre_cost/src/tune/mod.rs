//! Finds the settings with which to draw a level. The choices are measured stage by stage at every camera,
//! and what another way beats is dropped. Of the remaining ways, the one that reaches a goal best is chosen.

mod candidates;
mod draw_settings;
mod goal;
mod lightmap_density;

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use bevy_ecs::prelude::*;
use lumbre_optics::Shading;
use lumbre_render::{FrameOptions, Gpu, Renderer};
use lumbre_scene::{ActiveCamera, Camera, Name, SceneSettings, reduce_lightmaps};

pub(crate) use self::candidates::Candidates;
pub use self::draw_settings::DrawSettings;
pub(crate) use self::draw_settings::{Choices, Stage};
pub use self::goal::Goal;
pub(crate) use self::goal::choose;
pub use self::lightmap_density::LIGHTMAP_BYTES;
use self::lightmap_density::LightmapSizes;
use crate::compile_ahead::device_ahead;
use crate::converged::ConvergedBakes;
use crate::findings::{cost_of, percent, short};
use crate::folder::Folder;
use crate::frame::Frame;
use crate::frames::{DrawnFrame, draw_in_rounds};
use crate::machine::machine;
use crate::measured::Measured;
use crate::rounds::Rounds;
use crate::scene_file::SceneFile;
use crate::{
    Conditions, CostError, CostReport, ErrorOver, Listener, Plot, Point, Quantity, Settings, Spread, Study,
};

/// The result of tuning.
#[derive(Clone, Debug, Default)]
pub struct Tuned {
    /// All settings with their times and errors, and the findings. The settings on the front were measured in
    /// more rounds.
    pub study: Study,
    /// The settings of each point of the study.
    pub settings: Vec<DrawSettings>,
    /// Indices of the points that no other one beats in time, error and bytes of lightmaps, and of the chosen one,
    /// from the cheapest to the most accurate.
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
    let lightmaps = LightmapSizes::of(&mut world);
    let mut worlds = Worlds { scene, aspect: conditions.aspect(), by_reduction: BTreeMap::new() };

    let mut measured = Measured { study: study(&scene.name), ..Measured::default() };
    let mut found = Candidates::default();
    // Once it is known at which cameras frames take longest, stages are timed there alone.
    let every = vec![true; cameras.len()];
    let mut slow = every.clone();
    let stages = Stage::ALL.len() as f64;
    let rounds = conditions.rounds(SECONDS[0] / stages);
    // What a stage drops is not chosen any more, and what it keeps is measured again: the fewest rounds that tell
    // times apart suffice for a quick result.
    let rounds_of_stage =
        Rounds { min: conditions.unless_quick(rounds.min, Spread::MIN_ROUNDS_TO_DISTINGUISH), ..rounds };
    for (place, stage) in Stage::ALL.into_iter().enumerate() {
        let share = |place: usize| 0.6 * place as f64 / stages;
        let ways = found.next(stage, &choices);
        if ways.len() > 1 {
            let told = [share(place), share(place + 1)];
            let drawn =
                draw_at_cameras(conditions, &mut worlds, (&cameras, &slow), &ways, rounds_of_stage, told)?;
            if found.settings.is_empty() {
                slow = slowest(&drawn, cameras.len());
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
    let ways: Vec<DrawSettings> = found.contenders().iter().map(|&one| found.settings[one]).collect();
    let sizes = |way: &DrawSettings| lightmaps.bytes(way.lightmap_reduction);
    let mut measure = |ways: &[DrawSettings], found: &mut Candidates, told: [f64; 2]| {
        let drawn = draw_at_cameras(
            conditions,
            &mut worlds,
            (&cameras, &every),
            ways,
            conditions.rounds(SECONDS[1]),
            told,
        )?;
        found.begin();
        for (way, drawn) in ways.iter().zip(&drawn) {
            found.take(*way, longest(drawn), |label| {
                point(conditions, scene, &cameras, (way, label), drawn, &mut measured)
            })?;
        }
        Ok::<_, CostError>(())
    };
    measure(&ways, &mut found, [0.6, if lightmaps.is_empty() { 1.0 } else { 0.8 }])?;
    let mut front = found.front();
    let mut chosen = found.chosen(&front, goal);
    let mut of_lightmaps = Vec::new();
    // Without a goal, the errors of coarser lightmaps show best beside the most accurate settings.
    if let Some(of) = chosen.or(front.last().copied()).filter(|_| !lightmaps.is_empty()) {
        let variants = lightmap_density::variants(found.settings[of]);
        let others: Vec<DrawSettings> = front.iter().map(|&one| found.settings[one]).collect();
        let ways: Vec<DrawSettings> = others.into_iter().chain(variants.iter().copied().skip(1)).collect();
        measure(&ways, &mut found, [0.8, 1.0])?;
        let places: Vec<usize> = variants.iter().filter_map(|variant| found.place(variant)).collect();
        let points: Vec<(&Point, f64)> =
            places.iter().map(|&place| (&found.points[place], sizes(&found.settings[place]))).collect();
        chosen =
            chosen.map(|chosen| lightmap_density::choose(&points, goal).map_or(chosen, |one| places[one]));
        of_lightmaps = lightmap_density::findings(&points);
        front = lightmap_density::front(&found, chosen, sizes);
    }
    let Candidates { settings, points, .. } = found;
    let mut study = Study { points, ..std::mem::take(&mut measured.study) };
    if !lightmaps.is_empty() {
        for (point, way) in study.points.iter_mut().zip(&settings) {
            point.counts.insert(LIGHTMAP_BYTES.to_owned(), sizes(way));
        }
    }
    if choosers > 0 {
        study.notes.push(format!(
            "{choosers} objects choose their own shading and keep it here; --shading in the commands overrides it."
        ));
    }
    study.findings = findings(&study.points, &front, chosen, goal, cameras.len());
    study.findings.extend(of_lightmaps);
    Ok(Tuned { study, settings, front, chosen, pictures: measured })
}

/// Returns for each camera whether frames there may be the slowest with some of these settings: where their range
/// of times is not below that of the slowest camera.
fn slowest(drawn: &[Vec<DrawnFrame>], cameras: usize) -> Vec<bool> {
    let mut slow = vec![false; cameras];
    for of_way in drawn {
        let Some(longest) = longest(of_way) else { continue };
        for (slow, drawn) in slow.iter_mut().zip(of_way) {
            *slow |= drawn.spread().is_some_and(|spread| !spread.is_below(&longest));
        }
    }
    slow
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

/// The level, as it is read and with coarser lightmaps. Ways to draw it share these Worlds, so that a renderer
/// uploads each of them once.
struct Worlds<'a> {
    scene: &'a SceneFile,
    aspect: f64,
    by_reduction: BTreeMap<u32, (Arc<Mutex<World>>, SceneSettings)>,
}

impl Worlds<'_> {
    /// Returns the World with lightmaps reduced by this much, and the settings of the file.
    ///
    /// # Errors
    /// [`CostError::Load`].
    fn with_lightmaps(&mut self, reduction: u32) -> Result<(Arc<Mutex<World>>, SceneSettings), CostError> {
        if let Some(known) = self.by_reduction.get(&reduction) {
            return Ok(known.clone());
        }
        let mut world = self.scene.open(self.aspect)?;
        reduce_lightmaps(&mut world, reduction);
        let own = world.get_resource::<SceneSettings>().copied().unwrap_or_default();
        let new = (Arc::new(Mutex::new(world)), own);
        self.by_reduction.insert(reduction, new.clone());
        Ok(new)
    }
}

/// Draws frames with some settings at every camera, times those at the cameras for which `timed` says so, and
/// returns all by settings and camera. `told` are the
/// fractions that are done before and after.
fn draw_at_cameras(
    conditions: &Conditions<'_>,
    worlds: &mut Worlds<'_>,
    (cameras, timed): (&[(Entity, String)], &[bool]),
    ways: &[DrawSettings],
    rounds: Rounds,
    told: [f64; 2],
) -> Result<Vec<Vec<DrawnFrame>>, CostError> {
    let mut frames = Vec::new();
    for settings in ways {
        let (world, own) = worlds.with_lightmaps(settings.lightmap_reduction)?;
        for ((camera, _), is_timed) in cameras.iter().zip(timed) {
            let options = FrameOptions { camera: Some(*camera), ..FrameOptions::default() };
            let frame = Frame::of(&world, options).with_settings(settings.of_scene(own)).sharing("tune");
            frames.push(frame.timed(*is_timed));
        }
    }
    let mut drawn = draw_in_rounds(conditions, frames, rounds, told)?.into_iter();
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
        reference: "the most accurate settings: Phong shading with soft shadows of twice the default resolution, lamps that do not end, four samples per pixel, and the file's lightmaps; times are those of the slowest camera, and errors those of the camera with the largest error".into(),
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
