//! The options of a traced picture, the picture itself and the report on it: plain data, with the validation
//! of the options.

use std::time::Duration;

use bevy_ecs::entity::Entity;
use glam::DVec3;
use lumbre_optics::ReflectionModel;
use serde::Serialize;

use crate::TraceError;
use crate::aov::{Aov, AovPicture};
use crate::filter::Filter;

/// Selects the light transport algorithm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Integrator {
    /// Whitted's ray tree: direct light of the lamps with hard shadows, mirrors and glass. Diffuse light from
    /// other surfaces comes from lightmaps and irradiance volumes only.
    #[default]
    Whitted,
    /// Path tracing: all light transport, unbiased, with noise whose standard error is reported.
    Path,
}

impl Integrator {
    /// Both integrators.
    pub const ALL: &'static [Self] = &[Self::Whitted, Self::Path];

    /// Returns the name used on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Whitted => "whitted",
            Self::Path => "path",
        }
    }

    /// Returns the integrator with that name on the command line, or `None` if there is none.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|choice| choice.name() == name)
    }
}

/// What to trace, how, and for how long.
#[derive(Clone, Debug, PartialEq)]
pub struct TraceOptions {
    /// The camera; `None` takes the active one, or the first if none is active.
    pub camera: Option<Entity>,
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// The light transport algorithm.
    pub integrator: Integrator,
    /// Replaces every object's specular reflection model.
    pub reflection: Option<ReflectionModel>,
    /// Largest number of mirrored and transmitted rays in succession. A path's diffuse and glossy reflections
    /// count too; at the last surface lights are still sampled, so that a path of depth 0 finds the light that
    /// one surface reflects. `None` means [`DEFAULT_DEPTH`] for the ray tree, and for paths that only Russian roulette
    /// ends them.
    pub depth: Option<u32>,
    /// Rays of the ray tree whose weight in the pixel is below this in every channel are not traced; 0 to 1.
    pub weight: f64,
    /// Whether lights cast shadows.
    pub shadows: bool,
    /// Whether the ray tree reads lightmaps as frames do. Paths never read them.
    pub lightmaps: bool,
    /// Whether the ray tree reads irradiance volumes as frames do. Paths never read them.
    pub irradiance_volumes: bool,
    /// Samples per pixel. The ray tree takes exactly this many, 1 without a number. Paths take at most this
    /// many, rounded up to a multiple of 4; without a number [`DEFAULT_PATHS`], or [`MAXIMUM_SAMPLES`] if
    /// `error` or `time` is given.
    pub samples: Option<u32>,
    /// Path tracing ends when the relative standard error of the whole picture is this or less.
    pub error: Option<f64>,
    /// When this much time is over, no further samples are started.
    pub time: Option<Duration>,
    /// Number of worker threads; `None` takes one per core.
    pub threads: Option<usize>,
    /// The reconstruction filter that weights the samples of a pixel.
    pub filter: Filter,
    /// For the ray tree with 4 or more samples: all pixels get a quarter of the [`samples`](Self::samples),
    /// and only those that then differ from a neighbour by more than this, as displayed, in [0, 1], get the
    /// rest. `None` gives all samples to all pixels.
    pub adaptive: Option<f64>,
    /// For paths: distributes samples in proportion to each pixel's noise, with [`samples`](Self::samples) of
    /// them per pixel on average.
    pub sample_by_noise: bool,
    /// Number that the random numbers of all samples depend on: pictures with different seeds have independent
    /// noise.
    pub seed: u32,
    /// Auxiliary pictures to produce beside the main one.
    pub aovs: Vec<Aov>,
}

impl Default for TraceOptions {
    fn default() -> Self {
        Self {
            camera: None,
            size: (1280, 720),
            integrator: Integrator::Whitted,
            reflection: None,
            depth: None,
            weight: DEFAULT_WEIGHT,
            shadows: true,
            lightmaps: true,
            irradiance_volumes: true,
            samples: None,
            error: None,
            time: None,
            threads: None,
            filter: Filter::Box,
            adaptive: None,
            sample_by_noise: false,
            seed: 0,
            aovs: Vec::new(),
        }
    }
}

/// Depth of the ray tree if none is given.
pub const DEFAULT_DEPTH: u32 = 5;
/// Smallest weight of a traced ray if none is given: a quarter of an 8-bit step of a white surface.
pub const DEFAULT_WEIGHT: f64 = 1.0 / 1024.0;
/// Paths per pixel if neither a number of samples nor an error nor a time is given.
pub const DEFAULT_PATHS: u32 = 64;
/// Largest depth allowed: a recorded tree is drawn by recursion. (No more than twice as many rays follow each other, with
/// those behind partly covering surfaces, which are no deeper.)
pub const MAXIMUM_DEPTH: u32 = 1000;
/// Largest number of samples per pixel allowed.
pub const MAXIMUM_SAMPLES: u32 = 1 << 20;

