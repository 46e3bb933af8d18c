//! Texels that had no time to gather, or too little: they show the patches' own solution, with an error that says how
//! rough that is. Not the gather.

use glam::{Vec2, Vec3};

use super::gather_sums::GatherSums;
use super::radiance_cache::RadianceCache;
use crate::color::wide_channel_mean;
use crate::coverage::Texel;
use crate::denoise::REPLICATES;
use crate::denoise::replicates::{mean, variance};
use crate::scene::Side;

/// Fewer gathered texels than this say nothing about the others.
const MIN_GATHERED: u32 = 256;

/// Where no more samples per replicate than this found only darkness, the patch says more than they do.
const FEW_SAMPLES: u32 = 3;

/// Whether a texel has gathered nothing, or nothing but darkness from few rays.
pub(crate) fn knows_nothing(sums: &GatherSums) -> bool {
    sums.samples <= FEW_SAMPLES && sums.sums.iter().all(|sum| *sum == Vec3::ZERO)
}

/// Gives the irradiance of its patch to every open texel for whose sums `is_replaced` holds.
/// The error stated for it is, relative to the light, the RMS difference between patches and texels where texels did
/// gather, plus one standard error of that; where too few did, it is all of the light.
pub(crate) fn from_patches(
    cache: &RadianceCache<'_>,
    texels: &[Texel],
    gathered: &mut [GatherSums],
    is_replaced: impl Fn(&GatherSums) -> bool,
) {
    let patch_light = |texel: &Texel| -> Vec3 {
        let Some(point) = texel.point(cache.scene, 0.5, 0.5) else { return Vec3::ZERO };
        let patch = cache.exchange.patches.at(point.triangle, Side::Front, point.at);
        patch.map_or(Vec3::ZERO, |patch| cache.exchange.indirect[patch.place()])
    };
    let (mut squared_differences, mut scatter, mut squared_light, mut count) = (0.0f64, 0.0f64, 0.0, 0u32);
    for (texel, sums) in texels.iter().zip(&*gathered).filter(|(_, sums)| sums.rays > 0) {
        let estimates = sums.estimates();
        let mean = wide_channel_mean(mean(&estimates));
        // The part of the difference that is the texel's own noise is not the patch's error.
        let noise = f64::from(variance(&estimates).element_sum()) / 3.0;
        let squared_difference = (mean - wide_channel_mean(patch_light(texel))).powi(2) - noise;
        squared_differences += squared_difference;
        scatter += squared_difference * squared_difference;
        squared_light += mean.powi(2) - noise;
        count += 1;
    }
    let relative_error = if count >= MIN_GATHERED && squared_light > 0.0 {
        // The noise of few rays may exceed the difference, which is then known only to within its standard error.
        ((squared_differences.max(0.0) + scatter.sqrt()) / squared_light).sqrt().min(1.0)
    } else {
        1.0
    };
    for (texel, sums) in
        texels.iter().zip(gathered).filter(|(texel, sums)| is_replaced(sums) && !texel.is_hidden())
    {
        let light = patch_light(texel);
        *sums = GatherSums {
            sums: [light; REPLICATES],
            samples: 1,
            rays: sums.rays,
            patch_errors: Vec2::X * REPLICATES as f32 * (relative_error * wide_channel_mean(light)) as f32,
            ..GatherSums::default()
        };
    }
}
