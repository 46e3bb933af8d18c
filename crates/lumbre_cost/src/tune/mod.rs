//! Which settings to draw a level with: one choice after another is measured side by side at every camera, what another way beats is dropped, and of what is left the one is
//! taken that keeps a goal. Not the studies, which explain; this decides.

mod draw_settings;

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::Instant;

use bevy_ecs::prelude::*;
use lumbre_optics::Shading;
use lumbre_render::{FrameOptions, Gpu, Renderer};
use lumbre_scene::{ActiveCamera, Camera, Name};

pub use self::draw_settings::DrawSettings;
use self::draw_settings::{Choices, Stage};
use crate::converged::ConvergedBakes;
use crate::findings::{cost_of, percent, short};
use crate::folder::Folder;
use crate::frames::{DrawnFrame, Frame, draw_frames};
use crate::machine::machine;
use crate::measured::Measured;
use crate::scene_file::SceneFile;
use crate::{
    Conditions, CostError, CostReport, ErrorOver, Listener, Plot, Point, Quantity, Settings, Spread, Study,
    pareto_front,
};

/// What settings have to keep.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Goal {
    /// Milliseconds that a frame may take, at the camera that takes the longest.
    pub milliseconds: Option<f64>,
    /// Relative RMSE against the most accurate settings, at the camera that is the farthest off.
    pub error: Option<f64>,
}

/// What was found.
#[derive(Clone, Debug, Default)]
pub struct Tuned {
    /// All settings with their times and errors, those that may be the best with more rounds; and what was found, in sentences.
    pub study: Study,
    /// The settings of each point of the study.
    pub settings: Vec<DrawSettings>,
    /// The points that no other one beats, from the cheapest to the most accurate.
    pub front: Vec<usize>,
    /// The point that keeps the goal best; none where none keeps it.
    pub chosen: Option<usize>,
    pictures: Measured,
}

/// Seconds for frames of all settings, and of those at the front once more.
const SECONDS: [f64; 2] = [10.0, 15.0];

/// What is asked of [`tune`].
#[derive(Clone, Debug)]
pub struct TuneOptions {
    /// The level.
    pub file: PathBuf,
    /// What settings have to keep.
    pub goal: Goal,
    /// Fewer rounds.
    pub quick: bool,
    /// Width and height of the frames in pixels.
    pub size: (u32, u32),
}

/// Measures every way to draw a file at each of its cameras, and takes the best that keeps the goal: the least error within a time, or the least time within an
/// error; of equals, the cheaper. With a folder it writes a report there, as of `lumbre cost`.
///
/// # Errors
/// [`CostError`]; [`CostError::Interrupted`] if the listener asks for it.
pub fn tune(
    gpu: &Gpu,
    options: &TuneOptions,
    report: Option<&Path>,
    listener: &Listener<'_>,
) -> Result<Tuned, CostError> {
    let begun = Instant::now();
    let files = [options.file.clone()];
    let (pictures, converged) = (RefCell::new(Renderer::new(gpu)), ConvergedBakes::default());
    let conditions = Conditions {
        gpu,
        pictures: &pictures,
        converged: &converged,
        quick: options.quick,
        counts_only: false,
        size: options.size,
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
    let choices = Choices::of(&mut world);
    let mut own = world.query::<&Shading>();
    let choosers = own.iter(&world).count();

    let mut measured = Measured { study: study(&scene.name), ..Measured::default() };
    let mut found = Candidates::default();
    let stages = Stage::ALL.len() as f64;
    for (place, stage) in Stage::ALL.into_iter().enumerate() {
        let share = |place: usize| 0.6 * place as f64 / stages;
        let ways = found.next(stage, &choices);
        if ways.len() > 1 {
            let told = [share(place), share(place + 1)];
            let drawn = draw_at_cameras(conditions, scene, &cameras, &ways, SECONDS[0] / stages, told)?;
            found.take(conditions, scene, &cameras, ways, drawn, &mut measured)?;
        }
    }
    // Only what may be the best is worth more rounds.
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
            "{choosers} objects choose their shading themselves and keep it; --shading of the commands asks nobody."
        ));
    }
    // The others were timed at another hour, and are beaten.
    let last: Vec<Point> = contenders.iter().map(|&place| study.points[place].clone()).collect();
    let place = |point: &Point| Some(contenders[last.iter().position(|other| std::ptr::eq(other, point))?]);
    let front: Vec<usize> = pareto_front(&last).into_iter().filter_map(place).collect();
    let chosen = choose(&last, goal).map(|place| contenders[place]);
    study.findings = findings(&study.points, &front, chosen, goal, cameras.len());
    Ok(Tuned { study, settings, front, chosen, pictures: measured })
}

