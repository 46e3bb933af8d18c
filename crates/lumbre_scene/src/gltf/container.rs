//! The binary glTF container (.glb): a header, a JSON chunk, a binary chunk and unknown chunks. Their
//! contents are not interpreted here.

use super::error::{LoadProblem, Notes};

pub(crate) const MAGIC: &[u8; 4] = b"glTF";
const JSON: u32 = 0x4E4F_534A;
const BIN: u32 = 0x004E_4942;

/// The parts of a glTF file.
pub(crate) struct Container<'a> {
    pub json: &'a [u8],
    /// The binary chunk, if there is one.
    pub binary: Option<&'a [u8]>,
    /// Type and bytes of chunks that are neither JSON nor BIN.
    pub others: Vec<(u32, &'a [u8])>,
}

/// Splits a .glb file (glTF 2.0 specification, section 4). A .gltf file is returned as its JSON.
pub(crate) fn split<'a>(bytes: &'a [u8], notes: &mut Notes) -> Result<Container<'a>, LoadProblem> {
    if !bytes.starts_with(MAGIC) {
        let first = bytes.iter().find(|byte| !byte.is_ascii_whitespace() && !b"\xef\xbb\xbf".contains(byte));
        if first != Some(&b'{') {
            let magic = String::from_utf8_lossy(bytes.get(..4).unwrap_or(bytes)).into_owned();
            return Err(LoadProblem::Magic { magic });
        }
        // JSON does not allow a byte order mark, but some editors write one.
        let json = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        return Ok(Container { json, binary: None, others: Vec::new() });
    }
    let version = word(bytes, 4, "the header")?;
    if version != 2 {
        return Err(LoadProblem::Version { version: version.to_string() });
    }
    let length = word(bytes, 8, "the header")?;
    let file = match bytes.get(..length as usize) {
        Some(file) => file,
        None => {
            let (what, place) = ("the file, by its header,".to_owned(), "the file");
            let (needed, found) = (u64::from(length), bytes.len() as u64);
            let problem = LoadProblem::Truncated { what, needed, found };
            if needed - found >= 4 {
                return Err(problem);
            }
            notes.repair(place, problem, "taken for padding that is missing")?;
            bytes
        }
    };
    let (json, rest) = chunk(file, 12, "the JSON chunk", notes)?;
    if json.0 != JSON {
        return Err(LoadProblem::Container {
            what: format!("the first chunk is of type {:#010x}, not JSON", json.0),
        });
    }
    let mut container = Container { json: json.1, binary: None, others: Vec::new() };
    let mut at = rest;
    while at < file.len() && container.binary.is_none() {
        let ((kind, content), rest) = chunk(file, at, "a chunk after the JSON", notes)?;
        if kind == BIN {
            container.binary = Some(content);
        } else {
            container.others.push((kind, content));
        }
        at = rest;
    }
    // Chunks after the binary one are unknown to glTF. They are kept, and the first incomplete one ends the
    // search.
    while let Ok((other, rest)) = chunk(file, at, "", &mut Notes::default()) {
        container.others.push(other);
        at = rest;
    }
    Ok(container)
}

fn word(bytes: &[u8], at: usize, what: &str) -> Result<u32, LoadProblem> {
    let found = at.checked_add(4).and_then(|end| bytes.get(at..end)).and_then(|slice| slice.try_into().ok());
    found.map(u32::from_le_bytes).ok_or_else(|| LoadProblem::Truncated {
        what: what.to_owned(),
        needed: at as u64 + 4,
        found: bytes.len() as u64,
    })
}

/// The type and the bytes of the chunk at an offset, and the offset of the next chunk.
fn chunk<'a>(
    file: &'a [u8],
    at: usize,
    what: &str,
    notes: &mut Notes,
) -> Result<((u32, &'a [u8]), usize), LoadProblem> {
    let length = word(file, at, what)? as usize;
    let kind = word(file, at + 4, what)?;
    let start = at + 8;
    let end = start.saturating_add(length);
    let content = match file.get(start..end) {
        Some(content) => content,
        None => {
            let found = file.len().saturating_sub(start) as u64;
            let problem = LoadProblem::Truncated { what: what.to_owned(), needed: length as u64, found };
            // Chunks are padded to four bytes, so up to three bytes may be missing at the end without loss of
            // data.
            if (length as u64).saturating_sub(found) >= 4 {
                return Err(problem);
            }
            notes.repair(what, problem, "taken for padding that is missing")?;
            file.get(start..).unwrap_or_default()
        }
    };
    Ok(((kind, content), end.min(file.len())))
}

/// Assembles a .glb file. The JSON is padded with spaces and everything else with zeros to multiples of four
/// bytes. Returns `None` above 4 GiB, the limit of the format.
pub(crate) fn join(json: &[u8], binary: &[u8], others: &[(u32, Vec<u8>)]) -> Option<Vec<u8>> {
    let mut chunks = vec![(JSON, json, b' ')];
    if !binary.is_empty() {
        chunks.push((BIN, binary, 0));
    }
    chunks.extend(others.iter().map(|(kind, content)| (*kind, content.as_slice(), 0)));
    let total = chunks.iter().try_fold(12usize, |total, (_, content, _)| {
        content.len().checked_next_multiple_of(4)?.checked_add(8)?.checked_add(total)
    })?;
    let mut file = Vec::new();
    file.try_reserve_exact(total).ok()?;
    file.extend_from_slice(MAGIC);
    file.extend_from_slice(&2u32.to_le_bytes());
    file.extend_from_slice(&u32::try_from(total).ok()?.to_le_bytes());
    for (kind, content, padding) in chunks {
        let padded = content.len().next_multiple_of(4);
        file.extend_from_slice(&u32::try_from(padded).ok()?.to_le_bytes());
        file.extend_from_slice(&kind.to_le_bytes());
        file.extend_from_slice(content);
        file.resize(file.len() + padded - content.len(), padding);
    }
    Some(file)
}
