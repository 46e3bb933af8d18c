//! Representatives: one texel of each block of a chart, which stands for the others where there is no time for all of
//! them. What the others show is copied or interpolated from representatives by those who compute it.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use glam::Vec2;
use rayon::prelude::*;

use super::covered_texels::CoveredTexels;
use super::footprint::Texel;
use crate::texel_index::CoveredTexel;

/// The representatives of the texels in blocks of some size.
pub(crate) struct Representatives<'a> {
    texels: &'a CoveredTexels<'a>,
    /// Texels along a block's side.
    side: u32,
    /// Per covered texel, its representative.
    list: Vec<CoveredTexel>,
}

impl<'a> Representatives<'a> {
    /// One for each block of `side` x `side` texels of one chart: the texel nearest the block's middle. Texels represent
    /// themselves if they are hidden, if a thin wall divides them, or if a contact line separates them from the
    /// representative of their block. (On triangles smaller than a texel contact lines are not known.) If the bake is
    /// cancelled, the rest represent themselves.
    pub fn new(texels: &'a CoveredTexels<'a>, side: u32) -> Self {
        let of_block = nearest_the_middle(texels, side);
        let of_texel = |place: usize| {
            let texel = CoveredTexel::new(place);
            let stands_alone = !is_whole(texels, texel) || texels.scene.stop.is_cancelled();
            let of_block = of_block[place].filter(|_| !stands_alone);
            of_block.filter(|&other| !are_separated(texels, [texel, other])).unwrap_or(texel)
        };
        let list = (0..texels.list.len()).into_par_iter().map(of_texel).collect();
        Self { texels, side, list }
    }

    /// The representative of a texel, perhaps itself.
    pub fn of(&self, texel: CoveredTexel) -> CoveredTexel {
        self.list[texel.place()]
    }

    /// Per covered texel, its representative.
    pub fn list(&self) -> &[CoveredTexel] {
        &self.list
    }

    /// Whether a texel represents itself, and perhaps others.
    pub fn represents_itself(&self, texel: CoveredTexel) -> bool {
        self.of(texel) == texel
    }

    /// The representatives from which a texel is interpolated, with weights that sum to 1: those of the blocks around it
    /// for which `fits` holds, that are in its chart and not beyond a contact line; if there is none, its own
    /// representative, whether that fits or not. Where blocks are whole, this is bilinear interpolation.
    pub fn around(
        &self,
        texel: CoveredTexel,
        fits: impl Fn(CoveredTexel) -> bool,
    ) -> Vec<(CoveredTexel, f32)> {
        let Self { texels, side, .. } = *self;
        let list = &texels.list;
        let shown = &list[texel.place()];
        let map = &texels.layout.maps[shown.map.place()];
        let mut around: Vec<(CoveredTexel, f32)> = Vec::new();
        for step in 0..9 {
            // One block to the left or above is a negative step, which wraps and is out of the map then.
            let [x, y] = [(shown.x, step % 3), (shown.y, step / 3)]
                .map(|(at, to)| (at + to * side).wrapping_sub(side));
            if x >= map.width || y >= map.height {
                continue;
            }
            let near = texels.open_at(map.texel(x, y)).map(|near| self.of(near));
            let is_new = |near: &CoveredTexel| around.iter().all(|(other, _)| other != near);
            let is_like_it =
                |near: &CoveredTexel| texels.chart(&list[near.place()]) == texels.chart(shown) && fits(*near);
            let Some(near) = near.filter(is_new).filter(is_like_it) else { continue };
            let distance = (middle(&list[near.place()]) - middle(shown)).abs() / side as f32;
            let weight = (1.0 - distance.x).max(0.0) * (1.0 - distance.y).max(0.0);
            if weight > 0.0 && is_whole(texels, near) && !are_separated(texels, [texel, near]) {
                around.push((near, weight));
            }
        }
        if around.is_empty() {
            return vec![(self.of(texel), 1.0)];
        }
        let sum: f32 = around.iter().map(|(_, weight)| weight).sum();
        around.iter_mut().for_each(|(_, weight)| *weight /= sum);
        around
    }
}

/// Per covered texel, the texel nearest the middle of its block, of those that are whole.
fn nearest_the_middle(texels: &CoveredTexels<'_>, side: u32) -> Vec<Option<CoveredTexel>> {
    let mut blocks: HashMap<[u32; 4], u32> = HashMap::new();
    // Per block, the texel and its squared distance from the middle, in half texels.
    let mut nearest: Vec<(Option<CoveredTexel>, u32)> = Vec::new();
    let block_of = |(place, texel): (usize, &Texel)| {
        let key = [texel.map.0, texels.chart(texel), texel.x / side, texel.y / side];
        let block = match blocks.entry(key) {
            Entry::Occupied(block) => *block.get(),
            Entry::Vacant(block) => {
                nearest.push((None, u32::MAX));
                *block.insert(nearest.len() as u32 - 1)
            }
        };
        let from_middle = |at: u32| (2 * (at % side) + 1).abs_diff(side).pow(2);
        let distance = from_middle(texel.x) + from_middle(texel.y);
        let (_, least) = nearest[block as usize];
        if distance < least && is_whole(texels, CoveredTexel::new(place)) {
            nearest[block as usize] = (Some(CoveredTexel::new(place)), distance);
        }
        block
    };
    let in_time = texels.list.iter().take_while(|_| !texels.scene.stop.is_cancelled());
    let mut block_of_texel: Vec<u32> = in_time.enumerate().map(block_of).collect();
    // After a cancellation, which discards the result, any block will do.
    block_of_texel.resize(texels.list.len(), 0);
    block_of_texel.iter().map(|&block| nearest.get(block as usize).and_then(|(texel, _)| *texel)).collect()
}

