//! How light gets from surface to surface: patches, form factors, the linear system, direct light.
//! Not the texels that show it.

pub(crate) mod clipping;
mod components;
pub(crate) mod contacts;
mod cosine_rays;
pub(crate) mod cut_out;
pub(crate) mod cuts;
pub(crate) mod direct;
mod emitter_bounds;
mod emitter_tree;
mod emitter_walk;
pub(crate) mod emitters;
pub(crate) mod exchange;
#[cfg(test)]
mod exchange_tests;
#[cfg(test)]
mod form_factor_tests;
pub(crate) mod form_factors;
mod global_lines;
#[cfg(test)]
mod lambert_integral;
mod larger_patches;
pub(crate) mod light_cut;
mod light_tree;
mod mean_of_points;
#[cfg(test)]
mod method_study_tests;
pub(crate) mod patch_index;
#[cfg(test)]
mod patch_tests;
pub(crate) mod patches;
pub(crate) mod polygon;
pub(crate) mod punctual;
mod punctual_irradiance;
mod receiver_quadrature;
pub(crate) mod sampling_guide;
pub(crate) mod shadow_clipping;
pub(crate) mod shaft;
mod share_variance;
pub(crate) mod shared_samples;
mod size_error;
mod solid_angle;
pub(crate) mod solution;
mod solver;
mod stationary;
pub(crate) mod visibility;
mod visible_part;
