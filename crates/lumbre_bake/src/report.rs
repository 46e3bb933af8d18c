//! The report of a bake: what it did, how long it took, and the estimated errors. Includes its text output, but not the
//! estimation of errors, which is in `final_gather` and `finish`.

use serde::{Deserialize, Serialize};

/// The time that one stage took.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct StageTime {
    /// Name of the stage.
    pub stage: String,
    /// Wall-clock seconds.
    pub seconds: f64,
}

/// The lightmap's estimated error at some time during the bake.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ErrorAtTime {
    /// Wall-clock seconds since the bake began, including those of an interrupted bake that it resumed.
    pub seconds: f64,
    /// Estimated relative RMSE of the lightmap.
    pub error: f64,
}

/// One source of a lightmap's error.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ErrorPart {
    /// Where the error comes from, in words.
    pub what: String,
    /// Estimated RMSE relative to the light around each texel. The squares of all parts add up to the square of
    /// [`BakeReport::estimated_error`].
    pub error: f64,
}

/// The irradiance probes of a bake; all zeros if there are none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ProbeReport {
    /// Number of probes along x, y and z.
    pub resolution: [u32; 3],
    /// Distance between neighbouring probes in metres, along x, y and z.
    pub spacing: [f64; 3],
    /// Number of probes that lie inside geometry; they are given the light of their neighbours.
    pub inside: usize,
    /// Estimated relative RMSE that sampling leaves in the probes.
    pub estimated_error: f64,
}

/// The error that is due to the map's resolution: how far a bilinear look-up differs from the irradiance at points of
/// the surfaces, apart from sampling errors. All zeros if it was not measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ResolutionReport {
    /// Number of points at which it was measured, distributed evenly over the surfaces.
    pub points: usize,
    /// RMSE relative to the mean irradiance at these points.
    pub error: f64,
    /// Standard error of `error`, due to the limited number of points.
    pub standard_error: f64,
}

/// A part of the level whose estimated error is larger than that of the whole.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct WorstPlace {
    /// Centre of its texels in world space, metres.
    pub center: [f64; 3],
    /// Estimated RMSE of its texels relative to the light around them.
    pub error: f64,
    /// Its fraction of all texels that show a surface, in (0, 1].
    pub texels: f64,
    /// Names of the objects that contribute most to this error, at most two.
    pub objects: Vec<String>,
}

impl std::fmt::Display for WorstPlace {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [x, y, z] = self.center;
        let (error, objects) = (Percent(self.error), self.objects.join(", "));
        write!(f, "{error} around ({x:.1}, {y:.1}, {z:.1}): {objects}")
    }
}

/// The effect of closing the seams. All values except `edges` are relative to the mean irradiance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct SeamReport {
    /// Number of seams: pairs of edges that coincide in space and join smoothly, but have different lightmap
    /// coordinates.
    pub edges: usize,
    /// RMS difference between the two sides of the seams before they were closed.
    pub jump_before: f64,
    /// RMS difference after they were closed.
    pub jump_after: f64,
    /// Mean change of the texels beside seams.
    pub mean_change: f64,
    /// Largest change of any channel of a texel.
    pub largest_change: f64,
}

/// What a bake reused of the previous one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct RebakeReport {
    /// Why the whole scene had to be baked; empty if light could be reused.
    pub whole: String,
    /// What differs from the previous bake: names of objects, or the lights.
    pub changed: Vec<String>,
    /// Number of texels that show a surface.
    pub texels: usize,
    /// How many of them had their direct light computed anew.
    pub relit: usize,
    /// How many of them had their bounced light gathered anew.
    pub gathered: usize,
    /// RMSE due to the neglected changes of the reused light, relative to the mean irradiance. It is part of the stated
    /// error.
    pub neglected: f64,
}

