//! The values that a lit shader writes: radiance within the range of the linear frame, OpenGL's clamped
//! colours, or, without a display pass, the target's final values.

use super::Subject;
use crate::shader::{Feature, Variant};

pub(super) fn call(subject: &Subject<'_>, variant: &mut Variant) {
    let frame = subject.frame;
    variant.set(Feature::Clamp, frame.clamp);
    variant.set(Feature::ClampVertices, frame.clamp && subject.is_lit_per_vertex());
    // Values that are clamped to 1 cannot overflow.
    variant.set(Feature::HalfRange, frame.half && !frame.clamp);
    if let Some(display) = frame.display {
        variant.set(Feature::Display, true);
        display.features().into_iter().for_each(|(feature, on)| variant.set(feature, on));
    }
}
