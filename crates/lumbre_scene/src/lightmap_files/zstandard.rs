//! Zstandard compression of texel data: the C reference library encodes, the Rust crate `ruzstd` decodes.
//!
//! Two libraries are used on purpose. `ruzstd` encodes at its fastest level only, which makes lightmaps a
//! fifth to a half larger; and files from elsewhere should not be parsed by a library written in C. As a
//! result, every file is decoded by an implementation independent of the one that wrote it.

use std::io::Read;

use ruzstd::decoding::StreamingDecoder;
use zstd::bulk::Compressor;
use zstd::zstd_safe::CParameter;

use super::Ktx2Error;

/// Takes a tenth of a second for a map of 2048 x 2048 texels. The highest levels save another tenth of the
/// size for ten times as long.
const LEVEL: i32 = 9;
/// A window of 4 MiB, which every decoder accepts. Some refuse windows as large as a large map (Bevy's stops
/// at 100 MiB).
const WINDOW_LOG: u32 = 22;

/// Compresses bytes to one frame with a checksum.
pub(crate) fn compress(bytes: &[u8]) -> Result<Vec<u8>, Ktx2Error> {
    let frame = || {
        let mut compressor = Compressor::new(LEVEL)?;
        compressor.set_parameter(CParameter::WindowLog(WINDOW_LOG))?;
        compressor.set_parameter(CParameter::ChecksumFlag(true))?;
        compressor.compress(bytes)
    };
    frame().map_err(|source| Ktx2Error::Zstandard { problem: source.to_string() })
}

/// Decompresses a frame that must hold exactly `length` bytes. The caller must have checked that `length`
/// bytes may be allocated.
pub(crate) fn decompress(frame: &[u8], length: usize) -> Result<Vec<u8>, Ktx2Error> {
    let failed = |problem: String| Ktx2Error::Zstandard { problem };
    // Writers choose a window of at most the next power of two.
    let window = (2 * length as u64).max(1 << 20);
    let mut decoder = StreamingDecoder::new_with_max_window_size(frame, window)
        .map_err(|error| failed(error.to_string()))?;
    let mut bytes = Vec::with_capacity(length);
    (&mut decoder)
        .take(length as u64 + 1)
        .read_to_end(&mut bytes)
        .map_err(|error| failed(error.to_string()))?;
    if bytes.len() != length {
        let found = if bytes.len() > length { "more" } else { "fewer" };
        return Err(failed(format!("holds {found} than the {length} bytes that its level claims")));
    }
    let stated = decoder.decoder.get_checksum_from_data();
    if stated.is_some() && stated != decoder.decoder.get_calculated_checksum() {
        return Err(failed("its checksum does not fit".to_owned()));
    }
    Ok(bytes)
}
