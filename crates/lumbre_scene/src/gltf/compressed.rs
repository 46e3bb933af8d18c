//! Decodes the compressed data of a file: buffer views (meshopt) and mesh primitives (Draco). The codecs are
//! in their own modules.

use std::borrow::Cow;

use super::compressed_primitives::{self, DecodedAccessors};
use super::compressed_views::{self, DecodedViews};
use super::document::Document;
use super::error::LoadProblem;
use super::limits::Budget;

/// The decompressed data of a file.
#[derive(Clone, Debug, Default)]
pub(crate) struct Decoded {
    /// Buffer views compressed with `EXT_meshopt_compression`.
    pub views: DecodedViews,
    /// Accessors of primitives compressed with `KHR_draco_mesh_compression`.
    pub accessors: DecodedAccessors,
}

/// Decodes all compressed data of a file.
pub(crate) fn decode(
    document: &Document,
    contents: &[Cow<'_, [u8]>],
    budget: &mut Budget,
) -> Result<Decoded, LoadProblem> {
    let views = compressed_views::decode(document, contents, budget)?;
    let accessors = compressed_primitives::decode(document, contents, budget)?;
    Ok(Decoded { views, accessors })
}
