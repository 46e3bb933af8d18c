//! The order in which the children of a node are visited: front to back, by the octant of the ray's direction. The
//! box test is in `wide_node`.
//!
//! Ylitie, Karras, Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017,
//! section 3.2: children are assigned to lanes so that lane ^ octant increases along the ray.

use glam::Vec3;

/// `ORDER[octant][lanes]`: bit i is bit i ^ octant of `lanes`.
static ORDER: [[u8; 256]; 8] = order();

const fn order() -> [[u8; 256]; 8] {
    let mut table = [[0; 256]; 8];
    let mut octant = 0;
    while octant < 8 {
        let mut lanes = 0;
        while lanes < 256 {
            let mut bit = 0;
            while bit < 8 {
                if lanes >> (bit ^ octant) & 1 == 1 {
                    table[octant][lanes] |= 1 << bit;
                }
                bit += 1;
            }
            lanes += 1;
        }
        octant += 1;
    }
    table
}

/// Returns `lanes` (one bit per lane) in visiting order: the lowest bit is visited first and stands for lane bit ^
/// octant.
#[inline(always)]
pub(crate) fn visits(lanes: u32, octant: u32) -> u32 {
    u32::from(ORDER[octant as usize & 7][lanes as usize & 255])
}

/// Returns the octant of a direction: one bit per axis, set where it is negative.
#[inline(always)]
pub(crate) fn octant(direction: Vec3) -> u32 {
    direction.is_negative_bitmask() & 7
}

/// Assigns a lane to each of up to eight children by their centres, greedily: first the best pair of child and
/// lane, then the best of the remaining ones.
pub(crate) fn lanes(centres: &[Vec3]) -> Vec<usize> {
    let middle = centres.iter().sum::<Vec3>() / centres.len().max(1) as f32;
    let mut pairs = Vec::with_capacity(centres.len() * 8);
    for (child, &centre) in centres.iter().enumerate() {
        for lane in 0..8 {
            // A ray in the octant of this number visits the lane first, so its child should be the farthest against
            // that direction.
            let sign = |axis: usize| if lane >> axis & 1 == 1 { -1.0 } else { 1.0 };
            let along = Vec3::new(sign(0), sign(1), sign(2));
            pairs.push(((centre - middle).dot(along), child, lane));
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut found = vec![usize::MAX; centres.len()];
    let mut taken = [false; 8];
    for (_, child, lane) in pairs {
        if found[child] == usize::MAX && !taken[lane] {
            found[child] = lane;
            taken[lane] = true;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn children_at_the_corners_are_visited_front_to_back() {
        let corners: Vec<Vec3> =
            (0..8).map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32)).collect();
        let lanes = lanes(&corners);
        for direction in [Vec3::ONE, Vec3::new(-1.0, 1.0, 1.0), Vec3::new(1.0, -2.0, -3.0), Vec3::NEG_ONE] {
            let octant = octant(direction);
            let signs = direction.signum();
            let mut waiting = visits(255, octant);
            let mut path = Vec::new();
            while waiting != 0 {
                let lane = (waiting.trailing_zeros() ^ octant) as usize;
                waiting &= waiting - 1;
                path.push(lanes.iter().position(|&l| l == lane).expect("eight children in eight lanes"));
            }
            // On each axis the nearer half comes before the farther half if the other axes are equal.
            for (i, &a) in path.iter().enumerate() {
                for &b in &path[..i] {
                    let step = (corners[a] - corners[b]) * signs;
                    assert!(step.max_element() > 0.0, "{a} after {b} towards {direction}");
                }
            }
        }
    }
}
