//! The ambient cube: the light at a point as six surfaces would receive it, one along each axis direction, and the
//! light of any other surface interpolated from them (Mitchell, McTaggart and Green, "Shading in Valve's Source
//! Engine", SIGGRAPH 2006). The light itself and the interpolation between cubes are found elsewhere.

use glam::{DVec3, DVec4};

/// Openness below this counts as 0: nothing is known about the light there, and the result is black.
pub const MIN_OPENNESS: f64 = 1e-12;

/// Returns E/π for a surface with this unit normal: the three sides that it faces, weighted by the squared
/// components of the normal, which add up to 1.
///
/// `x`, `y` and `z` are the sides along each axis that the normal faces. Their RGB is E/π for a surface along that
/// axis, premultiplied by the openness of the probes that it was interpolated from; `w` is that openness (above 0,
/// at most 1, the same for all three). A probe inside a wall has so little openness that its light shows only where
/// there is no other probe. Dividing by the interpolated openness keeps such probes from darkening or tinting their
/// neighbours. An openness of 0, or a zero normal, gives no light.
///
/// ```
/// use glam::{DVec3, DVec4};
/// use lumbre_optics::ambient_cube;
///
/// let (sky, ground) = (DVec4::splat(1.0), DVec4::new(0.2, 0.2, 0.2, 1.0));
/// assert_eq!(ambient_cube(DVec3::Y, ground, sky, ground), DVec3::ONE);
/// // Half of the points between were inside of a wall, and hold nothing.
/// assert_eq!(ambient_cube(DVec3::Y, 0.5 * ground, 0.5 * sky, 0.5 * ground), DVec3::ONE);
/// ```
///
/// # Error of the f32 twin
///
/// The sums of three products of squares are off by 4 u of the sum of their terms' magnitudes. The quotient is off
/// by that error over the openness, by as much again relative to the result for the openness itself, and by 2.5
/// units in the last place (5 u) for the division.
pub fn ambient_cube(normal: DVec3, x: DVec4, y: DVec4, z: DVec4) -> DVec3 {
    let weights = normal * normal;
    let sum = weights.x * x + weights.y * y + weights.z * z;
    sum.truncate() / sum.w.max(MIN_OPENNESS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_light_is_even_from_every_side() {
        let light = DVec4::new(0.3, 0.5, 0.7, 1.0);
        for normal in [DVec3::X, DVec3::NEG_Z, DVec3::new(0.6, -0.64, 0.48)] {
            let lit = ambient_cube(normal, light, light, light);
            assert!((lit - light.truncate()).length() < 1e-15, "{lit}");
        }
    }

    #[test]
    fn each_side_counts_by_the_square_of_its_cosine() {
        let side = |light: f64| DVec4::new(light, 0.0, 0.0, 1.0);
        let lit = ambient_cube(DVec3::new(0.6, 0.0, -0.8), side(1.0), side(100.0), side(2.0));
        assert!((lit.x - (0.36 + 2.0 * 0.64)).abs() < 1e-15, "{lit}");
    }

    #[test]
    fn without_openness_or_direction_there_is_no_light_and_no_nan() {
        let light = DVec4::ONE;
        assert_eq!(ambient_cube(DVec3::ZERO, light, light, light), DVec3::ZERO);
        assert_eq!(ambient_cube(DVec3::X, DVec4::ZERO, light, light), DVec3::ZERO);
    }
}
