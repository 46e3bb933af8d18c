//! From WESL modules and feature flags to a wgpu shader module, errors included.

use std::borrow::Cow;

use crate::RenderError;
use lumbre_shaders::MODULES;

/// Resolves imports and conditions of `root` with exactly these flags.
pub(crate) fn to_wgsl(root: &str, flags: &[(&str, bool)]) -> Result<String, String> {
    let mut resolver = wesl::VirtualResolver::new();
    for (path, source) in MODULES {
        let path = format!("package::{}", path.replace('/', "::"));
        let path = path.parse().map_err(|error| format!("{path}: {error}"))?;
        resolver.add_module(path, Cow::Borrowed(*source));
    }
    let mut compiler = wesl::Wesl::new_barebones().set_custom_resolver(resolver);
    compiler.set_mangler(wesl::ManglerKind::Escape).set_options(wesl::CompileOptions {
        imports: true,
        condcomp: true,
        strip: true,
        lazy: true,
        ..Default::default()
    });
    // A flag that nobody set is a slip of ours, not a feature that is off.
    compiler.set_missing_feature_behavior(wesl::Feature::Error);
    for (name, on) in flags {
        compiler.set_feature(name, *on);
    }
    let root = format!("package::{root}").parse().map_err(|error| format!("{root}: {error}"))?;
    compiler.compile(&root).map(|result| result.to_string()).map_err(|error| error.to_string())
}

/// Compiles one variant for the device.
pub(crate) fn compile(
    device: &wgpu::Device,
    root: &str,
    flags: &[(&str, bool)],
) -> Result<wgpu::ShaderModule, RenderError> {
    let variant = || flags.iter().filter(|(_, on)| *on).map(|(name, _)| *name).collect::<Vec<_>>().join(" ");
    let source =
        to_wgsl(root, flags).map_err(|message| RenderError::Shader { variant: variant(), message })?;
    let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(root),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    match pollster::block_on(scope.pop()) {
        None => Ok(module),
        Some(error) => Err(RenderError::Shader { variant: variant(), message: error.to_string() }),
    }
}

#[cfg(test)]
mod tests {
    use lumbre_optics::{ReflectionModel, Shading};

    use super::to_wgsl;
    use crate::shader::{Feature, Variant};

    /// The WGSL of a variant, which naga accepts.
    fn valid(variant: &Variant) -> String {
        let source = to_wgsl("forward", &variant.flags()).unwrap();
        let module = match naga::front::wgsl::parse_str(&source) {
            Ok(module) => module,
            Err(error) => panic!("{variant}: {}", error.emit_to_string(&source)),
        };
        let capabilities = naga::valid::Capabilities::default();
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

    const LIT: [Feature; 3] = [Feature::Lit, Feature::DynamicLights, Feature::PointLights];

    #[test]
    fn every_feature_makes_a_valid_shader_in_every_shading() {
        // What a feature needs beside itself.
        let with = |feature: Feature| match feature {
            Feature::BaseColorTexture => vec![Feature::Uv0, Feature::Modulated],
            Feature::EmissiveTexture
            | Feature::MetallicRoughnessTexture
            | Feature::NormalTexture
            | Feature::OcclusionTexture => vec![Feature::Uv0],
            Feature::Lightmap => vec![Feature::Uv1, Feature::StaticLights],
            Feature::AlphaMask => vec![Feature::Alpha],
            Feature::FogLinear
            | Feature::FogExponential
            | Feature::FogExponentialSquared
            | Feature::FogDepthCue => vec![Feature::Fog],
            Feature::Fog => vec![Feature::FogLinear],
            Feature::ClampVertices => vec![Feature::Clamp],
            Feature::UniformLights => vec![Feature::InverseSquareClusters],
            Feature::ShadowCubes | Feature::ShadowCascades | Feature::SoftShadows => vec![Feature::Shadows],
            Feature::DisplaySrgb | Feature::DisplayClamp | Feature::EncodeSrgb | Feature::DecodeSrgb => {
                vec![Feature::Display]
            }
            _ => vec![],
        };
        for shading in Shading::ALL {
            for feature in Feature::ALL {
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
        ] {
            assert!(!plain.contains(word), "{word} is left in:\n{plain}");
        }
        let unlit = valid(&variant(Shading::Phong, &[Feature::Uv0, Feature::BaseColorTexture]));
        assert!(unlit.contains("textureSample"));
        for word in ["frame_lights", "light_list", "safe_normalize", "for ("] {
            assert!(!unlit.contains(word), "{word} is left in:\n{unlit}");
        }
        // Polygons alone: nothing of the other kinds is left; all together: both are there.
        let polygons = [Feature::Lit, Feature::DynamicLights, Feature::StaticLights, Feature::PolygonLights];
        let alone = valid(&variant(Shading::Phong, &polygons));
        assert!(alone.contains("polygon_form_factor") && !alone.contains("evaluate_light("), "{alone}");
        let together =
            valid(&variant(Shading::Phong, &[polygons.as_slice(), &[Feature::PointLights]].concat()));
        assert!(together.contains("polygon_form_factor") && together.contains("attenuate"), "{together}");
        // Clusters alone: of inverse-square lights nothing is asked that they do not have; with others, all is there.
        let clusters = [Feature::Lit, Feature::InverseSquareClusters, Feature::UniformLights];
        let lean = valid(&variant(Shading::Phong, &clusters));
        assert!(lean.contains("cluster_lists") && lean.contains("attenuate_inverse_square"), "{lean}");
        for word in ["evaluate_light(", "spot_factor", "attenuate(", "for (", "array<LightParameters>"] {
            assert!(!lean.contains(word), "{word} is left in:\n{lean}");
        }
        let lightmapped = [Feature::Lightmap, Feature::Uv1, Feature::RangedClusters, Feature::SpotLights];
        let all = valid(&variant(Shading::Phong, &[clusters.as_slice(), &lightmapped].concat()));
        assert!(all.contains("spot_factor"), "{all}");
        assert!(all.contains("first_baked"), "baked lights are told apart:\n{all}");
        // Shadows of one kind of light know nothing of the others'.
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
        let lit = valid(&variant(Shading::Phong, &[LIT.as_slice(), &[Feature::SpotLights]].concat()));
        assert!(
            lit.contains("for (") && lit.contains("spot_factor"),
            "the test would not see a spot light:\n{lit}"
        );
    }
}
