//! Finds triangles that coincide exactly with another of the same orientation, so that light interacts with only one of
//! them: the emitter if one emits, else the first. Triangles of opposite orientation are the two faces of a sheet, and
//! both stay.

use std::collections::HashMap;

use glam::Vec3;

use super::position_bits;

/// For each triangle, whether a coincident one replaces it. `emits` says which triangles emit light.
pub(crate) fn is_hidden_duplicate(triangles: &[[Vec3; 3]], emits: &[bool]) -> Vec<bool> {
    let mut first: HashMap<[[u32; 3]; 3], usize> = HashMap::with_capacity(triangles.len());
    let mut is_hidden_duplicate = vec![false; triangles.len()];
    for (index, triangle) in triangles.iter().enumerate() {
        let keys = triangle.map(position_bits);
        // Rotating the corners so that the smallest comes first keeps the winding.
        let smallest = (0..3).min_by_key(|&i| keys[i]).unwrap_or(0);
        let key = [keys[smallest], keys[(smallest + 1) % 3], keys[(smallest + 2) % 3]];
        match first.get(&key).copied() {
            None => {
                first.insert(key, index);
            }
            Some(earlier) if emits[index] && !emits[earlier] => {
                is_hidden_duplicate[earlier] = true;
                first.insert(key, index);
            }
            Some(_) => is_hidden_duplicate[index] = true,
        }
    }
    is_hidden_duplicate
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_emitter_wins_else_the_first() {
        let t = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let rotated = [Vec3::X, Vec3::Y, Vec3::ZERO];
        let back = [Vec3::X, Vec3::ZERO, Vec3::Y];
        assert_eq!(is_hidden_duplicate(&[t, rotated, back], &[false; 3]), [false, true, false]);
        assert_eq!(is_hidden_duplicate(&[t, rotated, back], &[false, true, false]), [true, false, false]);
    }
}
