//! Which normal a face is lit with. The material of that side is chosen by `Material::surface`, with the same flag.

use glam::DVec3;

use crate::normalization::try_normalize;

/// Returns the normal, reversed on the back of a face: two-sided lighting of OpenGL 2.1 §2.14.1, where the front is
/// the side whose corners wind counter-clockwise on the screen.
///
/// # Error of the f32 twin
///
/// None: only the sign changes.
pub fn facing_normal(normal: DVec3, front_facing: bool) -> DVec3 {
    if front_facing { normal } else { -normal }
}

/// Returns the unit vector of an interpolated normal, or the face's own unit normal where interpolation cancelled
/// it to zero.
///
/// # Error of the f32 twin
///
/// That of [`safe_normalize`](crate::safe_normalize). The face's own normal replaces interpolated normals shorter
/// than 7·10⁻¹⁶; within 20 u of that length either may be returned.
pub fn shading_normal(interpolated: DVec3, face_normal: DVec3) -> DVec3 {
    try_normalize(interpolated).unwrap_or(face_normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_back_sees_the_reversed_normal() {
        assert_eq!(facing_normal(DVec3::Y, true), DVec3::Y);
        assert_eq!(facing_normal(DVec3::Y, false), -DVec3::Y);
    }

    #[test]
    fn a_cancelled_normal_falls_back_to_the_face() {
        assert_eq!(shading_normal(DVec3::X * 0.1, DVec3::Y), DVec3::X);
        assert_eq!(shading_normal(DVec3::ZERO, DVec3::Y), DVec3::Y);
        assert_eq!(shading_normal(DVec3::NAN, DVec3::Y), DVec3::Y);
    }
}
