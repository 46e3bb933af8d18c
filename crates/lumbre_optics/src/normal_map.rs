//! Normal maps: the normal of a fragment from a texel in tangent space, and the spread of the normals that a
//! minified map averages. The tangents are made in `lumbre_mesh`; the sampling is done elsewhere.
//!
//! The tangent frame is MikkTSpace's: the bitangent is (normal x tangent) times the tangent's handedness, and none
//! of the three is normalized between the vertices and the sum (Mikkelsen 2008), so that a map looks as it did in
//! the tool that baked it. The texel is decoded as in glTF, 2 c - 1, and red and green are multiplied by the scale
//! before the sum is normalized.
//!
//! **Minified maps.** The mean of many unit normals is shorter than 1, and its length tells how much they spread:
//! for a mean of length L the variance along each axis is σ² = (1 - L)/L (Toksvig 2005), and a lobe of width α
//! convolved with them has α'² = α² + 2 σ² (as in `specular_antialiasing`). A mip level stores the direction of the
//! mean and, in its alpha channel, the root of 2 σ². Eight bits of that root resolve spreads down to those of the
//! exponent 130,000; eight bits of L would end at 500. The first level has no spread: a magnified map is smooth
//! between its texels.

use glam::{DVec3, DVec4};

use crate::normalization::{TINY_LENGTH_SQUARED, safe_normalize};

/// Squared length, relative to the interpolated normal, below which the bent normal counts as having no direction
/// and the surface's own normal is used. The texels (128, 128, 128) and (127, 127, 127), which are what eight bits
/// make of a zero vector, are below it.
pub const SHORTEST_BENT_SQUARED: f64 = 1e-4;

/// Returns the unit normal that a normal map's texel stands for.
///
/// `texel` has the three channels, 0 to 1; `tangent` is the interpolated tangent, with its handedness in `w`;
/// `normal` is the interpolated normal, which need not be unit. A texel or a tangent without a direction gives the
/// surface's own normal; a zero normal stays zero.
///
/// ```
/// use glam::{DVec3, DVec4};
/// use lumbre_optics::map_normal;
///
/// // A slope of one in one along the tangent.
/// let texel = DVec3::new(1.0, 0.5, 1.0);
/// let bent = map_normal(texel, 1.0, DVec4::new(1.0, 0.0, 0.0, 1.0), DVec3::Y);
/// assert!((bent - DVec3::new(0.5f64.sqrt(), 0.5f64.sqrt(), 0.0)).length() < 1e-15);
/// ```
///
/// # Error of the f32 twin
///
/// With A = |x s T| + |y s (N x T)| + |z N|, where each product is taken by magnitudes, the sum is off by 10 u A
/// and its direction by 20 u |A| over its length, plus 8 u. Where the sum is within rounding of having no
/// direction, it may be either normal.
pub fn map_normal(texel: DVec3, scale: f64, tangent: DVec4, normal: DVec3) -> DVec3 {
    let slope = 2.0 * texel - DVec3::ONE;
    let along = tangent.truncate();
    let bitangent = normal.cross(along) * tangent.w;
    let bent = slope.x * scale * along + slope.y * scale * bitangent + slope.z * normal;
    let squared = normal.length_squared();
    let has_direction =
        squared > TINY_LENGTH_SQUARED && bent.length_squared() > SHORTEST_BENT_SQUARED * squared;
    safe_normalize(if has_direction { bent } else { normal })
}

/// Returns the tangent for a texture whose coordinates are transformed (`KHR_texture_transform`): the texture's
/// axes rotate and mirror with the transform.
///
/// `tangent` is that of the mesh's own coordinates; `u` and `v` are the rows of the linear part of the transform.
/// The result is exact for rotations, mirrorings and scales; under a shear the two axes stay perpendicular. If `v`
/// is zero, so is the tangent.
///
/// # Error of the f32 twin
///
/// 12 u of |T| + |N x T| for each component, as all factors are at most 1. Where the determinant is within rounding
/// of 0, the sign may be either.
pub fn transformed_tangent(u: DVec3, v: DVec3, tangent: DVec4, normal: DVec3) -> DVec4 {
    let side = if u.x * v.y - u.y * v.x < 0.0 { -1.0 } else { 1.0 };
    // The direction in which u grows: the first column of the inverse, without its length.
    let axis = safe_normalize(DVec3::new(v.y, -v.x, 0.0)) * side;
    let along = tangent.truncate();
    // The bitangent points against v.
    let bitangent = normal.cross(along) * tangent.w;
    (axis.x * along - axis.y * bitangent).extend(tangent.w * side)
}

/// Returns by how much α² widens for a mip level's spread (its alpha channel) and the map's scale. In [0, 1].
///
/// # Error of the f32 twin
///
/// 2 u: two products.
pub fn normal_map_widening(spread: f64, scale: f64) -> f64 {
    let root = spread * scale;
    (root * root).clamp(0.0, 1.0)
}

