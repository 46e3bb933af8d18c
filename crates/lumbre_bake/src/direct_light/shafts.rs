//! The triangles that may occlude the sources of light from texels: collected for tiles of texels by shafts, and
//! narrowed down for each texel. Where they are few, direct light is computed without shadow rays. The light itself is
//! in `sources`.

use std::collections::BTreeMap;

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::light_cuts::LightCuts;
use super::light_visibility::visibilities;
use crate::coverage::texel_geometry::{bounding_area, positions_of, shows_plane};
use crate::coverage::{Footprint, FootprintPoint, GRID, Texel, TexelGroups, barycentric};
use crate::scene::BakeScene;
use crate::sources::{LightCut, Sources};
use crate::texel_index::CoveredTexel;
use crate::visibility::{Area, LampOccluders, LightVisibility, ReceiverShape, Shaft, Visibility};

/// What may occlude the sources from a tile.
#[derive(Default)]
struct TileOccluders {
    lamps: Vec<TileLampOccluders>,
    /// By the lights' indices, ascending.
    lights: Vec<(u32, LightVisibility)>,
    /// The index of a texel of the tile that is in the open; `None` if there is none, or if no texel of the tile is
    /// wanted.
    open_texel: Option<CoveredTexel>,
}

/// What may occlude a lamp, a node of the emitter tree, from a tile.
struct TileLampOccluders {
    node: u32,
    /// The emitters that may shine on the tile, each with the triangles that may occlude it.
    emitters: Vec<(u32, Vec<u32>)>,
}

/// What may occlude the sources from each texel.
pub(crate) struct Shafts<'a> {
    scene: &'a BakeScene,
    sources: &'a Sources<'a>,
    tiles: Vec<TileOccluders>,
    /// The tile of each covered texel.
    tile_of: Vec<u32>,
}

impl<'a> Shafts<'a> {
    /// Collects the occluders for all tiles of covered texels with a texel that is wanted.
    pub fn new(
        sources: &'a Sources<'a>,
        texels: &[Texel],
        cuts: &LightCuts,
        wanted: impl Fn(CoveredTexel) -> bool + Sync,
    ) -> Self {
        let scene = sources.scene;
        let mut shafts = Self { scene, sources, tiles: Vec::new(), tile_of: Vec::new() };
        if sources.emitters.is_empty() && sources.lights.is_empty() {
            return shafts;
        }
        let TexelGroups { members, group_of } = TexelGroups::tiles(texels);
        shafts.tile_of = group_of;
        shafts.tiles = members
            .par_iter()
            .map(|members| {
                if scene.stop.is_cancelled() || !members.iter().any(|&texel| wanted(texel)) {
                    return TileOccluders::default();
                }
                let cut = cuts.of(members[0]);
                let open_texel = members.iter().copied().find(|&texel| !texels[texel.place()].is_hidden());
                let members = || members.iter().map(|&texel| &texels[texel.place()]);
                let occluders = shafts.tile_occluders(cut, members).unwrap_or_default();
                TileOccluders { open_texel, ..occluders }
            })
            .collect();
        shafts
    }

    /// The shaft from an area to an emitter; `None` if the emitter does not shine on the area.
    fn shaft(&self, area: &Area, emitter: u32) -> Option<Shaft> {
        let emitter = &self.sources.emitters[emitter as usize];
        Shaft::new(area, emitter.corners_f64, emitter.normal)
    }

    /// The occluders of a tile; `None` if its texels need shadow rays to every source.
    fn tile_occluders<'t, T: Iterator<Item = &'t Texel>>(
        &self,
        cut: &LightCut,
        members: impl Fn() -> T,
    ) -> Option<TileOccluders> {
        let mut open = members().filter(|texel| !texel.is_hidden());
        let first = open.next()?;
        let mut positions = Vec::new();
        members().for_each(|texel| positions_of(self.scene, texel, &mut positions));
        let area = bounding_area(self.scene, first.triangle, &positions)?;
        if !members().all(|texel| shows_plane(self.scene, texel, first.triangle)) {
            return None;
        }
        let lamp = |&node: &u32| {
            let all_emitters = self.sources.emitters_of(node);
            if all_emitters.len() > MAX_EMITTERS {
                return None;
            }
            let mut emitters = Vec::new();
            for &emitter in all_emitters {
                if self.scene.stop.is_cancelled() {
                    return None;
                }
                if let Some(shaft) = self.shaft(&area, emitter) {
                    emitters.push((emitter, shaft.triangles(self.scene, MAX_BLOCKERS)?));
                }
            }
            Some(TileLampOccluders { node, emitters })
        };
        let lamps = cut.lamps.iter().filter_map(lamp).collect();
        let lights = visibilities(self.sources, &cut.lights, &area, first.side(self.scene));
        Some(TileOccluders { lamps, lights, open_texel: None })
    }

