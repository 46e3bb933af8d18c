//! How light gets from surface to surface: patches, form factors, the linear system, direct light.
//! Not the texels that show it.

pub(crate) mod box_tree;
pub(crate) mod components;
pub(crate) mod contacts;
#[cfg(test)]
mod contour;
pub(crate) mod cuts;
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
pub(crate) mod solver;
