//! One level of a texture, before it is uploaded.

/// Texels of four bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct MipLevel {
    pub width: u32,
    pub height: u32,
    pub rgba: Vec<u8>,
}
