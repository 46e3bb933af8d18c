//! Rooms: closed pieces of a mesh whose fronts face inward. Closed pieces whose fronts face outward are solids.

use glam::{DVec3, Vec3};

use crate::bounds::Bounds;

/// A closed piece of a mesh whose fronts face inward.
#[derive(Clone, Debug)]
pub(crate) struct Room {
    bounds: Bounds<Vec3>,
    /// The planes of a convex room: inward unit normals with their distance from the coordinate origin. Empty if the
    /// room is not convex or has more than [`MAX_SIDES`] triangles.
    sides: Vec<(DVec3, f64)>,
}

/// Distance up to which things count as touching, relative to their coordinates.
const TOUCHING: f32 = 64.0 / (1 << 24) as f32;
/// Most triangles of a room whose planes are stored.
const MAX_SIDES: usize = 256;

impl Room {
    fn new(triangles: &[[Vec3; 3]], bounds: Bounds<Vec3>) -> Self {
        let mut room = Self { bounds, sides: Vec::new() };
        if triangles.len() <= MAX_SIDES {
            let side = |corners: &[Vec3; 3]| {
                let [a, b, c] = corners.map(|corner| corner.as_dvec3());
                let normal = (b - a).cross(c - a).try_normalize()?;
                Some((normal, normal.dot(a)))
            };
            room.sides = triangles.iter().filter_map(side).collect();
            if !triangles.iter().flatten().all(|&corner| room.contains(corner)) {
                room.sides.clear();
            }
        }
        room
    }

    /// Distance that counts as touching, in canonical units.
    fn slack(&self) -> f32 {
        TOUCHING * self.bounds.low.abs().max(self.bounds.high.abs()).max_element()
    }

    /// Whether a point is inside the room or on its sides; `false` also where this is unknown, because no planes are
    /// stored.
    pub fn contains(&self, point: Vec3) -> bool {
        let (place, slack) = (point.as_dvec3(), f64::from(self.slack()));
        !self.sides.is_empty()
            && self.sides.iter().all(|(normal, height)| normal.dot(place) >= height - slack)
    }

    /// Whether all three corners lie in the room's bounding box.
    fn spans(&self, corners: &[Vec3; 3]) -> bool {
        let Bounds { low, high } = self.bounds;
        corners.iter().all(|corner| corner.cmpge(low).all() && corner.cmple(high).all())
    }

    /// Whether the room's bounding box lies within another box, or touches it from inside.
    pub fn is_within(&self, outer: Bounds<Vec3>) -> bool {
        let slack = self.slack();
        (outer.low - slack).cmple(self.bounds.low).all() && (outer.high + slack).cmpge(self.bounds.high).all()
    }
}

/// A closed piece of a mesh, with its number and bounding box.
pub(crate) struct ClosedShell {
    pub number: u32,
    pub bounds: Bounds<Vec3>,
    /// Present if its fronts face inward.
    pub room: Option<Room>,
}

/// The closed pieces in ascending order of their numbers. `pieces` gives for each triangle the number of its closed
/// piece, if any.
pub(crate) fn closed_shells(triangles: &[[Vec3; 3]], pieces: &[Option<u32>]) -> Vec<ClosedShell> {
    let mut order: Vec<(u32, usize)> =
        pieces.iter().enumerate().filter_map(|(index, piece)| Some(((*piece)?, index))).collect();
    order.sort_unstable();
    let piece = |same: &[(u32, usize)]| {
        let corners: Vec<[Vec3; 3]> = same.iter().map(|&(_, index)| triangles[index]).collect();
        let origin = corners[0][0].as_dvec3();
        // Six times the signed volume: negative where the fronts face inward.
        let mut volume = 0.0;
        for corners in &corners {
            let [a, b, c]: [DVec3; 3] = corners.map(|corner| corner.as_dvec3() - origin);
            volume += a.dot(b.cross(c));
        }
        let bounds = corners.iter().flatten().copied().collect();
        let room = (volume < 0.0).then(|| Room::new(&corners, bounds));
        ClosedShell { number: same[0].0, bounds, room }
    };
    order.chunk_by(|a, b| a.0 == b.0).map(piece).collect()
}

/// Whether every triangle lies within the bounding box of some room.
pub(crate) fn all_within(rooms: &[Room], triangles: impl Iterator<Item = [Vec3; 3]>) -> bool {
    let mut last = 0;
    for corners in triangles {
        // Usually the same room as for the previous triangle.
        if rooms.get(last).is_some_and(|room| room.spans(&corners)) {
            continue;
        }
        match rooms.iter().position(|room| room.spans(&corners)) {
            Some(room) => last = room,
            None => return false,
        }
    }
    !rooms.is_empty()
}

#[cfg(test)]
mod tests {
    use super::super::hidden_side::closed_pieces;
    use super::*;

    fn rooms_of(triangles: &[[Vec3; 3]]) -> Vec<Room> {
        closed_shells(triangles, &closed_pieces(triangles))
            .into_iter()
            .filter_map(|piece| piece.room)
            .collect()
    }

    #[test]
    fn a_room_is_a_closed_piece_that_looks_inward() {
        let block = lumbre_mesh::shapes::cuboid(Vec3::ONE, 1).triangle_positions().unwrap();
        let room: Vec<[Vec3; 3]> = block.iter().map(|&[a, b, c]| [a * 4.0, c * 4.0, b * 4.0]).collect();
        assert!(rooms_of(&block).is_empty());
        let both = [room.clone(), block].concat();
        let rooms = rooms_of(&both);
        assert_eq!(
            (rooms.len(), rooms[0].bounds),
            (1, Bounds { low: Vec3::splat(-2.0), high: Vec3::splat(2.0) })
        );
        assert!(all_within(&rooms, both.iter().copied()));
        assert!(!all_within(&rooms, std::iter::once([Vec3::ZERO, Vec3::X, Vec3::Y * 3.0])));
        assert!(!all_within(&rooms_of(&both[1..]), room.iter().copied()));
    }

    #[test]
    fn a_convex_room_knows_which_points_it_contains_and_another_does_not() {
        let turn = glam::Quat::from_rotation_y(0.6);
        let block = lumbre_mesh::shapes::cuboid(Vec3::splat(4.0), 1).triangle_positions().unwrap();
        let convex: Vec<[Vec3; 3]> = block.iter().map(|&[a, b, c]| [a, c, b].map(|p| turn * p)).collect();
        let room = &rooms_of(&convex)[0];
        let inside = [Vec3::ZERO, Vec3::splat(1.9), Vec3::new(2.0, 0.0, 0.3)].map(|point| turn * point);
        assert!(inside.into_iter().all(|point| room.contains(point)));
        // In the room's bounding box, but outside of the room.
        let beside = Vec3::new(2.5, 0.0, 2.5);
        assert!(room.spans(&[beside; 3]) && !room.contains(beside));
        // The same room with one corner pushed in is not convex.
        let dented: Vec<[Vec3; 3]> = convex
            .iter()
            .map(|corners| {
                corners.map(|p| if p.distance(turn * Vec3::splat(2.0)) < 1e-3 { p * 0.2 } else { p })
            })
            .collect();
        let dented = &rooms_of(&dented)[0];
        assert!(!dented.contains(Vec3::ZERO));
        let smaller = Bounds { low: room.bounds.low * 0.9, ..room.bounds };
        assert!(room.is_within(room.bounds) && !room.is_within(smaller));
    }
}
