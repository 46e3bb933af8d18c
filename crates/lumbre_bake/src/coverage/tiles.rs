//! Tiles of texels that show one flat triangle: what is true of all of a tile is found once. Not what is found.

use std::collections::HashMap;

use glam::{DVec2, DVec3, Vec3};

use super::footprint::{Footprint, Texel};
use crate::scene::BakeScene;
use crate::visibility::shaft::{Area, contact};

/// Texels along a tile's side.
const SIDE: u32 = 8;

/// Covered texels by tiles.
#[derive(Default)]
pub(crate) struct Tiles {
    /// Of each tile, the numbers of its texels.
    pub members: Vec<Vec<u32>>,
    /// The tile of each covered texel.
    pub tile_of: Vec<u32>,
}

impl Tiles {
    /// Of texels that are ordered by maps and rows.
    pub fn new(texels: &[Texel]) -> Self {
        let mut numbers: HashMap<Key, u32> = HashMap::new();
        let mut tiles = Self { members: Vec::new(), tile_of: Vec::with_capacity(texels.len()) };
        let mut last: Option<(Key, u32)> = None;
        for (place, texel) in texels.iter().enumerate() {
            let key = (texel.object, texel.y / SIDE, texel.x / SIDE, texel.triangle);
            let number = match last {
                Some((known, number)) if known == key => number,
                _ => *numbers.entry(key).or_insert_with(|| {
                    tiles.members.push(Vec::new());
                    tiles.members.len() as u32 - 1
                }),
            };
            last = Some((key, number));
            tiles.members[number as usize].push(place as u32);
            tiles.tile_of.push(number);
        }
        tiles
    }
}

/// Map, row and column of a tile, and the triangle.
type Key = (u32, u32, u32, u32);

/// Places whose hull holds all that a texel shows.
pub(crate) fn positions_of(scene: &BakeScene, texel: &Texel, positions: &mut Vec<Vec3>) {
    let mut add = |triangle: u32, (u, v)| positions.push(scene.triangles[triangle as usize].position(u, v));
    match &texel.footprint {
        Footprint::Whole(_) => {
            for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
                if let Some(point) = texel.point(scene, x, y) {
                    add(point.triangle, point.at);
                }
            }
        }
        Footprint::Points(points) => points.iter().for_each(|point| add(point.triangle, point.at)),
        Footprint::Hidden => {}
    }
}

/// Whether all that a texel shows is flat and looks where a triangle looks.
pub(crate) fn shows_plane(scene: &BakeScene, texel: &Texel, triangle: u32) -> bool {
    let normal = scene.triangles[triangle as usize].normal;
    let same = |index: u32| {
        let other = &scene.triangles[index as usize];
        index == triangle || (other.flat && other.normal.dot(normal) > 0.9999)
    };
    match &texel.footprint {
        Footprint::Whole(own) => same(*own),
        Footprint::Points(points) => points.iter().all(|point| same(point.triangle)),
        Footprint::Hidden => true,
    }
}

/// A rectangle on a flat triangle around places on it; none where they are not in its plane.
pub(crate) fn area(scene: &BakeScene, triangle: u32, positions: &[Vec3]) -> Option<Area> {
    let triangle = &scene.triangles[triangle as usize];
    let (origin, normal) = (triangle.corners[0].as_dvec3(), triangle.normal.as_dvec3().try_normalize()?);
    if !triangle.flat || positions.is_empty() {
        return None;
    }
    // Along the map's rows, and across.
    let [p, q, r] = triangle.corners.map(|corner| corner.as_dvec3());
    let [a, b, c] = triangle.uv;
    let row = (q - p) * f64::from((c - a).y) - (r - p) * f64::from((b - a).y);
    let row = (row - normal * row.dot(normal)).try_normalize()?;
    let across = normal.cross(row);
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for position in positions {
        let position = position.as_dvec3() - origin;
        if position.dot(normal).abs() > contact(normal, f64::from(triangle.extent)) {
            return None;
        }
        let flat = DVec2::new(position.dot(row), position.dot(across));
        (low, high) = (low.min(flat), high.max(flat));
    }
    let corner = |x: f64, y: f64| -> DVec3 { origin + row * x + across * y };
    let corners =
        [corner(low.x, low.y), corner(high.x, low.y), corner(high.x, high.y), corner(low.x, high.y)];
    Some(Area { corners, normal })
}
