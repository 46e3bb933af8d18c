//! A grid of probes: the position of a point in it, and where a texture holds the sides of its ambient cubes. Their
//! light is not computed here.
//!
//! Probes are at the centres of cells. The texture is laid out like Bevy's `IrradianceVolume`: (Rx, 2 Ry, 3 Rz)
//! texels for Rx x Ry x Rz cells. The sides that face along an axis come behind (in z) those of the previous axis,
//! and the negative sides come below (in y) the positive ones.

use glam::DVec3;

/// Returns the position of a point in cells: 0.5 at the first probe of an axis, 1.5 at the second. A point outside
/// the box of probes is clamped to the nearest point of that box, so that the light has no edge where the grid
/// ends.
///
/// `scale` (cells per metre, negative where the grid is mirrored) and `offset` (cells) transform the point to
/// cells; `resolution` is the number of cells along each axis, at least 1.
///
/// # Error of the f32 twin
///
/// 2 u of |point scale| + |offset|, plus u of the resolution, from the clamp to the centre of the last cell.
pub fn probe_grid_cell(point: DVec3, scale: DVec3, offset: DVec3, resolution: DVec3) -> DVec3 {
    (point * scale + offset).max(DVec3::splat(0.5)).min(resolution - DVec3::splat(0.5))
}

/// Returns the texture coordinates, from 0 to 1, at which a linear filter interpolates the sides of the probes
/// around a cell: those that face along an axis (0, 1 or 2), or against it if `negative`. Within
/// [`probe_grid_cell`]'s range the filter reads no texel of another side.
///
/// # Error of the f32 twin
///
/// 8 u of the result: a product, a sum, the denominator, and 5 u of the quotient.
pub fn probe_grid_texel(cell: DVec3, resolution: DVec3, axis: f64, negative: bool) -> DVec3 {
    let row = cell.y + if negative { resolution.y } else { 0.0 };
    let slice = cell.z + axis * resolution.z;
    DVec3::new(cell.x, row, slice) / (resolution * DVec3::new(1.0, 2.0, 3.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_of_a_box_are_half_a_cell_outside_of_the_probes() {
        // Four cells from x = -1 to 1.
        let cell = |x: f64| {
            probe_grid_cell(DVec3::splat(x), DVec3::splat(2.0), DVec3::splat(2.0), DVec3::splat(4.0)).x
        };
        assert_eq!([-9.0, -1.0, -0.75, 0.0, 0.75, 1.0, 9.0].map(cell), [0.5, 0.5, 0.5, 2.0, 3.5, 3.5, 3.5]);
    }

    #[test]
    fn one_cell_is_the_same_everywhere() {
        let cell = probe_grid_cell(DVec3::new(3.0, -8.0, 0.1), DVec3::ONE, DVec3::ZERO, DVec3::ONE);
        assert_eq!(cell, DVec3::splat(0.5));
        let texel = probe_grid_texel(cell, DVec3::ONE, 2.0, true);
        assert_eq!(texel, DVec3::new(0.5, 0.75, 2.5 / 3.0));
    }

    #[test]
    fn sides_lie_behind_and_below_each_other() {
        let resolution = DVec3::new(3.0, 2.0, 4.0);
        // The centre of cell (2, 1, 3) in texels of a texture of 3 x 4 x 12.
        let texel = |axis, negative| {
            probe_grid_texel(DVec3::new(2.5, 1.5, 3.5), resolution, axis, negative)
                * DVec3::new(3.0, 4.0, 12.0)
        };
        assert_eq!(texel(0.0, false), DVec3::new(2.5, 1.5, 3.5));
        assert_eq!(texel(1.0, true), DVec3::new(2.5, 3.5, 7.5));
        assert_eq!(texel(2.0, false), DVec3::new(2.5, 1.5, 11.5));
    }
}