    /// Lamps that have samples of their own in a block that `accepts_block` accepts, by its number and cut, but whose
    /// occluders are unknown in most of the block's tiles: pairs of a texel's index, which stands for its block, and
    /// the lamp.
    pub fn unresolved(
        &self,
        cuts: &LightCuts,
        accepts_block: impl Fn(u32, &LightCut) -> bool,
    ) -> Vec<(CoveredTexel, u32)> {
        // The number of tiles in each block; and for each block and lamp a texel and the number of tiles that do not
        // know the lamp's occluders.
        let mut tiles: BTreeMap<u32, u32> = BTreeMap::new();
        let mut unresolved: BTreeMap<(u32, u32), (CoveredTexel, u32)> = BTreeMap::new();
        for (tile, texel) in self.tiles.iter().filter_map(|tile| Some((tile, tile.open_texel?))) {
            let block = cuts.block(texel);
            *tiles.entry(block).or_default() += 1;
            let cut = cuts.of(texel);
            for &lamp in cut.lamps.iter().filter(|_| accepts_block(block, cut)) {
                if tile.lamps.iter().all(|occluders| occluders.node != lamp) {
                    unresolved.entry((block, lamp)).or_insert((texel, 0)).1 += 1;
                }
            }
        }
        let in_most_tiles = |((block, lamp), (texel, count)): ((u32, u32), (CoveredTexel, u32))| {
            (2 * count > tiles[&block]).then_some((texel, lamp))
        };
        unresolved.into_iter().filter_map(in_most_tiles).collect()
    }

    /// What may occlude the sources from a texel, as far as that is known; `place` is the texel's index.
    pub fn visibility(&self, place: usize, texel: &Texel) -> Visibility<'_> {
        // Only punctual lights use the square.
        let square = if self.sources.lights.is_empty() { None } else { square(self.scene, texel) };
        let Some(&tile) = self.tile_of.get(place) else {
            return Visibility { square, ..Visibility::UNKNOWN };
        };
        let tile = &self.tiles[tile as usize];
        let (mut texel_area, mut positions) = (None, Vec::new());
        let narrow_lamp = |tile_lamp: &TileLampOccluders| {
            if tile_lamp.emitters.iter().all(|(_, blockers)| blockers.is_empty()) {
                return Some(LampOccluders { node: tile_lamp.node, emitters: Vec::new() });
            }
            if texel_area.is_none() {
                positions_of(self.scene, texel, &mut positions);
                texel_area = bounding_area(self.scene, texel.triangle, &positions);
            }
            let area = texel_area?;
            let narrow_emitter = |(emitter, blockers): &(u32, Vec<u32>)| {
                let shaft = self.shaft(&area, *emitter)?;
                let corners = blockers.iter().filter_map(|&index| {
                    let triangle = &self.scene.triangles[index as usize];
                    let corners = triangle.corners.map(|corner| corner.as_dvec3());
                    shaft.may_meet(&corners, f64::from(triangle.extent)).then_some(corners)
                });
                Some((*emitter, corners.collect()))
            };
            let emitters: Vec<(u32, Vec<_>)> = tile_lamp.emitters.iter().filter_map(narrow_emitter).collect();
            let is_clear = emitters.iter().all(|(_, blockers)| blockers.is_empty());
            Some(LampOccluders {
                node: tile_lamp.node,
                emitters: if is_clear { Vec::new() } else { emitters },
            })
        };
        let lamps = tile.lamps.iter().filter_map(narrow_lamp).collect();
        let in_shadow =
            tile.lights.iter().any(|(_, visibility)| matches!(visibility, LightVisibility::Shadows(..)));
        Visibility {
            lamps,
            lights: &tile.lights,
            receiver_shape: in_shadow.then(|| receiver_shape(self.scene, texel)),
            square,
        }
    }
}

/// The shape of what a texel of a flat tile shows.
fn receiver_shape(scene: &BakeScene, texel: &Texel) -> ReceiverShape {
    let mut positions = Vec::new();
    positions_of(scene, texel, &mut positions);
    let place = |position: &Vec3| position.as_dvec3();
    match (&texel.footprint, &positions[..]) {
        (Footprint::Whole(_), [a, b, d, c]) => ReceiverShape::Parallelogram([a, b, c, d].map(place)),
        _ => ReceiverShape::Points(positions.iter().map(place).collect()),
    }
}

/// How far a texel's points may lie from the plane square of its triangle, as a share of the square's diagonal.
const FLAT: f32 = 1e-3;

/// The corners of a texel, on the surface, if one triangle fills its square, or several do that lie in one plane.
fn square(scene: &BakeScene, texel: &Texel) -> Option<[DVec3; 4]> {
    let triangle = &scene.triangles[texel.triangle as usize];
    let corner = Vec2::new(texel.x as f32, texel.y as f32);
    let place = |offset: Vec2| barycentric(triangle, corner + offset).map(|(u, v)| triangle.position(u, v));
    let corners = [place(Vec2::ZERO)?, place(Vec2::X)?, place(Vec2::ONE)?, place(Vec2::Y)?];
    let tolerance = FLAT * corners[0].distance(corners[2]);
    let is_filled = match &texel.footprint {
        Footprint::Whole(_) => true,
        Footprint::Points(points) => {
            let on_square = |point: &FootprintPoint| {
                let (u, v) = point.at;
                let position = scene.triangles[point.triangle as usize].position(u, v);
                place(point.offset).is_some_and(|place| place.distance(position) <= tolerance)
            };
            points.len() == GRID && points.iter().all(on_square)
        }
        Footprint::Hidden => false,
    };
    is_filled.then(|| corners.map(|corner| corner.as_dvec3()))
}

/// The most triangles that may occlude an emitter, and the most emitters of a lamp; with more, shadow rays are faster.
const MAX_BLOCKERS: usize = 32;
const MAX_EMITTERS: usize = 8;
