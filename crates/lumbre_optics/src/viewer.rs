//! The direction to the viewer, who is local or, as OpenGL assumes by default, infinitely distant.

use glam::DVec3;

use crate::normalization::{safe_normalize, try_normalize};

/// Returns v, the unit direction to the viewer.
///
/// A local viewer is at `eye`. For an infinitely distant one the direction is `backward` everywhere: the camera's
/// own +Z axis, a unit vector from the scene to the camera. The result is zero where the point is the eye itself.
///
/// # Error of the f32 twin
///
/// 9 u of each component for a local viewer, as for a half vector: the difference of two positions is rounded once
/// per component. None for a distant viewer. Errors of the positions themselves are not included.
pub fn viewer_direction(local_viewer: bool, eye: DVec3, backward: DVec3, point: DVec3) -> DVec3 {
    if local_viewer { safe_normalize(eye - point) } else { backward }
}

/// Returns [`viewer_direction`], or `None` where the point is the eye or `backward` is zero.
pub fn try_viewer_direction(local_viewer: bool, eye: DVec3, backward: DVec3, point: DVec3) -> Option<DVec3> {
    try_normalize(if local_viewer { eye - point } else { backward })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn local_and_distant() {
        let (eye, backward) = (DVec3::new(0.0, 3.0, 4.0), DVec3::Z);
        assert_eq!(viewer_direction(true, eye, backward, DVec3::ZERO), DVec3::new(0.0, 0.6, 0.8));
        assert_eq!(viewer_direction(false, eye, backward, DVec3::ZERO), DVec3::Z);
        assert_eq!(viewer_direction(true, eye, backward, eye), DVec3::ZERO);
        assert_eq!(try_viewer_direction(true, eye, backward, eye), None);
        assert_eq!(try_viewer_direction(false, eye, backward, eye), Some(DVec3::Z));
        assert_eq!(try_viewer_direction(false, eye, DVec3::ZERO, DVec3::ZERO), None);
    }
}