impl std::fmt::Display for RebakeReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        /// Most names that are listed.
        const MAX_NAMES: usize = 5;
        if !self.whole.is_empty() {
            return write!(f, "baked whole: {}", self.whole);
        }
        let names = self.changed.iter().take(MAX_NAMES).map(String::as_str).collect::<Vec<_>>().join(", ");
        let others = self.changed.len().saturating_sub(MAX_NAMES);
        let others = if others > 0 { format!(" and {others} more") } else { String::new() };
        let changed = if names.is_empty() { "no object".to_owned() } else { names + &others };
        let share = |count: usize| 100.0 * count as f64 / self.texels.max(1) as f64;
        write!(
            f,
            "baked again what changed: {changed}; {:.1} % of the texels gathered anew, direct light of {:.1} % anew, the others kept (their light may \
             have changed by {:.3} % of the mean)",
            share(self.gathered),
            share(self.relit),
            100.0 * self.neglected
        )
    }
}

/// Why a bake stopped taking samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Ended {
    /// The estimated error is at most the requested one.
    #[default]
    #[serde(rename = "reached")]
    Reached,
    /// The time limit was reached.
    #[serde(rename = "time")]
    Time,
    /// The quality's limit of rays was reached.
    #[serde(rename = "most rays")]
    MostRays,
    /// More rays would hardly reduce the remaining error.
    #[serde(rename = "no further gain")]
    NoFurtherGain,
}

impl Ended {
    /// The first of these reasons that applies.
    pub(crate) fn after(reached: bool, is_late: bool, most_rays: bool) -> Self {
        match (reached, is_late, most_rays) {
            (true, ..) => Self::Reached,
            (_, true, _) => Self::Time,
            (.., true) => Self::MostRays,
            _ => Self::NoFurtherGain,
        }
    }
}

impl std::fmt::Display for Ended {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Reached => "reached",
            Self::Time => "not reached: the time ran out",
            Self::MostRays => "not reached: the most rays of this quality were cast",
            Self::NoFurtherGain => "not reached: more rays would not make what is left smaller",
        })
    }
}

