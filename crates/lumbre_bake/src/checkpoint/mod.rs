//! Checkpoints: what an interrupted bake has computed, in a file, so that it goes on from there and ends with the same bits. Not the
//! finished lightmaps.
//!
//! ```text
//!   magic      8 bytes   "LUMBRECP"
//!   version    u32       VERSION; everything is little endian
//!   identity  32 bytes   content hash of scene, options and baker
//!   checksum  32 bytes   BLAKE3 of all that
//!   blocks, each:
//!     bytes    u64       of the block's content: all up to its checksum
//!     in the format of postcard:
//!       stage            by its place in the order of the stages
//!       of               values of the whole list
//!       start            the first of them that is here
//!       seconds          that the bake had taken
//!       values           none where the time ran out
//!     checksum 32 bytes  BLAKE3 of the checksum before and of this block
//! ```
//!
//! Everything that takes long is a list of values, each a function of its index, computed in chunks: the bake runs through its stages and
//! takes the chunks that are in the file from there. All between them is computed again. So there is no state to be restored, and what
//! follows cannot tell where its values come from.
//!
//! The header is written beside and renamed. Blocks are appended, each value once; a block that a crash has cut short fails its checksum,
//! and the bake goes on from the one before.

pub(crate) mod checkpoint_file;
pub(crate) mod record;

use std::path::PathBuf;
use std::time::Duration;

pub(crate) use checkpoint_file::CheckpointFile;
pub(crate) use record::Record;

/// The version of the format: another is not read.
const VERSION: u32 = 3;

/// Where a bake keeps what it has computed, and whether it begins with what is kept there.
///
/// The bake does not remove the file when it is complete: the caller does, with [`Checkpoint::remove`], when the result is safe.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Checkpoint {
    /// The file. Beside it, while it is begun, lies one with `.partial` at its end.
    pub path: PathBuf,
    /// Begins with what is there. Without it a checkpoint that is there is replaced.
    pub resume: bool,
    /// Time between writes, which is what a crash costs; longer where writing itself takes more than a twentieth of it. An interruption
    /// by the progress callback costs nothing: it writes first.
    pub interval: Duration,
}

impl Checkpoint {
    /// A checkpoint that is written every two seconds, and read if `resume`.
    pub fn new(path: impl Into<PathBuf>, resume: bool) -> Self {
        Self { path: path.into(), resume, interval: Duration::from_secs(2) }
    }

    /// Removes the file, and what a killed bake may have left beside it.
    ///
    /// # Errors
    /// What the system says, unless there is no such file.
    pub fn remove(&self) -> std::io::Result<()> {
        checkpoint_file::remove_if_there(&checkpoint_file::temporary(&self.path))?;
        checkpoint_file::remove_if_there(&self.path)
    }
}
