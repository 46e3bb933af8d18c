//! Conversion of traced radiance to displayed colours, as frames do it.

use glam::DVec3;
use lumbre_optics::{encode_srgb, tone_curve};

/// Returns the sRGB-encoded display colour of a radiance that exposure has been applied to: tone curve, then
/// sRGB's encoding, each channel in [0, 1].
pub fn shown(radiance: DVec3) -> DVec3 {
    tone_curve(radiance).clamp(DVec3::ZERO, DVec3::ONE).map(encode_srgb)
}