/// What a bake did, how long it took, and how large its errors are estimated to be.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct BakeReport {
    /// The [`content_hash`](crate::content_hash) of the bake's input, in hexadecimal digits.
    pub content_hash: String,
    /// Wall-clock time of each stage that ran, in order.
    pub stages: Vec<StageTime>,
    /// Wall-clock seconds of the whole bake.
    pub seconds: f64,
    /// Number of worker threads.
    pub threads: usize,
    /// Number of static triangles, without degenerate ones and duplicates.
    pub triangles: usize,
    /// Number of rays cast, of every kind.
    pub rays: u64,
    /// Millions of rays per second, over the time of the stages that cast rays.
    pub mega_rays_per_second: f64,
    /// Number of patches of the radiosity system.
    pub patches: usize,
    /// Number of nonzero form factors.
    pub form_factors: usize,
    /// Iterations of the solver for red, green and blue.
    pub iterations: [u32; 3],
    /// Largest relative residual among the three channels.
    pub residual: f64,
    /// Bound on the relative error of the solution: residual / (1 - largest reflectance).
    pub residual_bound: f64,
    /// Number of lightmaps, including atlases.
    pub maps: usize,
    /// Number of lightmaps that several objects share.
    pub atlases: usize,
    /// Number of texels of all maps.
    pub texels: usize,
    /// Fraction of the texels that are covered by a surface, in [0, 1].
    pub coverage: f64,
    /// Number of texels that lie wholly or partly inside other geometry. The hidden part does not contribute to their
    /// value.
    pub hidden_texels: usize,
    /// Rays of the final gather that ended on the black back of a one-sided surface or inside a closed solid, or that
    /// left a scene whose rooms are closed on all sides. They bring no light.
    pub leaked_rays: u64,
    /// Gather rays per covered texel, on average.
    pub gather_rays: f64,
    /// Mean irradiance over the texels that show a surface, W/m², linear RGB.
    pub mean_irradiance: [f64; 3],
    /// Estimated RMSE that sampling leaves in the lightmap. The error of each texel is taken relative to the light
    /// around it, as a viewer whose eyes have adapted to that room would see it.
    pub estimated_error: f64,
    /// The same over what is in view from a place of the level, where that is worst (the worst 5 % of all texels apart):
    /// the error in the level's worst room, which easier rooms and the outside do not make smaller.
    #[serde(default)]
    pub error_in_worst_view: f64,
    /// The same errors as `estimated_error`, relative to the mean irradiance of the whole level.
    pub error_of_mean: f64,
    /// The sources of `estimated_error`, the largest first.
    #[serde(default)]
    pub error_parts: Vec<ErrorPart>,
    /// Where the estimated error is largest: at most three places about the size of a room (an eighth of the level's
    /// longest side), each with at least a hundredth of all texels, the worst first. Empty if no place is worse than
    /// the whole.
    pub worst: Vec<WorstPlace>,
    /// The estimated error over time: after each round of the final gather (or after direct light, if nothing bounces),
    /// and at the end. Empty if there was nothing to bake.
    pub curve: Vec<ErrorAtTime>,
    /// Whether `estimated_error` and `error_in_worst_view` are at most
    /// [`BakeOptions::error`](crate::BakeOptions::error).
    pub error_reached: bool,
    /// The error that is due to the map's resolution. It is not part of `estimated_error`.
    pub resolution: ResolutionReport,
    /// The irradiance probes, which light moving objects.
    pub probes: ProbeReport,
    /// Why the bake stopped taking samples.
    pub ended: Ended,
    /// Upper estimate of the bytes that the bake needs beside the World, made before its long stages.
    pub memory_bytes: u64,
    /// The part of `seconds` that was spent by an interrupted bake whose results were resumed from a checkpoint.
    pub resumed_seconds: f64,
    /// Fraction of the exchange between patches that was removed so that no row of form factors sums to more than 1.
    pub energy_lost: f64,
    /// The effect of closing the seams; all zeros if there were none.
    pub seams: SeamReport,
    /// What was reused of a previous bake; `None` if this bake was given no samples of one.
    pub rebake: Option<RebakeReport>,
    /// What was wrong with the input, with the names of objects, and what was done about it.
    pub warnings: Vec<String>,
    /// Work that was left out, each with the reason.
    pub skipped: Vec<String>,
}

/// What a stage reports besides its result and the figures of its own.
#[derive(Debug, Default)]
pub(crate) struct StageNotes {
    /// Number of rays cast.
    pub rays: u64,
    /// As [`BakeReport::warnings`].
    pub warnings: Vec<String>,
    /// As [`BakeReport::skipped`].
    pub skipped: Vec<String>,
}

impl StageNotes {
    pub fn of_rays(rays: u64) -> Self {
        Self { rays, ..Self::default() }
    }

    pub fn of_warnings(warnings: Vec<String>) -> Self {
        Self { warnings, ..Self::default() }
    }

    pub fn of_skipped(what_and_why: impl Into<String>) -> Self {
        Self { skipped: vec![what_and_why.into()], ..Self::default() }
    }
}

impl StageNotes {
    /// Notes that something is left out, for which nothing stands.
    pub fn without<T: Default>(&mut self, what: &str, why: &str) -> T {
        self.skipped.push(format!("{what}: {why}"));
        T::default()
    }

    /// The result of a stage, whose notes are added to these.
    pub fn noted<T>(&mut self, (result, notes): (T, StageNotes)) -> T {
        self.rays += notes.rays;
        self.warnings.extend(notes.warnings);
        self.skipped.extend(notes.skipped);
        result
    }
}

impl BakeReport {
    /// Sets what the notes of all stages say.
    pub(crate) fn set_notes(&mut self, notes: StageNotes) {
        (self.rays, self.warnings, self.skipped) = (notes.rays, notes.warnings, notes.skipped);
    }

    /// Mean irradiance, mean of the channels, W/m².
    pub(crate) fn mean_of_channels(&self) -> f64 {
        self.mean_irradiance.iter().sum::<f64>() / 3.0
    }

