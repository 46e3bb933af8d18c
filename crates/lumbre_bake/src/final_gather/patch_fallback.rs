//! Texels that had no time to gather, or too little: they show the patches' own solution, with an error that says how
//! rough that is. Not the gather.

use glam::{Vec2, Vec3};

use crate::coverage::footprint::Texel;
use crate::denoise::replicates::{REPLICATES, mean, variance};
use crate::final_gather::gather_sums::GatherSums;
use crate::final_gather::radiance_cache::RadianceCache;
use crate::scene::material::Side;

/// Fewer gathered texels than this say nothing about the others.
const MIN_GATHERED: u32 = 256;

/// Where no more samples per replicate than this found only darkness, the patch says more than they do.
const FEW_SAMPLES: u32 = 3;

/// Gives the irradiance of its patch to every texel that has gathered nothing, or nothing but darkness from few rays.
/// The error stated for it is, relative to the light, the RMS difference between patches and texels where texels did
/// gather; where too few did, it is all of the light.
pub(crate) fn from_patches(cache: &RadianceCache<'_>, texels: &[Texel], gathered: &mut [GatherSums]) {
    let patch_light = |texel: &Texel| -> Vec3 {
        let Some(point) = texel.point(cache.scene, 0.5, 0.5) else { return Vec3::ZERO };
        let patch = cache.patches.at(point.triangle, Side::Front, point.at);
        patch.map_or(Vec3::ZERO, |patch| cache.patch_indirect[patch.place()])
    };
    let channel_mean = |light: Vec3| f64::from(light.element_sum()) / 3.0;
    let (mut squared_differences, mut squared_light, mut count) = (0.0, 0.0, 0u32);
    for (texel, sums) in texels.iter().zip(&*gathered).filter(|(_, sums)| sums.samples > 0) {
        let estimates = sums.estimates();
        let mean = channel_mean(mean(&estimates));
        // The part of the difference that is the texel's own noise is not the patch's error.
        let noise = f64::from(variance(&estimates).element_sum()) / 3.0;
        squared_differences += (mean - channel_mean(patch_light(texel))).powi(2) - noise;
        squared_light += mean.powi(2) - noise;
        count += 1;
    }
    let relative_error = if count >= MIN_GATHERED && squared_light > 0.0 {
        (squared_differences.max(0.0) / squared_light).sqrt().min(1.0)
    } else {
        1.0
    };
    let knows_nothing =
        |sums: &GatherSums| sums.samples <= FEW_SAMPLES && sums.sums.iter().all(|sum| *sum == Vec3::ZERO);
    for (texel, sums) in
        texels.iter().zip(gathered).filter(|(texel, sums)| knows_nothing(sums) && !texel.is_hidden())
    {
        let light = patch_light(texel);
        *sums = GatherSums {
            sums: [light; REPLICATES],
            samples: 1,
            rays: sums.rays,
            patch_errors: Vec2::X * REPLICATES as f32 * (relative_error * channel_mean(light)) as f32,
            ..GatherSums::default()
        };
    }
}
