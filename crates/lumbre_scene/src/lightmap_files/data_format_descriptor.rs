//! The basic data format descriptor of the packed formats, as a KTX2 file contains it.
//!
//! Khronos Data Format Specification 1.3, chapter 5, and section 3.12 of the KTX 2.0 specification:
//! supercompressed files keep the descriptor of the uncompressed data.

use super::PackedFormat;

const MODEL_RGBSDA: u32 = 1;
const PRIMARIES_BT709: u32 = 1;
const TRANSFER_LINEAR: u32 = 1;
const VERSION: u32 = 2;
const EXPONENT: u32 = 0x20;
const FLOAT: u32 = 0x80;

/// The descriptor as 32-bit words, starting with its total size in bytes.
pub(crate) fn data_format_descriptor(format: PackedFormat) -> Vec<u32> {
    // One `sample` has four words: the bit range and the channel, the position in the texel block, and the
    // values that represent 0 and 1.
    let sample = |channel: u32, offset: u32, bits: u32, lower: u32, upper: u32| {
        [offset | (bits - 1) << 16 | channel << 24, 0, lower, upper]
    };
    let samples: Vec<u32> = match format {
        // Each channel has one sample for its mantissa and one for the shared exponent. The lower bound of
        // the exponent is its bias, and the bounds are those the specification lists for this format.
        PackedFormat::Rgb9E5 => (0..3)
            .flat_map(|channel| {
                [sample(channel, 9 * channel, 9, 0, 8448), sample(channel | EXPONENT, 27, 5, 15, 31)]
            })
            .flatten()
            .collect(),
        PackedFormat::B10G11R11 => [(0, 11), (11, 11), (22, 10)]
            .into_iter()
            .zip(0..)
            .flat_map(|((offset, bits), channel)| sample(channel | FLOAT, offset, bits, 0, 1f32.to_bits()))
            .collect(),
    };
    let block = 24 + 4 * samples.len() as u32;
    let header = [
        block + 4,
        // Vendor Khronos, basic descriptor type.
        0,
        VERSION | block << 16,
        // The flags are 0: straight alpha is the default.
        MODEL_RGBSDA | PRIMARIES_BT709 << 8 | TRANSFER_LINEAR << 16,
        // Blocks of one texel.
        0,
        // Four bytes in the only plane.
        4,
        0,
    ];
    header.into_iter().chain(samples).collect()
}
