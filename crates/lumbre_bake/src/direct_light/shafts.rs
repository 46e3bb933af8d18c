//! What may stand between texels and what shines on them: found for tiles of texels, and narrowed down for each. Where it is little, direct
//! light needs no shadow ray. Not the light: that is `direct`.

use std::collections::BTreeMap;

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::light_cuts::LightCuts;
use super::light_visibility::visibilities;
use crate::coverage::footprint::{Footprint, FootprintPoint, GRID, Texel, barycentric};
use crate::coverage::tiles::{Tiles, area, positions_of, shows_plane};
use crate::scene::BakeScene;
use crate::sources::light_cut::LightCut;
use crate::sources::light_sources::Sources;
use crate::texel_index::CoveredTexel;
use crate::visibility::occluders::{LampOccluders, Visibility};
use crate::visibility::shadow_clipping::{LightVisibility, ReceiverShape};
use crate::visibility::shaft::{Area, Shaft};

/// What may stand between a tile and the sources.
#[derive(Default)]
struct TileOccluders {
    lamps: Vec<TileLampOccluders>,
    /// By the lights' numbers.
    lights: Vec<(u32, LightVisibility)>,
    /// A texel of it, by its place, that shows something: none if nobody wants to know.
    asked: Option<u32>,
}

/// What may stand between a tile and a part of the emissive surfaces, by numbers.
struct TileLampOccluders {
    node: u32,
    emitters: Vec<(u32, Vec<u32>)>,
}

/// What may stand between texels and the sources.
pub(crate) struct Shafts<'a> {
    scene: &'a BakeScene,
    sources: &'a Sources<'a>,
    tiles: Vec<TileOccluders>,
    /// The tile of each covered texel.
    tile_of: Vec<u32>,
}

impl<'a> Shafts<'a> {
    /// For all covered texels; tiles of which none is wanted are left out.
    pub fn new(
        scene: &'a BakeScene,
        sources: &'a Sources<'a>,
        texels: &[Texel],
        cuts: &LightCuts,
        wanted: impl Fn(CoveredTexel) -> bool + Sync,
    ) -> Self {
        let mut shafts = Self { scene, sources, tiles: Vec::new(), tile_of: Vec::new() };
        if sources.emitters.is_empty() && sources.lights.is_empty() {
            return shafts;
        }
        let Tiles { members, tile_of } = Tiles::new(texels);
        shafts.tile_of = tile_of;
        shafts.tiles = members
            .par_iter()
            .map(|members| {
                if scene.stop.is_cancelled() || !members.iter().any(|&place| wanted(CoveredTexel(place))) {
                    return TileOccluders::default();
                }
                let cut = cuts.of(members[0] as usize);
                let asked = members.iter().copied().find(|&place| !texels[place as usize].is_hidden());
                let members = || members.iter().map(|&place| &texels[place as usize]);
                let found = shafts.tile_occluders(cut, members).unwrap_or_default();
                TileOccluders { asked, ..found }
            })
            .collect();
        shafts
    }

    /// From an area to an emitter; `None` where no light passes.
    fn shaft(&self, area: &Area, emitter: u32) -> Option<Shaft> {
        let emitter = &self.sources.emitters[emitter as usize];
        Shaft::new(area, emitter.corners_f64, emitter.normal)
    }

    /// `None` where rays have to tell.
    fn tile_occluders<'t, T: Iterator<Item = &'t Texel>>(
        &self,
        cut: &LightCut,
        members: impl Fn() -> T,
    ) -> Option<TileOccluders> {
        let mut open = members().filter(|texel| !texel.is_hidden());
        let first = open.next()?;
        let mut positions = Vec::new();
        members().for_each(|texel| positions_of(self.scene, texel, &mut positions));
        let area = area(self.scene, first.triangle, &positions)?;
        if !members().all(|texel| shows_plane(self.scene, texel, first.triangle)) {
            return None;
        }
        let lamp = |&node: &u32| {
            let emitters = self.sources.emitters_of(node);
            if emitters.len() > MAX_EMITTERS {
                return None;
            }
            let mut found = Vec::new();
            for &emitter in emitters {
                if self.scene.stop.is_cancelled() {
                    return None;
                }
                if let Some(shaft) = self.shaft(&area, emitter) {
                    found.push((emitter, shaft.triangles(self.scene, MAX_BLOCKERS)?));
                }
            }
            Some(TileLampOccluders { node, emitters: found })
        };
        let lamps = cut.lamps.iter().filter_map(lamp).collect();
        let lights = visibilities(self.sources, &cut.lights, &area, first.side(self.scene));
        Some(TileOccluders { lamps, lights, asked: None })
    }

