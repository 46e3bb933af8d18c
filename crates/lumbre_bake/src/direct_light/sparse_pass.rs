//! A first pass under a time limit: over one texel of each block first, and then over as many of the others as there seems
//! to be time for. What is sampled, and how the rest is interpolated, is the caller's.

use crate::BakeError;
use crate::checkpoint::Record;
use crate::chunks::{decide, in_chunks};
use crate::coverage::{CoveredTexels, Representatives};
use crate::monitor::BakeMonitor;
use crate::texel_index::CoveredTexel;

/// Sides of the blocks that texels may be interpolated from, and that of the blocks which are sampled whatever time it
/// takes, in texels.
const SIDES: [u32; 3] = [1, 2, 4];
const COARSEST: u32 = 8;
/// All texels are sampled if that takes at most this share of the time that is left, up to so many times the time that
/// the stage should take: a map without interpolated texels is worth a delay.
const SHARE_OF_TIME: f64 = 0.5;
const DELAY: f64 = 1.6;
/// The share of the pass in the progress that the first blocks are.
const BLOCKS_PROGRESS: f32 = 0.02;

/// What a pass has sampled.
pub(crate) struct SparsePass<'a, T> {
    pub sampled: Vec<(CoveredTexel, T)>,
    /// The blocks from which the other texels are to be interpolated; `None` if all were sampled.
    pub blocks: Option<Representatives<'a>>,
}

