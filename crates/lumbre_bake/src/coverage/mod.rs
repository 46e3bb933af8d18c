//! Which surface each texel of the lightmaps shows, and what hides it. Not the light that arrives there.

pub(crate) mod blocks;
pub(crate) mod charts;
pub(crate) mod covered_texels;
pub(crate) mod divided_texels;
pub(crate) mod footprint;
pub(crate) mod hidden;
pub(crate) mod tile_sequence;
pub(crate) mod tiles;
