//! Writes KTX2 files with one level (KTX File Format Specification 2.0). The texels are encoded before.

use super::data_format_descriptor::data_format_descriptor;
use super::ktx2::{HEADER_BYTES, IDENTIFIER, LEVEL_BYTES, ORIENTATION_KEY};
use super::{Ktx2Error, Ktx2Texture, Supercompression, zstandard};

impl Ktx2Texture {
    /// Encodes the texture as a KTX2 file.
    ///
    /// # Errors
    /// [`Ktx2Error::Size`] if the number of texels is 0 or does not match the size, [`Ktx2Error::Zstandard`]
    /// if compression fails.
    pub fn to_bytes(&self, supercompression: Supercompression) -> Result<Vec<u8>, Ktx2Error> {
        let count = [self.height, self.depth.unwrap_or(1)]
            .into_iter()
            .try_fold(u64::from(self.width), |product, side| product.checked_mul(u64::from(side)));
        if count != Some(self.texels.len() as u64) || self.texels.is_empty() {
            let depth = self.depth.map(|depth| format!(" x {depth}")).unwrap_or_default();
            let size = format!("{} x {}{depth}", self.width, self.height);
            return Err(Ktx2Error::Size { texels: self.texels.len(), size });
        }
        let texels: Vec<u8> = self.texels.iter().flat_map(|texel| texel.to_le_bytes()).collect();
        let unpacked = texels.len() as u64;
        let level = match supercompression {
            Supercompression::None => texels,
            Supercompression::Zstandard => zstandard::compress(&texels)?,
        };
        let descriptor = data_format_descriptor(self.format);
        let metadata = metadata(if self.depth.is_some() { "rdi" } else { "rd" });
        let descriptor_offset = HEADER_BYTES + LEVEL_BYTES;
        let metadata_offset = descriptor_offset + 4 * descriptor.len();
        // A multiple of 4, as the specification requires for levels without supercompression.
        let level_offset = metadata_offset + metadata.len();

        let mut file = IDENTIFIER.to_vec();
        let words = [
            self.format.vulkan_format(),
            // typeSize: texels are uploaded as 32-bit words.
            4,
            self.width,
            self.height,
            self.depth.unwrap_or(0),
            // No layers, one face, one level.
            0,
            1,
            1,
            supercompression.scheme(),
            descriptor_offset as u32,
            4 * descriptor.len() as u32,
            metadata_offset as u32,
            metadata.len() as u32,
        ];
        file.extend(words.into_iter().flat_map(u32::to_le_bytes));
        // No supercompression global data: neither scheme has any. Then the index entry of the only level.
        let longs = [0, 0, level_offset as u64, level.len() as u64, unpacked];
        file.extend(longs.into_iter().flat_map(u64::to_le_bytes));
        file.extend(descriptor.into_iter().flat_map(u32::to_le_bytes));
        file.extend(metadata);
        file.extend(level);
        Ok(file)
    }
}

/// The key/value data, sorted by key, each entry padded to a multiple of four bytes.
fn metadata(orientation: &str) -> Vec<u8> {
    let writer = concat!("Lumbre ", env!("CARGO_PKG_VERSION"));
    let mut bytes = Vec::new();
    for (key, value) in [(ORIENTATION_KEY, orientation), ("KTXwriter", writer)] {
        let entry = format!("{key}\0{value}\0");
        bytes.extend((entry.len() as u32).to_le_bytes());
        bytes.extend(entry.into_bytes());
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    bytes
}
