//! The half vector h between the light and the viewer. (Document \[M\] says between r and v, which is a slip.)

use glam::DVec3;

use crate::normalization::{safe_normalize, try_normalize};

/// Returns h = (l + v)/|l + v| of two unit vectors; zero where l = -v.
///
/// The length is that of the computed sum and not 2 + 2 l·v, which cancels near l = -v.
///
/// # Error of the f32 twin
///
/// 9 u of each component, even near l = -v: the sum is rounded once per component however much of it cancels; then
/// [`safe_normalize`]'s 7 u, and 1 u for the length.
pub fn half_vector(light: DVec3, viewer: DVec3) -> DVec3 {
    safe_normalize(light + viewer)
}

/// Returns [`half_vector`], or `None` where l = -v.
pub fn try_half_vector(light: DVec3, viewer: DVec3) -> Option<DVec3> {
    try_normalize(light + viewer)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_lies_half_way() {
        let half = half_vector(DVec3::X, DVec3::Y);
        // One addition, one root and one division: under four units of 2⁻⁵³.
        assert!((half - DVec3::new(0.5f64.sqrt(), 0.5f64.sqrt(), 0.0)).length() < 4e-16);
    }

    #[test]
    fn opposite_vectors_have_none() {
        assert_eq!(half_vector(DVec3::X, -DVec3::X), DVec3::ZERO);
        assert_eq!(try_half_vector(DVec3::X, -DVec3::X), None);
    }

    #[test]
    fn nearly_opposite_vectors_keep_their_half() {
        // l = (1, e, 0), v = (-1, e, 0): h is exactly +Y however small e is, while 2 + 2 l·v would give 0/0.
        for e in [1e-3, 1e-8, 1e-12] {
            let half = half_vector(DVec3::new(1.0, e, 0.0), DVec3::new(-1.0, e, 0.0));
            assert_eq!(half, DVec3::Y, "e = {e}");
        }
    }
}
