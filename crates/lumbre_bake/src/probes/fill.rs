//! Fills the probes inside geometry with the mean of their neighbours outside, so that interpolation next to a wall
//! does not mix in the darkness within it. Which probes are inside is found in `light`.

use glam::{IVec3, UVec3};
use lumbre_scene::AmbientCube;

/// Steps to the neighbours across the faces of a cell.
const NEIGHBOURS: [IVec3; 6] = [IVec3::X, IVec3::NEG_X, IVec3::Y, IVec3::NEG_Y, IVec3::Z, IVec3::NEG_Z];

/// Fills the cells that are not valid, ring by ring starting from the valid ones; leaves everything as it is if no cell
/// is valid.
pub(crate) fn fill(resolution: UVec3, valid: &[bool], cubes: &mut [AmbientCube]) {
    let size = resolution.as_ivec3();
    let index = |cell: IVec3| ((cell.z * size.y + cell.y) * size.x + cell.x) as usize;
    let cell = |index: usize| {
        let index = index as i32;
        IVec3::new(index % size.x, index / size.x % size.y, index / (size.x * size.y))
    };
    let mut known = valid.to_vec();
    let mut unknown: Vec<usize> = (0..known.len()).filter(|&at| !known[at]).collect();
    while !unknown.is_empty() {
        // A ring reads earlier rings only, so that the order of its cells does not matter.
        let ring: Vec<(usize, AmbientCube)> = unknown
            .iter()
            .filter_map(|&at| {
                let (mut sum, mut count) = (AmbientCube::default(), 0.0f32);
                for step in NEIGHBOURS {
                    let neighbour = cell(at) + step;
                    let is_in_grid = neighbour.cmpge(IVec3::ZERO).all() && neighbour.cmplt(size).all();
                    if is_in_grid && known[index(neighbour)] {
                        for (sum, side) in sum.0.iter_mut().zip(cubes[index(neighbour)].0) {
                            *sum += side;
                        }
                        count += 1.0;
                    }
                }
                (count > 0.0).then(|| (at, AmbientCube(sum.0.map(|side| side / count))))
            })
            .collect();
        if ring.is_empty() {
            return;
        }
        for (at, cube) in ring {
            cubes[at] = cube;
            known[at] = true;
        }
        unknown.retain(|&at| !known[at]);
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn rings_grow_from_the_valid_cells() {
        // One row: 8 | ? ? ? | 2, and a second row without valid cells.
        let cube = |value: f32| AmbientCube([Vec3::splat(value); 6]);
        let valid = [true, false, false, false, true, false, false, false, false, false];
        let mut cubes: Vec<AmbientCube> = valid.iter().map(|_| cube(100.0)).collect();
        (cubes[0], cubes[4]) = (cube(8.0), cube(2.0));
        fill(UVec3::new(5, 1, 2), &valid, &mut cubes);
        let values: Vec<f32> = cubes.iter().map(|cube| cube.0[3].y).collect();
        assert_eq!(values[..5], [8.0, 8.0, 5.0, 2.0, 2.0]);
        // The ends of the second row are filled in the first ring, the others in later ones.
        assert_eq!((values[5], values[6], values[8], values[9]), (8.0, 8.0, 2.0, 2.0));
        assert_eq!(values[7], (5.0 + 8.0 + 2.0) / 3.0);

        let mut dark = vec![cube(0.0); 4];
        fill(UVec3::new(4, 1, 1), &[false; 4], &mut dark);
        assert_eq!(dark, vec![cube(0.0); 4]);
    }
}