/// What is known of the ways to draw a level so far.
#[derive(Default)]
struct Candidates {
    settings: Vec<DrawSettings>,
    /// A point for each of them.
    points: Vec<Point>,
    /// Those that were measured last, side by side: only their times can be compared.
    latest: Vec<usize>,
}

/// Ways from which a stage goes on, at most: those that no other one beats, spread evenly over them if there are more.
const CARRIED_ON: usize = 5;

impl Candidates {
    /// What a stage has to measure: those that are still in the running, and what differs from the best of them in what the stage chooses.
    fn next(&self, stage: Stage, choices: &Choices) -> Vec<DrawSettings> {
        if self.latest.is_empty() {
            let reference = choices.reference();
            let others = stage.others(reference, choices);
            return [reference].into_iter().chain(others).collect();
        }
        let running: Vec<DrawSettings> = self.contenders().iter().map(|&one| self.settings[one]).collect();
        let points: Vec<Point> = self.contenders().iter().map(|&one| self.points[one].clone()).collect();
        let place = |point: &Point| points.iter().position(|other| std::ptr::eq(other, point));
        let front: Vec<usize> = pareto_front(&points).into_iter().filter_map(place).collect();
        let mut ways = running.clone();
        for from in evenly(&front, CARRIED_ON) {
            for other in stage.others(running[from], choices) {
                if !ways.contains(&other) {
                    ways.push(other);
                }
            }
        }
        // Nothing to choose: what is known is known.
        if ways.len() == running.len() { Vec::new() } else { ways }
    }

    /// Takes what was measured of some ways, with their pictures if they are new.
    fn take(
        &mut self,
        conditions: &Conditions<'_>,
        scene: &SceneFile,
        cameras: &[(Entity, String)],
        ways: Vec<DrawSettings>,
        drawn: Vec<Vec<DrawnFrame>>,
        measured: &mut Measured,
    ) -> Result<(), CostError> {
        if self.settings.is_empty() {
            for (number, ((_, name), exact)) in cameras.iter().zip(drawn.iter().flatten()).enumerate() {
                measured.keep_reference(&reference_name(number, name), exact.picture.clone());
            }
        }
        self.latest.clear();
        for (way, drawn) in ways.into_iter().zip(&drawn) {
            let place = match self.settings.iter().position(|known| *known == way) {
                Some(place) => place,
                None => {
                    let label = way.label(self.settings.first().unwrap_or(&way));
                    let Some(point) = point(conditions, scene, cameras, (&way, label), drawn, measured)?
                    else {
                        continue;
                    };
                    self.settings.push(way);
                    self.points.push(point);
                    self.points.len() - 1
                }
            };
            self.points[place].milliseconds = longest(drawn);
            self.latest.push(place);
        }
        Ok(())
    }

    /// Those of the last that no other one of them beats.
    fn contenders(&self) -> Vec<usize> {
        let latest: Vec<&Point> = self.latest.iter().map(|&one| &self.points[one]).collect();
        let kept = (0..latest.len()).filter(|&one| !is_beaten(one, &latest));
        kept.map(|one| self.latest[one]).collect()
    }
}

/// At most so many of them, the first and the last among them.
fn evenly(all: &[usize], most: usize) -> Vec<usize> {
    let last = all.len().saturating_sub(1);
    match all.len() <= most {
        true => all.to_vec(),
        false => (0..most).map(|place| all[place * last / (most - 1)]).collect(),
    }
}

/// What the picture of a camera under the most accurate settings is called.
fn reference_name(number: usize, camera: &str) -> String {
    format!("reference {number} {camera}")
}

/// Errors that are no farther apart look alike: a quarter of a step of eight bits, in a picture of half grey.
const ALIKE: f64 = 0.002;

/// The setting that keeps the goal best: the least error where a time is given, and of those that look alike the cheapest; else the least time.
fn choose(points: &[Point], goal: Goal) -> Option<usize> {
    let known = points
        .iter()
        .enumerate()
        .filter_map(|(place, point)| Some((place, point.milliseconds?.median, point.error?.relative_rmse)));
    let keeps = |(_, time, error): &(usize, f64, f64)| {
        goal.milliseconds.is_none_or(|most| *time <= most) && goal.error.is_none_or(|most| *error <= most)
    };
    let kept: Vec<(usize, f64, f64)> = known.filter(keeps).collect();
    let least = kept.iter().map(|(.., error)| *error).fold(f64::INFINITY, f64::min);
    let most = if goal.milliseconds.is_some() { least + ALIKE } else { f64::INFINITY };
    let alike = kept.into_iter().filter(|(.., error)| *error <= most);
    alike.min_by(|a, b| a.1.total_cmp(&b.1).then(a.2.total_cmp(&b.2))).map(|(place, ..)| place)
}