/// Whether one value can stand for all of a texel: it is in the open, and no thin wall divides it.
fn is_whole(texels: &CoveredTexels<'_>, texel: CoveredTexel) -> bool {
    !texels.list[texel.place()].is_hidden() && texels.divided.binary_search(&texel).is_err()
}

/// The middle of a texel on its map, in texels.
fn middle(texel: &Texel) -> Vec2 {
    Vec2::new(texel.x as f32, texel.y as f32) + 0.5
}

/// Whether a contact line runs between the middles of two texels of a map.
fn are_separated(texels: &CoveredTexels<'_>, pair: [CoveredTexel; 2]) -> bool {
    let [from, to] = pair.map(|texel| &texels.list[texel.place()]);
    texels.contacts.separate(&texels.layout.maps[from.map.place()], [middle(from), middle(to)])
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;
    use std::sync::Arc;

    use glam::{DAffine3, DVec3, Vec3};
    use lumbre_mesh::shapes;

    use super::super::footprint::receiver;
    use super::super::on_a_floor::on_a_floor;
    use super::*;
    use crate::monitor::BakeMonitor;
    use crate::scene::laid_out::laid_out;
    use crate::scene::{PlacedPrimitive, SceneObject, StaticScene};
    use crate::{BakeOptions, Density};

    #[test]
    fn interpolation_on_a_whole_floor_is_bilinear() {
        on_a_floor(32, |texels, _| {
            let blocks = Representatives::new(texels, 4);
            let value = |texel: CoveredTexel| {
                let Vec2 { x, y } = middle(&texels.list[texel.place()]);
                1.0 + 2.0 * x - 3.0 * y + 0.5 * x * y
            };
            for (texel, Texel { x, y, .. }) in texels.open() {
                let around = blocks.around(texel, |_| true);
                assert!(around.iter().all(|(other, _)| blocks.represents_itself(*other)));
                let sum: f32 = around.iter().map(|(_, weight)| weight).sum();
                assert!((sum - 1.0).abs() < 1e-5, "{sum}");
                // Beyond the outermost representatives there is nothing to interpolate with.
                if [x, y].iter().all(|at| (4..28).contains(*at)) {
                    let light: f32 = around.iter().map(|(other, weight)| weight * value(*other)).sum();
                    assert!((light - value(texel)).abs() < 1e-3, "{light} {}", value(texel));
                }
            }
            assert_eq!(texels.open().filter(|(texel, _)| blocks.represents_itself(*texel)).count(), 8 * 8);
        });
    }

    #[test]
    fn nothing_is_interpolated_across_a_wall_or_from_sources_that_do_not_fit() {
        let object = |mesh, place: DVec3| {
            let transform = DAffine3::from_translation(place);
            let primitive = PlacedPrimitive { mesh: Arc::new(mesh), transform, ..PlacedPrimitive::default() };
            SceneObject::new("", vec![primitive])
        };
        const WALL: f64 = 0.21;
        let floor = object(shapes::plane(4.0, 4.0, 1, 1), DVec3::ZERO);
        let wall = object(shapes::cuboid(Vec3::new(0.002, 1.0, 4.0), 1), DVec3::new(WALL, 0.5, 0.0));
        let input =
            StaticScene { objects: vec![floor, wall], sky: Vec3::ONE, ..StaticScene::default() }.checked();
        let input = input.unwrap();
        let options = BakeOptions { density: Density::MapSize(64), ..BakeOptions::default() };
        let (layout, scene) = laid_out(&input.objects, input.space(), &options);
        let mut carry_on = |_| ControlFlow::Continue(());
        let mut monitor = BakeMonitor::new(&mut carry_on, None);
        let (texels, _) = CoveredTexels::new(&scene, &layout, &mut monitor).unwrap();
        let blocks = Representatives::new(&texels, 8);
        let is_beyond = |texel: CoveredTexel| {
            let point = texels.list[texel.place()].point(&scene, 0.5, 0.5).expect("it is in the open");
            scene.space.world(receiver(&scene, &point).position).x > WALL
        };
        let on_floor = texels.open().filter(|(texel, of)| of.map.0 == 0 && is_whole(&texels, *texel));
        let (mut count, mut interpolated) = (0, 0);
        for (texel, _) in on_floor {
            let around = blocks.around(texel, |_| true);
            assert!(around.iter().all(|(other, _)| is_beyond(*other) == is_beyond(texel)));
            assert_eq!(is_beyond(blocks.of(texel)), is_beyond(texel));
            count += 1;
            interpolated += u32::from(!blocks.represents_itself(texel));
            // If nothing fits, the texel's own representative must.
            assert_eq!(blocks.around(texel, |_| false), [(blocks.of(texel), 1.0)]);
            let fits = |other: CoveredTexel| other.0.is_multiple_of(2);
            let around = blocks.around(texel, fits);
            assert!(around.iter().all(|(other, _)| fits(*other)) || around == [(blocks.of(texel), 1.0)]);
        }
        assert!(count > 3900 && interpolated > 3000, "{interpolated} of {count}");
    }
}
