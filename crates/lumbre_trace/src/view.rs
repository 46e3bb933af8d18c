//! A scene seen by a camera under options: what all samples of a picture have in common. Not the samples.

use bevy_ecs::world::World;
use glam::DVec2;
use lumbre_scene::update_transforms;

use crate::TraceError;
use crate::camera_ray::CameraRays;
use crate::direct_light::Lighting;
use crate::film::FilterSampler;
use crate::geometry::SpaceRay;
use crate::medium::MediumStack;
use crate::options::{DEFAULT_DEPTH, Integrator, TraceOptions};
use crate::random::Numbers;
use crate::ray_tree::{Limits, RayTree};
use crate::scene::Scene;

/// Rays of one tree at most, shadow rays apart: what glass in glass would multiply without end is cut off, and counted.
const MOST_RAYS: u32 = 100_000;

/// What is seen, and how.
pub(crate) struct View {
    pub scene: Scene,
    pub camera: CameraRays,
    /// The media that the eye is in.
    media: MediumStack,
    pub options: TraceOptions,
    filter: FilterSampler,
}

impl View {
    /// Reads a World. Its global transforms are brought up to date.
    pub fn new(world: &mut World, options: &TraceOptions) -> Result<Self, TraceError> {
        options.validate()?;
        update_transforms(world);
        let camera = CameraRays::new(world, options.camera, options.size)?;
        // Paths find that light themselves.
        let read = options.integrator == Integrator::Whitted;
        let baked_light = [options.lightmaps && read, options.irradiance_volumes && read];
        let scene = Scene::new(world, camera.eye, options.reflection, baked_light)?;
        let camera = camera.relative_to(scene.origin);
        let media = MediumStack::at(&scene, camera.place());
        let filter = FilterSampler::new(options.filter);
        Ok(Self { media, camera, options: options.clone(), filter, scene })
    }

    /// Width and height of the picture in pixels.
    pub fn size(&self) -> (usize, usize) {
        (self.options.size.0 as usize, self.options.size.1 as usize)
    }

    pub fn lighting(&self) -> Lighting {
        Lighting { shadows: self.options.shadows, by_light: false }
    }

    pub fn ray_tree(&self, lighting: Lighting) -> RayTree<'_> {
        let limits = Limits {
            depth: self.options.depth.unwrap_or(DEFAULT_DEPTH),
            weight: self.options.weight,
            rays: MOST_RAYS,
        };
        RayTree { scene: &self.scene, camera: &self.camera, limits, lighting }
    }

    /// The numbers of a sample, where it goes through the picture, in pixels from the upper left corner, and the sign it counts with.
    pub fn sample_place(&self, (x, y): (usize, usize), pass: u32, index: u32) -> (Numbers, DVec2, f64) {
        let pixel = (y as u32).wrapping_mul(65_537).wrapping_add(x as u32);
        let mut numbers = Numbers::new(pixel, pass, index);
        // One ray of a tree goes through the middle, as a frame's does.
        let alone = self.options.integrator == Integrator::Whitted && self.options.samples.unwrap_or(1) == 1;
        let (offset, sign) = if alone { (DVec2::ZERO, 1.0) } else { self.filter.place(numbers.pair()) };
        (numbers, pixel_middle(x, y) + offset, sign)
    }

    /// The media that the eye is in.
    pub fn media(&self) -> &MediumStack {
        &self.media
    }

    /// Rays of a pinhole start in one place; parallel ones do not.
    pub fn media_of(&self, ray: &SpaceRay) -> MediumStack {
        if self.scene.solids && self.camera.is_parallel() {
            MediumStack::at(&self.scene, ray.origin)
        } else {
            self.media.clone()
        }
    }
}

/// The middle of a pixel, in pixels from the upper left corner.
pub(crate) fn pixel_middle(x: usize, y: usize) -> DVec2 {
    DVec2::new(x as f64 + 0.5, y as f64 + 0.5)
}
