//! Finds vertices with equal positions: files split vertices for normals and texture coordinates where the
//! surface itself is connected. There is no tolerance: positions must be bitwise equal, except that -0 equals
//! 0.

use std::collections::HashMap;

use glam::Vec3;

/// For every vertex, the index of the first vertex at the same position.
pub fn weld_positions(positions: &[Vec3]) -> Vec<u32> {
    let mut first = HashMap::with_capacity(positions.len());
    positions
        .iter()
        .zip(0u32..)
        // Adding 0 turns -0 into 0.
        .map(|(position, index)| {
            *first.entry((*position + 0.0).to_array().map(f32::to_bits)).or_insert(index)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_positions_become_one() {
        let positions = [Vec3::ZERO, Vec3::X, -Vec3::ZERO, Vec3::X, Vec3::X.with_x(1.0 + f32::EPSILON)];
        assert_eq!(weld_positions(&positions), [0, 1, 0, 1, 4]);
    }
}
