//! Which settings to draw a level with: all are measured side by side at every camera, those that another one beats are dropped, and of what is left the one is taken
//! that keeps a goal. Not the studies, which explain; this decides.

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::Instant;

use bevy_ecs::prelude::*;
use lumbre_optics::{ErrorBound, Light, Shading};
use lumbre_render::{FrameOptions, Gpu};
use lumbre_scene::{ActiveCamera, Camera, Name, SceneSettings};

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

/// A way to draw a level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawSettings {
    /// How often the lighting equation is evaluated, for objects that do not choose for themselves.
    pub shading: Shading,
    /// Shadows of lights that ask for them.
    pub shadows: bool,
    /// Four samples a pixel.
    pub multisample: bool,
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

impl DrawSettings {
    /// The most accurate: the others are measured against it.
    pub const REFERENCE: Self = Self { shading: Shading::Phong, shadows: true, multisample: true };

    /// Every combination, the most accurate first. What no light asks for is not varied.
    fn all(has_shadows: bool) -> Vec<Self> {
        let mut all = Vec::new();
        for multisample in [true, false] {
            for shadows in [true, false] {
                for shading in rates() {
                    if shadows || has_shadows {
                        all.push(Self { shading, shadows, multisample });
                    }
                }
            }
        }
        all
    }

    fn label(&self) -> String {
        let shadows = if self.shadows { "" } else { ", no shadows" };
        let samples = if self.multisample { ", four samples" } else { "" };
        format!("{}{shadows}{samples}", self.shading)
    }

    /// As `lumbre render` is asked for them.
    pub fn arguments(&self) -> String {
        let shadows = if self.shadows { "" } else { " --no-shadows" };
        let samples = if self.multisample { " --msaa" } else { "" };
        format!("--shading {}{shadows}{samples}", self.shading)
    }

    /// What of them is the World's: objects that choose their shading keep it.
    fn set(&self, world: &mut World) {
        world.get_resource_or_insert_with(SceneSettings::default).shading = self.shading;
    }

    /// What of them is the frame's.
    fn options(&self) -> FrameOptions {
        let Self { shadows, multisample, .. } = *self;
        FrameOptions { shadows, multisample, ..FrameOptions::default() }
    }
}

/// Errors that shading by need is tried with.
const BOUNDS: [f32; 4] = [0.003, 0.01, 0.03, 0.1];

