//! Finds the sides of surfaces that can never be seen: the insides of closed meshes. Whether a point lies inside a mesh
//! is decided by rays (`occlusion`).

use std::collections::HashMap;

use glam::Vec3;

use super::position_bits;
use crate::disjoint_sets::DisjointSets;

/// For each triangle, the number of its connected piece if that piece is closed, that is, if every directed edge is
/// matched by one in the opposite direction. Vertices count as the same if their coordinates are equal bit for bit.
pub(crate) fn closed_pieces(triangles: &[[Vec3; 3]]) -> Vec<Option<u32>> {
    let mut vertices: HashMap<[u32; 3], u32> = HashMap::new();
    let corners: Vec<[u32; 3]> = triangles
        .iter()
        .map(|triangle| {
            triangle.map(|position| {
                let next = vertices.len() as u32;
                *vertices.entry(position_bits(position)).or_insert(next)
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
        let pieces = closed_pieces(&triangles);
        assert!(pieces[..closed].iter().all(Option::is_some));
        assert!(pieces[closed].is_none());
        triangles.remove(0);
        assert!(closed_pieces(&triangles).iter().all(Option::is_none));
    }
}
