//! The file of a checkpoint: it is first read to its end, and then written from there on. Not what its values mean.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::record::{self, Record};
use super::replace_file::{WhenBusy, replace_file};
use super::{Checkpoint, VERSION};
use crate::content_hash::ContentHash;
use crate::error::CheckpointError;

const MAGIC: &[u8; 8] = b"LUMBRECP";
const CHECKSUM: usize = 32;
const HEADER: usize = 8 + 4 + 32 + CHECKSUM;
/// Bytes beyond which pending blocks are written without waiting for the interval.
const MAX_PENDING: usize = 64 << 20;
/// The interval is at least this many times as long as a write takes.
const MIN_INTERVAL_IN_WRITES: u32 = 20;

/// Identifies the values that a block holds: which part of which list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct ChunkKey {
    /// The stage, by its place in the order.
    pub stage: u8,
    /// How many values the whole list has.
    pub of: usize,
    /// Index of the first value in this block.
    pub start: usize,
}

/// The file that keeps what a bake has computed so far; without one, nothing is kept.
#[derive(Default)]
pub(crate) struct CheckpointFile {
    open: Option<OpenCheckpoint>,
    /// Warnings for the user.
    pub warnings: Vec<String>,
    /// Seconds that the interrupted bake had taken by the last block that was read.
    pub resumed: f64,
}

struct OpenCheckpoint {
    file: File,
    path: PathBuf,
    /// Offset in the file up to which it has been read, or will be written with the pending bytes.
    end: u64,
    /// Length of the file while it is being read; `None` once it is being written.
    reading: Option<u64>,
    /// Checksum of the last block, which goes into that of the next.
    chain: [u8; CHECKSUM],
    /// Blocks that have not been written yet.
    pending: Vec<u8>,
    interval: Duration,
    /// When blocks were last written.
    written: Instant,
}

impl CheckpointFile {
    /// Opens the checkpoint to be resumed, or begins a new one.
    pub fn open(checkpoint: &Checkpoint, identity: &ContentHash) -> Result<Self, CheckpointError> {
        let path = &checkpoint.path;
        let mut opened = Self::default();
        let existing = match std::fs::symlink_metadata(path) {
            Ok(_) => Some(open_existing(path)?),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => return Err(unusable(error)),
        };
        let resumed = match existing {
            None if checkpoint.resume => {
                opened.warn(path, "there is no such checkpoint: baking from the start");
                None
            }
            Some((file, length)) if checkpoint.resume => match read_header(file, identity) {
                Ok((file, chain)) => Some((file, length, chain)),
                Err(why) => {
                    opened.warn(path, &format!("{why}: baking from the start"));
                    None
                }
            },
            _ => None,
        };
        let (file, reading, chain) = match resumed {
            Some((file, length, chain)) => (file, Some(length), chain),
            None => {
                let (file, chain) = begin(path, identity).map_err(unusable)?;
                (file, None, chain)
            }
        };
        opened.open = Some(OpenCheckpoint {
            file,
            path: path.clone(),
            end: HEADER as u64,
            reading,
            chain,
            pending: Vec::new(),
            interval: checkpoint.interval,
            written: Instant::now(),
        });
        Ok(opened)
    }

    fn warn(&mut self, path: &Path, what: &str) {
        self.warnings.push(format!("{}: {what}", path.display()));
    }

    /// The values that come next, if the file has them, and the seconds that the interrupted bake had taken by then. An
    /// empty list means that its time ran out here.
    pub fn next<T: Record>(&mut self, key: ChunkKey) -> Option<(Vec<T>, f64)> {
        let open = self.open.as_mut()?;
        let length = open.reading?;
        match open.read_block(length, key) {
            Ok(Some((values, seconds))) => {
                self.resumed = seconds;
                Some((values, seconds))
            }
            end => {
                open.reading = None;
                let path = open.path.clone();
                if let Err(why) = end {
                    self.warn(&path, &format!("{why}; going on with what comes before"));
                }
                self.truncate();
                None
            }
        }
    }

    /// Truncates the file to what has been read, so that it is written from there on.
    fn truncate(&mut self) {
        let Some(open) = &mut self.open else { return };
        let end = open.end;
        let truncated = open.file.set_len(end).and_then(|()| open.file.seek(SeekFrom::Start(end)));
        open.written = Instant::now();
        if let Err(error) = truncated {
            self.give_up(&error);
        }
    }

    /// Appends values. They are written to the file when the interval has passed.
    pub fn record<T: Record>(&mut self, key: ChunkKey, values: &[T], seconds: f64) {
        let Some(open) = &mut self.open else { return };
        if open.reading.take().is_some() {
            // What is left in the file comes after values that it does not have, so it is of no use.
            self.truncate();
        }
        let Some(open) = &mut self.open else { return };
        match record::written(&(key, seconds, values)) {
            Ok(content) => open.append(&content),
            Err(error) => return self.give_up(&io::Error::other(error)),
        }
        if open.pending.len() > MAX_PENDING || open.written.elapsed() >= open.interval {
            self.flush();
        }
    }

    /// Writes the pending blocks to the file.
    pub fn flush(&mut self) {
        let Some(open) = self.open.as_mut().filter(|open| !open.pending.is_empty()) else { return };
        let begun = Instant::now();
        let written = open.file.write_all(&open.pending).and_then(|()| open.file.sync_data());
        open.pending.clear();
        open.written = Instant::now();
        open.interval = open.interval.max(begun.elapsed() * MIN_INTERVAL_IN_WRITES);
        if let Err(error) = written {
            self.give_up(&error);
        }
    }

