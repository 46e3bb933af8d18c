//! Baked light of surfaces with a lightmap, if the frame uses lightmaps.

use super::Subject;
use crate::shader::{Feature, Variant};

pub(super) fn call(subject: &Subject<'_>, variant: &mut Variant) {
    variant.set(Feature::Lightmap, subject.frame.lightmaps && subject.object.is_lit_by_lightmap());
}
