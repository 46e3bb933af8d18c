//! How light gets from surface to surface: patches, form factors, the linear system, direct light.
//! Not the texels that show it.

#[cfg(test)]
mod contour;
pub(crate) mod direct;
pub(crate) mod emitter_tree;
pub(crate) mod emitters;
pub(crate) mod exchange;
#[cfg(test)]
mod form_factor_tests;
pub(crate) mod form_factors;
pub(crate) mod guide;
pub(crate) mod patches;
pub(crate) mod polygon;
pub(crate) mod punctual;
mod share_variance;
pub(crate) mod solver;
