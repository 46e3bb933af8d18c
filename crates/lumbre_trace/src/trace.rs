//! The entry points of the tracer: reads the World, runs the integrator until there are enough samples, and
//! develops picture and report. The integrators themselves are in `ray_tree` and `path`.

use std::time::Instant;

use bevy_ecs::world::World;
use glam::{DVec2, DVec3};

use crate::TraceError;
use crate::aov::{Aov, AovPicture, AovValues};
use crate::branch::{Branch, Kind};
use crate::branch_drawing::{TreeFormat, draw_tree};
use crate::checkpoint::{Continuation, Keeper};
use crate::direct_light::Lighting;
use crate::film::Film;
use crate::first_hit::{FirstHit, FirstHits};
use crate::light_aovs::LightAovs;
use crate::options::{Ended, Integrator, Picture, TraceOptions, TraceReport};
use crate::ray_rates::RayRates;
use crate::rendering::{Listener, Rendering};
use crate::view::View;

/// Traces a picture of a World. `listener` is called from several threads, but never concurrently.
///
/// # Errors
/// [`TraceError`], before the first ray is traced.
pub fn trace(
    world: &mut World,
    options: &TraceOptions,
    listener: &Listener<'_>,
) -> Result<(Picture, TraceReport), TraceError> {
    Tracer::new(world, options)?.picture(listener)
}

/// A World that was read and is ready to be traced with fixed options.
pub struct Tracer {
    view: View,
    light: LightAovs,
}

impl Tracer {
    /// Reads a World and brings its global transforms up to date.
    ///
    /// # Errors
    /// [`TraceError`] if the options are out of range or the World cannot be traced.
    pub fn new(world: &mut World, options: &TraceOptions) -> Result<Self, TraceError> {
        let view = View::new(world, options)?;
        let light = LightAovs::new(&options.aovs, &view.scene, options.integrator)?;
        Ok(Self { view, light })
    }

    /// Traces the picture from its first sample.
    ///
    /// # Errors
    /// [`TraceError::Threads`].
    pub fn picture(&self, listener: &Listener<'_>) -> Result<(Picture, TraceReport), TraceError> {
        self.continued(&Continuation::default(), listener)
    }