/// Whether another one is as accurate and takes less time, quartiles and all.
fn is_beaten(one: usize, points: &[&Point]) -> bool {
    let known = |point: &Point| Some((point.milliseconds?, point.error?.relative_rmse));
    let Some((time, error)) = known(points[one]) else { return true };
    let others = points.iter().enumerate().filter(|(place, _)| *place != one);
    others.filter_map(|(_, other)| known(other)).any(|(other, its)| its <= error && other.is_below(&time))
}

/// The camera that takes the longest, by its median.
fn longest(drawn: &[DrawnFrame]) -> Option<Spread> {
    let spreads = drawn.iter().filter_map(|drawn| Spread::of(&drawn.times));
    spreads.max_by(|a, b| a.median.total_cmp(&b.median))
}

/// The cameras by name; each entity is the same whenever the file is read.
fn cameras(world: &mut World) -> Vec<(Entity, String)> {
    let mut cameras = world.query_filtered::<(Entity, Option<&Name>, Has<ActiveCamera>), With<Camera>>();
    let mut found: Vec<(Entity, String, bool)> = cameras
        .iter(world)
        .map(|(entity, name, active)| (entity, name.map_or("camera", Name::as_str).to_owned(), active))
        .collect();
    // The one that a program begins with comes first.
    found.sort_by_key(|(entity, _, active)| (!active, *entity));
    found.into_iter().map(|(entity, name, _)| (entity, name)).collect()
}

/// Frames of some of the settings at every camera: per setting, per camera. `told` are the shares that are done before and after.
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
        let world = Rc::new(RefCell::new(world));
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

/// A way's point: the longest time and the largest error of all cameras, with the picture of that camera. Nothing without a camera.
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
        question: "Which settings draw it with the least error within a time, or in the least time within an error?".into(),
        reference: "the most accurate of them: Phong shading with soft shadows of twice the usual resolution, lamps without an end, and four samples a pixel; time and error are those of the camera that is the worst".into(),
        plots: vec![Plot {
            title: "Error against time".into(),
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
            "Nothing keeps within {within}; the cheapest is {}, the most accurate {}.",
            told(cheapest),
            told(best)
        )),
        _ => None,
    };
    let ways = format!(
        "{} ways to draw it at {cameras} {}; {} of them are beaten by none.",
        points.len(),
        if cameras == 1 { "camera" } else { "cameras" },
        front.len()
    );
    choice.into_iter().chain([ways]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ErrorOf;

    fn point(time: f64, error: f64) -> Point {
        let milliseconds = Spread::of(&[0.98 * time, time, 1.02 * time]);
        Point {
            milliseconds,
            error: Some(ErrorOf { relative_rmse: error, ..ErrorOf::default() }),
            ..Point::default()
        }
    }

    #[test]
    fn a_planted_optimum_is_chosen() {
        let points =
            [point(40.0, 0.0), point(20.0, 0.01), point(19.0, 0.2), point(5.0, 0.4), point(20.2, 0.01)];
        let within = |milliseconds, error| choose(&points, Goal { milliseconds, error });
        assert_eq!(within(Some(100.0), None), Some(0));
        assert_eq!(within(Some(30.0), None), Some(1), "of two with the same error the cheaper");
        assert_eq!(within(Some(19.5), None), Some(2));
        assert_eq!(within(None, Some(0.05)), Some(1));
        assert_eq!(within(None, Some(0.5)), Some(3));
        assert_eq!(within(Some(30.0), Some(0.05)), Some(1));
        let alike = [point(40.0, 0.0), point(30.0, 0.001), point(20.0, 0.003)];
        assert_eq!(
            choose(&alike, Goal { milliseconds: Some(50.0), error: None }),
            Some(1),
            "what looks alike is cheaper"
        );
        assert_eq!(within(Some(4.0), None), None);
        assert_eq!(within(Some(30.0), Some(0.001)), None);
        // A clear winner beats; one that lies within the quartiles does not.
        let slower =
            [point(40.0, 0.0), point(20.0, 0.01), point(9.0, 0.5), point(9.0, 0.5), point(30.0, 0.01)];
        let beaten = |points: &[Point]| is_beaten(4, &points.iter().collect::<Vec<_>>());
        assert!(beaten(&slower) && !beaten(&points));
    }

    #[test]
    fn a_few_of_many_are_spread_over_them() {
        assert_eq!(evenly(&[3, 1, 2], 5), [3, 1, 2]);
        assert_eq!(evenly(&[0, 1, 2, 3, 4, 5, 6, 7, 8], 5), [0, 2, 4, 6, 8]);
        assert_eq!(evenly(&[0, 1, 2, 3, 4, 5], 5), [0, 1, 2, 3, 5]);
    }
}
