//! The direct light of texels for which one value does not do: over which it changes much, such as around a lamp that
//! hangs just below the ceiling. Of such a texel, rays from the room may reach only the dark part. It is divided into
//! cells, whose light is computed once, before the rays that read it are cast. Not the light of other texels, of which
//! `texel_radiance` has one value each.

use std::num::NonZeroU32;

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::chunks::in_chunks;
use crate::color::channel_mean;
use crate::coverage::{CoveredTexels, Footprint, FootprintPoint, Texel, receiver};
use crate::direct_light::{DirectLight, LocalLight};
use crate::monitor::BakeMonitor;
use crate::sampling::{Sequence, Stream};
use crate::sources::Sources;
use crate::texel_index::{CoveredTexel, MapTexel};
use crate::{BakeError, BakeOptions};

/// A texel's direct light is steep if that of the texels around it differs by more than this share of the brightest.
const STEEP: f32 = 0.5;
/// It matters only if the brightest of them has this many times the light around the texel: the edge of a shadow is
/// steep too, but rays reach both of its sides.
const MIN_LIGHT: f64 = 2.0;

/// Cells along a texel's side, at most and at least.
const CELLS: u32 = 8;
const LEAST_CELLS: u32 = 2;
/// Where there are many such texels they have fewer cells, down to 2 x 2: no more than this many per covered texel. So
/// cells take no more memory than a number per covered texel and, at the default quality, about as long as two shadow
/// rays from each.
const CELLS_PER_TEXEL: usize = 1;
/// The share of the time left in which cells may be computed, if it is limited. The texels after that have one value,
/// as a complete map is more urgent.
const TIME_SHARE: f64 = 0.1;
/// So many times fewer shadow rays go to each lamp from a point of a cell than from a texel in the first pass of direct
/// light: one at the default quality. All rays that read a cell share its noise. In a cell alone it may be large; the
/// mean over the texel is scaled to the texel's light, which has far less. The cells of a texel that a wall divides
/// cannot be scaled, and each of their points has as many rays as a texel.
const FEWER_SAMPLES: u32 = 8;
/// Cells whose mean is so many times the texel's light, or such a part of it, have missed what lights the texel.
const MAX_SCALE: f32 = 4.0;

/// The number of a steep texel, plus one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SteepTexel(NonZeroU32);

/// The direct light of all steep texels.
#[derive(Clone, Debug, Default)]
pub(crate) struct SteepLight {
    /// Cells along a texel's side.
    side: u32,
    /// Irradiance of the cells (mixed lights included, W/m²), texel by texel and row by row; NaN where nothing is known.
    cells: Vec<Vec3>,
    /// Shadow rays that were cast.
    pub rays: u64,
}

/// The light of the cells of one texel.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct TexelCells {
    light: Vec<Vec3>,
    rays: u32,
}

