//! The torch in the player's hand: a spotlight that follows the view. Not where it hangs: that is `game`.

use glam::Vec3;
use lumbre_optics::{Attenuation, BakeMode, Light, SpotCone};
use lumbre_scene::Transform;

/// The light of the torch: a warm cone of 26 degrees to each side that reaches 18 m.
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

/// Where the hand holds it, in the camera's space: low on the right, so that what it lights shows its relief.
pub fn torch_place() -> Transform {
    Transform::from_xyz(0.22, -0.28, -0.05)
}
