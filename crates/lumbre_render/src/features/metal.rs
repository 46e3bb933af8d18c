//! Metals under baked light: they have no diffuse reflection, which lightmaps and irradiance volumes light otherwise.

use super::Subject;
use crate::shader::{Feature, Variant};

pub(super) fn call(subject: &Subject<'_>, variant: &mut Variant) {
    let baked = variant.has(Feature::Lightmap) || variant.has(Feature::IrradianceVolume);
    variant.set(Feature::BakedMetal, subject.object.metal && baked);
}
