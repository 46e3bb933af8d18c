//! Finds the settings with which to draw a level. A survey of all cameras finds those that stand for the others.
//! At these the choices are measured stage by stage, and what another way beats is dropped. The remaining ways
//! are drawn at every camera, the one that reaches a goal best is chosen, and its time checked at every camera.

mod cameras;
mod candidates;
mod draw_settings;
mod goal;
mod lightmap_density;
mod measured_ways;

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::time::Instant;

use lumbre_optics::Shading;
use lumbre_render::{Gpu, Renderer};

use self::cameras::Cameras;
pub(crate) use self::candidates::Candidates;
pub use self::draw_settings::DrawSettings;
pub(crate) use self::draw_settings::{Choices, Stage};
pub use self::goal::Goal;
pub(crate) use self::goal::choose;
pub use self::lightmap_density::LIGHTMAP_BYTES;
use self::lightmap_density::LightmapSizes;
use self::measured_ways::{MeasuredWays, Where};
use crate::compile_ahead::device_ahead;
use crate::converged::ConvergedBakes;
use crate::findings::{cost_of, percent, short};
use crate::folder::Folder;
use crate::machine::machine;
use crate::measured::Measured;
use crate::rounds::Rounds;
use crate::scene_file::SceneFile;
use crate::shared_bakes::SharedBakes;
use crate::{Conditions, CostError, CostReport, Listener, Plot, Point, Quantity, Settings, Spread, Study};

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
    let bakes = SharedBakes::default();
    let ahead = device_ahead(gpu);
    let conditions = Conditions {
        gpu,
        ahead: ahead.as_ref(),
        pictures: &pictures,
        converged: &converged,
        bakes: &bakes,
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
        let mut measured = std::mem::take(&mut tuned.pictures);
        measured.study = tuned.study.clone();
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
    let cameras = Cameras::of(&mut world);
    let choices = Choices::of(&mut world, None);
    let mut own = world.query::<&Shading>();
    let choosers = own.iter(&world).count();
    let lightmaps = LightmapSizes::of(&mut world);
    drop(world);

    let ways = MeasuredWays::new(conditions, scene, choices.reference(), study(&scene.name));
    let mut search = Search { conditions, cameras, ways, found: Candidates::default() };
    search.survey(&choices, [0.0, SURVEYED])?;
    search.narrow_down(&choices, [SURVEYED, NARROWED_DOWN])?;
    let mut chosen = search.choose(goal, [NARROWED_DOWN, CHOSEN])?;
    let mut front = search.found.front();
    let mut of_lightmaps = Vec::new();
    let sizes = |way: &DrawSettings| lightmaps.bytes(way);
    // Without a goal, the errors of coarser lightmaps show best beside the most accurate settings.
    if let Some(of) = chosen.or(front.last().copied()).filter(|_| !lightmaps.is_empty()) {
        let variants = lightmap_density::variants(search.found.settings[of]);
        let others: Vec<DrawSettings> = front.iter().map(|&one| search.found.settings[one]).collect();
        let ways: Vec<DrawSettings> = others.into_iter().chain(variants.iter().copied().skip(1)).collect();
        search.measure_everywhere(&ways, [CHOSEN, 1.0])?;
        let found = &search.found;
        let places: Vec<usize> = variants.iter().filter_map(|variant| found.place(variant)).collect();
        let points: Vec<(&Point, f64)> =
            places.iter().map(|&place| (&found.points[place], sizes(&found.settings[place]))).collect();
        chosen =
            chosen.map(|chosen| lightmap_density::choose(&points, goal).map_or(chosen, |one| places[one]));
        let ways: Vec<DrawSettings> = places.iter().map(|&place| found.settings[place]).collect();
        of_lightmaps = lightmap_density::findings(&points, &ways);
        front = lightmap_density::front(found, chosen, sizes);
    }
    let Search { found, cameras, ways, .. } = search;
    let Candidates { settings, points, .. } = found;
    let mut measured = ways.pictures;
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
    study.findings = findings(&study.points, &front, chosen, goal, &cameras);
    study.findings.extend(of_lightmaps);
    Ok(Tuned { study, settings, front, chosen, pictures: measured })
}

/// Fractions of the work that are done after each part of it; the rest is for coarser lightmaps.
const SURVEYED: f64 = 0.2;
const NARROWED_DOWN: f64 = 0.6;
const CHOSEN: f64 = 0.8;

/// How often the choice is made again because another camera turns out to be the slowest with it.
const CHANGES_OF_MIND: usize = 2;

/// What is known while settings are searched for.
struct Search<'a> {
    conditions: &'a Conditions<'a>,
    cameras: Cameras,
    ways: MeasuredWays<'a>,
    found: Candidates,
}

