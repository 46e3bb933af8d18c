//! Patches, the form factors between them, and the linear system whose solution is the light that leaves each of them.
//! The light of texels is computed from it in `final_gather`.

pub(crate) mod bsp;
pub(crate) mod components;
pub(crate) mod cosine_rays;
pub(crate) mod exchange;
#[cfg(test)]
mod exchange_tests;
pub(crate) mod face_clusters;
#[cfg(test)]
pub(crate) mod form_factor_tests;
pub(crate) mod form_factors;
pub(crate) mod global_lines;
pub(crate) mod larger_patches;
#[cfg(test)]
mod method_study_tests;
pub(crate) mod patch_index;
pub(crate) mod patch_light;
#[cfg(test)]
mod patch_tests;
pub(crate) mod patches;
pub(crate) mod ray_counts;
pub(crate) mod sampling_guide;
pub(crate) mod size_error;
pub(crate) mod solution;
pub(crate) mod solver;
mod sparse_distributions;
pub(crate) mod stationary;
mod subdivision;
pub(crate) mod transport;
mod triangle_cells;
mod unseen_regions;

pub(crate) use exchange::{Exchange, ExchangeReport};
pub(crate) use form_factors::FormFactors;
pub(crate) use patch_index::{PatchIndex, RegionIndex};
pub(crate) use patches::{Patch, Patches};
pub(crate) use sampling_guide::{Discovery, GuidedPatch, SamplingGuide};
pub(crate) use sparse_distributions::RowPart;
pub(crate) use subdivision::Subdivision;
pub(crate) use transport::{PatchResolution, Transport};