/// Samples the `wanted` texels, in ascending order, or if there is too little time, only so many that the others can be
/// interpolated from them. `share` is that of the pass in the running stage's progress.
pub(crate) fn sparse_pass<'a, T: Copy + Send + Sync + Record>(
    texels: &'a CoveredTexels<'a>,
    wanted: &[CoveredTexel],
    share: f32,
    monitor: &mut BakeMonitor<'_>,
    sample: impl Fn(CoveredTexel) -> T + Sync,
) -> Result<SparsePass<'a, T>, BakeError> {
    let pass = |texels: &[CoveredTexel], share: f32, monitor: &mut BakeMonitor<'_>| {
        monitor.pass(share);
        let values = in_chunks(texels.len(), monitor, |place| sample(texels[place]))?;
        Ok::<_, BakeError>(texels.iter().copied().zip(values).collect::<Vec<_>>())
    };
    if monitor.clock().seconds_left().is_none() {
        return Ok(SparsePass { sampled: pass(wanted, share, monitor)?, blocks: None });
    }
    let mut is_wanted = vec![false; texels.list.len()];
    wanted.iter().for_each(|texel| is_wanted[texel.place()] = true);
    // Nothing can be interpolated from a representative that is not sampled.
    let must_be_sampled = |blocks: &Representatives<'_>, texel: CoveredTexel| {
        blocks.is_one(texel) || !is_wanted[blocks.of(texel).place()]
    };
    let coarse = monitor.run_interruptible(0.0, || Representatives::new(texels, COARSEST))?;
    let (first, rest): (Vec<CoveredTexel>, Vec<CoveredTexel>) =
        wanted.iter().partition(|texel| must_be_sampled(&coarse, **texel));
    let begun = monitor.seconds();
    let mut sampled = pass(&first, BLOCKS_PROGRESS, monitor)?;
    let seconds_per_texel = (monitor.seconds() - begun) / first.len().max(1) as f64;
    let left = SHARE_OF_TIME * monitor.clock().until(DELAY).seconds_left().unwrap_or(f64::INFINITY);
    let has_time = |side: &u32| rest.len() as f64 * seconds_per_texel <= left * f64::from(side * side);
    let side = decide(monitor, SIDES.into_iter().find(has_time).unwrap_or(COARSEST))?;
    let blocks = match side {
        COARSEST => Some(coarse),
        1 => None,
        side => Some(monitor.run_interruptible(0.0, || Representatives::new(texels, side))?),
    };
    let is_next =
        |texel: &&CoveredTexel| blocks.as_ref().is_none_or(|blocks| must_be_sampled(blocks, **texel));
    let next: Vec<CoveredTexel> = rest.iter().filter(is_next).copied().collect();
    sampled.extend(pass(&next, share, monitor)?);
    if blocks.is_some() {
        monitor.cut_short();
    }
    Ok(SparsePass { sampled, blocks })
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;
    use std::sync::Arc;
    use std::time::Duration;

    use glam::{DAffine3, DVec3, Vec3};
    use lumbre_mesh::{TriangleMesh, shapes};
    use lumbre_optics::{BakeMode, Light};

    use super::super::direct_light;
    use super::*;
    use crate::color::channel_mean;
    use crate::scene::laid_out::laid_out;
    use crate::scene::{PlacedLight, PlacedPrimitive, SceneObject, StaticScene};
    use crate::sources::{Direct, Sources};
    use crate::{BakeOptions, Density};

    /// A floor of 4 m with nine plates above it, a wall and lights.
    fn lit_floor(lights: Vec<PlacedLight>) -> StaticScene {
        let object = |(mesh, place): (TriangleMesh, DVec3)| {
            let transform = DAffine3::from_translation(place);
            let mesh = Arc::new(mesh);
            SceneObject::new("", vec![PlacedPrimitive { mesh, transform, ..PlacedPrimitive::default() }])
        };
        let floor = (shapes::plane(4.0, 4.0, 1, 1), DVec3::ZERO);
        let wall = (shapes::cuboid(Vec3::new(0.01, 1.0, 4.0), 1), DVec3::new(0.503, 0.5, 0.0));
        let plates = (0..9).map(|number| {
            let place = DVec3::new(f64::from(number % 3) - 1.0, 0.4, f64::from(number / 3) - 1.0);
            (shapes::cuboid(Vec3::new(0.3, 0.01, 0.4), 1), 1.2 * place.with_y(0.4))
        });
        let objects = [floor, wall].into_iter().chain(plates).map(object).collect();
        StaticScene { objects, lights, ..StaticScene::default() }.checked().unwrap()
    }

    /// The direct light on a floor of 128 x 128 texels, with this time for it, and how many of its texels have rays of
    /// their own.
    fn light_on_floor(input: &StaticScene, time: Option<Duration>) -> (Vec<Direct>, usize) {
        let options = BakeOptions { density: Density::MapSize(128), time, ..BakeOptions::default() };
        let (layout, scene) = laid_out(&input.objects, input.space(), &options);
        let sources = Sources::new(&scene, Vec::new(), input.lights.clone(), Vec3::ZERO);
        let mut carry_on = |_| ControlFlow::Continue(());
        // What is hidden is found without a limit, as it is the same then.
        let mut monitor = BakeMonitor::new(&mut carry_on, None);
        let (texels, _) = CoveredTexels::new(&scene, &layout, &mut monitor).unwrap();
        let mut carry_on = |_| ControlFlow::Continue(());
        let mut monitor = BakeMonitor::new(&mut carry_on, time);
        let (direct, _) = direct_light(&sources, &texels, &[], &options, &mut monitor).unwrap();
        let on_floor = texels.open().filter(|(_, texel)| texel.map.0 == 0);
        let direct: Vec<Direct> = on_floor.map(|(texel, _)| direct.texels[texel.place()]).collect();
        let with_rays = direct.iter().filter(|direct| direct.rays > 0).count();
        (direct, with_rays)
    }

    fn check(lights: Vec<PlacedLight>) {
        let input = lit_floor(lights);
        let (exact, _) = light_on_floor(&input, None);
        let (late, with_rays) = light_on_floor(&input, Some(Duration::from_nanos(1)));
        // Every texel has light, though few have rays.
        assert!(with_rays < exact.len() / 4, "{with_rays} of {} have rays", exact.len());
        let light = |direct: &Direct| f64::from(channel_mean(direct.baked));
        let mean = exact.iter().map(light).sum::<f64>() / exact.len() as f64;
        let mean_square = |of: &dyn Fn(&Direct, &Direct) -> f64| {
            late.iter().zip(&exact).map(|(late, exact)| of(late, exact)).sum::<f64>() / exact.len() as f64
        };
        let error = mean_square(&|late, exact| (light(late) - light(exact)).powi(2)).sqrt() / mean;
        let stated = mean_square(&|late, _| f64::from(late.variance)).sqrt() / mean;
        let bias = mean_square(&|late, exact| light(late) - light(exact)) / mean;
        println!("{with_rays} of {}: off by {error:.3}, stated {stated:.3}, bias {bias:.3}", exact.len());
        assert!(error < 1.25 * stated && stated < 4.0 * error, "off by {error}, stated {stated}");
        assert!(error < 0.5 && bias.abs() < 0.05, "off by {error}, bias {bias}");
    }

    #[test]
    fn without_time_the_shadows_of_one_light_are_interpolated_and_the_error_is_stated() {
        let lamp = Light { bake: BakeMode::Static, radius: 0.1, ..Light::point(Vec3::ONE) };
        check(vec![PlacedLight { light: lamp, position: DVec3::new(0.3, 2.0, 0.2), axis: DVec3::NEG_Y }]);
    }

    #[test]
    fn without_time_the_light_of_many_lights_is_interpolated_and_the_error_is_stated() {
        let lamp = Light { bake: BakeMode::Static, ..Light::point(Vec3::ONE) };
        let lamps = (0..400).map(|number| {
            let position =
                DVec3::new(f64::from(number % 20) / 5.0 - 2.0, 1.0, f64::from(number / 20) / 5.0 - 2.0);
            PlacedLight { light: lamp.clone(), position, axis: DVec3::NEG_Y }
        });
        check(lamps.collect());
    }
}