    /// Traces the picture, going on from what an earlier run kept of it. The result has the same bits as a
    /// run that was never interrupted.
    ///
    /// # Errors
    /// [`TraceError::Checkpoint`] before the first ray is traced, [`TraceError::Threads`].
    pub fn continued(
        &self,
        continuation: &Continuation<'_>,
        listener: &Listener<'_>,
    ) -> Result<(Picture, TraceReport), TraceError> {
        let view = &self.view;
        let keeper = Keeper::new(view, &self.light, continuation);
        let from = match view.options.integrator {
            Integrator::Whitted => None,
            Integrator::Path => keeper.kept()?,
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(view.options.threads.unwrap_or(0));
        let pool = pool.build().map_err(|error| TraceError::Threads { reason: error.to_string() })?;
        let started = Instant::now();
        let rendering = Rendering::new(view, &self.light, listener);
        let (film, ended) = match view.options.integrator {
            Integrator::Whitted => pool.install(|| rendering.ray_trees()),
            Integrator::Path => pool.install(|| rendering.paths(from, &keeper)),
        };
        let aovs = pool.install(|| self.aovs(&film));
        Ok(self.developed(&film, aovs, ended, started.elapsed().as_secs_f64()))
    }

    /// Returns the ray tree through a point of the picture, in pixels from its upper left corner; pixel
    /// centres are at half-integers.
    pub fn tree(&self, place: DVec2) -> Branch {
        let view = &self.view;
        let camera = view.camera.through(place);
        let tree = view.ray_tree(Lighting { by_light: true, ..view.lighting() });
        let recorded = tree.record(camera.ray, camera.farthest, &view.media_of(&camera.ray));
        recorded.unwrap_or_else(|| {
            Branch::new(Kind::Camera, &camera.ray, view.scene.origin, DVec3::ONE, DVec3::ONE)
        })
    }

    /// Returns a tree of this tracer in a format, with a newline at its end.
    pub fn draw_tree(&self, tree: &Branch, format: TreeFormat) -> String {
        draw_tree(&self.view.scene, tree, format)
    }

    /// Returns the surface that is visible through a point of the picture, in pixels from its upper left
    /// corner, or `None` for the background.
    pub fn first_hit(&self, place: DVec2) -> Option<FirstHit> {
        FirstHit::through(&self.view, place)
    }

    /// Measures how fast the picture's rays are found compared with the bare triangle hierarchy, on the
    /// calling thread, in `rounds` rounds.
    pub fn ray_rates(&self, rounds: usize) -> RayRates {
        RayRates::of(&self.view, rounds)
    }

    /// Returns what was left out of the World, and why.
    pub fn notes(&self) -> &[String] {
        &self.view.scene.notes
    }

    /// Builds the auxiliary pictures that were asked for, each once.
    fn aovs(&self, film: &Film) -> Vec<AovPicture> {
        let asked = &self.view.options.aovs;
        let first_hits = asked.iter().any(Aov::is_first_hit).then(|| FirstHits::of(&self.view));
        let mut pictures = Vec::new();
        for (number, aov) in asked.iter().enumerate() {
            if asked[..number].contains(aov) {
                continue;
            }
            let values = match (aov, &first_hits) {
                (Aov::Albedo, Some(found)) => AovValues::Colors(found.albedo.clone()),
                (Aov::Normal, Some(found)) => AovValues::Directions(found.normals.clone()),
                (Aov::Depth, Some(found)) => AovValues::Numbers(found.depths.clone()),
                (Aov::Rays, _) => {
                    AovValues::Numbers(film.pixels.iter().map(|pixel| f64::from(pixel.rays)).collect())
                }
                (Aov::StandardError, _) => {
                    let unknown = DVec3::INFINITY;
                    let errors = film.pixels.iter().map(|pixel| pixel.standard_error().unwrap_or(unknown));
                    AovValues::Colors(errors.collect())
                }
                _ => continue,
            };
            pictures.push(AovPicture { aov: aov.clone(), values });
        }
        for (number, aov) in self.light.aovs.iter().enumerate() {
            pictures.push(AovPicture { aov: aov.clone(), values: AovValues::Colors(film.light(number)) });
        }
        pictures
    }

    fn developed(
        &self,
        film: &Film,
        aovs: Vec<AovPicture>,
        ended: Ended,
        seconds: f64,
    ) -> (Picture, TraceReport) {
        let (width, height) = self.view.options.size;
        let errors: Option<Vec<DVec3>> = film.pixels.iter().map(|pixel| pixel.standard_error()).collect();
        let picture = Picture {
            width,
            height,
            radiance: film.pixels.iter().map(|pixel| pixel.mean()).collect(),
            standard_error: errors,
            rays: film.pixels.iter().map(|pixel| pixel.rays).collect(),
            exposure: self.view.camera.exposure,
            aovs,
        };
        let rays: u64 = film.pixels.iter().map(|pixel| u64::from(pixel.rays)).sum();
        let counts = || film.pixels.iter().map(|pixel| pixel.samples);
        let finished = counts().filter(|&samples| samples > 0).count() as f64 / film.pixels.len() as f64;
        let report = TraceReport {
            integrator: self.view.options.integrator,
            ended,
            seconds,
            rays,
            mega_rays_per_second: rays as f64 / seconds.max(1e-9) / 1e6,
            samples: [counts().min().unwrap_or(0), counts().max().unwrap_or(0)],
            finished,
            standard_error: film.relative_error(),
            cut: film.cut(),
            notes: self.view.scene.notes.clone(),
        };
        (picture, report)
    }
}
