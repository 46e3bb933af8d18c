//! Lambert's cosine law. `shade` multiplies it by the diffuse colour.

use glam::DVec3;

/// Returns max(n·l, 0) of unit vectors, at most 1. It is 0 for a zero normal or a light behind the surface.
///
/// # Error of the f32 twin
///
/// 3 u Σ|n l|, absolute: each product is rounded once and passes through two sums, in any order. For unit vectors
/// that is at most 3 u √3, and in practice seldom above 2 u. The relative error is unbounded at grazing angles.
pub fn lambert(normal: DVec3, light: DVec3) -> f64 {
    normal.dot(light).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cosine_in_front_and_nothing_behind() {
        let light = DVec3::new(3f64.sqrt() / 2.0, 0.5, 0.0);
        assert_eq!(lambert(DVec3::Y, light), 0.5);
        assert_eq!(lambert(-DVec3::Y, light), 0.0);
        assert_eq!(lambert(DVec3::X, DVec3::Y), 0.0);
        assert_eq!(lambert(DVec3::ZERO, light), 0.0);
    }

    #[test]
    fn rounding_cannot_lift_it_above_one() {
        assert_eq!(lambert(DVec3::Y * (1.0 + 1e-7), DVec3::Y), 1.0);
    }
}
