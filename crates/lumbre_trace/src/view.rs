//! A scene as a camera sees it under given options: what all samples of a picture share. Samples are taken in
//! `estimator`.

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

/// Largest number of rays of one tree, shadow rays not counted. Glass within glass would multiply them
/// without end; what is cut off is counted.
const MAX_RAYS: u32 = 100_000;

/// The scene, the camera and the options of a picture.
pub(crate) struct View {
    pub scene: Scene,
    pub camera: CameraRays,
    /// The media that contain the eye.
    media: MediumStack,
    pub options: TraceOptions,
    filter: FilterSampler,
}

impl View {
    /// Reads a World and brings its global transforms up to date.
    pub fn new(world: &mut World, options: &TraceOptions) -> Result<Self, TraceError> {
        options.validate()?;
        update_transforms(world);
        let camera = CameraRays::new(world, options.camera, options.size)?;
        // Paths trace the light that lightmaps and irradiance volumes hold.
        let read = options.integrator == Integrator::Whitted;
        let baked_light = [options.lightmaps && read, options.irradiance_volumes && read];
        let scene = Scene::new(world, camera.eye, options.reflection, baked_light)?;
        let camera = camera.relative_to(scene.origin);
        let media = MediumStack::at(&scene, camera.place());
        let filter = FilterSampler::new(options.filter);
        Ok(Self { media, camera, options: options.clone(), filter, scene })
    }

    /// Returns width and height of the picture in pixels.
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
            rays: MAX_RAYS,
        };
        RayTree { scene: &self.scene, camera: &self.camera, limits, lighting }
    }

    /// Returns the random numbers of a sample, its position in the picture in pixels from the upper left
    /// corner, and the sign of its weight.
    pub fn sample_place(&self, (x, y): (usize, usize), pass: u32, index: u32) -> (Numbers, DVec2, f64) {
        let pixel = (y as u32).wrapping_mul(65_537).wrapping_add(x as u32);
        let mut numbers = Numbers::new(pixel ^ self.options.seed.wrapping_mul(SEED_STEP), pass, index);
        // A single ray of the ray tree goes through the pixel's centre, as in a frame.
        let alone = self.options.integrator == Integrator::Whitted && self.options.samples.unwrap_or(1) == 1;
        let (offset, sign) = if alone { (DVec2::ZERO, 1.0) } else { self.filter.place(numbers.pair()) };
        (numbers, pixel_middle(x, y) + offset, sign)
    }

    /// Returns the media that contain the eye.
    pub fn media(&self) -> &MediumStack {
        &self.media
    }

    /// Returns the media at the start of a camera ray. The rays of a parallel projection start in different
    /// points, those of a perspective one at the eye.
    pub fn media_of(&self, ray: &SpaceRay) -> MediumStack {
        if self.scene.solids && self.camera.is_parallel() {
            MediumStack::at(&self.scene, ray.origin)
        } else {
            self.media.clone()
        }
    }
}

/// An odd number with which different seeds give a pixel different random numbers.
const SEED_STEP: u32 = 0x85eb_ca6b;

/// Returns the centre of a pixel, in pixels from the upper left corner.
pub(crate) fn pixel_middle(x: usize, y: usize) -> DVec2 {
    DVec2::new(x as f64 + 0.5, y as f64 + 0.5)
}
