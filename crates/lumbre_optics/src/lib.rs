//! Light and material types and the reflection equations in f64.
//!
//! This crate holds everything that the documents \[I\], \[E\] and \[M\] (`docs/documents.md`) say about one light
//! at one point. It knows nothing about scenes, files or devices. Each equation has its own file and a twin in
//! `shaders/optics`: a WGSL function of the same name, with the same order of arguments and the same guards.
//!
//! ```text
//!       Light                                   viewer_direction ─┐            Material, front or back
//!         │ where it stands, where it shines                      │                  │ + textures
//!         ▼                                                       │                  ▼
//!   evaluate_light ──► LightSample ──────────────► light_contribution ◄──────── SurfaceSample
//!     attenuate          l, colours, factors         │  lambert                  k_a k_d k_s n
//!     spot_factor                                    │  phong │ blinn_phong (4n, matched) │ torrance_sparrow
//!                                                    ▼                           D: microfacets  F: fresnel
//!                          apply_fog ◄── add_emission ◄── Contribution { ambient, diffuse, specular }
//!
//!   beside it: polygon_light_contribution (an emissive polygon in place of a LightSample),
//!              transmitted_direction (Snell), facing_normal (two-sided), LightMatrix (document [I]'s 3x3 matrices),
//!              normalized_phong (highlights of one energy), map_normal and occlusion (textures that bend and weaken light)
//! ```
//!
//! Directions are unit vectors that point away from the surface: `normal`, `light`, `viewer`. The zero vector
//! stands for "no direction" and receives no light. Every function returns finite values for finite input; where a
//! formula itself has no value, its `try_` counterpart returns `None`. [`Light::validate`], [`Material::validate`]
//! and [`Fog::validate`] reject input that must not be loaded at all, with an error that names the field.
//!
//! The section "Error of the f32 twin" of each function bounds the error of its WGSL twin. The bounds are in terms
//! of u = 2⁻²⁴, the relative error of one rounding (half a unit in the last place), and follow from what WGSL
//! guarantees: sums, differences and products u, division 5 u, inverseSqrt 4 u, roots 9 u, exp 2 u (3 + 2 |x|),
//! log2 8 u absolute in [1/2, 2] and 6 u relative elsewhere. They hold to first order, plus a few times 2⁻¹²⁶,
//! because a device may flush numbers below that to 0. The test target `twins` has the same bounds as functions and
//! checks a device against them, with a million inputs for each.
//!
//! ```
//! use glam::{DVec3, Vec3};
//! use lumbre_optics::{Light, Material, ReflectionModel, evaluate_light, light_contribution};
//!
//! let lamp = Light::point(Vec3::splat(4.0)); // inverse square
//! lamp.validate("lamp")?;
//! let paper = Material::matt(Vec3::splat(0.5));
//! let at_point = evaluate_light(&lamp, DVec3::new(0.0, 2.0, 0.0), DVec3::ZERO, DVec3::ZERO);
//! let lit = light_contribution(ReflectionModel::Phong, &paper.front, &at_point, DVec3::Y, DVec3::Y);
//! assert_eq!(lit.diffuse, DVec3::splat(0.5)); // 0.5 · 4 / 2² · cos 0
//! # Ok::<(), lumbre_optics::LightError>(())
//! ```

mod ambient_cube;
mod angle;
mod attenuation;
mod blinn_phong;
mod emission;
mod energy_conserving;
mod error_bound;
mod evaluate_light;
mod fog;
mod fog_validation;
mod fresnel;
mod half_vector;
mod interpolation_error;
mod lambert;
mod light;
mod light_matrix;
mod light_validation;
mod material;
mod material_validation;
mod metal_reflectance;
mod microfacet_reflection;
mod microfacets;
mod normal_map;
mod normalization;
mod normalized_highlight;
mod occlusion;
mod phong;
mod polygon_light;
mod power;
mod probe_grid;
mod roughness;
mod shade;
mod shading;
mod snell;
mod specular_antialiasing;
mod spot;
mod tone_curve;
mod torrance_sparrow;
mod two_sided;
mod validation;
mod viewer;

