//! Lights: the kinds that the light loop has to support, and the lists that it finds them by.

use lumbre_optics::Shading;

use super::Subject;
use crate::extract::{LightCounts, LightSet, UNIFORM_LIGHTS};
use crate::shader::{Feature, Variant};

pub(super) fn call(subject: &Subject<'_>, variant: &mut Variant) {
    let (object, frame) = (subject.object, subject.frame);
    let clustered = frame.clustered && subject.lit && subject.shading == Shading::Phong;
    let LightSet { every, unbounded, inverse_square, shadowed, ranged, .. } = &frame.lights;
    let listed = if clustered { unbounded } else { every };
    // On a lightmapped surface, a baked light still adds its highlight, if the material has one, and its
    // ambient term.
    let lightmapped = frame.lightmaps && object.is_lit_by_lightmap();
    let left =
        |of: &LightCounts| of.all > of.dynamic && (!lightmapped || object.specular || of.static_ambient);
    variant.set(Feature::DynamicLights, listed.dynamic > 0);
    variant.set(Feature::StaticLights, left(listed));
    let reads = |of: &LightCounts| clustered && (of.dynamic > 0 || left(of));
    variant.set(Feature::InverseSquareClusters, reads(inverse_square));
    variant.set(Feature::UniformLights, reads(inverse_square) && inverse_square.all <= UNIFORM_LIGHTS);
    variant.set(
        Feature::InverseSquareSpots,
        [inverse_square, shadowed].into_iter().any(|of| reads(of) && of.spot),
    );
    variant.set(Feature::ShadowedClusters, reads(shadowed));
    variant.set(Feature::RangedClusters, reads(ranged));
    for kinds in [Some(listed), clustered.then_some(ranged)].into_iter().flatten() {
        variant.set(Feature::DirectionalLights, kinds.directional);
        variant.set(Feature::PointLights, kinds.point);
        variant.set(Feature::SpotLights, kinds.spot);
        variant.set(Feature::PolygonLights, kinds.polygon);
    }
    for kinds in
        [Some(listed), clustered.then_some(shadowed), clustered.then_some(ranged)].into_iter().flatten()
    {
        variant.set(Feature::Shadows, kinds.shadows.lights > 0);
        variant.set(Feature::ShadowCubes, kinds.shadows.cubes);
        variant.set(Feature::ShadowCascades, kinds.shadows.cascades);
        variant.set(Feature::SoftShadows, kinds.shadows.soft);
        variant.set(Feature::HardShadows, kinds.shadows.lights > 0 && frame.hard_shadows);
    }
}
