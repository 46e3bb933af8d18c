//! GPU texture formats that pack three unsigned floats into 32 bits. The KTX2 file around them is elsewhere.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::shared_exponent;
use super::unsigned_float::{FLOAT_10, FLOAT_11};

/// How a KTX2 file packs a colour into 32 bits. Both formats are unsigned, every GPU can filter both, and
/// half floats represent every colour of either exactly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum PackedFormat {
    /// Nine bits per channel and a shared exponent. The error is at most 1/511.5 of the largest channel;
    /// largest value 65408.
    #[default]
    Rgb9E5,
    /// Floats of 11, 11 and 10 bits. The error is at most 1/128 of red and green and 1/64 of blue; largest
    /// value 65024 (blue 64512).
    B10G11R11,
}

impl PackedFormat {
    /// Both formats.
    pub const ALL: [Self; 2] = [Self::Rgb9E5, Self::B10G11R11];

    /// The name on the command line: `rgb9e5` or `b10g11r11`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rgb9E5 => "rgb9e5",
            Self::B10G11R11 => "b10g11r11",
        }
    }

    /// The value of the `VkFormat`: E5B9G9R9_UFLOAT_PACK32 or B10G11R11_UFLOAT_PACK32.
    pub fn vulkan_format(self) -> u32 {
        match self {
            Self::Rgb9E5 => 123,
            Self::B10G11R11 => 122,
        }
    }

    /// The largest number of each channel, to which larger ones are clamped.
    pub fn largest(self) -> Vec3 {
        match self {
            Self::Rgb9E5 => Vec3::splat(shared_exponent::LARGEST),
            Self::B10G11R11 => Vec3::new(FLOAT_11.largest(), FLOAT_11.largest(), FLOAT_10.largest()),
        }
    }

    /// Upper bound on the encoding error of each channel of a colour within [0, largest], in closed form.
    pub fn largest_error(self, color: Vec3) -> Vec3 {
        match self {
            Self::Rgb9E5 => Vec3::splat((color.max_element() / 511.5).max(2f32.powi(-25))),
            Self::B10G11R11 => (color * Vec3::new(1.0 / 128.0, 1.0 / 128.0, 1.0 / 64.0)).max(Vec3::new(
                2f32.powi(-21),
                2f32.powi(-21),
                2f32.powi(-20),
            )),
        }
    }

    /// Encodes a colour as the nearest one of the format, clamped to [0, largest]. `None` if a channel is NaN
    /// or infinite.
    pub fn encode(self, color: Vec3) -> Option<u32> {
        color.is_finite().then(|| match self {
            Self::Rgb9E5 => shared_exponent::encode(color),
            Self::B10G11R11 => {
                FLOAT_11.encode(color.x) | FLOAT_11.encode(color.y) << 11 | FLOAT_10.encode(color.z) << 22
            }
        })
    }

    /// Decodes 32 bits exactly. B10G11R11 can represent infinity and NaN, though [`PackedFormat::encode`]
    /// never writes them.
    pub fn decode(self, bits: u32) -> Vec3 {
        match self {
            Self::Rgb9E5 => shared_exponent::decode(bits),
            Self::B10G11R11 => Vec3::new(
                FLOAT_11.decode(bits & 0x7ff),
                FLOAT_11.decode(bits >> 11 & 0x7ff),
                FLOAT_10.decode(bits >> 22),
            ),
        }
    }
}
