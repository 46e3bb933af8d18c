//! A first pass under a time limit: over a few texels, which show how long the others will take, and then over all others
//! or over as fine a grid of them as there seems to be time for. What is sampled, and how the rest is interpolated, is the caller's.

use super::light_cuts::BLOCK_SIDE;
use crate::BakeError;
use crate::chunks::{Record, decide, in_chunks};
use crate::coverage::{CoveredTexels, Representatives};
use crate::monitor::BakeMonitor;
use crate::texel_index::CoveredTexel;

/// The side of the blocks of which one texel is sampled whatever time it takes, in texels.
const COARSEST: u32 = 8;
/// A texel must have the light cut of its own representative, from which it is interpolated if no other has the same.
const _: () = assert!(BLOCK_SIDE.is_multiple_of(COARSEST));
/// The sides of smaller blocks that there may be time for. Blocks of one texel leave nothing to be interpolated.
const SMALLER: [u32; 3] = [1, 2, 4];
/// If no more texels than this are wanted, all of them are sampled whatever time it takes: small scenes never lose quality.
const ALWAYS_SAMPLED: usize = 8192;
/// A map without interpolated texels is worth a delay: the stage may overrun its deadline by this factor.
const LATEST: f64 = 2.0;
/// The share of the time left until then that smaller blocks may take.
const SHARE_OF_TIME: f64 = 0.8;
/// The share of the rest of the stage's progress that the first few texels are.
const FEW_PROGRESS: f32 = 0.02;

/// What a pass has sampled.
pub(crate) struct SparsePass<'a, T> {
    pub sampled: Vec<(CoveredTexel, T)>,
    /// The seconds that the samples took.
    pub seconds: f64,
    /// The blocks from which the other texels are to be interpolated; `None` if there are no others.
    pub blocks: Option<Representatives<'a>>,
}

/// Samples the `wanted` texels, in ascending order and none of them hidden, or if there is too little time, only so many
/// that the others can be interpolated from them. `share` is that of the pass in the running stage's progress.
pub(crate) fn sparse_pass<'a, T: Copy + Send + Sync + Record>(
    texels: &'a CoveredTexels<'a>,
    wanted: &[CoveredTexel],
    share: f32,
    monitor: &mut BakeMonitor<'_>,
    sample: impl Fn(CoveredTexel) -> T + Sync,
) -> Result<SparsePass<'a, T>, BakeError> {
    let mut pass = SparsePass { sampled: Vec::new(), seconds: 0.0, blocks: None };
    let sample =
        |texels: &[CoveredTexel], share: f32, pass: &mut SparsePass<'a, T>, monitor: &mut BakeMonitor<'_>| {
            monitor.pass(share);
            let begun = monitor.seconds();
            let values = in_chunks(texels.len(), monitor, |place| sample(texels[place]))?;
            pass.sampled.extend(texels.iter().copied().zip(values));
            // A chunk from a checkpoint sets the clock to when it was computed, which may be before `begun`.
            pass.seconds += (monitor.seconds() - begun).max(0.0);
            Ok::<_, BakeError>(())
        };
    if monitor.clock().seconds_left().is_none() || wanted.len() <= ALWAYS_SAMPLED {
        sample(wanted, share, &mut pass, monitor)?;
        return Ok(pass);
    }
    // Hidden texels take no time, and would make all others seem quick.
    debug_assert!(wanted.iter().all(|texel| !texels.list[texel.place()].is_hidden()));
    let mut is_wanted = vec![false; texels.list.len()];
    wanted.iter().for_each(|texel| is_wanted[texel.place()] = true);
    // Nothing can be interpolated from a representative that is not sampled.
    let must_be_sampled = |blocks: &Representatives<'_>, texel: CoveredTexel| {
        blocks.represents_itself(texel) || !is_wanted[blocks.of(texel).place()]
    };
    // A few all over the level say how long the others will take.
    let is_first = |place: usize| place.is_multiple_of((COARSEST * COARSEST) as usize);
    let first: Vec<CoveredTexel> = wanted.iter().copied().step_by((COARSEST * COARSEST) as usize).collect();
    let rest = wanted.iter().enumerate().filter(|(place, _)| !is_first(*place)).map(|(_, texel)| *texel);
    let rest: Vec<CoveredTexel> = rest.collect();
    sample(&first, FEW_PROGRESS, &mut pass, monitor)?;
    let seconds_per_texel = pass.seconds / first.len().max(1) as f64;
    let left = SHARE_OF_TIME * monitor.clock().until(LATEST).seconds_left().unwrap_or(f64::INFINITY);
    let has_time = |side: &u32| rest.len() as f64 * seconds_per_texel <= left * f64::from(side * side);
    let side = decide(monitor, SMALLER.into_iter().find(has_time).unwrap_or(COARSEST))?;
    let blocks = match side {
        1 => None,
        side => Some(monitor.run_interruptible(1.0, || Representatives::new(texels, side))?),
    };
    let is_next = |texel: &CoveredTexel| blocks.as_ref().is_none_or(|blocks| must_be_sampled(blocks, *texel));
    let next: Vec<CoveredTexel> = rest.into_iter().filter(is_next).collect();
    sample(&next, share, &mut pass, monitor)?;
    if pass.sampled.len() < wanted.len() {
        monitor.cut_short();
        pass.blocks = blocks;
    }
    Ok(pass)
}

