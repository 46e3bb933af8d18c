//! Fog and depth cueing: the mode that the scene asks for.

use lumbre_optics::FogMode;

use super::Subject;
use crate::shader::{Feature, Variant};

pub(super) fn call(subject: &Subject<'_>, variant: &mut Variant) {
    let Some(fog) = &subject.settings.fog else { return };
    let mode = match fog.mode {
        FogMode::Linear { .. } => Feature::FogLinear,
        FogMode::Exponential { .. } => Feature::FogExponential,
        FogMode::ExponentialSquared { .. } => Feature::FogExponentialSquared,
        FogMode::DepthCue { .. } => Feature::FogDepthCue,
    };
    variant.set(Feature::Fog, true);
    variant.set(mode, true);
}
