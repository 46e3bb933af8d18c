//! The baked light of a surface, where it has a lightmap and the frame uses them.

use super::Subject;
use crate::shader::{Feature, Variant};

pub(super) fn call(subject: &Subject<'_>, variant: &mut Variant) {
    variant.set(Feature::Lightmap, subject.frame.lightmaps && subject.object.is_lit_by_lightmap());
}
