//! The checks that lights, materials and fogs share: whether a number is finite and at least 0. Each type has its
//! own errors.

use glam::Vec3;

/// Returns what is wrong with a number, as a reason that completes "the field … is …", or `None` if it is finite
/// and at least 0.
pub(crate) fn fault(value: f32) -> Option<&'static str> {
    if value.is_nan() {
        Some("not a number")
    } else if value.is_infinite() {
        Some("infinite")
    } else if value < 0.0 {
        Some("negative")
    } else {
        None
    }
}

/// Returns the first faulty channel of a colour: its value and what is wrong with it.
pub(crate) fn color_fault(color: Vec3) -> Option<(f32, &'static str)> {
    color.to_array().into_iter().find_map(|channel| fault(channel).map(|reason| (channel, reason)))
}
