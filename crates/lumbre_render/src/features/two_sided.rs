//! Separate lighting of back faces, if the material is double-sided and the scene lights both sides.

use super::Subject;
use crate::shader::{Feature, Variant};

pub(super) fn call(subject: &Subject<'_>, variant: &mut Variant) {
    variant.set(Feature::TwoSided, subject.object.double_sided && subject.settings.two_sided);
}
