//! Counts rays that leak: those that end on the black back of a surface or inside something closed, and those that leave a
//! scene that is closed on all sides. Not their repair: `texels::hidden` takes out what lies inside geometry, before.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::{DVec3, Vec3};

/// Counters that threads share without waiting for each other.
const SHARDS: usize = 16;

/// A counter on a cache line of its own.
#[derive(Debug, Default)]
#[repr(align(64))]
struct Shard(AtomicU64);

/// Counts rays that leak.
#[derive(Debug, Default)]
pub(crate) struct Leaks {
    shards: [Shard; SHARDS],
    /// Whether rooms that are closed on all sides hold the whole scene: no ray should leave it.
    pub closed_scene: bool,
}

impl Leaks {
    /// For a scene that is closed on all sides, or not.
    pub fn new(closed_scene: bool) -> Self {
        Self { closed_scene, ..Self::default() }
    }

    /// Counts a ray.
    pub fn note(&self) {
        let thread = rayon::current_thread_index().unwrap_or(0) % SHARDS;
        self.shards[thread].0.fetch_add(1, Ordering::Relaxed);
    }

    /// Rays counted so far: exact where no thread is casting.
    pub fn count(&self) -> u64 {
        self.shards.iter().map(|shard| shard.0.load(Ordering::Relaxed)).sum()
    }
}

/// A box.
pub(crate) type Extent = (Vec3, Vec3);

/// The closed pieces that look inward, with their extents: rooms. `pieces` names the closed piece of each triangle, if any.
pub(crate) fn rooms(triangles: &[[Vec3; 3]], pieces: &[Option<u32>]) -> Vec<(u32, Extent)> {
    let mut order: Vec<(u32, usize)> =
        pieces.iter().enumerate().filter_map(|(index, piece)| Some(((*piece)?, index))).collect();
    order.sort_unstable();
    let piece = |same: &[(u32, usize)]| {
        let origin = triangles[same[0].1][0].as_dvec3();
        let (mut low, mut high, mut volume) = (Vec3::INFINITY, Vec3::NEG_INFINITY, 0.0);
        for &(_, index) in same {
            let [a, b, c]: [DVec3; 3] = triangles[index].map(|corner| corner.as_dvec3() - origin);
            volume += a.dot(b.cross(c));
            for corner in triangles[index] {
                (low, high) = (low.min(corner), high.max(corner));
            }
        }
        (volume < 0.0).then_some((same[0].0, (low, high)))
    };
    order.chunk_by(|a, b| a.0 == b.0).filter_map(piece).collect()
}

/// Whether every triangle lies within some room's extent.
pub(crate) fn all_within(rooms: &[Extent], triangles: impl Iterator<Item = [Vec3; 3]>) -> bool {
    let mut last = 0;
    let within = |room: &Extent, corners: &[Vec3; 3]| {
        corners.iter().all(|corner| corner.cmpge(room.0).all() && corner.cmple(room.1).all())
    };
    for corners in triangles {
        // Mostly the one before.
        if rooms.get(last).is_some_and(|room| within(room, &corners)) {
            continue;
        }
        match rooms.iter().position(|room| within(room, &corners)) {
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

    #[test]
    fn a_room_is_a_closed_piece_that_looks_inward() {
        let block = lumbre_mesh::shapes::cuboid(Vec3::ONE, 1).triangle_positions().unwrap();
        let room: Vec<[Vec3; 3]> = block.iter().map(|&[a, b, c]| [a * 4.0, c * 4.0, b * 4.0]).collect();
        let found = |triangles: &[[Vec3; 3]]| -> Vec<Extent> {
            rooms(triangles, &closed_pieces(triangles)).into_iter().map(|(_, extent)| extent).collect()
        };
        assert!(found(&block).is_empty());
        let both = [room.clone(), block].concat();
        assert_eq!(found(&both), [(Vec3::splat(-2.0), Vec3::splat(2.0))]);
        assert!(all_within(&found(&both), both.iter().copied()));
        assert!(!all_within(&found(&both), std::iter::once([Vec3::ZERO, Vec3::X, Vec3::Y * 3.0])));
        assert!(!all_within(&found(&room[1..]), room.iter().copied()));
    }
}
