//! What a bake did, what it cost and how good it is. Not its drawing.

use serde::{Deserialize, Serialize};

/// The time of one stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct StageTime {
    /// What was done, in words.
    pub stage: String,
    /// Wall-clock seconds.
    pub seconds: f64,
}

/// How good the lightmap was after some time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ErrorAtTime {
    /// Wall-clock seconds since the bake began, those of a bake that it continues included.
    pub seconds: f64,
    /// Estimated relative RMSE of the lightmap.
    pub error: f64,
}

/// A part of a lightmap's error.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ErrorPart {
    /// Where it comes from, in words.
    pub what: String,
    /// Estimated RMSE, relative to the light around each texel. The squares of all parts add up to that of the whole.
    pub error: f64,
}

/// The probes of a bake; all zeros without any.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ProbeReport {
    /// Probes along x, y and z.
    pub resolution: [u32; 3],
    /// Metres between them.
    pub spacing: [f64; 3],
    /// How many lie inside geometry and show their neighbours' light.
    pub inside: usize,
    /// Estimated relative RMSE that sampling leaves in them.
    pub estimated_error: f64,
}

/// How far a bilinear look-up in the map is from what arrives at points of the surfaces, sampling apart; zeros where it was not measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ResolutionReport {
    /// Points at which it was measured, spread evenly over the surfaces.
    pub points: usize,
    /// RMSE relative to the points' mean irradiance.
    pub error: f64,
    /// Standard error of that, for so few points.
    pub standard_error: f64,
}

/// A part of the level where the estimated error is larger than that of the whole.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct WorstPlace {
    /// The middle of its texels, metres, in the world.
    pub center: [f64; 3],
    /// Estimated RMSE of its texels, relative to the light around them.
    pub error: f64,
    /// Its share of all texels that show a surface, in (0, 1].
    pub texels: f64,
    /// The objects, at most two, to which most of that error belongs.
    pub objects: Vec<String>,
}

impl std::fmt::Display for WorstPlace {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [x, y, z] = self.center;
        let objects = self.objects.join(", ");
        write!(f, "{:.2} % around ({x:.1}, {y:.1}, {z:.1}): {objects}", 100.0 * self.error)
    }
}

/// What closing the seams did. Relative to the mean irradiance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct SeamReport {
    /// Pairs of edges that lie in one place, join smoothly and have lightmap coordinates of their own.
    pub edges: usize,
    /// RMS difference between the two sides along them, before.
    pub jump_before: f64,
    /// And after.
    pub jump_after: f64,
    /// Mean change of the texels beside seams.
    pub mean_change: f64,
    /// Largest change of a texel's channel.
    pub largest_change: f64,
}

/// What a bake kept of the former one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct RebakeReport {
    /// Why nothing could be kept; empty if something was.
    pub whole: String,
    /// What differs from the former bake: objects by name, or the lights.
    pub changed: Vec<String>,
    /// Texels that show a surface.
    pub texels: usize,
    /// Of them, those whose direct light was computed anew.
    pub relit: usize,
    /// Of them, those whose light by bounces was gathered anew.
    pub gathered: usize,
    /// RMSE relative to the mean irradiance by which the light of all others may have changed; it is part of the stated error.
    pub neglected: f64,
}

impl std::fmt::Display for RebakeReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        /// Names that are listed.
        const NAMED: usize = 5;
        if !self.whole.is_empty() {
            return write!(f, "baked whole: {}", self.whole);
        }
        let named = self.changed.iter().take(NAMED).map(String::as_str).collect::<Vec<_>>().join(", ");
        let others = self.changed.len().saturating_sub(NAMED);
        let others = if others > 0 { format!(" and {others} more") } else { String::new() };
        let named = if named.is_empty() { "no object".to_owned() } else { named + &others };
        let share = |count: usize| 100.0 * count as f64 / self.texels.max(1) as f64;
        write!(
            f,
            "baked again what changed: {named}; {:.1} % of the texels gathered anew, direct light of {:.1} % anew, the others kept (their light may \
             have changed by {:.3} % of the mean)",
            share(self.gathered),
            share(self.relit),
            100.0 * self.neglected
        )
    }
}

