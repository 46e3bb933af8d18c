//! The textures of a material, and the sets of texture coordinates that they and the lightmap read.

use lumbre_scene::ObjectTraits;

use super::Subject;
use crate::shader::{Feature, Variant};
use crate::texture_sets;

pub(super) fn call(subject: &Subject<'_>, variant: &mut Variant) {
    for (feature, bound) in texture_sets::features(subject.object.texture_mask) {
        variant.set(feature, bound);
    }
    // Light from the vertex stage is modulated by the texture per fragment.
    let modulated = subject.is_lit_per_vertex() && variant.has(Feature::BaseColorTexture);
    variant.set(Feature::Modulated, modulated);
}

/// Returns the variant with the coordinates of its remaining textures.
pub(super) fn coordinates(object: &ObjectTraits, mut variant: Variant) -> Variant {
    let read = |second: bool| {
        let slots = (0..).zip(texture_sets::features(object.texture_mask));
        slots
            .filter(|(slot, _)| (object.second_set & (1 << slot) != 0) == second)
            .any(|(_, (feature, _))| variant.has(feature))
    };
    let (first, second) = (read(false), read(true));
    variant.set(Feature::Uv0, first);
    variant.set(Feature::Uv1, second || variant.has(Feature::Lightmap));
    variant
}
