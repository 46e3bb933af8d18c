//! Where the viewer is, as seen from the surface: local, or infinitely distant as OpenGL assumes by default.

use glam::DVec3;

use crate::normalization::{safe_normalize, try_normalize};

/// v: the unit direction to the viewer.
///
/// A local viewer stands at `eye`; an infinitely distant one is seen along `backward`, the camera's own +Z
/// axis (unit, from the scene to the camera), from everywhere. Zero where the point is the eye itself.
///
/// # Error of the f32 twin
///
/// 9 u of each component for a local viewer, as of a half vector: the difference of two positions is rounded
/// once per component. None for a distant one. How well the positions themselves are known is another matter.
pub fn viewer_direction(local_viewer: bool, eye: DVec3, backward: DVec3, point: DVec3) -> DVec3 {
    if local_viewer { safe_normalize(eye - point) } else { backward }
}

/// [`viewer_direction`], or nothing where the point is the eye, or the distant viewer has no direction.
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
