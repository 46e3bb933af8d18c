//! Texels that had no time to gather, or too little: they show the patches' own solution, with an error that says how
//! rough that is. Not the gather.

use glam::{Vec2, Vec3};

use super::gather_sums::GatherSums;
use super::radiance_cache::RadianceCache;
use crate::BakeError;
use crate::chunks::in_chunks;
use crate::color::wide_channel_mean;
use crate::coverage::{CoveredTexels, Texel};
use crate::denoise::REPLICATES;
use crate::denoise::replicates::{mean, variance};
use crate::monitor::BakeMonitor;
use crate::sampling::hash;
use crate::scene::Side;
use crate::texel_index::CoveredTexel;

/// How many texels are compared with their patches, and the samples of each replicate that they gather for it.
const PROBED: usize = 2048;
const PROBE_SAMPLES: u32 = 2;
/// Fewer texels than this say nothing about the others.
const MIN_PROBED: usize = 256;
/// Estimated fraction of the stage's progress from now on.
const PROBE_PROGRESS: f32 = 0.1;

/// Where no more samples per replicate than this found only darkness, the patch says more than they do.
const FEW_SAMPLES: u32 = 3;

/// Whether a texel has gathered nothing, or nothing but darkness from few rays.
pub(crate) fn knows_nothing(sums: &GatherSums) -> bool {
    sums.samples <= FEW_SAMPLES && sums.sums.iter().all(|sum| *sum == Vec3::ZERO)
}

/// The gather's few samples give way to the patches where their noise exceeds the patches' error by this factor: noise is
/// smoothed, while the facets of patches catch the eye.
const MUCH_NOISIER: f64 = 2.0;

/// Whether the patches' light is much closer to the truth than that of texels with so much noise: the sum of their squared
/// errors divided by that of their squared light.
pub(crate) fn are_much_better(
    cache: &RadianceCache<'_>,
    texels: &CoveredTexels<'_>,
    relative_squared_noise: f64,
    seed: u32,
    monitor: &mut BakeMonitor<'_>,
) -> Result<bool, BakeError> {
    Ok(relative_squared_noise > (MUCH_NOISIER * error_of_patches(cache, texels, seed, monitor)?).powi(2))
}

/// Gives the irradiance of its patch to every open texel for whose sums `is_replaced` holds. The error stated for it is,
/// relative to the light, that of [`error_of_patches`].
pub(crate) fn from_patches(
    cache: &RadianceCache<'_>,
    texels: &CoveredTexels<'_>,
    gathered: &mut [GatherSums],
    seed: u32,
    is_replaced: impl Fn(CoveredTexel, &GatherSums) -> bool,
    monitor: &mut BakeMonitor<'_>,
) -> Result<(), BakeError> {
    let replaced: Vec<CoveredTexel> = texels
        .open()
        .map(|(texel, _)| texel)
        .filter(|&texel| is_replaced(texel, &gathered[texel.place()]))
        .collect();
    if replaced.is_empty() {
        return Ok(());
    }
    monitor.pass(PROBE_PROGRESS);
    let relative_error = error_of_patches(cache, texels, seed, monitor)?;
    for texel in replaced {
        let light = patch_light(cache, &texels.list[texel.place()]);
        let sums = &mut gathered[texel.place()];
        *sums = GatherSums {
            sums: [light; REPLICATES],
            samples: 1,
            rays: sums.rays,
            patch_errors: Vec2::X * REPLICATES as f32 * (relative_error * wide_channel_mean(light)) as f32,
            ..GatherSums::default()
        };
    }
    Ok(())
}

/// The irradiance of the patch that a texel lies on.
fn patch_light(cache: &RadianceCache<'_>, texel: &Texel) -> Vec3 {
    let Some(point) = texel.point(cache.scene, 0.5, 0.5) else { return Vec3::ZERO };
    let patch = cache.exchange.patches.at(point.triangle, Side::Front, point.at);
    patch.map_or(Vec3::ZERO, |patch| cache.exchange.indirect[patch.place()])
}

