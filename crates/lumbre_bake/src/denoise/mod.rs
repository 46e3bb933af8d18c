//! Denoising: smooths sampled light over texels of one surface, and estimates the bias that this brings. Where the
//! samples come from is of no concern here.

pub(crate) mod box_sums;
pub(crate) mod conserve_light;
pub(crate) mod denoised;
pub(crate) mod filter_features;
pub(crate) mod filter_pass;
pub(crate) mod kernel;
pub(crate) mod nearness;
pub(crate) mod neighbourhoods;
pub(crate) mod neighbours;
#[cfg(test)]
mod neighbours_tests;
pub(crate) mod plane;
pub(crate) mod replicates;
pub(crate) mod smooth;
pub(crate) mod smoothing_bias;
pub(crate) mod surface;
pub(crate) mod texel_rows;
pub(crate) mod weighted_fit;

pub(crate) use denoised::Denoised;
pub(crate) use nearness::Nearness;
pub(crate) use neighbourhoods::Neighbourhoods;
pub(crate) use replicates::{Estimates, REPLICATES};