    /// Lamps that have samples of their own in blocks in most of whose tiles it is not known what may stand before them: a texel of the block,
    /// by its place, and the lamp.
    pub fn unresolved(&self, cuts: &LightCuts) -> Vec<(u32, u32)> {
        // Of each block its tiles, and of each lamp there those that leave it open.
        let mut tiles: BTreeMap<u32, u32> = BTreeMap::new();
        let mut open: BTreeMap<(u32, u32), (u32, u32)> = BTreeMap::new();
        for (tile, asked) in self.tiles.iter().filter_map(|tile| Some((tile, tile.asked?))) {
            let block = cuts.block(asked as usize);
            *tiles.entry(block).or_default() += 1;
            // Where all lamps have samples of their own the sum over them is exact, and only what is hidden of it is left to rays.
            let cut = cuts.of(asked as usize);
            for &lamp in cut.lamps.iter().filter(|_| !cut.has_all_lamps) {
                if tile.lamps.iter().all(|occluders| occluders.node != lamp) {
                    open.entry((block, lamp)).or_insert((asked, 0)).1 += 1;
                }
            }
        }
        let most = |((block, lamp), (asked, count)): ((u32, u32), (u32, u32))| {
            (2 * count > tiles[&block]).then_some((asked, lamp))
        };
        open.into_iter().filter_map(most).collect()
    }

    /// What may stand between a texel, by its number, and those of the sources for which that is known.
    pub fn visibility(&self, place: usize, texel: &Texel) -> Visibility<'_> {
        // Asked for by lights alone.
        let square = if self.sources.lights.is_empty() { None } else { square(self.scene, texel) };
        let Some(&tile) = self.tile_of.get(place) else {
            return Visibility { square, ..Visibility::UNKNOWN };
        };
        let tile = &self.tiles[tile as usize];
        let (mut own, mut positions) = (None, Vec::new());
        let one = |tile_lamp: &TileLampOccluders| {
            if tile_lamp.emitters.iter().all(|(_, blockers)| blockers.is_empty()) {
                return Some(LampOccluders { node: tile_lamp.node, emitters: Vec::new() });
            }
            if own.is_none() {
                positions_of(self.scene, texel, &mut positions);
                own = area(self.scene, texel.triangle, &positions);
            }
            let area = own?;
            let narrowed = |(emitter, blockers): &(u32, Vec<u32>)| {
                let shaft = self.shaft(&area, *emitter)?;
                let corners = blockers.iter().filter_map(|&index| {
                    let triangle = &self.scene.triangles[index as usize];
                    let corners = triangle.corners.map(|corner| corner.as_dvec3());
                    shaft.may_meet(&corners, f64::from(triangle.extent)).then_some(corners)
                });
                Some((*emitter, corners.collect()))
            };
            let emitters: Vec<(u32, Vec<_>)> = tile_lamp.emitters.iter().filter_map(narrowed).collect();
            let clear = emitters.iter().all(|(_, blockers)| blockers.is_empty());
            Some(LampOccluders { node: tile_lamp.node, emitters: if clear { Vec::new() } else { emitters } })
        };
        let lamps = tile.lamps.iter().filter_map(one).collect();
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

/// What a texel on a plane shows of it.
fn receiver_shape(scene: &BakeScene, texel: &Texel) -> ReceiverShape {
    let mut positions = Vec::new();
    positions_of(scene, texel, &mut positions);
    let place = |position: &Vec3| position.as_dvec3();
    match (&texel.footprint, &positions[..]) {
        (Footprint::Whole(_), [a, b, d, c]) => ReceiverShape::Parallelogram([a, b, c, d].map(place)),
        _ => ReceiverShape::Points(positions.iter().map(place).collect()),
    }
}

/// Of the distance that two corners of a texel have, how far its points may lie from the square of its triangle.
const FLAT: f32 = 1e-3;

/// The corners of a texel whose square is filled by one triangle, or by several as if they were one.
fn square(scene: &BakeScene, texel: &Texel) -> Option<[DVec3; 4]> {
    let triangle = &scene.triangles[texel.triangle as usize];
    let corner = Vec2::new(texel.x as f32, texel.y as f32);
    let place = |offset: Vec2| barycentric(triangle, corner + offset).map(|(u, v)| triangle.position(u, v));
    let corners = [place(Vec2::ZERO)?, place(Vec2::X)?, place(Vec2::ONE)?, place(Vec2::Y)?];
    let near = FLAT * corners[0].distance(corners[2]);
    let fills = match &texel.footprint {
        Footprint::Whole(_) => true,
        Footprint::Points(points) => {
            let on_square = |point: &FootprintPoint| {
                let (u, v) = point.at;
                let found = scene.triangles[point.triangle as usize].position(u, v);
                place(point.offset).is_some_and(|place| place.distance(found) <= near)
            };
            points.len() == GRID && points.iter().all(on_square)
        }
        Footprint::Hidden => false,
    };
    fills.then(|| corners.map(|corner| corner.as_dvec3()))
}

/// Most triangles that may stand before an emitter, and most emitters of a lamp: beyond, rays are quicker.
const MAX_BLOCKERS: usize = 32;
const MAX_EMITTERS: usize = 8;
