//! Baked light of objects without a lightmap, if there is an irradiance volume and the frame uses it.

use super::Subject;
use crate::shader::{Feature, Variant};

pub(super) fn call(subject: &Subject<'_>, variant: &mut Variant) {
    let called_for = subject.frame.irradiance_volumes && subject.object.is_lit_by_irradiance_volume();
    variant.set(Feature::IrradianceVolume, called_for);
}
