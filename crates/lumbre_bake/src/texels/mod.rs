//! The texels of the lightmaps: which surface they show, the light that arrives there, and what stands in the texels
//! that show none. Not the transport between patches that the gather reads.

pub(crate) mod allocation;
pub(crate) mod blocks;
pub(crate) mod charts;
pub(crate) mod covered_texels;
pub(crate) mod direct_light;
pub(crate) mod divided_light;
pub(crate) mod error_estimate;
pub(crate) mod error_ledger;
pub(crate) mod fill;
pub(crate) mod filter_features;
pub(crate) mod footprint;
pub(crate) mod gather;
pub(crate) mod hidden;
mod incident;
pub(crate) mod kept;
pub(crate) mod lanes;
pub(crate) mod late;
mod light_cuts;
mod light_visibility;

pub(crate) mod local_light;
pub(crate) mod neighbours;
pub(crate) mod plane;
pub(crate) mod radiance_cache;
pub(crate) mod resolution_error;
pub(crate) mod rounds;
pub(crate) mod seams;
pub(crate) mod separate_light;
pub(crate) mod shafts;
pub(crate) mod shared_light;
pub(crate) mod smooth;
pub(crate) mod smoothing_bias;
pub(crate) mod straddling;
pub(crate) mod surroundings;
pub(crate) mod texel_radiance;
pub(crate) mod tile_sequence;
pub(crate) mod tiles;
pub(crate) mod weighted_fit;
pub(crate) mod worst_places;
