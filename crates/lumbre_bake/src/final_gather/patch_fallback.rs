//! Texels for which there was no time, or too little: they show the patches' own solution, and say how little that is worth. Not the gather.

use glam::{Vec2, Vec3};

use crate::coverage::footprint::Texel;
use crate::denoise::replicates::{REPLICATES, mean, variance};
use crate::final_gather::gather_sums::GatherSums;
use crate::final_gather::radiance_cache::RadianceCache;
use crate::scene::material::Side;

/// Fewer gathered texels than this say nothing about the others.
const ENOUGH: u32 = 256;

/// Samples of a replicate up to which darkness all around says less than the patch does.
const FEW: u32 = 3;

/// Gives every texel that has gathered nothing, or nothing but darkness from few rays, the irradiance of its patch. Its error is by as much as
/// patches are off where texels did gather, relative to the light, and all of it where too few did.
pub(crate) fn from_patches(cache: &RadianceCache<'_>, texels: &[Texel], gathered: &mut [GatherSums]) {
    let of_patch = |texel: &Texel| -> Vec3 {
        let Some(point) = texel.point(cache.scene, 0.5, 0.5) else { return Vec3::ZERO };
        let patch = cache.patches.at(point.triangle, Side::Front, point.at);
        patch.map_or(Vec3::ZERO, |patch| cache.patch_indirect[patch.place()])
    };
    let grey = |light: Vec3| f64::from(light.element_sum()) / 3.0;
    let (mut apart, mut all, mut count) = (0.0, 0.0, 0u32);
    for (texel, own) in texels.iter().zip(&*gathered).filter(|(_, own)| own.samples > 0) {
        let estimates = own.estimates();
        let mean = grey(mean(&estimates));
        // What chance moved the mean by is no fault of the patch.
        let by_chance = f64::from(variance(&estimates).element_sum()) / 3.0;
        apart += (mean - grey(of_patch(texel))).powi(2) - by_chance;
        all += mean.powi(2) - by_chance;
        count += 1;
    }
    let off = if count >= ENOUGH && all > 0.0 { (apart.max(0.0) / all).sqrt().min(1.0) } else { 1.0 };
    let knows_nothing =
        |own: &GatherSums| own.samples <= FEW && own.sums.iter().all(|sum| *sum == Vec3::ZERO);
    for (texel, own) in
        texels.iter().zip(gathered).filter(|(texel, own)| knows_nothing(own) && !texel.is_hidden())
    {
        let light = of_patch(texel);
        *own = GatherSums {
            sums: [light; REPLICATES],
            samples: 1,
            rays: own.rays,
            patch_errors: Vec2::X * REPLICATES as f32 * (off * grey(light)) as f32,
            ..GatherSums::default()
        };
    }
}