impl TraceOptions {
    /// Checks that all options are in range.
    ///
    /// # Errors
    /// [`TraceError::Size`] or [`TraceError::Option`] for the first option that is out of range.
    pub fn validate(&self) -> Result<(), TraceError> {
        let (width, height) = self.size;
        if !((1..=32_768).contains(&width) && (1..=32_768).contains(&height)) {
            return Err(TraceError::Size { width, height });
        }
        let refused = |option, value: String, wanted| Err(TraceError::Option { option, value, wanted });
        if self.depth.is_some_and(|depth| depth > MAXIMUM_DEPTH) {
            return refused("depth", format!("{:?}", self.depth), "at most 1000");
        }
        if !(self.weight >= 0.0 && self.weight <= 1.0) {
            return refused("weight", self.weight.to_string(), "from 0 to 1");
        }
        if self.samples.is_some_and(|samples| !(1..=MAXIMUM_SAMPLES).contains(&samples)) {
            return refused("samples", format!("{:?}", self.samples), "from 1 to 1048576");
        }
        let positive = |value: f64| value > 0.0 && value.is_finite();
        if self.error.is_some_and(|error| !positive(error)) {
            return refused("error", format!("{:?}", self.error), "greater than 0");
        }
        if self.adaptive.is_some_and(|threshold| !positive(threshold)) {
            return refused("adaptive", format!("{:?}", self.adaptive), "greater than 0");
        }
        if self.threads == Some(0) {
            return refused("threads", "0".to_owned(), "at least 1");
        }
        Ok(())
    }
}

/// Progress of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// 0 to 1; an estimate where paths go on until an error or a time is reached.
    pub fraction: f64,
    /// Samples that every pixel has so far.
    pub samples: u32,
    /// Relative standard error of the whole picture so far, once it can be stated.
    pub error: Option<f64>,
}

/// Why a picture ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ended {
    /// All samples were taken.
    Complete,
    /// The requested error was reached.
    Error,
    /// The time was over.
    Time,
    /// The listener interrupted it.
    Interrupted,
}

/// A traced picture, top row first.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Radiance of every pixel, linear RGB, W/(m² sr); 0 where nothing was traced.
    pub radiance: Vec<DVec3>,
    /// Standard error of every pixel's radiance, if every pixel has enough samples to state it.
    pub standard_error: Option<Vec<DVec3>>,
    /// Rays traced for every pixel, shadow rays included.
    pub rays: Vec<u32>,
    /// The camera's exposure: the factor on radiance for display.
    pub exposure: f32,
    /// The auxiliary pictures that were asked for.
    pub aovs: Vec<AovPicture>,
}

/// Statistics of a traced picture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TraceReport {
    /// The light transport algorithm.
    pub integrator: Integrator,
    /// Why it ended.
    pub ended: Ended,
    /// Duration in seconds.
    pub seconds: f64,
    /// Rays traced, shadow rays included.
    pub rays: u64,
    /// Millions of rays per second.
    pub mega_rays_per_second: f64,
    /// Smallest and largest number of samples of a pixel.
    pub samples: [u32; 2],
    /// Fraction of the pixels that have any sample, 0 to 1.
    pub finished: f64,
    /// Relative standard error of the whole picture: the root mean square of the pixels' standard errors over
    /// the mean radiance.
    pub standard_error: Option<f64>,
    /// What the limits of depth and weight cut off.
    pub cut: Cut,
    /// What was left out of the scene, and why.
    pub notes: Vec<String>,
}

/// What the limits of depth, weight and ray count cut off the ray trees.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Cut {
    /// Sum of the weights of a pixel's untraced rays, in its worst sample, averaged over all pixels.
    pub mean_weight: f64,
    /// The largest such sum of any pixel.
    pub largest_weight: f64,
    /// The brightest radiance that any traced ray returned, W/(m² sr).
    pub brightest: f64,
    /// Upper bound of the radiance that may be missing from any pixel, provided that no point that was not
    /// seen emits more by itself than the points that were: the largest weight times the largest local light
    /// over 1 - (k_r + k_t). `None` where that series diverges, at a surface that passes on all light and
    /// adds some.
    pub bound: Option<f64>,
}
