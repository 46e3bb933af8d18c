//! Backs that are lit by themselves: where the material has two sides and the scene lights both.

use super::Subject;
use crate::shader::{Feature, Variant};

pub(super) fn call(subject: &Subject<'_>, variant: &mut Variant) {
    variant.set(Feature::TwoSided, subject.object.double_sided && subject.settings.two_sided);
}
