//! The binary glTF container: a header, a JSON chunk, a binary chunk. Not what is in them.

use super::error::LoadProblem;

const MAGIC: &[u8; 4] = b"glTF";
const JSON: u32 = 0x4E4F_534A;
const BIN: u32 = 0x004E_4942;

/// The parts of a file: its JSON, and the binary chunk if there is one.
pub(crate) struct Container<'a> {
    pub json: &'a [u8],
    pub binary: Option<&'a [u8]>,
}

/// Splits a .glb, or takes a .gltf as it is. glTF 2.0 specification, section 4.
pub(crate) fn split(bytes: &[u8]) -> Result<Container<'_>, LoadProblem> {
    if !bytes.starts_with(MAGIC) {
        let first = bytes.iter().find(|byte| !byte.is_ascii_whitespace() && !b"\xef\xbb\xbf".contains(byte));
        if first != Some(&b'{') {
            let magic = String::from_utf8_lossy(bytes.get(..4).unwrap_or(bytes)).into_owned();
            return Err(LoadProblem::Magic { magic });
        }
        // A byte order mark is not JSON, but editors write it.
        return Ok(Container { json: bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), binary: None });
    }
    let version = word(bytes, 4, "the header")?;
    if version != 2 {
        return Err(LoadProblem::Version { version: version.to_string() });
    }
    let length = word(bytes, 8, "the header")?;
    let Some(file) = bytes.get(..length as usize) else {
        let (needed, found) = (u64::from(length), bytes.len() as u64);
        return Err(LoadProblem::Truncated { what: "the file, by its header,".to_owned(), needed, found });
    };
    let (json, rest) = chunk(file, 12, "the JSON chunk")?;
    if json.0 != JSON {
        return Err(LoadProblem::Container {
            what: format!("the first chunk is of type {:#010x}, not JSON", json.0),
        });
    }
    let mut at = rest;
    while at < file.len() {
        let (next, rest) = chunk(file, at, "a chunk after the JSON")?;
        if next.0 == BIN {
            return Ok(Container { json: json.1, binary: Some(next.1) });
        }
        at = rest;
    }
    Ok(Container { json: json.1, binary: None })
}

fn word(bytes: &[u8], at: usize, what: &str) -> Result<u32, LoadProblem> {
    let found = at.checked_add(4).and_then(|end| bytes.get(at..end)).and_then(|slice| slice.try_into().ok());
    found.map(u32::from_le_bytes).ok_or_else(|| LoadProblem::Truncated {
        what: what.to_owned(),
        needed: at as u64 + 4,
        found: bytes.len() as u64,
    })
}

/// The type and the bytes of the chunk at an offset, and the offset after it.
fn chunk<'a>(file: &'a [u8], at: usize, what: &str) -> Result<((u32, &'a [u8]), usize), LoadProblem> {
    let length = word(file, at, what)? as usize;
    let kind = word(file, at + 4, what)?;
    let start = at + 8;
    let content = start.checked_add(length).and_then(|end| file.get(start..end));
    let content = content.ok_or_else(|| LoadProblem::Truncated {
        what: what.to_owned(),
        needed: length as u64,
        found: file.len().saturating_sub(start) as u64,
    })?;
    Ok(((kind, content), start + length))
}

/// Puts a .glb together; pads the JSON with spaces and the binary with zeros to multiples of four. `None` above 4 GiB,
/// which the format cannot hold.
pub(crate) fn join(json: &[u8], binary: &[u8]) -> Option<Vec<u8>> {
    let padded = |length: usize| length.checked_next_multiple_of(4);
    let (json_length, binary_length) = (padded(json.len())?, padded(binary.len())?);
    let binary_chunk = if binary.is_empty() { 0 } else { binary_length.checked_add(8)? };
    let total = json_length.checked_add(20)?.checked_add(binary_chunk)?;
    let mut file = Vec::new();
    file.try_reserve_exact(total).ok()?;
    file.extend_from_slice(MAGIC);
    file.extend_from_slice(&2u32.to_le_bytes());
    file.extend_from_slice(&u32::try_from(total).ok()?.to_le_bytes());
    file.extend_from_slice(&u32::try_from(json_length).ok()?.to_le_bytes());
    file.extend_from_slice(&JSON.to_le_bytes());
    file.extend_from_slice(json);
    file.resize(20 + json_length, b' ');
    if !binary.is_empty() {
        file.extend_from_slice(&u32::try_from(binary_length).ok()?.to_le_bytes());
        file.extend_from_slice(&BIN.to_le_bytes());
        file.extend_from_slice(binary);
        file.resize(total, 0);
    }
    Some(file)
}
