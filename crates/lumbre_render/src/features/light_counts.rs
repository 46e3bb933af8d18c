//! Counts of lights, in frames that are measured this way and on devices that can count, in the stage that
//! evaluates the lights.

use super::Subject;
use crate::shader::{Feature, Variant};

pub(super) fn call(subject: &Subject<'_>, variant: &mut Variant) {
    let counted = subject.frame.counted;
    let counts = if subject.is_lit_per_vertex() { counted.vertices } else { counted.fragments };
    variant.set(Feature::CountLights, counts);
}
