//! The final gather: the light by bounces of every covered texel, by rays that read the radiance of patches and texels,
//! in rounds until the requested error is reached. Not the smoothing of the result: that is `denoise`.

pub(crate) mod error_estimate;
pub(crate) mod error_ledger;
pub(crate) mod first_round;
pub(crate) mod gather;
pub(crate) mod gather_sums;
pub(crate) mod incident;
pub(crate) mod learned_guide;
pub(crate) mod lit_texels;
pub(crate) mod map_error;
pub(crate) mod patch_fallback;
pub(crate) mod radiance_cache;
pub(crate) mod reused_gather;
mod round_goals;
pub(crate) mod rounds;
pub(crate) mod steep_light;
pub(crate) mod texel_radiance;

pub(crate) use error_ledger::ErrorLedger;
pub(crate) use gather_sums::{GatherSums, UnguidedLight, Weights};
pub(crate) use lit_texels::LitTexels;
pub(crate) use map_error::MapError;
pub(crate) use radiance_cache::RadianceCache;
pub(crate) use reused_gather::ReusedGather;
pub(crate) use rounds::{GatherReport, IndirectLight};
pub(crate) use texel_radiance::TexelRadiance;
