//! A picture of a World, from the options to the pixels: reads the scene, chooses the integrator, takes samples until there are enough. Not
//! how light is followed: that is `ray_tree` and `path`.

use std::time::Instant;

use bevy_ecs::world::World;
use glam::{DVec2, DVec3};

use crate::TraceError;
use crate::aov::{Aov, AovPicture, AovValues};
use crate::branch::{Branch, Kind};
use crate::checkpoint::{Continuation, Keeper};
use crate::direct_light::Lighting;
use crate::film::Film;
use crate::first_hit::{FirstHit, FirstHits};
use crate::light_aovs::LightAovs;
use crate::light_terms::LightTerms;
use crate::options::{Ended, Integrator, Picture, TraceOptions, TraceReport};
use crate::ray_rates::RayRates;
use crate::rendering::{Listener, Rendering};
use crate::view::View;

/// Bytes of a thread's stack: trees of the greatest depth fit, and what is not used is never touched.
const STACK: usize = 256 << 20;

/// Traces a picture of a World. `listener` is called from several threads, one at a time.
///
/// # Errors
/// [`TraceError`], before the first ray.
pub fn trace(
    world: &mut World,
    options: &TraceOptions,
    listener: &Listener<'_>,
) -> Result<(Picture, TraceReport), TraceError> {
    Tracer::new(world, options)?.picture(listener)
}

/// A World that has been read, with what is asked of it.
pub struct Tracer {
    view: View,
    light: LightAovs,
}

impl Tracer {
    /// Reads a World. Its global transforms are brought up to date.
    ///
    /// # Errors
    /// [`TraceError`].
    pub fn new(world: &mut World, options: &TraceOptions) -> Result<Self, TraceError> {
        let view = View::new(world, options)?;
        let light = LightAovs::new(&options.aovs, &view.scene, options.integrator)?;
        Ok(Self { view, light })
    }

    /// Traces the picture.
    ///
    /// # Errors
    /// [`TraceError::Threads`].
    pub fn picture(&self, listener: &Listener<'_>) -> Result<(Picture, TraceReport), TraceError> {
        self.continued(&Continuation::default(), listener)
    }

    /// Traces the picture, from what an earlier run has kept of it. It ends with the bits of a run that was never interrupted.
    ///
    /// # Errors
    /// [`TraceError::Checkpoint`] before the first ray, [`TraceError::Threads`].
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
        let pool = pool.stack_size(STACK);
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

    /// The ray tree through a place of the picture, in pixels from its upper left corner; the middle of a pixel is half a pixel off.
    pub fn tree(&self, place: DVec2) -> Branch {
        let view = &self.view;
        let camera = view.camera.through(place);
        let mut root = Branch::new(Kind::Camera, &camera.ray, view.scene.origin, DVec3::ONE, DVec3::ONE);
        let tree = view.ray_tree(Lighting { by_light: true, ..view.lighting() });
        let mut grow = || {
            let media = view.media_of(&camera.ray);
            tree.grow(camera.ray, camera.farthest, &media, Some(&mut root), LightTerms::default());
        };
        std::thread::scope(|scope| {
            // Deep trees need more than a main thread's stack.
            let thread = std::thread::Builder::new().stack_size(STACK);
            if let Ok(thread) = thread.spawn_scoped(scope, &mut grow) {
                // What it did is in the tree.
                let _ = thread.join();
            }
        });
        root
    }

    /// The surface that is seen through a place of the picture; nothing where the background is.
    pub fn first_hit(&self, place: DVec2) -> Option<FirstHit> {
        FirstHit::through(&self.view, place)
    }

    /// How fast the picture's rays are found beside the bare hierarchy of triangles, on this thread, in so many rounds.
    pub fn ray_rates(&self, rounds: usize) -> RayRates {
        RayRates::of(&self.view, rounds)
    }

    /// What was left out of the World, and why.
    pub fn notes(&self) -> &[String] {
        &self.view.scene.notes
    }

    /// The auxiliary pictures that are asked for.
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
