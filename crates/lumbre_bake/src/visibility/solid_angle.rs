//! The solid angle of a triangle and of a parallelogram. Not what a light sends through it: that is `punctual_irradiance`.

use glam::DVec3;

/// Of a triangle with its corners relative to the eye, positive where they run counter-clockwise for it, steradians (van Oosterom and Strackee,
/// "The Solid Angle of a Plane Triangle", 1983, equation 8). Exact to rounding; where the eye is
/// nearer to an edge than 10⁻⁸ of the triangle's size, to 10⁻⁷.
pub(crate) fn of_triangle([a, b, c]: [DVec3; 3]) -> f64 {
    let [x, y, z] = [a, b, c].map(DVec3::length);
    let volume = a.dot(c.cross(b));
    let rest = x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y;
    2.0 * volume.atan2(rest)
}

/// Of a parallelogram with its corners, one after the other, relative to the eye; positive from either side.
pub(crate) fn of_parallelogram([a, b, c, d]: [DVec3; 4]) -> f64 {
    (of_triangle([a, b, c]) + of_triangle([a, c, d])).abs()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn a_cube_s_faces_and_corners() {
        let square = |half: f64, height: f64| {
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
                .map(|[x, z]| DVec3::new(half * x, height, half * z))
        };
        // A cube has six faces about its middle, and eight cubes are about a corner.
        assert!((of_parallelogram(square(1.0, 1.0)) - 4.0 * PI / 6.0).abs() < 1e-14);
        let quarter = square(0.5, 1.0).map(|corner| corner + DVec3::new(0.5, 0.0, 0.5));
        assert!((of_parallelogram(quarter) - 4.0 * PI / 24.0).abs() < 1e-14);
        // From so near that it is half of all there is; from its plane nothing; from afar A / d².
        assert!((of_parallelogram(square(1.0, 1e-7)) - 2.0 * PI).abs() < 1e-6);
        let beside = square(1.0, 0.0).map(|corner| corner + DVec3::X * 3.0);
        assert_eq!(of_parallelogram(beside), 0.0);
        assert!((of_parallelogram(square(1.0, 1e4)) / 4e-8 - 1.0).abs() < 1e-7);
    }

    #[test]
    fn its_sign_says_which_side_is_seen() {
        let corners = [DVec3::new(0.0, 1.0, 0.0), DVec3::new(1.0, 1.0, 0.0), DVec3::new(0.0, 1.0, 1.0)];
        let [a, b, c] = corners;
        // VisibilitySummary from below they run counter-clockwise.
        assert!(of_triangle([a, b, c]) > 0.0 && of_triangle([a, c, b]) < 0.0);
    }
}
