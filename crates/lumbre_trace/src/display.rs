//! From radiance to what people see, as a frame shows it. No light transport.

use glam::DVec3;
use lumbre_optics::{encode_srgb, tone_curve};

/// The numbers that a screen is given for a colour after exposure: the tone curve, encoded in sRGB.
pub fn shown(radiance: DVec3) -> DVec3 {
    tone_curve(radiance).clamp(DVec3::ZERO, DVec3::ONE).map(encode_srgb)
}