/// Why a bake took no more samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Ended {
    /// The estimated error is at most the one asked for.
    #[default]
    #[serde(rename = "reached")]
    Reached,
    /// The time was up.
    #[serde(rename = "time")]
    Time,
    /// The quality's most rays were cast.
    #[serde(rename = "most rays")]
    MostRays,
    /// What is left of the error is not made smaller by rays.
    #[serde(rename = "no further gain")]
    NoFurtherGain,
}

impl Ended {
    /// By the first of these that holds.
    pub(crate) fn after(reached: bool, late: bool, most_rays: bool) -> Self {
        match (reached, late, most_rays) {
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

/// What a bake did, what it cost and how good it is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct BakeReport {
    /// The [`content_hash`](crate::content_hash) of what was baked, in hexadecimal digits.
    pub content_hash: String,
    /// Wall-clock time of each stage that ran, in order.
    pub stages: Vec<StageTime>,
    /// Wall-clock seconds of the whole.
    pub seconds: f64,
    /// Worker threads.
    pub threads: usize,
    /// Static triangles that light meets, after degenerate ones and duplicates were dropped.
    pub triangles: usize,
    /// Rays cast, of every kind.
    pub rays: u64,
    /// Millions of rays per second of the stages that cast them.
    pub mega_rays_per_second: f64,
    /// Patches of the radiosity system.
    pub patches: usize,
    /// Pairs of patches that see each other.
    pub form_factors: usize,
    /// Iterations of the solver, for red, green and blue.
    pub iterations: [u32; 3],
    /// Largest relative residual of the three channels.
    pub residual: f64,
    /// Bound on the relative error of the solution: residual / (1 - largest reflectance).
    pub residual_bound: f64,
    /// Lightmaps made, atlases among them.
    pub maps: usize,
    /// Lightmaps that several objects share.
    pub atlases: usize,
    /// Texels of all maps.
    pub texels: usize,
    /// Share of the texels that a surface covers, in [0, 1].
    pub coverage: f64,
    /// Texels that lie wholly or partly inside other geometry; the hidden part does not count into their value.
    pub hidden_texels: usize,
    /// Rays of the final gather that ended on the black back of a one-sided surface, inside something closed, or left a scene that
    /// rooms close on all sides; they bring no light.
    pub leaked_rays: u64,
    /// Gather rays per covered texel, on average.
    pub gather_rays: f64,
    /// Mean irradiance over covered texels, W/m², linear RGB.
    pub mean_irradiance: [f64; 3],
    /// Estimated RMSE that sampling leaves in the lightmap, of each texel relative to the light around it: what an eye in that room sees.
    pub estimated_error: f64,
    /// The same errors relative to the mean irradiance of the whole level.
    pub error_of_mean: f64,
    /// What `estimated_error` is made of, the largest part first.
    #[serde(default)]
    pub error_parts: Vec<ErrorPart>,
    /// Where it is largest: at most three places about the size of a room (an eighth of the level's longest side), each with a hundredth of all
    /// texels or more; the worst first. Empty where no place is worse than the whole.
    pub worst: Vec<WorstPlace>,
    /// That error against time: after each round of the final gather (or after direct light, where nothing bounces), and at the end. Empty
    /// where there was nothing to bake.
    pub curve: Vec<ErrorAtTime>,
    /// Whether the estimated error is at most the one asked for.
    pub error_reached: bool,
    /// The error that the map's resolution leaves, estimated apart.
    pub resolution: ResolutionReport,
    /// Light for what moves.
    pub probes: ProbeReport,
    /// Why the bake took no more samples.
    pub ended: Ended,
    /// Bytes that the bake was estimated to need at most, beside the World, before its long stages began.
    pub memory_bytes: u64,
    /// Seconds of `seconds` that an interrupted bake had spent and this one was spared.
    pub resumed_seconds: f64,
    /// Share of the patches' mutual exchange that was cut so that no row of form factors exceeds 1.
    pub energy_lost: f64,
    /// What closing the seams did; zeros where there were none.
    pub seams: SeamReport,
    /// What was kept of a former bake; none where there was no such bake to keep from.
    pub rebake: Option<RebakeReport>,
    /// What was odd in the input, with names, and what was done about it.
    pub warnings: Vec<String>,
    /// Work that the scene did not call for, each with its reason.
    pub skipped: Vec<String>,
}

impl BakeReport {
    /// What the estimated error is made of, in a line; none where there is no error. Small parts are left out.
    pub fn error_parts_in_words(&self) -> Option<String> {
        /// Of the squared error, the share below which a part is small.
        const SMALL: f64 = 0.05;
        let told = |part: &&ErrorPart| part.error.powi(2) >= SMALL * self.estimated_error.powi(2);
        let name = |part: &ErrorPart| format!("{} {:.2} %", part.what, 100.0 * part.error);
        let parts: Vec<String> = self.error_parts.iter().filter(told).map(name).collect();
        (!parts.is_empty()).then(|| format!("made of {} (their squares add up)", parts.join(", ")))
    }
}

impl std::fmt::Display for BakeReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(
            f,
            "{} maps, {} texels ({:.0} % covered, {} partly hidden) in {:.2} s on {} threads",
            self.maps,
            self.texels,
            100.0 * self.coverage,
            self.hidden_texels,
            self.seconds,
            self.threads
        )?;
        writeln!(
            f,
            "estimated error {:.2} % of the light around, {:.2} % of the level's mean: {}",
            100.0 * self.estimated_error,
            100.0 * self.error_of_mean,
            self.ended
        )?;
        if let Some(parts) = self.error_parts_in_words() {
            writeln!(f, "  {parts}")?;
        }
        for place in &self.worst {
            writeln!(f, "  {place}")?;
        }
        if self.resolution.points > 0 {
            let ResolutionReport { points, error, standard_error } = self.resolution;
            writeln!(
                f,
                "resolution error {:.2} % ± {:.2} %, by {points} points between texels",
                100.0 * error,
                100.0 * standard_error
            )?;
        }
        writeln!(
            f,
            "{} rays ({:.2} million a second), {:.0} gathered per texel, {} leaked",
            self.rays, self.mega_rays_per_second, self.gather_rays, self.leaked_rays
        )?;
        writeln!(
            f,
            "{} triangles, {} patches, {} form factors; {:?} iterations, residual {:.1e}, energy lost {:.1e}",
            self.triangles, self.patches, self.form_factors, self.iterations, self.residual, self.energy_lost
        )?;
        if self.seams.edges > 0 {
            writeln!(
                f,
                "{} seams: jump {:.2} % before, {:.2} % after; texels moved by {:.2} % on average, {:.2} % at most",
                self.seams.edges,
                100.0 * self.seams.jump_before,
                100.0 * self.seams.jump_after,
                100.0 * self.seams.mean_change,
                100.0 * self.seams.largest_change
            )?;
        }
        if self.probes.resolution != [0; 3] {
            let ProbeReport { resolution: [x, y, z], inside, estimated_error, .. } = self.probes;
            writeln!(
                f,
                "{x} x {y} x {z} probes, {inside} inside geometry, error {:.2} %",
                100.0 * estimated_error
            )?;
        }
        if let Some(rebake) = &self.rebake {
            writeln!(f, "{rebake}")?;
        }
        for ErrorAtTime { seconds, error } in &self.curve {
            writeln!(f, "  after {seconds:>8.3} s error {:.3} %", 100.0 * error)?;
        }
        for stage in &self.stages {
            writeln!(f, "  {:<14} {:>8.3} s", stage.stage, stage.seconds)?;
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