/// Rates of evaluation that are tried, the most accurate first.
fn rates() -> Vec<Shading> {
    let by_need = BOUNDS.into_iter().filter_map(ErrorBound::new);
    let by_need = by_need.map(|max_error| Shading::Auto { max_error });
    [Shading::Phong].into_iter().chain(by_need).chain([Shading::Gouraud, Shading::Flat]).collect()
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
    let conditions = Conditions {
        gpu,
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
    let mut lights = world.query::<&Light>();
    let has_shadows = lights.iter(&world).any(|light| light.enabled && light.shadow);
    let mut own = world.query::<&Shading>();
    let choosers = own.iter(&world).count();

    let settings = DrawSettings::all(has_shadows);
    let everything: Vec<usize> = (0..settings.len()).collect();
    let mut drawn =
        draw_at_cameras(conditions, scene, &cameras, settings.iter().copied(), SECONDS[0], [0.0, 0.6])?;
    let mut measured = Measured { study: study(&scene.name), ..Measured::default() };
    let points = points(conditions, scene, &cameras, &settings, &drawn, &mut measured)?;
    // Only what may be the best is worth more rounds.
    let contenders: Vec<usize> = everything.into_iter().filter(|&one| !is_beaten(one, &points)).collect();
    let some = contenders.iter().map(|&one| settings[one]);
    let again = draw_at_cameras(conditions, scene, &cameras, some, SECONDS[1], [0.6, 1.0])?;
    for (&place, again) in contenders.iter().zip(again) {
        for (own, again) in drawn[place].iter_mut().zip(again) {
            own.times.extend(again.times);
        }
    }
    let timed = |(point, drawn): (Point, &Vec<DrawnFrame>)| Point { milliseconds: longest(drawn), ..point };
    let mut study = std::mem::take(&mut measured.study);
    study.points = points.into_iter().zip(&drawn).map(timed).collect();
    if choosers > 0 {
        study.notes.push(format!(
            "{choosers} objects choose their shading themselves and keep it; --shading of the commands asks nobody."
        ));
    }
    let place = |point: &Point| study.points.iter().position(|other| std::ptr::eq(other, point));
    let front: Vec<usize> = pareto_front(&study.points).into_iter().filter_map(place).collect();
    let chosen = choose(&study.points, goal);
    study.findings = findings(&study.points, &front, chosen, goal, cameras.len());
    Ok(Tuned { study, settings, front, chosen, pictures: measured })
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
fn is_beaten(one: usize, points: &[Point]) -> bool {
    let known = |point: &Point| Some((point.milliseconds?, point.error?.relative_rmse));
    let Some((time, error)) = known(&points[one]) else { return true };
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
    settings: impl Iterator<Item = DrawSettings>,
    seconds: f64,
    told: [f64; 2],
) -> Result<Vec<Vec<DrawnFrame>>, CostError> {
    let mut frames = Vec::new();
    for settings in settings {
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

/// A point for each of the settings: the longest time and the largest error of all cameras, with the picture of that camera.
fn points(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    cameras: &[(Entity, String)],
    all: &[DrawSettings],
    drawn: &[Vec<DrawnFrame>],
    measured: &mut Measured,
) -> Result<Vec<Point>, CostError> {
    let Some(exact) = all.iter().position(|settings| *settings == DrawSettings::REFERENCE) else {
        return Ok(Vec::new());
    };
    let references: Vec<String> = cameras
        .iter()
        .enumerate()
        .zip(&drawn[exact])
        .map(|((number, (_, name)), drawn)| {
            measured.keep_reference(&format!("reference {number} {name}"), drawn.picture.clone())
        })
        .collect();
    let mut points = Vec::new();
    for (settings, drawn) in all.iter().zip(drawn) {
        let mut worst: Option<Measured> = None;
        for (camera, (reference, drawn)) in references.iter().zip(drawn).enumerate() {
            let mut one = Measured { study: study(&scene.name), ..Measured::default() };
            let kept = measured.pictures.get(reference).cloned();
            one.pictures.extend(kept.map(|picture| (reference.clone(), picture)));
            let name = &cameras[camera].1;
            let point = Point {
                series: settings.shading.name().to_owned(),
                label: settings.label(),
                counts: drawn.counts(),
                command: format!(
                    "lumbre render {} -o frame.png --camera '{name}' --size {} {}",
                    scene.in_commands(),
                    conditions.size_text(),
                    settings.arguments()
                ),
                ..Point::default()
            };
            one.add_picture(point, drawn.picture.clone(), reference, ErrorOver::Picture)?;
            let error = |of: &Measured| {
                of.study.points.first().and_then(|point| point.error).map_or(0.0, |error| error.relative_rmse)
            };
            if worst.as_ref().is_none_or(|worst| error(&one) > error(worst)) {
                worst = Some(one);
            }
        }
        let Some(mut worst) = worst else { continue };
        measured.pictures.append(&mut worst.pictures);
        measured.heat.append(&mut worst.heat);
        let milliseconds = longest(drawn);
        points.extend(worst.study.points.into_iter().map(|point| Point { milliseconds, ..point }));
    }
    Ok(points)
}

fn study(scene: &str) -> Study {
    Study {
        name: "tune".into(),
        title: format!("Settings for {scene}"),
        question: "Which settings draw it with the least error within a time, or in the least time within an error?".into(),
        reference: "the most accurate of them: Phong shading with shadows and four samples a pixel; time and error are those of the camera that is the worst".into(),
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
        assert!(is_beaten(
            4,
            &[point(40.0, 0.0), point(20.0, 0.01), point(9.0, 0.5), point(9.0, 0.5), point(30.0, 0.01)]
        ));
        assert!(!is_beaten(4, &points));
    }
}