    /// Goes on without a checkpoint, with a warning: a failing disk must not end the bake.
    fn give_up(&mut self, error: &io::Error) {
        if let Some(open) = self.open.take() {
            self.warn(
                &open.path,
                &format!(
                    "the checkpoint can no longer be written: {error}; if the bake is interrupted, it goes on from before this"
                ),
            );
        }
    }
}

impl OpenCheckpoint {
    /// Reads the next block; `Ok(None)` at the end of the file.
    ///
    /// # Errors
    /// Why the file cannot be read on.
    fn read_block<T: Record>(
        &mut self,
        length: u64,
        key: ChunkKey,
    ) -> Result<Option<(Vec<T>, f64)>, &'static str> {
        const TRUNCATED: &str = "its last block is cut short";
        const DAMAGED: &str = "it is damaged: a checksum is wrong";
        const MISMATCH: &str = "it holds other values than this bake computes";
        let left = length - self.end;
        if left == 0 {
            return Ok(None);
        }
        let mut size = [0; 8];
        let read =
            |file: &mut File, bytes: &mut [u8]| file.read_exact(bytes).map_err(|_| "it cannot be read on");
        if left < 8 {
            return Err(TRUNCATED);
        }
        read(&mut self.file, &mut size)?;
        let bytes = u64::from_le_bytes(size);
        // A damaged length must not allocate more than the file holds.
        if bytes > left - 8 || left - 8 - bytes < CHECKSUM as u64 {
            return Err(TRUNCATED);
        }
        let mut content = vec![0; bytes as usize];
        let mut checksum = [0; CHECKSUM];
        read(&mut self.file, &mut content)?;
        read(&mut self.file, &mut checksum)?;
        let chain = chained(&self.chain, &content);
        if chain != checksum {
            return Err(DAMAGED);
        }
        let (block_key, seconds, values): (ChunkKey, f64, Vec<T>) = record::read(&content).ok_or(MISMATCH)?;
        let fits = block_key == key && values.len() <= key.of - key.start;
        if !(fits && seconds.is_finite() && seconds >= 0.0) {
            return Err(MISMATCH);
        }
        self.chain = chain;
        self.end += 8 + bytes + CHECKSUM as u64;
        Ok(Some((values, seconds)))
    }

    fn append(&mut self, content: &[u8]) {
        self.pending.extend_from_slice(&(content.len() as u64).to_le_bytes());
        self.pending.extend_from_slice(content);
        self.chain = chained(&self.chain, content);
        self.pending.extend_from_slice(&self.chain);
        self.end += (8 + content.len() + CHECKSUM) as u64;
    }
}

/// The checksum of a block: of that of the block before and of its own content.
fn chained(before: &[u8; CHECKSUM], content: &[u8]) -> [u8; CHECKSUM] {
    *blake3::Hasher::new().update(before).update(content).finalize().as_bytes()
}

fn unusable(error: io::Error) -> CheckpointError {
    CheckpointError::Unusable { reason: error.to_string() }
}

/// Opens and locks an existing file if it is a checkpoint; returns it with its length.
fn open_existing(path: &Path) -> Result<(File, u64), CheckpointError> {
    // Opening a pipe would block forever.
    if !std::fs::metadata(path).map_err(unusable)?.is_file() {
        return Err(CheckpointError::Foreign);
    }
    let mut file = OpenOptions::new().read(true).write(true).open(path).map_err(unusable)?;
    lock(&file)?;
    let mut magic = Vec::new();
    (&file).take(MAGIC.len() as u64).read_to_end(&mut magic).map_err(unusable)?;
    // A power failure may leave an empty file, or only the beginning of one.
    if !MAGIC.starts_with(&magic) {
        return Err(CheckpointError::Foreign);
    }
    file.seek(SeekFrom::Start(0)).map_err(unusable)?;
    let length = file.metadata().map_err(unusable)?.len();
    Ok((file, length))
}

fn lock(file: &File) -> Result<(), CheckpointError> {
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(CheckpointError::InUse),
        // Some network file systems have no locks; the bake need not fail for that.
        _ => Ok(()),
    }
}

/// Checks that a checkpoint belongs to this bake, and returns the checksum that its blocks' chain begins with.
///
/// # Errors
/// Why it does not.
fn read_header(file: File, identity: &ContentHash) -> Result<(File, [u8; CHECKSUM]), String> {
    let mut header = Vec::new();
    (&file).take(HEADER as u64).read_to_end(&mut header).map_err(|error| error.to_string())?;
    if let Some(version) = header.get(8..12).and_then(|version| version.try_into().ok()) {
        let version = u32::from_le_bytes(version);
        if version != VERSION {
            return Err(format!("the checkpoint's format is version {version}, this baker reads {VERSION}"));
        }
    }
    let Some((head, checksum)) = header.split_last_chunk::<CHECKSUM>().filter(|_| header.len() == HEADER)
    else {
        return Err("the checkpoint is damaged: it is cut short".into());
    };
    if blake3::hash(head).as_bytes() != checksum {
        return Err("the checkpoint is damaged: a checksum is wrong".into());
    }
    if head[12..] != identity.bytes()[..] {
        return Err(
            "the checkpoint is of another scene, other options or another version of the baker".into()
        );
    }
    Ok((file, *checksum))
}

/// A new checkpoint without blocks. Its header is complete before the file has its name.
fn begin(path: &Path, identity: &ContentHash) -> io::Result<(File, [u8; CHECKSUM])> {
    let mut header = [MAGIC.as_slice(), &VERSION.to_le_bytes(), identity.bytes()].concat();
    let checksum = *blake3::hash(&header).as_bytes();
    header.extend_from_slice(&checksum);
    let file = replace_file(path, WhenBusy::Fail, |file| file.write_all(&header))?;
    Ok((file, checksum))
}
