//! The numbers that a lit shader writes: radiance within what the linear frame holds, OpenGL's clamped colours, or, where there is no display pass, what the target holds.

use super::Subject;
use crate::shader::{Feature, Variant};

pub(super) fn call(subject: &Subject<'_>, variant: &mut Variant) {
    let frame = subject.frame;
    variant.set(Feature::Clamp, frame.clamp);
    variant.set(Feature::ClampVertices, frame.clamp && subject.is_lit_per_vertex());
    // What is clamped to 1 overflows nothing.
    variant.set(Feature::HalfRange, frame.half && !frame.clamp);
    if let Some(display) = frame.display {
        variant.set(Feature::Display, true);
        display.features().into_iter().for_each(|(feature, on)| variant.set(feature, on));
    }
}
