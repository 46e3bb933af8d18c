//! Limits on the size of a decoded scene.

use super::document::Document;
use super::error::LoadProblem;

/// Limits on what loading allocates, so that a small file cannot fill the memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoadLimits {
    /// Total size of decoded vertices and indices in bytes. The default is 64 MiB plus 64 times the size of
    /// the file with its buffers, plus 1024 times the size of data compressed with
    /// `KHR_draco_mesh_compression`, where a triangle may take one byte.
    pub decoded_bytes: Option<u64>,
    /// Largest width and height of an image in texels; 16384 by default.
    pub image_side: u32,
    /// Total size of decoded images in bytes; 32 GiB by default. An image is also refused before it is
    /// decoded if it claims more texels than its bytes can represent.
    pub image_bytes: u64,
}

impl Default for LoadLimits {
    fn default() -> Self {
        Self { decoded_bytes: None, image_side: 16_384, image_bytes: 32 << 30 }
    }
}

impl LoadLimits {
    /// The budget for decoding a file of this size with these buffers.
    pub(crate) fn budget(
        &self,
        file_bytes: usize,
        document: &Document,
        contents: &[std::borrow::Cow<'_, [u8]>],
    ) -> Budget {
        let total = contents
            .iter()
            .fold(file_bytes as u64, |total, content| total.saturating_add(content.len() as u64));
        let compressed = compressed_bytes(document).min(total).saturating_mul(DRACO_EXPANSION);
        let default = || total.saturating_mul(64).saturating_add(64 << 20).saturating_add(compressed);
        Budget::new(self.decoded_bytes.unwrap_or_else(default))
    }
}

/// How many bytes of vertices and indices one byte of Draco data may expand to.
const DRACO_EXPANSION: u64 = 1024;

/// Total size of the buffer views that hold Draco data, as claimed by the document. Each view is counted
/// once.
fn compressed_bytes(document: &Document) -> u64 {
    let primitives = document.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let views = primitives.filter_map(|primitive| {
        primitive.extensions.get("KHR_draco_mesh_compression")?.get("bufferView")?.as_u64()
    });
    let distinct: std::collections::HashSet<u64> = views.collect();
    let lengths =
        distinct.into_iter().filter_map(|view| document.buffer_views.get(usize::try_from(view).ok()?));
    lengths.fold(0u64, |total, view| total.saturating_add(view.byte_length.0))
}

/// A limit in bytes, and how much of it is used up.
#[derive(Clone, Debug)]
pub(crate) struct Budget {
    used: u64,
    limit: u64,
}

impl Budget {
    pub(crate) fn new(limit: u64) -> Self {
        Self { used: 0, limit }
    }

    /// Takes `count` elements of `size` bytes from the budget; called before they are allocated. `what` names
    /// them in the error.
    pub(crate) fn charge(
        &mut self,
        count: u64,
        size: usize,
        what: impl FnOnce() -> String,
    ) -> Result<(), LoadProblem> {
        let needed = count.saturating_mul(size as u64).saturating_add(self.used);
        if needed > self.limit {
            return Err(LoadProblem::TooLarge { what: what(), needed, limit: self.limit });
        }
        self.used = needed;
        Ok(())
    }
}