impl Search<'_> {
    /// Draws the most accurate settings and the crudest ones of every kind at all cameras, to find the cameras that
    /// stand for all of them.
    fn survey(&mut self, choices: &Choices, [before, after]: [f64; 2]) -> Result<(), CostError> {
        let reference = choices.reference();
        let extremes = [reference, choices.crudest()];
        let crude: Vec<DrawSettings> = [reference].into_iter().chain(choices.crude()).collect();
        let (every, none) = (self.cameras.every(), self.cameras.none());
        let middle = 0.5 * (before + after);
        let rounds = self.fewest_rounds();
        let pictured = Where { timed: &none, pictured: &every };
        self.ways.draw(&self.cameras, &crude, pictured, rounds, [before, middle])?;
        if self.cameras.all.len() > 1 {
            let timed = Where { timed: &every, pictured: &none };
            let times = self.ways.draw(&self.cameras, &extremes, timed, rounds, [middle, after])?;
            let errors = |way: &DrawSettings| {
                let known = self.ways.errors(way, &self.cameras);
                known.into_iter().map(Option::unwrap_or_default).collect()
            };
            let errors: Vec<Vec<f64>> = crude.iter().map(errors).collect();
            self.cameras.choose(&times, &errors);
        }
        Ok(())
    }

    /// Measures the choices of one stage after the other at the cameras that stand for all. What a stage drops is not
    /// chosen any more, and what it keeps is measured again: for a quick result the fewest rounds suffice that tell
    /// times apart.
    fn narrow_down(&mut self, choices: &Choices, [before, after]: [f64; 2]) -> Result<(), CostError> {
        let stages = Stage::ALL.len() as f64;
        let rounds = self.conditions.rounds(SECONDS[0] / stages);
        let min = self.conditions.unless_quick(rounds.min, Spread::MIN_ROUNDS_TO_DISTINGUISH);
        let share = |place: usize| before + (after - before) * place as f64 / stages;
        for (place, stage) in Stage::ALL.into_iter().enumerate() {
            let ways = self.found.next(stage, choices);
            if ways.len() > 1 {
                let pictured = self.cameras.inaccurate.clone();
                let told = [share(place), share(place + 1)];
                self.measure(&ways, &pictured, Rounds { min, ..rounds }, told)?;
            }
        }
        Ok(())
    }

    /// Measures the ways that may be chosen, chooses the one that reaches the goal best, and checks at which cameras
    /// that one takes longest.
    fn choose(&mut self, goal: Goal, [before, after]: [f64; 2]) -> Result<Option<usize>, CostError> {
        let ways: Vec<DrawSettings> =
            self.found.contenders().iter().map(|&one| self.found.settings[one]).collect();
        let middle = 0.5 * (before + after);
        self.measure_everywhere(&ways, [before, middle])?;
        let mut chosen = self.found.chosen(&self.found.front(), goal);
        for _ in 0..CHANGES_OF_MIND {
            let Some(way) = chosen.map(|one| self.found.settings[one]) else { break };
            if self.cameras.all.len() == 1 {
                break;
            }
            let (every, none) = (self.cameras.every(), self.cameras.none());
            let at = Where { timed: &every, pictured: &none };
            let times = self.ways.draw(&self.cameras, &[way], at, self.fewest_rounds(), [middle, after])?;
            if !times.first().is_some_and(|times| self.cameras.add_slower(times)) {
                break;
            }
            self.measure_everywhere(&ways, [middle, after])?;
            chosen = self.found.chosen(&self.found.front(), goal);
        }
        Ok(chosen)
    }

    /// Measures ways for a decision: their errors at every camera, and their times where frames take longest.
    fn measure_everywhere(&mut self, ways: &[DrawSettings], told: [f64; 2]) -> Result<(), CostError> {
        self.measure(ways, &self.cameras.every(), self.conditions.rounds(SECONDS[1]), told)
    }

    /// Times ways side by side where frames take longest, draws the pictures that are missing of them, and takes all
    /// as the latest measurement.
    fn measure(
        &mut self,
        ways: &[DrawSettings],
        pictured: &[bool],
        rounds: Rounds,
        told: [f64; 2],
    ) -> Result<(), CostError> {
        let at = Where { timed: &self.cameras.slow, pictured };
        let times = self.ways.draw(&self.cameras, ways, at, rounds, told)?;
        self.found.begin();
        for (way, times) in ways.iter().zip(times) {
            let longest = times.into_iter().flatten().max_by(|a, b| a.median.total_cmp(&b.median));
            self.found.take_anew(*way, longest, self.ways.point(way));
        }
        Ok(())
    }

    /// Returns the fewest rounds with which times are told apart.
    fn fewest_rounds(&self) -> Rounds {
        let few = Spread::MIN_ROUNDS_TO_DISTINGUISH;
        Rounds { min: few, max: few, ..self.conditions.rounds(0.0) }
    }
}

fn study(scene: &str) -> Study {
    Study {
        name: "tune".into(),
        title: format!("Settings for {scene}"),
        question: "Which settings draw the level with the least error within a time, or in the least time within an error?".into(),
        reference: "the most accurate settings: Phong shading with soft shadows of twice the default resolution, lamps that do not end, four samples per pixel, and the file's lightmaps as half floats; times are those of the slowest camera, and errors those of the camera with the largest error".into(),
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
    cameras: &Cameras,
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
    let mut measured = format!(
        "{} settings were measured; {} of them are not beaten by any others in both time and error.",
        points.len(),
        front.len()
    );
    if cameras.all.len() > 1 {
        measured += &format!(
            " Of the {} cameras, frames take longest at {}, where they were timed; errors are the largest of all cameras, and for settings that were dropped early the largest of {}.",
            cameras.all.len(),
            cameras.named(&cameras.slow),
            cameras.named(&cameras.inaccurate)
        );
    }
    choice.into_iter().chain([measured]).collect()
}