/// By how much texels differ from what they are interpolated from: the sum of the squared differences divided by that of
/// the squared light, from pairs of both. Where there is no light in any pair, all of it may be wrong.
pub(crate) fn relative_difference(pairs: impl Iterator<Item = [f64; 2]>) -> f32 {
    let [differences, light] = pairs.fold([0.0, 0.0], |sum, pair| [sum[0] + pair[0], sum[1] + pair[1]]);
    let relative = differences.max(0.0) / light;
    if relative.is_finite() && light > 0.0 { relative.min(1.0) as f32 } else { 1.0 }
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

    /// Direct light in a scene, with this time for it, where the light of some texels is known; and the texels' maps and
    /// columns.
    fn light_in(
        input: &StaticScene,
        density: Density,
        time: Option<Duration>,
        known: &[Option<Direct>],
    ) -> (Vec<Direct>, Vec<(u32, u32)>) {
        let options = BakeOptions { density, time, ..BakeOptions::default() };
        let (layout, scene) = laid_out(&input.objects, input.space(), &options);
        let sources = Sources::new(&scene, Vec::new(), input.lights.clone(), Vec3::ZERO);
        let mut carry_on = |_| ControlFlow::Continue(());
        // What is hidden is found without a limit, as it is the same then.
        let mut monitor = BakeMonitor::new(&mut carry_on, None);
        let (texels, _) = CoveredTexels::new(&scene, &layout, &mut monitor).unwrap();
        let mut carry_on = |_| ControlFlow::Continue(());
        let mut monitor = BakeMonitor::new(&mut carry_on, time);
        let (direct, _) = direct_light(&sources, &texels, known, &options, &mut monitor).unwrap();
        (direct.texels, texels.list.iter().map(|texel| (texel.map.0, texel.x)).collect())
    }

    /// Little enough time for the coarsest blocks alone.
    const NO_TIME: Option<Duration> = Some(Duration::from_nanos(1));

    fn light(direct: &Direct) -> f64 {
        f64::from(channel_mean(direct.baked))
    }

    /// Compares the light that there is without time on the first `maps` objects with the exact one: the share of texels
    /// with rays of their own, and RMS error, stated error and bias relative to the mean light.
    fn compare(input: &StaticScene, density: Density, maps: u32) -> [f64; 4] {
        let (exact, places) = light_in(input, density, None, &[]);
        let (late, _) = light_in(input, density, NO_TIME, &[]);
        let pairs: Vec<(&Direct, &Direct)> = late
            .iter()
            .zip(&exact)
            .zip(&places)
            .filter(|(_, (map, _))| *map < maps)
            .map(|(pair, _)| pair)
            .collect();
        let mean = |of: &dyn Fn(&Direct, &Direct) -> f64| {
            pairs.iter().map(|(late, exact)| of(late, exact)).sum::<f64>() / pairs.len() as f64
        };
        let mean_light = mean(&|_, exact| light(exact));
        let sampled = mean(&|late, _| f64::from(u8::from(late.rays > 0)));
        let error = mean(&|late, exact| (light(late) - light(exact)).powi(2)).sqrt() / mean_light;
        let stated = mean(&|late, _| f64::from(late.variance)).sqrt() / mean_light;
        let bias = mean(&|late, exact| light(late) - light(exact)) / mean_light;
        println!("{sampled:.3} have rays: off by {error:.3}, stated {stated:.3}, bias {bias:.3}");
        [sampled, error, stated, bias]
    }

    fn point_light() -> Vec<PlacedLight> {
        let lamp = Light { bake: BakeMode::Static, radius: 0.1, ..Light::point(Vec3::ONE) };
        vec![PlacedLight { light: lamp, position: DVec3::new(0.3, 2.0, 0.2), axis: DVec3::NEG_Y }]
    }

    fn many_lights() -> Vec<PlacedLight> {
        let lamp = Light { bake: BakeMode::Static, ..Light::point(Vec3::ONE) };
        let lamps = (0..400).map(|number| {
            let position =
                DVec3::new(f64::from(number % 20) / 5.0 - 2.0, 1.0, f64::from(number / 20) / 5.0 - 2.0);
            PlacedLight { light: lamp.clone(), position, axis: DVec3::NEG_Y }
        });
        lamps.collect()
    }

    #[test]
    fn without_time_light_is_interpolated_and_its_error_is_stated() {
        for lights in [point_light(), many_lights()] {
            let [sampled, error, stated, bias] = compare(&lit_floor(lights), Density::MapSize(128), 1);
            assert!(sampled < 0.25, "{sampled} have rays");
            assert!(error < 1.25 * stated && stated < 4.0 * error, "off by {error}, stated {stated}");
            assert!(error < 0.5 && bias.abs() < 0.05, "off by {error}, bias {bias}");
        }
    }

    /// Tiles that are as large as a block have nothing to be interpolated between, but are not exact for that.
    #[test]
    fn the_error_of_small_charts_is_stated_too() {
        let tile = Arc::new(shapes::plane(0.18, 0.18, 1, 1));
        let tiles = (0..400).map(|number| {
            let place =
                DVec3::new(f64::from(number % 20) / 5.0 - 2.0, 0.0, f64::from(number / 20) / 5.0 - 2.0);
            let transform = DAffine3::from_translation(place);
            SceneObject::new(
                "",
                vec![PlacedPrimitive { mesh: Arc::clone(&tile), transform, ..PlacedPrimitive::default() }],
            )
        });
        let StaticScene { objects, lights, .. } = lit_floor(point_light());
        let objects = tiles.chain(objects.into_iter().skip(1)).collect();
        let input = StaticScene { objects, lights, ..StaticScene::default() }.checked().unwrap();
        let [sampled, error, stated, _] = compare(&input, Density::TexelsPerMeter(30.0), 400);
        assert!(sampled < 0.3, "{sampled} have rays");
        assert!(error < 1.5 * stated && stated < 6.0 * error, "off by {error}, stated {stated}");
    }

    /// Known light contains that of the shared sources; what is interpolated beside it gets that by itself.
    #[test]
    fn light_beside_what_is_known_is_not_counted_twice() {
        let input = lit_floor(many_lights());
        let (exact, places) = light_in(&input, Density::MapSize(128), None, &[]);
        // The representatives beside it are four columns before it and three beyond it.
        const BORDER: u32 = 48;
        let is_known = |&(map, column): &(u32, u32)| map > 0 || column < BORDER;
        let known: Vec<Option<Direct>> =
            exact.iter().zip(&places).map(|(direct, place)| is_known(place).then_some(*direct)).collect();
        let (late, _) = light_in(&input, Density::MapSize(128), NO_TIME, &known);
        let (mut sum, mut expected) = (0.0, 0.0);
        for ((late, exact), place) in late.iter().zip(&exact).zip(&places) {
            if is_known(place) {
                assert_eq!(late.baked, exact.baked);
            } else if place.1 < BORDER + 3 {
                sum += light(late);
                expected += light(exact);
            }
        }
        println!("{} times the light", sum / expected);
        assert!((sum / expected - 1.0).abs() < 0.12, "{} times the light", sum / expected);
    }
}