/// Returns the spread, 0 to 1, of unit normals whose mean has this length: √(2 (1 - L)/L). This is for uploads;
/// shaders read the spread from the map.
pub fn normal_map_spread(mean_length: f64) -> f64 {
    let length = mean_length.clamp(0.0, 1.0);
    (2.0 * (1.0 - length) / length.max(f64::MIN_POSITIVE)).sqrt().min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: (DVec4, DVec3) = (DVec4::new(1.0, 0.0, 0.0, 1.0), DVec3::Z);

    #[test]
    fn a_texel_is_a_vector_in_the_frame() {
        let (tangent, normal) = FRAME;
        let near = |a: DVec3, b: DVec3| assert!((a - b.normalize()).length() < 1e-15, "{a} {b}");
        // Red along the tangent, green along the bitangent, blue along the normal.
        near(map_normal(DVec3::new(0.5, 0.5, 1.0), 1.0, tangent, normal), DVec3::Z);
        near(map_normal(DVec3::new(1.0, 0.5, 1.0), 1.0, tangent, normal), DVec3::new(1.0, 0.0, 1.0));
        near(map_normal(DVec3::new(0.5, 1.0, 1.0), 1.0, tangent, normal), DVec3::new(0.0, 1.0, 1.0));
        near(map_normal(DVec3::new(0.5, 1.0, 1.0), -0.5, tangent, normal), DVec3::new(0.0, -0.5, 1.0));
        let other_side = tangent.truncate().extend(-1.0);
        near(map_normal(DVec3::new(0.5, 1.0, 1.0), 1.0, other_side, normal), DVec3::new(0.0, -1.0, 1.0));
        // With scale 0 the map has no effect.
        near(map_normal(DVec3::new(0.1, 0.9, 0.8), 0.0, tangent, normal), DVec3::Z);
        // Interpolated and not normalized, both are equally short.
        let (tangent, normal) = ((0.5 * tangent.truncate()).extend(1.0), 0.5 * normal);
        near(map_normal(DVec3::new(1.0, 0.5, 1.0), 1.0, tangent, normal), DVec3::new(1.0, 0.0, 1.0));
    }

    #[test]
    fn what_has_no_direction_leaves_the_surface_its_own() {
        let (tangent, normal) = FRAME;
        for code in [127.0, 127.5, 128.0] {
            assert_eq!(map_normal(DVec3::splat(code / 255.0), 1.0, tangent, normal), normal, "{code}");
        }
        // Without a tangent only the texel's blue is left.
        assert_eq!(map_normal(DVec3::new(0.9, 0.2, 0.8), 1.0, DVec4::ZERO, normal), normal);
        assert_eq!(map_normal(DVec3::new(0.9, 0.2, 0.5), 1.0, DVec4::ZERO, normal), normal);
        assert_eq!(map_normal(DVec3::new(0.9, 0.2, 0.8), 1.0, tangent, DVec3::ZERO), DVec3::ZERO);
    }

    #[test]
    fn a_transformed_picture_takes_its_axes_along() {
        let (tangent, normal) = FRAME;
        // v increases downwards, against the bitangent: a point of the surface at (x, y) has (u, v) = (x, -y)
        // before the transform.
        let check = |rows: [[f64; 2]; 2]| {
            let [u, v] = rows.map(|row| DVec3::new(row[0], row[1], 0.0));
            let made = transformed_tangent(u, v, tangent, normal);
            let along = made.truncate();
            let against_v = normal.cross(along) * made.w;
            // The change of the transformed coordinates along a direction on the surface.
            let change = |direction: DVec3, row: DVec3| row.x * direction.x - row.y * direction.y;
            assert!(change(along, u) > 0.0 && change(along, v).abs() < 1e-15, "{rows:?}: {made}");
            assert!(change(against_v, v) < 0.0 && change(against_v, u).abs() < 1e-15, "{rows:?}: {made}");
            assert!((along.length() - 1.0).abs() < 1e-15);
        };
        check([[1.0, 0.0], [0.0, 1.0]]);
        check([[3.0, 0.0], [0.0, 0.5]]);
        check([[-1.0, 0.0], [0.0, 1.0]]);
        check([[1.0, 0.0], [0.0, -2.0]]);
        let (sine, cosine) = 0.7f64.sin_cos();
        check([[cosine, sine], [-sine, cosine]]);
        check([[2.0 * cosine, -2.0 * sine], [-2.0 * sine, -2.0 * cosine]]);
        assert_eq!(transformed_tangent(DVec3::ZERO, DVec3::ZERO, tangent, normal).truncate(), DVec3::ZERO);
    }

    #[test]
    fn a_short_mean_is_a_wide_lobe() {
        assert_eq!(normal_map_spread(1.0), 0.0);
        assert_eq!(normal_map_spread(0.0), 1.0);
        // Normals tilted by ±s along both axes have the variance s² along each, and α² widens by twice that.
        let tilt = 0.05f64;
        let mean = (1.0 / (1.0 + 2.0 * tilt * tilt)).sqrt();
        let widening = normal_map_widening(normal_map_spread(mean), 1.0);
        assert!((widening / (2.0 * tilt * tilt) - 1.0).abs() < 3e-3, "{widening}");
        // Half the scale gives a quarter of the variance; the widening is at most that of a hemisphere.
        assert_eq!(normal_map_widening(0.5, 0.5), 0.0625);
        assert_eq!(normal_map_widening(0.5, -0.5), 0.0625);
        assert_eq!(normal_map_widening(1.0, 7.0), 1.0);
    }
}
