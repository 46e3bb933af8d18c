//! The torch in the player's hand: a spotlight that follows the view. `game` attaches it to the camera.

use glam::Vec3;
use lumbre_optics::{Attenuation, BakeMode, Light, SpotCone};
use lumbre_scene::Transform;

/// Returns the light of the torch: a warm cone with a half angle of 26 degrees and a range of 18 m.
pub fn torch_light(lit: bool) -> Light {
    let cone = SpotCone::Smooth { inner: 0.14, outer: 0.46 };
    let attenuation = Attenuation { constant: 1.0, linear: 0.0, quadratic: 0.14, clamp: false, range: 18.0 };
    Light {
        attenuation,
        enabled: lit,
        bake: BakeMode::Dynamic,
        ..Light::spot(Vec3::new(1.7, 1.55, 1.25), cone)
    }
}

/// Returns where the hand holds the torch in the camera's space: low on the right, so that its light shows
/// the relief of surfaces.
pub fn torch_place() -> Transform {
    Transform::from_xyz(0.22, -0.28, -0.05)
}