pub use ambient_cube::{MIN_OPENNESS, ambient_cube};
pub use angle::quarter_angle;
pub use attenuation::{
    Attenuation, MAXIMUM_DISTANCE, MINIMUM_DISTANCE, UNLIMITED_RANGE, attenuate, attenuate_quadratic,
    try_attenuate,
};
pub use blinn_phong::{blinn_phong, blinn_phong_4n, blinn_phong_matched};
pub use emission::{add_emission, exitance};
pub use energy_conserving::{distribution_ggx, gltf_reflection, lobe_peak, smith_attenuation};
pub use error_bound::ErrorBound;
pub use evaluate_light::{LightSample, NoLight, evaluate_light, try_evaluate_light};
pub use fog::{
    Fog, FogMode, apply_fog, fog_depth_cue, fog_exponential, fog_exponential_squared, fog_fraction,
    fog_linear, fog_weight, try_fog_weight,
};
pub use fog_validation::FogError;
pub use fresnel::{
    fresnel_conductor, fresnel_dielectric, fresnel_schlick, try_fresnel_conductor, try_fresnel_dielectric,
};
pub use half_vector::{half_vector, try_half_vector};
pub use interpolation_error::{
    ConeOverObject, Highlight, InterpolationError, LightOverObject, TriangleSpread, interpolation_error,
};
pub use lambert::lambert;
pub use light::{BakeMode, Light, LightKind};
pub use light_matrix::{LightMatrix, ReflectionMatrix};
pub use light_validation::{LARGEST_INTENSITY, LightError};
pub use material::{AlphaMode, Lobe, Material, SHARP_SHININESS, Surface};
pub use material_validation::{LARGEST_COEFFICIENT, MaterialError};
pub use metal_reflectance::{lobe_albedo, metal_reflectance};
pub use microfacet_reflection::{
    Distribution, Fresnel, fresnel_normal_reflectance, microfacet_lobe, microfacet_reflection,
    try_fresnel_normal_reflectance,
};
pub use microfacets::{
    distribution_cosine_power, distribution_gaussian, distribution_trowbridge_reitz, half_value_angle,
    half_value_sine_squared,
};
pub use normal_map::{
    SHORTEST_BENT_SQUARED, map_normal, normal_map_spread, normal_map_widening, transformed_tangent,
};
pub use normalization::{TINY_LENGTH_SQUARED, safe_length, safe_normalize, try_normalize};
pub use normalized_highlight::{
    blinn_phong_normalization, microfacet_normalization, normalized_blinn_phong, normalized_phong,
    phong_normalization,
};
pub use occlusion::occlusion;
pub use phong::{phong, reflected_direction, try_reflected_direction};
pub use polygon_light::{
    HIGHLIGHT_SAMPLES, PolygonLight, polygon_form_factor, polygon_highlight, polygon_light_contribution,
};
pub use power::{cosine_lobe, power_of_cosine, safe_pow};
pub use probe_grid::{probe_grid_cell, probe_grid_texel};
pub use roughness::{MAX_SHININESS, shininess_from_roughness};
pub use shade::{
    Contribution, DEFAULT_IOR, SurfaceSample, light_contribution, model_exponent, shade, specular_factor,
    specular_reflection,
};
pub use shading::{FlatRule, NoShading, ReflectionModel, Shading};
pub use snell::{
    critical_angle, is_totally_reflected, transmitted_cosine, transmitted_direction, transmitted_highlight,
    try_transmitted_cosine, try_transmitted_direction,
};
pub use specular_antialiasing::{
    FILTER_VARIANCE, FilteredLobe, LARGEST_WIDENING, filtered_lobe, lobe_widening,
};
pub use spot::{MINIMUM_COSINE_DIFFERENCE, SpotCone, SpotCosines, smooth_spot_factor, spot_factor};
pub use tone_curve::{decode_srgb, decode_srgb_byte, encode_srgb, tone_curve};
pub use torrance_sparrow::{
    MINIMUM_VIEW_COSINE, geometric_attenuation, torrance_sparrow, torrance_sparrow_geometry,
};
pub use two_sided::{facing_normal, shading_normal};
pub use viewer::{try_viewer_direction, viewer_direction};