/// The RMS difference between patches and texels, plus one standard error of that, relative to the light: found by
/// gathering at a few texels all over the level, though the time is up. Where there are too few texels, it is all of the
/// light.
fn error_of_patches(
    cache: &RadianceCache<'_>,
    texels: &CoveredTexels<'_>,
    seed: u32,
    monitor: &mut BakeMonitor<'_>,
) -> Result<f64, BakeError> {
    let open = texels.open().count();
    if open < MIN_PROBED {
        return Ok(1.0);
    }
    // One of each run of texels, at a random place, as regular ones could keep in step with the rows of a map.
    let run = open.div_ceil(PROBED);
    let is_probed = |place: &usize| place % run == hash(seed ^ (place / run) as u32) as usize % run;
    let probed = texels.open().enumerate().filter(|(place, _)| is_probed(place));
    let probed: Vec<&Texel> = probed.map(|(_, (_, texel))| texel).collect();
    let gathered: Vec<GatherSums> = in_chunks(probed.len(), monitor, |place| {
        let mut sums = GatherSums::default();
        cache.gather(probed[place], &mut sums, PROBE_SAMPLES, seed);
        sums
    })?;
    let (mut squared_differences, mut scatter, mut squared_light) = (0.0f64, 0.0f64, 0.0);
    for (texel, sums) in probed.iter().zip(&gathered) {
        let estimates = sums.estimates();
        let mean = wide_channel_mean(mean(&estimates));
        // The part of the difference that is the texel's own noise is not the patch's error.
        let noise = f64::from(variance(&estimates).element_sum()) / 3.0;
        let squared_difference = (mean - wide_channel_mean(patch_light(cache, texel))).powi(2) - noise;
        squared_differences += squared_difference;
        scatter += squared_difference * squared_difference;
        squared_light += mean.powi(2) - noise;
    }
    // The noise of few rays may exceed the difference, which is then known only to within its standard error.
    let squared = (squared_differences.max(0.0) + scatter.sqrt()) / squared_light;
    Ok(if squared_light > 0.0 { squared.sqrt().min(1.0) } else { 1.0 })
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;
    use std::sync::Arc;

    use glam::{DAffine3, DVec3};
    use lumbre_mesh::shapes;

    use super::*;
    use crate::direct_light::direct_light;
    use crate::radiosity::{Exchange, PatchResolution, Subdivision, Transport};
    use crate::scene::laid_out::laid_out;
    use crate::scene::{PlacedPrimitive, SceneObject, StaticScene};
    use crate::sources::Sources;
    use crate::{BakeOptions, Density};

    /// Calls `check` with a plate under the sky that a table shades, and the light that its patches exchange.
    fn under_a_table(check: impl FnOnce(&RadianceCache<'_>, &CoveredTexels<'_>, &mut BakeMonitor<'_>)) {
        let object = |size: Vec3, height: f64| {
            let (mesh, transform) =
                (Arc::new(shapes::cuboid(size, 1)), DAffine3::from_translation(DVec3::Y * height));
            SceneObject::new("", vec![PlacedPrimitive { mesh, transform, ..PlacedPrimitive::default() }])
        };
        let objects = vec![object(Vec3::new(2.0, 0.1, 2.0), 0.0), object(Vec3::new(1.0, 0.1, 1.0), 0.4)];
        let input = StaticScene { objects, sky: Vec3::ONE, ..StaticScene::default() }.checked().unwrap();
        let options = BakeOptions { density: Density::TexelsPerMeter(16.0), ..BakeOptions::default() };
        let (layout, scene) = laid_out(&input.objects, input.space(), &options);
        let sources = Sources::new(&scene, Vec::new(), Vec::new(), input.sky);
        let mut carry_on = |_| ControlFlow::Continue(());
        let mut monitor = BakeMonitor::new(&mut carry_on, None);
        let (texels, _) = CoveredTexels::new(&scene, &layout, &mut monitor).unwrap();
        let (direct, _) = direct_light(&sources, &texels, &[], &options, &mut monitor).unwrap();
        let resolution = PatchResolution {
            subdivision: Subdivision::new(&scene, 0.2 * scene.space.scale as f32),
            texture_points: 16,
            form_factor_rays: 200_000,
            memory_bytes: 0,
        };
        let (transport, _) = Transport::new(&scene, &resolution, &options, &mut monitor).unwrap();
        let ((exchange, _), _) = Exchange::new(&sources, transport, &[], &options, &mut monitor).unwrap();
        let (exchange, _) = exchange.expect("light bounces");
        let cache = RadianceCache::new(&sources, &texels, &direct, exchange, &options, &mut monitor).unwrap();
        check(&cache, &texels, &mut monitor);
    }

    #[test]
    fn patches_replace_only_what_is_much_noisier() {
        under_a_table(|cache, texels, monitor| {
            let error = error_of_patches(cache, texels, 1, monitor).unwrap();
            assert!(error > 0.005 && error < 0.5, "{error}");
            let mut are_better =
                |noise: f64| are_much_better(cache, texels, noise.powi(2), 1, monitor).unwrap();
            assert_eq!(
                [1.0, 1.9, 2.1, 10.0].map(|factor| are_better(factor * error)),
                [false, false, true, true]
            );
        });
    }

    #[test]
    fn patches_leave_what_is_kept_and_state_their_error() {
        under_a_table(|cache, texels, monitor| {
            let kept =
                GatherSums { sums: [Vec3::splat(7.0); REPLICATES], samples: 1, ..GatherSums::default() };
            let mut gathered = vec![kept; texels.list.len()];
            let is_replaced = |texel: CoveredTexel, _: &GatherSums| texel.0.is_multiple_of(3);
            from_patches(cache, texels, &mut gathered, 1, is_replaced, monitor).unwrap();
            let error = error_of_patches(cache, texels, 1, monitor).unwrap();
            for (texel, of) in texels.open() {
                let sums = &gathered[texel.place()];
                if is_replaced(texel, sums) {
                    let light = patch_light(cache, of);
                    assert_eq!(sums.estimates()[0], light);
                    let stated = f64::from(sums.patch_error().length());
                    assert!((stated - error * wide_channel_mean(light)).abs() < 1e-3 * (1e-3 + stated));
                } else {
                    assert_eq!(sums.sums, kept.sums);
                }
            }
        });
    }
}
