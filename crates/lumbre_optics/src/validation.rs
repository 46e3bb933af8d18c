//! The checks that lights, materials and fogs share: is a number finite, at least 0, in a range. Their errors
//! are each type's own.

use glam::Vec3;

/// What is wrong with a number, as a reason that completes "the field … is …".
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

/// The first channel of a colour with a fault: its value, and what is wrong with it.
pub(crate) fn color_fault(color: Vec3) -> Option<(f32, &'static str)> {
    color.to_array().into_iter().find_map(|channel| fault(channel).map(|reason| (channel, reason)))
}
