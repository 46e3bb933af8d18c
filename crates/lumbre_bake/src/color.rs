//! Arithmetic of colours: radiance, irradiance and reflectance with a red, a green and a blue channel.

use glam::Vec3;

/// Mean of the three channels.
pub(crate) fn channel_mean(color: Vec3) -> f32 {
    color.element_sum() / 3.0
}

/// Mean of the three channels, for sums in double precision: only the channels' sum is rounded to single precision.
pub(crate) fn wide_channel_mean(color: Vec3) -> f64 {
    f64::from(color.element_sum()) / 3.0
}
