//! Filtering of highlights within a pixel, if the frame asks for it. Only highlights that are evaluated per
//! fragment can alias.

use super::Subject;
use crate::shader::{Feature, Variant};

pub(super) fn call(subject: &Subject<'_>, variant: &mut Variant) {
    let per_fragment = subject.lit && !subject.is_lit_per_vertex();
    let filtered = subject.frame.specular_antialiasing && per_fragment && subject.object.specular;
    variant.set(Feature::SpecularAntialiasing, filtered);
}
