//! Which sides of surfaces can never be seen: the inside of a closed mesh. Not which points lie inside: rays tell.

use std::collections::HashMap;

use glam::Vec3;

use crate::disjoint_sets::DisjointSets;

/// For each triangle, its connected piece if that is closed: every directed edge has one that runs back.
/// Vertices are the same where their coordinates are, bit by bit.
pub(crate) fn closed_pieces(triangles: &[[Vec3; 3]]) -> Vec<Option<u32>> {
    let mut vertices: HashMap<[u32; 3], u32> = HashMap::new();
    let corners: Vec<[u32; 3]> = triangles
        .iter()
        .map(|triangle| {
            triangle.map(|position| {
                // -0 and 0 are one place.
                let key = (position + Vec3::ZERO).to_array().map(f32::to_bits);
                let next = vertices.len() as u32;
                *vertices.entry(key).or_insert(next)
            })
        })
        .collect();
    let mut pieces = DisjointSets::new(vertices.len());
    let mut balance: HashMap<(u32, u32), i32> = HashMap::new();
    for &[a, b, c] in &corners {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            pieces.join(from, to);
            *balance.entry((from.min(to), from.max(to))).or_default() += if from < to { 1 } else { -1 };
        }
    }
    let mut closed = vec![true; vertices.len()];
    for (&(vertex, _), &sum) in &balance {
        if sum != 0 {
            closed[pieces.find(vertex) as usize] = false;
        }
    }
    let piece = |&[a, ..]: &[u32; 3]| {
        let piece = pieces.find(a);
        closed[piece as usize].then_some(piece)
    };
    corners.iter().map(piece).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_closed_a_sheet_is_not() {
        let mesh = lumbre_mesh::shapes::cuboid(Vec3::ONE, 2);
        let mut triangles = mesh.triangle_positions().unwrap();
        let closed = triangles.len();
        let far = Vec3::splat(9.0);
        triangles.push([far, far + Vec3::X, far + Vec3::Y]);
        let found = closed_pieces(&triangles);
        assert!(found[..closed].iter().all(Option::is_some));
        assert!(found[closed].is_none());
        triangles.remove(0);
        assert!(closed_pieces(&triangles).iter().all(Option::is_none));
    }
}
