//! Fog and depth cueing, in the mode that the scene asks for.

use lumbre_optics::FogMode;

use super::Subject;
use crate::shader::{Feature, TABLES_IN_TEXTURES, Variant};

pub(super) fn call(subject: &Subject<'_>, variant: &mut Variant) {
    let Some(fog) = &subject.settings.fog else { return };
    variant.set(Feature::Fog, true);
    variant.set(fog_feature(&fog.mode), true);
}

/// Returns the feature of a mode, which is set in addition to that of any fog.
pub(crate) fn fog_feature(mode: &FogMode) -> Feature {
    match mode {
        FogMode::Linear { .. } => Feature::FogLinear,
        FogMode::Exponential { .. } => Feature::FogExponential,
        FogMode::ExponentialSquared { .. } => Feature::FogExponentialSquared,
        FogMode::DepthCue { .. } => Feature::FogDepthCue,
    }
}

/// Returns the fog flags of shaders that have no other features and read tables from buffers.
pub(crate) fn fog_flags(fog: Option<Feature>) -> Vec<(&'static str, bool)> {
    let features = [
        Feature::Fog,
        Feature::FogLinear,
        Feature::FogExponential,
        Feature::FogExponentialSquared,
        Feature::FogDepthCue,
    ];
    let on = |feature| fog.is_some_and(|mode| feature == mode || feature == Feature::Fog);
    let flags = features.into_iter().map(|feature| (feature.name(), on(feature)));
    flags.chain([(TABLES_IN_TEXTURES, false)]).collect()
}
