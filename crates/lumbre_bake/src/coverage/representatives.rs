//! Representatives: one texel of each block of a chart, which stands for the others where there is no time for all of
//! them. What the others show is copied or interpolated from representatives by those who compute it.

use glam::Vec2;
use rayon::prelude::*;

use super::covered_texels::CoveredTexels;
use super::footprint::Texel;
use super::texel_groups::TexelGroups;
use crate::texel_index::CoveredTexel;

/// The representatives of the texels in blocks of some size.
pub(crate) struct Representatives<'a> {
    texels: &'a CoveredTexels<'a>,
    /// Texels along a block's side.
    side: u32,
    /// Per covered texel, its representative.
    of: Vec<CoveredTexel>,
}

impl<'a> Representatives<'a> {
    /// One for each block of `side` x `side` texels of one chart: the texel nearest the block's middle. Texels represent
    /// themselves if they are hidden, if a thin wall divides them, or if a contact line separates them from the
    /// representative of their block.
    pub fn new(texels: &'a CoveredTexels<'a>, side: u32) -> Self {
        let list = &texels.list;
        let blocks = TexelGroups::blocks(list, &texels.charts, side);
        let from_middle = |texel: &CoveredTexel| {
            let Texel { x, y, .. } = &list[texel.place()];
            [x, y].map(|at| (2 * (at % side) + 1).abs_diff(side).pow(2)).iter().sum::<u32>()
        };
        let nearest = |members: &Vec<CoveredTexel>| {
            let whole = members.iter().copied().filter(|&texel| !is_divided(texels, texel));
            whole.min_by_key(from_middle)
        };
        let of_block: Vec<Option<CoveredTexel>> = blocks.members.iter().map(nearest).collect();
        let of_texel = |place: usize| {
            let texel = CoveredTexel::new(place);
            let stands_alone = list[place].is_hidden() || is_divided(texels, texel);
            let of_block = of_block[blocks.group_of[place] as usize].filter(|_| !stands_alone);
            of_block.filter(|&other| !are_separated(texels, [texel, other])).unwrap_or(texel)
        };
        let of = (0..list.len()).into_par_iter().map(of_texel).collect();
        Self { texels, side, of }
    }

    /// The representative of a texel, perhaps itself.
    pub fn of(&self, texel: CoveredTexel) -> CoveredTexel {
        self.of[texel.place()]
    }

    /// Per covered texel, its representative.
    pub fn all(&self) -> &[CoveredTexel] {
        &self.of
    }

    /// Whether a texel represents itself, and perhaps others.
    pub fn is_one(&self, texel: CoveredTexel) -> bool {
        self.of(texel) == texel
    }

    /// The representatives from which a texel is interpolated, with weights that sum to 1: those of the blocks around it
    /// for which `fits` holds, that are in its chart and not beyond a contact line. Where blocks are whole, this is
    /// bilinear interpolation.
    pub fn around(
        &self,
        texel: CoveredTexel,
        fits: impl Fn(CoveredTexel) -> bool,
    ) -> Vec<(CoveredTexel, f32)> {
        let Self { texels, side, .. } = *self;
        let list = &texels.list;
        let of = &list[texel.place()];
        let map = &texels.layout.maps[of.map.place()];
        let mut around: Vec<(CoveredTexel, f32)> = Vec::new();
        for step in 0..9 {
            // One block to the left or above is a negative step, which wraps and is out of the map then.
            let [x, y] =
                [(of.x, step % 3), (of.y, step / 3)].map(|(at, to)| (at + to * side).wrapping_sub(side));
            if x >= map.width || y >= map.height {
                continue;
            }
            let near = texels.open_at(map.texel(x, y)).map(|near| self.of(near));
            let is_new = |near: &CoveredTexel| around.iter().all(|(other, _)| other != near);
            let is_like_it =
                |near: &CoveredTexel| texels.chart(&list[near.place()]) == texels.chart(of) && fits(*near);
            let Some(near) = near.filter(is_new).filter(is_like_it) else { continue };
            let distance = (middle(&list[near.place()]) - middle(of)).abs() / side as f32;
            let weight = (1.0 - distance.x).max(0.0) * (1.0 - distance.y).max(0.0);
            if weight > 0.0 && !is_divided(texels, near) && !are_separated(texels, [texel, near]) {
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

fn is_divided(texels: &CoveredTexels<'_>, texel: CoveredTexel) -> bool {
    texels.divided.binary_search(&texel).is_ok()
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
                assert!(around.iter().all(|(other, _)| blocks.is_one(*other)));
                let sum: f32 = around.iter().map(|(_, weight)| weight).sum();
                assert!((sum - 1.0).abs() < 1e-5, "{sum}");
                // Beyond the outermost representatives there is nothing to interpolate with.
                if [x, y].iter().all(|at| (4..28).contains(*at)) {
                    let light: f32 = around.iter().map(|(other, weight)| weight * value(*other)).sum();
                    assert!((light - value(texel)).abs() < 1e-3, "{light} {}", value(texel));
                }
            }
            assert_eq!(texels.open().filter(|(texel, _)| blocks.is_one(*texel)).count(), 8 * 8);
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
        let on_floor = texels.open().filter(|(texel, of)| of.map.0 == 0 && !is_divided(&texels, *texel));
        let (mut count, mut interpolated) = (0, 0);
        for (texel, _) in on_floor {
            let around = blocks.around(texel, |_| true);
            assert!(around.iter().all(|(other, _)| is_beyond(*other) == is_beyond(texel)));
            assert_eq!(is_beyond(blocks.of(texel)), is_beyond(texel));
            count += 1;
            interpolated += u32::from(!blocks.is_one(texel));
            // If nothing fits, the texel's own representative must.
            assert_eq!(blocks.around(texel, |_| false), [(blocks.of(texel), 1.0)]);
        }
        assert!(count > 3900 && interpolated > 3000, "{interpolated} of {count}");
    }
}
