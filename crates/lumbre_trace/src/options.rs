//! What can be asked of a picture, and what is said about it afterwards. Plain data.

use std::time::Duration;

use bevy_ecs::entity::Entity;
use glam::DVec3;
use lumbre_optics::ReflectionModel;
use serde::Serialize;

use crate::TraceError;
use crate::aov::{Aov, AovPicture};
use crate::filter::Filter;

/// How light is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Integrator {
    /// The documents' ray tree: lamps with hard shadows, mirrors, glass; diffuse light from other surfaces as lightmaps have it.
    #[default]
    Whitted,
    /// Paths: all light as it is, with noise that is stated.
    Path,
}

impl Integrator {
    /// Both.
    pub const ALL: &'static [Self] = &[Self::Whitted, Self::Path];

    /// The name used on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Whitted => "whitted",
            Self::Path => "path",
        }
    }

    /// The choice with that name, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|choice| choice.name() == name)
    }
}

/// What is asked of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct TraceOptions {
    /// The camera; else the active one, else the first.
    pub camera: Option<Entity>,
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// How light is followed.
    pub integrator: Integrator,
    /// This specular model in place of the scene's.
    pub reflection: Option<ReflectionModel>,
    /// Mirrored and transmitted rays one after another. Of paths all reflections count, and without a number only chance ends them.
    pub depth: Option<u32>,
    /// Rays of the tree that count for less than this in every channel are not traced.
    pub weight: f64,
    /// Lights cast shadows.
    pub shadows: bool,
    /// The ray tree reads lightmaps as a frame does. Paths never do.
    pub lightmaps: bool,
    /// The ray tree reads irradiance volumes as a frame does. Paths never do.
    pub irradiance_volumes: bool,
    /// Samples of every pixel: exactly so many of the ray tree, at most so many paths.
    pub samples: Option<u32>,
    /// Relative standard error of the whole picture at which paths are enough.
    pub error: Option<f64>,
    /// After which no more samples are begun.
    pub time: Option<Duration>,
    /// Worker threads; as many as there are cores without this.
    pub threads: Option<usize>,
    /// How samples make a pixel.
    pub filter: Filter,
    /// Of the ray tree: pixels whose samples differ by more than this, as shown, get up to [`samples`](Self::samples) of them, others a
    /// quarter. Without it all get all.
    pub adaptive: Option<f64>,
    /// Of paths: pixels get samples in proportion to their noise, and [`samples`](Self::samples) of them in the mean.
    pub sample_by_noise: bool,
    /// Auxiliary pictures that are wanted beside the picture.
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
            aovs: Vec::new(),
        }
    }
}

/// The ray tree's depth where none is asked for.
pub const DEFAULT_DEPTH: u32 = 5;
/// The ray tree's least weight where none is asked for: a quarter of an eight-bit step of a white surface.
pub const DEFAULT_WEIGHT: f64 = 1.0 / 1024.0;
/// Paths of every pixel where neither a number nor an error nor a time is asked for.
pub const DEFAULT_PATHS: u32 = 64;
/// Deeper trees than this would outgrow a thread's stack.
pub const MAXIMUM_DEPTH: u32 = 1000;
/// Most samples of a pixel.
pub const MAXIMUM_SAMPLES: u32 = 1 << 20;

impl TraceOptions {
    /// Whether it makes sense.
    ///
    /// # Errors
    /// [`TraceError::Size`] and [`TraceError::Option`], the first fault.
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

/// How far a picture is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// 0 to 1; of paths that go on until an error or a time is reached, what is expected.
    pub fraction: f64,
    /// Samples that every pixel has.
    pub samples: u32,
    /// Relative standard error of the whole picture so far, if it can be stated.
    pub error: Option<f64>,
}

/// Why a picture ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ended {
    /// All that was asked for is there.
    Complete,
    /// The error asked for is reached.
    Error,
    /// The time is over.
    Time,
    /// Somebody interrupted it.
    Interrupted,
}

/// A picture, top row first.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Radiance of every pixel, linear RGB, W/(m² sr); 0 where nothing was traced.
    pub radiance: Vec<DVec3>,
    /// Standard error of every pixel's radiance, if it was sampled often enough to state it.
    pub standard_error: Option<Vec<DVec3>>,
    /// Rays of every pixel, shadow rays too.
    pub rays: Vec<u32>,
    /// Factor on radiance of the camera.
    pub exposure: f32,
    /// The auxiliary pictures that were asked for.
    pub aovs: Vec<AovPicture>,
}

/// What is said about a picture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TraceReport {
    /// How light was followed.
    pub integrator: Integrator,
    /// Why it ended.
    pub ended: Ended,
    /// Seconds.
    pub seconds: f64,
    /// Rays, shadow rays too.
    pub rays: u64,
    /// Millions of rays a second.
    pub mega_rays_per_second: f64,
    /// Samples of a pixel: the least and the most.
    pub samples: [u32; 2],
    /// Share of the pixels that have any, 0 to 1.
    pub finished: f64,
    /// Relative standard error of the whole picture: root mean square of the pixels' standard errors over the mean radiance.
    pub standard_error: Option<f64>,
    /// What the limits of depth and weight cut off.
    pub cut: Cut,
    /// What was left out, and why.
    pub notes: Vec<String>,
}

/// What the limits cut off of the ray trees.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Cut {
    /// Weight of the rays that were not traced, summed up by pixel: the mean over all pixels.
    pub mean_weight: f64,
    /// Of the pixel that lost most.
    pub largest_weight: f64,
    /// The brightest radiance that any ray of the picture brought, W/(m² sr).
    pub brightest: f64,
    /// So much radiance may be missing from any pixel at most, if no point that was not seen sends more by itself than the points that
    /// were: the largest weight times the largest local light over 1 - (k_r + k_t). Nothing where that series has no end: a surface that
    /// passes on all light and adds some.
    pub bound: Option<f64>,
}
