//! Fog and depth cueing: the mode that the scene asks for.

use lumbre_optics::FogMode;

use super::Subject;
use crate::shader::{Feature, Variant};

pub(super) fn call(subject: &Subject<'_>, variant: &mut Variant) {
    let Some(fog) = &subject.settings.fog else { return };
    variant.set(Feature::Fog, true);
    variant.set(fog_feature(&fog.mode), true);
}

/// The feature of a mode, beside that of any fog.
pub(crate) fn fog_feature(mode: &FogMode) -> Feature {
    match mode {
        FogMode::Linear { .. } => Feature::FogLinear,
        FogMode::Exponential { .. } => Feature::FogExponential,
        FogMode::ExponentialSquared { .. } => Feature::FogExponentialSquared,
        FogMode::DepthCue { .. } => Feature::FogDepthCue,
    }
}
