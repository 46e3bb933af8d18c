//! Evaluates the samples of a pixel with the chosen integrator. How many samples a pixel gets is decided in
//! `rendering`.

use glam::DVec2;

use crate::film::{PixelSum, Sample};
use crate::light_aovs::LightAovs;
use crate::light_terms::LightTerms;
use crate::options::Integrator;
use crate::path::Paths;
use crate::random::Numbers;
use crate::ray_tree::RayTree;
use crate::view::View;

/// The integrator of a picture, with the auxiliary pictures that its light belongs to.
pub(crate) struct Estimator<'a> {
    view: &'a View,
    aovs: &'a LightAovs,
    integrator: Followed<'a>,
}

enum Followed<'a> {
    Trees(RayTree<'a>),
    Paths(Box<Paths<'a>>),
}

impl<'a> Estimator<'a> {
    pub fn new(view: &'a View, aovs: &'a LightAovs) -> Self {
        let integrator = match view.options.integrator {
            Integrator::Whitted => {
                let mut lighting = view.lighting();
                lighting.by_light = aovs.are_wanted();
                Followed::Trees(view.ray_tree(lighting))
            }
            Integrator::Path => {
                let (depth, shadows) = (view.options.depth, view.options.shadows);
                let paths = Paths::new(&view.scene, &view.camera, depth, shadows);
                Followed::Paths(Box::new(paths))
            }
        };
        Self { view, aovs, integrator }
    }

    /// Takes `samples` samples of a pixel in one pass.
    pub fn pixel(&self, pixel: (usize, usize), pass: u32, samples: u32) -> PixelSum {
        let mut sum = PixelSum::default();
        for index in 0..samples {
            let (numbers, place, sign) = self.view.sample_place(pixel, pass, index);
            let sample = self.sample(place, numbers);
            self.aovs.add(&mut sum.light, sample.terms.iter(), sign);
            sum.add(&sample, sign);
        }
        sum
    }

    fn sample(&self, place: DVec2, mut numbers: Numbers) -> Sample {
        let camera = self.view.camera.through(place);
        let media = self.view.media_of(&camera.ray);
        let terms = LightTerms::new(self.aovs.are_wanted());
        match &self.integrator {
            Followed::Trees(tree) => {
                let seen = tree.grow(camera.ray, camera.farthest, &media, terms);
                Sample {
                    radiance: seen.radiance,
                    rays: seen.rays,
                    cut: seen.cut,
                    brightest: seen.brightest,
                    limit: seen.limit,
                    terms: seen.terms,
                }
            }
            Followed::Paths(paths) => paths.sample(&camera, media, &mut numbers, terms),
        }
    }
}
