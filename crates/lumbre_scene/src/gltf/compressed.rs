//! What of a file's data is compressed, decoded and bounded: buffer views and the primitives of meshes. Not the codecs.

use std::borrow::Cow;

use super::compressed_primitives::{self, DecodedAccessors};
use super::compressed_views::{self, DecodedViews};
use super::document::Document;
use super::error::LoadProblem;
use super::limits::Budget;

/// The data of a file that were compressed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Decoded {
    /// By `EXT_meshopt_compression`.
    pub views: DecodedViews,
    /// By `KHR_draco_mesh_compression`.
    pub accessors: DecodedAccessors,
}

/// Decodes everything that is compressed in a file.
pub(crate) fn decode(
    document: &Document,
    contents: &[Cow<'_, [u8]>],
    budget: &mut Budget,
) -> Result<Decoded, LoadProblem> {
    let views = compressed_views::decode(document, contents, budget)?;
    let accessors = compressed_primitives::decode(document, contents, budget)?;
    Ok(Decoded { views, accessors })
}
