//! Which surface each texel of the lightmaps shows, and which texels other geometry hides. Not the light that arrives
//! there.

pub(crate) mod charts;
pub(crate) mod contact_lines;
pub(crate) mod covered_texels;
pub(crate) mod divided_texels;
pub(crate) mod footprint;
pub(crate) mod hidden;
#[cfg(test)]
pub(crate) mod on_a_floor;
pub(crate) mod representatives;
pub(crate) mod texel_geometry;
pub(crate) mod texel_groups;
pub(crate) mod tile_sequence;

pub(crate) use contact_lines::ContactLines;
pub(crate) use covered_texels::CoveredTexels;
pub(crate) use footprint::{Footprint, FootprintPoint, GRID, MapAxes, Texel, barycentric, receiver};
pub(crate) use representatives::Representatives;
pub(crate) use texel_groups::TexelGroups;
pub(crate) use tile_sequence::TileSequence;
