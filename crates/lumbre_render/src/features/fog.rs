//! Fog and depth cueing: the mode that the scene asks for.

use lumbre_optics::FogMode;

use super::Subject;
use crate::shader::{Feature, TABLES_IN_TEXTURES, Variant};

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

/// Fog in shaders that know no other feature, and read tables from buffers.
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
