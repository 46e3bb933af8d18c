//! The light by bounces of every covered texel: rays that read the radiance of patches and texels, in rounds until the error asked for is reached.
//! Not the smoothing of what they found.

pub(crate) mod error_estimate;
pub(crate) mod error_ledger;
pub(crate) mod gather;
pub(crate) mod gather_sums;
pub(crate) mod incident;
pub(crate) mod lit_texels;
pub(crate) mod map_error;
pub(crate) mod patch_fallback;
pub(crate) mod radiance_cache;
pub(crate) mod reused_gather;
pub(crate) mod rounds;
pub(crate) mod texel_radiance;