impl SteepLight {
    /// Computes the light of all texels whose direct light is steep, as far as there is time. Also returns these texels.
    /// `direct_by_place` is the direct light per texel of all maps, NaN where it is not known.
    pub fn new(
        sources: &Sources<'_>,
        texels: &CoveredTexels<'_>,
        direct: &DirectLight,
        direct_by_place: &[Vec3],
        options: &BakeOptions,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<(Self, Vec<MapTexel>), BakeError> {
        let steep: Vec<CoveredTexel> =
            monitor.run_interruptible(0.0, || steep_texels(texels, direct_by_place, &direct.local))?;
        let most = CELLS_PER_TEXEL * texels.list.len();
        let side = std::iter::successors(Some(CELLS), |side| Some(side / 2))
            .find(|side| *side <= LEAST_CELLS || steep.len() * (side * side) as usize <= most)
            .unwrap_or(LEAST_CELLS);
        let clock = monitor.clock();
        let deadline = clock.seconds_left().map(|left| clock.seconds() + TIME_SHARE * left);
        let cells_of_texels = in_chunks(steep.len(), monitor, |place| {
            if deadline.is_some_and(|deadline| clock.seconds() > deadline) {
                return TexelCells::unknown(side);
            }
            let texel = steep[place];
            // A wall divides the texel, so that its one value, a mean of both sides, is that of neither.
            let is_divided = texels.divided.binary_search(&texel).is_ok();
            let mean = (!is_divided).then(|| direct.texels[texel.place()].total());
            texel_cells(sources, &texels.list[texel.place()], side, mean, options)
        })?;
        let mut light =
            Self { side, cells: Vec::with_capacity(steep.len() * (side * side) as usize), rays: 0 };
        for TexelCells { light: of_texel, rays } in cells_of_texels {
            light.cells.extend(of_texel);
            light.rays += u64::from(rays);
        }
        let places = steep.iter().map(|texel| texels.list[texel.place()].index).collect();
        Ok((light, places))
    }

    /// The numbers of the texels, in the order of [`SteepLight::new`].
    pub fn numbers() -> impl Iterator<Item = SteepTexel> {
        (1..).filter_map(NonZeroU32::new).map(SteepTexel)
    }

    /// The direct irradiance at a place in a texel's unit square, if it is known.
    pub fn at(&self, SteepTexel(number): SteepTexel, offset: Vec2) -> Option<Vec3> {
        let texel = (number.get() as usize - 1) * (self.side * self.side) as usize;
        let light = self.cells.get(texel + cell_at(offset, self.side))?;
        (!light.x.is_nan()).then_some(*light)
    }
}

impl TexelCells {
    /// Those of a texel for which there was no time.
    fn unknown(side: u32) -> Self {
        Self { light: vec![Vec3::NAN; (side * side) as usize], rays: 0 }
    }
}

/// The number of the cell at a place in a texel's unit square.
fn cell_at(offset: Vec2, side: u32) -> usize {
    // `as` saturates: negative places are in the first column or row, and so is NaN.
    let [column, row] = (offset * side as f32).to_array().map(|place| (place as u32).min(side - 1));
    (row * side + column) as usize
}

/// The light of a texel's cells, scaled such that its mean is that of the texel, if one is given.
fn texel_cells(
    sources: &Sources<'_>,
    texel: &Texel,
    side: u32,
    mean: Option<Vec3>,
    options: &BakeOptions,
) -> TexelCells {
    let scene = sources.scene;
    let points: Vec<FootprintPoint> = match &texel.footprint {
        // Only these points are known to be in the open.
        Footprint::Points(points) if !texel.has_points_for_all() => points.clone(),
        _ => {
            let middle =
                |cell: u32| (Vec2::new((cell % side) as f32, (cell / side) as f32) + 0.5) / side as f32;
            let middles = (0..side * side).map(middle);
            middles.filter_map(|Vec2 { x, y }| texel.covered_point(scene, x, y)).collect()
        }
    };
    let sequence = Sequence::new(options.seed, Stream::SteepLight, texel.index.0);
    let [of_texel, ..] = options.effort().direct;
    let samples = if mean.is_some() { (of_texel / FEWER_SAMPLES).max(1) } else { of_texel };
    let (mut sums, mut counts) =
        (vec![Vec3::ZERO; (side * side) as usize], vec![0u32; (side * side) as usize]);
    let (mut total, mut rays) = (Vec3::ZERO, 0);
    for (number, point) in points.iter().enumerate() {
        let at = receiver(scene, point);
        let direct = sources.irradiance(sequence.of(number as u32), samples, &|_, _| Some(at));
        let cell = cell_at(point.offset, side);
        sums[cell] += direct.total();
        counts[cell] += 1;
        total += direct.total();
        rays += direct.rays;
    }
    let scale = scale(total / points.len().max(1) as f32, mean);
    let light = |(sum, count): (Vec3, u32)| match scale {
        Some(scale) if count > 0 => scale * sum / count as f32,
        _ => Vec3::NAN,
    };
    TexelCells { light: sums.into_iter().zip(counts).map(light).collect(), rays }
}

/// By what the light of cells is multiplied so that its mean becomes the given one; `None` if the cells have missed it.
fn scale(of_cells: Vec3, mean: Option<Vec3>) -> Option<Vec3> {
    let Some(mean) = mean else { return Some(Vec3::ONE) };
    let ratio = channel_mean(mean) / channel_mean(of_cells);
    let has_found_it = (MAX_SCALE.recip()..=MAX_SCALE).contains(&ratio);
    let of_channel = |channel: usize| match of_cells[channel] > 0.0 {
        true => (mean[channel] / of_cells[channel]).min(MAX_SCALE),
        false => 1.0,
    };
    has_found_it.then(|| Vec3::from_array(std::array::from_fn(of_channel)))
}

/// The texels that have steep direct light, in ascending order. `direct` is per texel of all maps, NaN where it is not
/// known.
fn steep_texels(texels: &CoveredTexels<'_>, direct: &[Vec3], local: &LocalLight) -> Vec<CoveredTexel> {
    let is_steep = |&(covered, texel): &(CoveredTexel, &Texel)| {
        let map = &texels.layout.maps[texel.map.place()];
        let light = |near: MapTexel| channel_mean(direct[near.place()]);
        let around = map.neighbourhood(texel.x, texel.y, 1).map(light).filter(|light| light.is_finite());
        let (least, most) =
            around.fold((f32::INFINITY, 0.0f32), |(least, most), light| (least.min(light), most.max(light)));
        most - least > STEEP * most && f64::from(most) > MIN_LIGHT * local.at(covered)
    };
    texels.open().filter(is_steep).map(|(covered, _)| covered).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coverage::on_a_floor::on_a_floor;
    use crate::scene::Side;
    use crate::sources::Emitter;

    /// A small lamp close above the middle of a texel, facing it, and nothing else that shines.
    fn lamp_above<'a>(texels: &CoveredTexels<'a>, texel: &Texel) -> Sources<'a> {
        let at = receiver(texels.scene, &texel.point(texels.scene, 0.5, 0.5).unwrap());
        let side = texel.side(texels.scene);
        let corner = |x: f32, z: f32| at.position + side * (0.2 * at.normal + 0.1 * Vec3::new(x, 0.0, z));
        let corners = [corner(0.0, 1.0), corner(1.0, 0.0), corner(-1.0, 0.0)];
        let product = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let corners =
            if product.dot(at.normal) < 0.0 { corners } else { [corners[0], corners[2], corners[1]] };
        let lamp = Emitter {
            corners,
            corners_f64: corners.map(|corner| corner.as_dvec3()),
            normal: -at.normal,
            area: 0.5 * product.length(),
            radiance: Vec3::new(1.0, 2.0, 0.0),
            triangle: 0,
            side: Side::Front,
        };
        Sources::new(texels.scene, vec![lamp], Vec::new(), Vec3::ZERO)
    }

    /// A texel on one triangle, and one that two share.
    #[test]
    fn cells_have_the_light_of_their_middles() {
        on_a_floor(8, |texels, _| {
            for texel in [&texels.list[2 * 8 + 5], &texels.list[4 * 8 + 4]] {
                let sources = lamp_above(texels, texel);
                let options = BakeOptions::default();
                let TexelCells { light, rays } = texel_cells(&sources, texel, CELLS, None, &options);
                assert_eq!(rays, options.effort().direct[0] * CELLS * CELLS);
                let steep = SteepLight { side: CELLS, cells: light.clone(), rays: 0 };
                let number = SteepLight::numbers().next().unwrap();
                for (x, y) in (0..CELLS).flat_map(|y| (0..CELLS).map(move |x| (x, y))) {
                    let middle = (Vec2::new(x as f32, y as f32) + 0.5) / CELLS as f32;
                    let point = texel.covered_point(texels.scene, middle.x, middle.y).unwrap();
                    let root = sources.emitter_tree.root().unwrap();
                    let at = receiver(texels.scene, &point);
                    let exact = sources.emitter_tree.unoccluded(&sources.emitters, root, &at);
                    for corner in [Vec2::splat(-0.06), Vec2::ZERO, Vec2::splat(0.06)] {
                        let cell = steep.at(number, middle + corner).unwrap();
                        assert!(cell.distance(exact) < 1e-5 * exact.length(), "{middle}: {cell} {exact}");
                    }
                }
                let brightest = light.iter().map(|light| light.y).fold(0.0, f32::max);
                let darkest = light.iter().map(|light| light.y).fold(f32::INFINITY, f32::min);
                assert!(brightest > 10.0 * darkest, "{darkest} to {brightest}");
                assert_eq!(steep.at(SteepLight::numbers().nth(1).unwrap(), Vec2::ZERO), None);
                let unknown = SteepLight { cells: TexelCells::unknown(CELLS).light, ..steep };
                assert_eq!(unknown.at(number, Vec2::splat(0.5)), None);
            }
        });
    }

    #[test]
    fn the_mean_over_the_cells_is_the_light_of_the_texel_unless_they_have_missed_it() {
        on_a_floor(8, |texels, _| {
            let texel = &texels.list[2 * 8 + 5];
            let sources = lamp_above(texels, texel);
            let mean_of = |cells: &TexelCells| cells.light.iter().sum::<Vec3>() / cells.light.len() as f32;
            let options = BakeOptions::default();
            let cells = |mean: Option<Vec3>| texel_cells(&sources, texel, CELLS, mean, &options);
            let unscaled = mean_of(&cells(None));
            for factor in [0.5, 1.0, 3.0] {
                let mean = mean_of(&cells(Some(factor * unscaled)));
                assert!(
                    mean.distance(factor * unscaled) < 1e-5 * mean.length(),
                    "{factor}: {mean} {unscaled}"
                );
            }
            for mean in [Vec3::ZERO, 0.1 * unscaled, 10.0 * unscaled, Vec3::NAN] {
                assert!(cells(Some(mean)).light.iter().all(|light| light.is_nan()), "{mean}");
            }
        });
    }

    /// Half of the texel is inside of something: nothing is known there, and the other half has its own light.
    #[test]
    fn cells_without_a_point_in_the_open_are_unknown() {
        on_a_floor(8, |texels, _| {
            let whole = &texels.list[2 * 8 + 5];
            let sources = lamp_above(texels, whole);
            let options = BakeOptions::default();
            let middles = (0..CELLS * CELLS).map(|cell| [cell % CELLS, cell / CELLS]);
            let middles = middles.map(|cell| cell.map(|place| (place as f32 + 0.5) / CELLS as f32));
            let points = middles.filter(|[x, _]| *x < 0.5);
            let points = points.map(|[x, y]| whole.covered_point(texels.scene, x, y).unwrap()).collect();
            let half = Texel { footprint: Footprint::Points(points), ..whole.clone() };
            let of_whole = texel_cells(&sources, whole, CELLS, None, &options).light;
            let of_half = texel_cells(&sources, &half, CELLS, None, &options).light;
            for (cell, (light, expected)) in of_half.iter().zip(&of_whole).enumerate() {
                match cell as u32 % CELLS < CELLS / 2 {
                    true => assert!(light.distance(*expected) < 1e-5 * expected.length(), "{cell}: {light}"),
                    false => assert!(light.is_nan(), "{cell}: {light}"),
                }
            }
        });
    }

    #[test]
    fn places_beyond_a_texel_belong_to_its_outer_cells() {
        let cell = |x: f32, y: f32| cell_at(Vec2::new(x, y), 4);
        assert_eq!([cell(0.0, 0.0), cell(0.99, 0.0), cell(1.0, 1.0), cell(-1.0, 0.3)], [0, 3, 15, 4]);
        assert_eq!(cell(f32::NAN, f32::INFINITY), 12);
    }
}
