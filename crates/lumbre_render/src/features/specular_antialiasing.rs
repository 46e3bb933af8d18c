//! Highlights as a pixel shows them, where the frame asks for it: only one that is evaluated per fragment can fall between pixels.

use super::Subject;
use crate::shader::{Feature, Variant};

pub(super) fn call(subject: &Subject<'_>, variant: &mut Variant) {
    let per_fragment = subject.lit && !subject.is_lit_per_vertex();
    let filtered = subject.frame.specular_antialiasing && per_fragment && subject.object.specular;
    variant.set(Feature::SpecularAntialiasing, filtered);
}
