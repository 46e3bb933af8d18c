//! The solid angles of a triangle and a parallelogram. `punctual_irradiance` computes the light that passes through
//! them.

use glam::DVec3;

/// Solid angle, in steradians, of a triangle with corners relative to the eye; positive if they run counter-clockwise
/// as seen from the eye (van Oosterom and Strackee, "The Solid Angle of a Plane Triangle", 1983, equation 8). It is
/// exact up to rounding, and to 10⁻⁷ if the eye is nearer to an edge than 10⁻⁸ of the triangle's size.
pub(crate) fn of_triangle([a, b, c]: [DVec3; 3]) -> f64 {
    let [x, y, z] = [a, b, c].map(DVec3::length);
    let volume = a.dot(c.cross(b));
    let rest = x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y;
    2.0 * volume.atan2(rest)
}

/// Solid angle, in steradians, of a parallelogram with its corners in order and relative to the eye; positive from
/// either side.
pub(crate) fn of_parallelogram([a, b, c, d]: [DVec3; 4]) -> f64 {
    (of_triangle([a, b, c]) + of_triangle([a, c, d])).abs()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn the_faces_of_a_cube_and_the_cubes_at_a_corner_fill_the_sphere() {
        let square = |half: f64, height: f64| {
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
                .map(|[x, z]| DVec3::new(half * x, height, half * z))
        };
        // A cube has six faces around its centre, and eight cubes meet at a corner.
        assert!((of_parallelogram(square(1.0, 1.0)) - 4.0 * PI / 6.0).abs() < 1e-14);
        let quarter = square(0.5, 1.0).map(|corner| corner + DVec3::new(0.5, 0.0, 0.5));
        assert!((of_parallelogram(quarter) - 4.0 * PI / 24.0).abs() < 1e-14);
        // From very near, it is a hemisphere; from within its plane, it is 0; from far away, it is A / d².
        assert!((of_parallelogram(square(1.0, 1e-7)) - 2.0 * PI).abs() < 1e-6);
        let beside = square(1.0, 0.0).map(|corner| corner + DVec3::X * 3.0);
        assert_eq!(of_parallelogram(beside), 0.0);
        assert!((of_parallelogram(square(1.0, 1e4)) / 4e-8 - 1.0).abs() < 1e-7);
    }

    #[test]
    fn its_sign_says_which_side_is_seen() {
        let corners = [DVec3::new(0.0, 1.0, 0.0), DVec3::new(1.0, 1.0, 0.0), DVec3::new(0.0, 1.0, 1.0)];
        let [a, b, c] = corners;
        // Seen from below, they run counter-clockwise.
        assert!(of_triangle([a, b, c]) > 0.0 && of_triangle([a, c, b]) < 0.0);
    }
}
