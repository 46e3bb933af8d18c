//! Compiles WESL modules with feature flags to a wgpu shader module, and reports errors.

use lumbre_shaders::to_wgsl;

use crate::RenderError;

/// Compiles one variant for the device.
pub(crate) fn compile(
    device: &wgpu::Device,
    root: &str,
    flags: &[(&str, bool)],
) -> Result<wgpu::ShaderModule, RenderError> {
    let variant = || flags.iter().filter(|(_, on)| *on).map(|(name, _)| *name).collect::<Vec<_>>().join(" ");
    let mut source = to_wgsl(root, flags)
        .map_err(|error| RenderError::Shader { variant: variant(), message: error.to_string() })?;
    let on = |name: &str| flags.contains(&(name, true));
    let early = device.features().contains(wgpu::Features::SHADER_EARLY_DEPTH_TEST);
    if on("COUNT_LIGHTS") && !on("ALPHA_MASK") && early {
        source = tested_early(&source).into();
    }
    let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(root),
        source: wgpu::ShaderSource::Wgsl((&*source).into()),
    });
    match pollster::block_on(scope.pop()) {
        None => Ok(module),
        Some(error) => Err(RenderError::Shader { variant: variant(), message: error.to_string() }),
    }
}

/// Returns WGSL with a forced depth test before each fragment. Without it, fragment shaders that write a
/// buffer are tested after they have run, so hidden fragments would be counted. It must not be used in
/// shaders that discard fragments, because an early test has already written the depth.
fn tested_early(source: &str) -> String {
    source.replace("@fragment", "@early_depth_test(force) @fragment")
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use lumbre_optics::{ReflectionModel, Shading};

    use super::{tested_early, to_wgsl};
    use crate::extract::LitPass;
    use crate::g_buffer::{DeferredVariants, GBufferContents};
    use crate::shader::{Feature, TableAccess, Variant};

    /// Returns the WGSL of a variant for a device with storage buffers. naga has validated it, and also that
    /// for a device whose fragments load records for each other.
    fn valid(variant: &Variant) -> Arc<str> {
        let shared = valid_with(variant, TableAccess { in_textures: true, shared: true });
        let shares = variant.shares_records();
        assert_eq!(shared.contains("subgroup"), shares, "{variant}:\n{shared}");
        let plain = valid_with(variant, TableAccess::default());
        assert!(!plain.contains("subgroup"), "{variant}:\n{plain}");
        plain
    }

    fn valid_with(variant: &Variant, tables: TableAccess) -> Arc<str> {
        let mut source = to_wgsl(variant.module(), &variant.flags(tables)).unwrap();
        if variant.has(Feature::CountLights) && variant.module() == "forward" {
            source = tested_early(&source).into();
            assert_eq!(source.matches("@early_depth_test(force) @fragment").count(), 1, "{source}");
        }
        let module = match naga::front::wgsl::parse_str(&source) {
            Ok(module) => module,
            Err(error) => panic!("{variant}: {}", error.emit_to_string(&source)),
        };
        let mut capabilities = naga::valid::Capabilities::default();
        capabilities.set(naga::valid::Capabilities::EARLY_DEPTH_TEST, source.contains("@early_depth_test"));
        capabilities.set(naga::valid::Capabilities::SUBGROUP, tables.shared);
        let mut validator = naga::valid::Validator::new(naga::valid::ValidationFlags::all(), capabilities);
        if let Err(error) = validator.validate(&module) {
            panic!("{variant}: {}", error.emit_to_string(&source));
        }
        source
    }

    fn variant(shading: Shading, features: &[Feature]) -> Variant {
        let mut variant = Variant::new(shading, ReflectionModel::Blinn);
        features.iter().for_each(|feature| variant.set(*feature, true));
        variant.reduced()
    }

    /// Deferred lighting of what a frame can have, in fragments and in compute shaders, for devices with buffers and
    /// for those with textures. What only a device with buffers has is not run on a software rasterizer.
    #[test]
    fn every_deferred_surface_has_valid_shaders_on_every_device() {
        let clusters = [
            Feature::InverseSquareClusters,
            Feature::InverseSquareSpots,
            Feature::RangedClusters,
            Feature::SpotLights,
            Feature::LocalViewer,
        ];
        let shadows = [
            Feature::ShadowedClusters,
            Feature::Shadows,
            Feature::ShadowCubes,
            Feature::ShadowCascades,
            Feature::SoftShadows,
            Feature::StaticLights,
            Feature::DirectionalLights,
        ];
        let fog = [Feature::Fog, Feature::FogLinear, Feature::TwoSided, Feature::HalfRange];
        let tinted = [Feature::Uv0, Feature::BaseColorTexture, Feature::VertexColor];
        let shown = [Feature::Display, Feature::DisplaySrgb, Feature::EncodeSrgb];
        let lightmap = [Feature::Lightmap, Feature::Uv1, Feature::StaticLights, Feature::BakedMetal];
        let volume = [Feature::IrradianceVolume, Feature::PolygonLights];
        let sets: [&[Feature]; 9] = [
            &[],
            &clusters,
            &shadows,
            &fog,
            &tinted,
            &shown,
            &lightmap,
            &volume,
            &[Feature::InverseSquareClusters, Feature::UniformLights, Feature::CountLights],
        ];
        let contents = [false, true].map(|lit_in_compute| GBufferContents { details: true, lit_in_compute });
        for features in sets {
            let all: Vec<_> = LIT.into_iter().chain(clusters).chain(features.iter().copied()).collect();
            for forward in [LIT.iter().chain(features).copied().collect(), all] {
                let forward = variant(Shading::Phong, &forward);
                for contents in contents {
                    let of = DeferredVariants::of(&forward, LitPass::Forward, Some(contents)).unwrap();
                    let wgsl = valid(&of.lighting);
                    assert_eq!(wgsl.contains("@compute"), contents.lit_in_compute, "{wgsl}");
                    assert_eq!(wgsl.contains("@fragment"), !contents.lit_in_compute, "{wgsl}");
                    valid(&of.geometry);
                }
            }
        }
    }

    const LIT: [Feature; 3] = [Feature::Lit, Feature::DynamicLights, Feature::PointLights];

    #[test]
    fn every_feature_makes_a_valid_shader_in_every_shading() {
        // Other features that a feature requires.
        let with = |feature: Feature| match feature {
            Feature::BaseColorTexture => vec![Feature::Uv0, Feature::Modulated],
            Feature::EmissiveTexture
            | Feature::MetallicRoughnessTexture
            | Feature::NormalTexture
            | Feature::OcclusionTexture => vec![Feature::Uv0],
            Feature::Lightmap => vec![Feature::Uv1, Feature::StaticLights],
            Feature::BakedMetal => vec![Feature::Lightmap, Feature::Uv1, Feature::StaticLights],
            Feature::AlphaMask => vec![Feature::Alpha],
            Feature::FogLinear
            | Feature::FogExponential
            | Feature::FogExponentialSquared
            | Feature::FogDepthCue => vec![Feature::Fog],
            Feature::Fog => vec![Feature::FogLinear],
            Feature::ClampVertices => vec![Feature::Clamp],
            Feature::UniformLights | Feature::InverseSquareSpots => vec![Feature::InverseSquareClusters],
            Feature::ShadowCubes | Feature::ShadowCascades | Feature::SoftShadows => vec![Feature::Shadows],
            Feature::DisplaySrgb | Feature::DisplayClamp | Feature::EncodeSrgb | Feature::DecodeSrgb => {
                vec![Feature::Display]
            }
            _ => vec![],
        };
        // Those of deferred shading come together: see the test below.
        let deferred = [Feature::GBuffer, Feature::GBufferDetails, Feature::Deferred, Feature::InCompute];
        for shading in Shading::ALL {
            for feature in Feature::ALL.iter().filter(|feature| !deferred.contains(feature)) {
                let features: Vec<_> = LIT.into_iter().chain(with(*feature)).chain([*feature]).collect();
                valid(&variant(*shading, &features));
            }
            for model in ReflectionModel::ALL {
                let mut variant = variant(*shading, &LIT);
                variant.reflection = *model;
                valid(&variant);
            }
            let unlit = [Feature::BaseColorTexture, Feature::Uv0, Feature::Alpha];
            valid(&variant(*shading, &unlit));
        }
    }

    #[test]
    fn the_fullest_vertex_stage_fits_the_limits_of_every_device() {
        // `wgpu::Limits::default()` has 16 variables between the stages, of which `front_facing` is one.
        const MOST: usize = 15;
        let textures = [
            Feature::BaseColorTexture,
            Feature::EmissiveTexture,
            Feature::MetallicRoughnessTexture,
            Feature::OcclusionTexture,
            Feature::NormalTexture,
            Feature::Uv0,
            Feature::Uv1,
            Feature::Modulated,
            Feature::VertexColor,
            Feature::Fog,
            Feature::FogLinear,
            Feature::TwoSided,
            Feature::BakedMetal,
        ];
        let mut fullest = 0;
        for shading in Shading::ALL {
            for baked in [Feature::Lightmap, Feature::IrradianceVolume] {
                let features: Vec<_> =
                    LIT.into_iter().chain(textures).chain([baked, Feature::StaticLights]).collect();
                let wgsl = valid(&variant(*shading, &features));
                let varyings = wgsl
                    .split("struct ")
                    .find(|part| part.lines().next().is_some_and(|name| name.contains("Varyings")));
                let body =
                    varyings.and_then(|part| part.split('}').next()).expect("the varyings are a structure");
                let count = body.matches("@location").count();
                assert!(count <= MOST, "{}, {baked:?}: {count}", shading.name());
                fullest = fullest.max(count);
            }
        }
        assert_eq!(fullest, MOST, "the list of features above is not the fullest");
    }

    #[test]
    fn what_is_not_called_for_leaves_no_instruction() {
        let plain = valid(&variant(Shading::Phong, &LIT));
        for word in [
            "textureSample",
            ": sampler",
            "lightmap",
            "fog_weight",
            "spot_factor",
            "discard",
            "phong_4n",
            "dpdx",
            "map_normal",
            "tangent",
            "occlusion",
            "peak",
            "polygon",
            "contour",
            "cluster",
            "inverse_square",
            "shadow",
            "tone_curve",
            "probe",
            "ambient_cube",
            "atomic",
            "contributing",
        ] {
            assert!(!plain.contains(word), "{word} is left in:\n{plain}");
        }
        let unlit = valid(&variant(Shading::Phong, &[Feature::Uv0, Feature::BaseColorTexture]));
        assert!(unlit.contains("textureSample"));
        for word in ["frame_lights", "light_list", "safe_normalize", "for ("] {
            assert!(!unlit.contains(word), "{word} is left in:\n{unlit}");
        }
        // With polygon lights alone, nothing of the other kinds is left; with another kind, both are there.
        let polygons = [Feature::Lit, Feature::DynamicLights, Feature::StaticLights, Feature::PolygonLights];
        let alone = valid(&variant(Shading::Phong, &polygons));
        assert!(alone.contains("polygon_form_factor") && !alone.contains("evaluate_light("), "{alone}");
        let together =
            valid(&variant(Shading::Phong, &[polygons.as_slice(), &[Feature::PointLights]].concat()));
        assert!(together.contains("polygon_form_factor") && together.contains("attenuate"), "{together}");
        // With clusters alone, inverse-square lights are evaluated without anything that they do not have;
        // with other lights, all of that is there.
        let clusters = [Feature::Lit, Feature::InverseSquareClusters, Feature::UniformLights];
        let lean = valid(&variant(Shading::Phong, &clusters));
        assert!(lean.contains("cluster_lists") && lean.contains("attenuate_quadratic"), "{lean}");
        for word in ["evaluate_light(", "spot_factor", "attenuate(", "for (", "array<LightParameters>"] {
            assert!(!lean.contains(word), "{word} is left in:\n{lean}");
        }
        let lightmapped = [Feature::Lightmap, Feature::Uv1, Feature::RangedClusters, Feature::SpotLights];
        let all = valid(&variant(Shading::Phong, &[clusters.as_slice(), &lightmapped].concat()));
        assert!(all.contains("spot_factor"), "{all}");
        assert!(all.contains("first_baked"), "baked lights are told apart:\n{all}");
        // Shadows of one kind of light contain nothing of the other kinds.
        let spots = valid(&variant(
            Shading::Phong,
            &[LIT.as_slice(), &[Feature::SpotLights, Feature::Shadows]].concat(),
        ));
        assert!(spots.contains("texture_depth_2d"), "{spots}");
        for word in ["cube_face", "cascade", "penumbra"] {
            assert!(!spots.contains(word), "{word} is left in:\n{spots}");
        }
        let dark = valid(&variant(Shading::Phong, &[Feature::Lit]));
        assert!(!dark.contains("for ("), "a scene without lights loops:\n{dark}");
        // An irradiance volume alone is evaluated at the rate of the shading, with the normals of a normal
        // map, without a loop or a highlight.
        let by_volume = [Feature::Lit, Feature::IrradianceVolume, Feature::Uv0, Feature::NormalTexture];
        for shading in Shading::ALL {
            let variant = variant(*shading, &by_volume);
            assert_eq!((variant.shading, variant.has(Feature::Matt)), (*shading, true));
            let shader = valid(&variant);
            assert!(shader.contains("ambient_cube"), "{shader}");
            assert_eq!(shader.contains("map_normal"), *shading == Shading::Phong, "{shader}");
            for word in ["for (", "viewer_direction", "filtered_lobe", "frame_ambient"] {
                assert!(!shader.contains(word), "{word} is left in:\n{shader}");
            }
        }
        let lit = valid(&variant(Shading::Phong, &[LIT.as_slice(), &[Feature::SpotLights]].concat()));
        assert!(
            lit.contains("for (") && lit.contains("spot_factor"),
            "the test would not see a spot light:\n{lit}"
        );
    }
}