    /// The sources of the estimated error in one line, without minor ones; `None` if there is no error.
    pub fn error_parts_in_words(&self) -> Option<String> {
        /// Parts with a smaller fraction of the squared error are minor.
        const MINOR: f64 = 0.05;
        let is_major = |part: &&ErrorPart| part.error.powi(2) >= MINOR * self.estimated_error.powi(2);
        let describe = |part: &ErrorPart| format!("{} {}", part.what, Percent(part.error));
        let parts: Vec<String> = self.error_parts.iter().filter(is_major).map(describe).collect();
        (!parts.is_empty()).then(|| format!("made of {} (their squares add up)", parts.join(", ")))
    }
}

impl std::fmt::Display for BakeReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { maps, texels, hidden_texels, seconds, threads, rays, leaked_rays, ended, .. } = self;
        let coverage = 100.0 * self.coverage;
        writeln!(
            f,
            "{maps} maps, {texels} texels ({coverage:.0} % covered, {hidden_texels} partly hidden) in {seconds:.2} s on {threads} threads"
        )?;
        let [error, in_worst_view, of_mean] =
            [self.estimated_error, self.error_in_worst_view, self.error_of_mean].map(Percent);
        writeln!(
            f,
            "estimated error {error} of the light around, {in_worst_view} in the worst room's view, {of_mean} of the level's \
             mean: {ended}"
        )?;
        if let Some(parts) = self.error_parts_in_words() {
            writeln!(f, "  {parts}")?;
        }
        for place in &self.worst {
            writeln!(f, "  {place}")?;
        }
        if self.resolution.points > 0 {
            let ResolutionReport { points, error, standard_error } = self.resolution;
            let [error, standard_error] = [error, standard_error].map(Percent);
            writeln!(f, "resolution error {error} ± {standard_error}, by {points} points between texels")?;
        }
        let (speed, gathered) = (self.mega_rays_per_second, self.gather_rays);
        writeln!(
            f,
            "{rays} rays ({speed:.2} million a second), {gathered:.0} gathered per texel, {leaked_rays} leaked"
        )?;
        let Self { triangles, patches, form_factors, iterations, residual, energy_lost, .. } = self;
        writeln!(
            f,
            "{triangles} triangles, {patches} patches, {form_factors} form factors; {iterations:?} iterations, residual {residual:.1e}, energy lost {energy_lost:.1e}"
        )?;
        if self.seams.edges > 0 {
            let SeamReport { edges, jump_before, jump_after, mean_change, largest_change } = self.seams;
            let [before, after, mean, most] =
                [jump_before, jump_after, mean_change, largest_change].map(Percent);
            writeln!(
                f,
                "{edges} seams: jump {before} before, {after} after; texels moved by {mean} on average, {most} at most"
            )?;
        }
        if self.probes.resolution != [0; 3] {
            let ProbeReport { resolution: [x, y, z], inside, estimated_error, .. } = self.probes;
            let error = Percent(estimated_error);
            writeln!(f, "{x} x {y} x {z} probes, {inside} inside geometry, error {error}")?;
        }
        if let Some(rebake) = &self.rebake {
            writeln!(f, "{rebake}")?;
        }
        for ErrorAtTime { seconds, error } in &self.curve {
            writeln!(f, "  after {seconds:>8.3} s error {:.3} %", 100.0 * error)?;
        }
        for StageTime { stage, seconds } in &self.stages {
            writeln!(f, "  {stage:<14} {seconds:>8.3} s")?;
        }
        for line in &self.skipped {
            writeln!(f, "skipped {line}")?;
        }
        for line in &self.warnings {
            writeln!(f, "warning: {line}")?;
        }
        Ok(())
    }
}

/// A share, displayed in percent.
struct Percent(f64);

impl std::fmt::Display for Percent {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.2} %", 100.0 * self.0)
    }
}
