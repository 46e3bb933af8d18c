//! Checkpoints: a file with what an interrupted bake has computed, so that the next one continues from there and ends
//! with the same bits. Not the finished lightmaps.
//!
//! ```text
//!   magic      8 bytes   "LUMBRECP"
//!   version    u32       VERSION; everything is little endian
//!   identity  32 bytes   content hash of scene, options and baker
//!   checksum  32 bytes   BLAKE3 of all that
//!   blocks, each:
//!     bytes    u64       length of the block's content: all up to its checksum
//!     content, in the format of postcard:
//!       stage            its place in the order of the stages
//!       of               how many values the whole list has
//!       start            index of the first value in this block
//!       seconds          that the bake had taken by then
//!       values           none where the time ran out
//!     checksum 32 bytes  BLAKE3 of the previous checksum and of this block's content
//! ```
//!
//! Everything that takes long is a list of values, each a function of its index, and is computed in chunks. A resumed
//! bake runs through all its stages, and takes the chunks that are in the file from there; everything in between is
//! computed again. So there is no state to restore, and later stages cannot tell where their values come from.
//!
//! The header is written to a temporary file, which is then renamed. Blocks are appended, each value once. A block that
//! a crash has cut short is noticed, and the bake continues from the one before.

pub(crate) mod checkpoint_file;
pub(crate) mod record;
pub(crate) mod replace_file;

use std::path::PathBuf;
use std::time::Duration;

pub(crate) use checkpoint_file::CheckpointFile;
pub(crate) use record::Record;
use replace_file::{remove_if_there, temporary_path};

/// Version of the file format; files of other versions are not read.
const VERSION: u32 = 4;

/// Where a bake keeps what it has computed, and whether it resumes from what is there.
///
/// The bake does not remove the file when it is complete: the caller does, with [`Checkpoint::remove`], once the result
/// is saved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Checkpoint {
    /// The file. While it is being created, there is another one beside it, with `.partial` appended to the name.
    pub path: PathBuf,
    /// Whether to resume from an existing checkpoint, instead of replacing it.
    pub resume: bool,
    /// Time between writes, which is what a crash can cost; it becomes longer where a write takes more than a twentieth
    /// of it. An interruption by the progress callback costs nothing, as everything is written first.
    pub interval: Duration,
}

impl Checkpoint {
    /// A checkpoint that is written every two seconds, and resumed from if `resume` is set.
    pub fn new(path: impl Into<PathBuf>, resume: bool) -> Self {
        Self { path: path.into(), resume, interval: Duration::from_secs(2) }
    }

    /// Removes the file, and the temporary one that a killed bake may have left beside it.
    ///
    /// # Errors
    /// Those of the file system, except that there is no such file.
    pub fn remove(&self) -> std::io::Result<()> {
        remove_if_there(&temporary_path(&self.path))?;
        remove_if_there(&self.path)
    }
}
