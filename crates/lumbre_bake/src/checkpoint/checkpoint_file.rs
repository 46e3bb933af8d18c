//! The file of a checkpoint: read to its end first, written from there on. Not what its values mean.

use std::ffi::OsString;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::record::{self, Record};
use super::{Checkpoint, VERSION};
use crate::content_hash::ContentHash;
use crate::error::CheckpointError;

const MAGIC: &[u8; 8] = b"LUMBRECP";
const CHECKSUM: usize = 32;
const HEADER: usize = 8 + 4 + 32 + CHECKSUM;
/// More than this does not wait for the interval.
const MAX_PENDING: usize = 64 << 20;
/// Writing may take one part in so many of the time.
const SHARE: u32 = 20;

/// Which values of which list a block holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct ChunkKey {
    /// The stage, by its place in the order.
    pub stage: u8,
    /// Values of the whole list.
    pub of: usize,
    /// The first that is here.
    pub start: usize,
}

/// What a bake has computed so far, in a file.
#[derive(Default)]
pub(crate) struct CheckpointFile {
    open: Option<OpenCheckpoint>,
    /// What the user should know, once each.
    pub warnings: Vec<String>,
    /// Seconds of work that were taken from the file.
    pub resumed: f64,
}

struct OpenCheckpoint {
    file: File,
    path: PathBuf,
    /// End of what is read or written, in the file.
    end: u64,
    /// Bytes of the file while it is being read; `None` when it is written.
    reading: Option<u64>,
    chain: [u8; CHECKSUM],
    pending: Vec<u8>,
    interval: Duration,
    written: Instant,
}

impl CheckpointFile {
    /// Opens or begins a checkpoint.
    pub fn open(checkpoint: &Checkpoint, identity: &ContentHash) -> Result<Self, CheckpointError> {
        let path = &checkpoint.path;
        let mut opened = Self::default();
        let found = match std::fs::symlink_metadata(path) {
            Ok(_) => Some(open_existing(path)?),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => return Err(unusable(error)),
        };
        let kept = match found {
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
        let (file, reading, chain) = match kept {
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

    /// The values that come next, if the file has them, and the seconds they had taken. An empty list: the time ran out here.
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
                self.cut();
                None
            }
        }
    }

    /// Makes what was read the beginning of what is written.
    fn cut(&mut self) {
        let Some(open) = &mut self.open else { return };
        let end = open.end;
        let cut = open.file.set_len(end).and_then(|()| open.file.seek(SeekFrom::Start(end)));
        open.written = Instant::now();
        if let Err(error) = cut {
            self.give_up(&error);
        }
    }

    /// Appends values. They reach the file when the interval is over.
    pub fn record<T: Record>(&mut self, key: ChunkKey, values: &[T], seconds: f64) {
        let Some(open) = &mut self.open else { return };
        if open.reading.take().is_some() {
            // The list was not asked for in chunks from its start: what is left in the file is of no use.
            self.cut();
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

    /// Writes what waits.
    pub fn flush(&mut self) {
        let Some(open) = self.open.as_mut().filter(|open| !open.pending.is_empty()) else { return };
        let begun = Instant::now();
        let written = open.file.write_all(&open.pending).and_then(|()| open.file.sync_data());
        open.pending.clear();
        open.written = Instant::now();
        open.interval = open.interval.max(begun.elapsed() * SHARE);
        if let Err(error) = written {
            self.give_up(&error);
        }
    }

    /// The bake is worth more than its checkpoint.
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
    /// `Ok(None)` at the end of the file.
    fn read_block<T: Record>(
        &mut self,
        length: u64,
        key: ChunkKey,
    ) -> Result<Option<(Vec<T>, f64)>, &'static str> {
        const CUT: &str = "its last block is cut short";
        const DAMAGED: &str = "it is damaged: a checksum is wrong";
        const OTHER: &str = "it holds other values than this bake computes";
        let left = length - self.end;
        if left == 0 {
            return Ok(None);
        }
        let mut size = [0; 8];
        let read =
            |file: &mut File, bytes: &mut [u8]| file.read_exact(bytes).map_err(|_| "it cannot be read on");
        if left < 8 {
            return Err(CUT);
        }
        read(&mut self.file, &mut size)?;
        let bytes = u64::from_le_bytes(size);
        // What the file does not hold is not allocated.
        if bytes > left - 8 || left - 8 - bytes < CHECKSUM as u64 {
            return Err(CUT);
        }
        let mut content = vec![0; bytes as usize];
        let mut checksum = [0; CHECKSUM];
        read(&mut self.file, &mut content)?;
        read(&mut self.file, &mut checksum)?;
        let chain = chained(&self.chain, &content);
        if chain != checksum {
            return Err(DAMAGED);
        }
        let (at, seconds, values): (ChunkKey, f64, Vec<T>) = record::read(&content).ok_or(OTHER)?;
        let fits = at == key && values.len() <= key.of - key.start;
        if !(fits && seconds.is_finite() && seconds >= 0.0) {
            return Err(OTHER);
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

fn chained(before: &[u8; CHECKSUM], content: &[u8]) -> [u8; CHECKSUM] {
    *blake3::Hasher::new().update(before).update(content).finalize().as_bytes()
}

fn unusable(error: io::Error) -> CheckpointError {
    CheckpointError::Unusable { reason: error.to_string() }
}

/// The name under which a checkpoint is begun.
pub(crate) fn temporary(path: &Path) -> PathBuf {
    let mut name = OsString::from(path.file_name().unwrap_or_default());
    name.push(".partial");
    path.with_file_name(name)
}

pub(crate) fn remove_if_there(path: &Path) -> io::Result<()> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// A file that is there, ours, and nobody else's at the moment; and its bytes.
fn open_existing(path: &Path) -> Result<(File, u64), CheckpointError> {
    // Opening a pipe would wait for ever.
    if !std::fs::metadata(path).map_err(unusable)?.is_file() {
        return Err(CheckpointError::Foreign);
    }
    let mut file = OpenOptions::new().read(true).write(true).open(path).map_err(unusable)?;
    lock(&file)?;
    let mut magic = Vec::new();
    (&file).take(MAGIC.len() as u64).read_to_end(&mut magic).map_err(unusable)?;
    // A power failure may leave an empty file.
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
        // Some network folders know no locks; the bake need not fail for that.
        _ => Ok(()),
    }
}

/// Checks whether a checkpoint is of this bake; says why not.
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

/// A new checkpoint without blocks, whole under its name at once.
fn begin(path: &Path, identity: &ContentHash) -> io::Result<(File, [u8; CHECKSUM])> {
    let mut header = [MAGIC.as_slice(), &VERSION.to_le_bytes(), identity.bytes()].concat();
    let checksum = *blake3::hash(&header).as_bytes();
    header.extend_from_slice(&checksum);
    let beside = temporary(path);
    let begun = (|| {
        let mut file = OpenOptions::new().read(true).write(true).create(true).truncate(true).open(&beside)?;
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            return Err(io::Error::new(io::ErrorKind::ResourceBusy, "another bake is beginning it"));
        }
        file.write_all(&header)?;
        std::fs::rename(&beside, path)?;
        Ok(file)
    })();
    if begun.is_err() {
        // Nothing more can be done about a file that cannot be removed either; the first error is the one to tell.
        let _ = remove_if_there(&beside);
    }
    Ok((begun?, checksum))
}
