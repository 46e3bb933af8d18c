//! Bounds of what is read from irradiance volumes.

use glam::{DVec3, DVec4};
use lumbre_optics::{self as optics, MIN_OPENNESS};

use super::{FLUSHED, U};

/// ambient_cube: 4 u of the terms of both sums, the error of the openness times the result, and 5 u of the
/// quotient.
pub fn ambient_cube(normal: DVec3, sides: [DVec4; 3]) -> DVec3 {
    let weights = normal * normal;
    let terms: DVec4 = (0..3).map(|axis| weights[axis] * sides[axis].abs()).sum();
    let of_sum = 4.0 * U * terms
        + DVec4::splat(6.0 * FLUSHED * (1.0 + sides.iter().map(|s| s.abs().max_element()).sum::<f64>()));
    let openness: f64 = (0..3).map(|axis| weights[axis] * sides[axis].w).sum();
    let result = optics::ambient_cube(normal, sides[0], sides[1], sides[2]).abs();
    (of_sum.truncate() + result * of_sum.w) / openness.max(MIN_OPENNESS)
        + 5.0 * U * result
        + DVec3::splat(FLUSHED)
}

/// probe_grid_cell: 2 u of |point scale| + |offset|, and the rounding of the last cell's centre.
pub fn probe_grid_cell(point: DVec3, scale: DVec3, offset: DVec3, resolution: DVec3) -> DVec3 {
    2.0 * U * ((point * scale).abs() + offset.abs()) + U * resolution + DVec3::splat(2.0 * FLUSHED)
}

/// probe_grid_texel: 8 u of the result: a product, a sum, the denominator, and the quotient's 5 u.
pub fn probe_grid_texel(cell: DVec3, resolution: DVec3, axis: f64, negative: bool) -> DVec3 {
    8.0 * U * optics::probe_grid_texel(cell, resolution, axis, negative).abs() + DVec3::splat(FLUSHED)
}
