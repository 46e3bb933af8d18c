//! From radiance to what people see: the twins of the frame's tone curve and of sRGB's encoding, in f64. No light transport.

use glam::DVec3;

/// Khronos PBR Neutral (2024): colours below 0.8 keep their values but for a small toe, brighter ones are compressed and lose saturation.
pub fn tone_curve(radiance: DVec3) -> DVec3 {
    let start = 0.8 - 0.04;
    let desaturation = 0.15;
    let mut color = radiance.max(DVec3::ZERO);
    let darkest = color.min_element();
    color -= if darkest < 0.08 { darkest - 6.25 * darkest * darkest } else { 0.04 };
    let peak = color.max_element();
    if peak < start {
        return color;
    }
    let span = 1.0 - start;
    let compressed = 1.0 - span * span / (peak + span - start);
    color *= compressed / peak;
    let white = 1.0 - 1.0 / (desaturation * (peak - compressed) + 1.0);
    color.lerp(DVec3::splat(compressed), white)
}

/// IEC 61966-2-1, per channel, of values that are clamped to [0, 1].
pub fn encode_srgb(linear: DVec3) -> DVec3 {
    let channel = |value: f64| {
        let value = value.clamp(0.0, 1.0);
        if value <= 0.003_130_8 { 12.92 * value } else { 1.055 * value.powf(1.0 / 2.4) - 0.055 }
    };
    DVec3::new(channel(linear.x), channel(linear.y), channel(linear.z))
}
