//! Coverage: alpha masks and alpha blending.

use lumbre_optics::AlphaMode;

use super::Subject;
use crate::shader::{Feature, Variant};

pub(super) fn call(subject: &Subject<'_>, variant: &mut Variant) {
    let mode = subject.object.alpha_mode;
    variant.set(Feature::Alpha, mode != AlphaMode::Opaque);
    variant.set(Feature::AlphaMask, matches!(mode, AlphaMode::Mask { .. }));
}
