//! A table in a texture, for devices whose shaders fetch texels faster than they read storage buffers, which
//! are software rasterizers. Texels are stored in rows; `table_place` of shaders/frame.wesl finds the row and
//! column of one. What a table holds is decided by its owner.

use std::ops::Range;

use crate::{Gpu, RenderError};

/// Texels per row.
const WIDTH: usize = 1024;

/// A texture with texels of four words or of one.
#[derive(Debug)]
pub(crate) struct TableTexture {
    texture: Option<(wgpu::Texture, wgpu::TextureView)>,
}

/// Returns how a table is bound: as a texture or as a storage buffer.
pub(crate) fn table_binding(in_texture: bool) -> wgpu::BindingType {
    match in_texture {
        true => wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Uint,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        },
        false => wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: true },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
    }
}

/// Returns the largest size in bytes of a table of words, in a texture or in a storage buffer.
pub(crate) fn most_bytes_of_words(gpu: &Gpu) -> u64 {
    let limits = gpu.device.limits();
    match gpu.reads_tables_from_textures() {
        true => (WIDTH * size_of::<u32>()) as u64 * u64::from(limits.max_texture_dimension_2d),
        false => limits.max_storage_buffer_binding_size,
    }
}

/// Returns the bytes of a texel, 16 if the entries are a multiple of that, else 4.
fn texel_size(entry_size: usize) -> usize {
    if entry_size.is_multiple_of(16) { 16 } else { 4 }
}

impl TableTexture {
    pub fn new() -> Self {
        Self { texture: None }
    }

    /// Returns the view to bind, once there is room.
    pub fn view(&self) -> Option<&wgpu::TextureView> {
        self.texture.as_ref().map(|(_, view)| view)
    }

    /// Makes room for this many entries of this size, a multiple of 4. Returns true if the texture was
    /// replaced.
    ///
    /// # Errors
    /// [`RenderError::BufferTooLarge`].
    pub fn make_room(
        &mut self,
        gpu: &Gpu,
        label: &'static str,
        (entries, entry_size): (usize, usize),
    ) -> Result<bool, RenderError> {
        let size = texel_size(entry_size);
        let rows = (entries * entry_size).div_ceil(size * WIDTH).max(1);
        if self.texture.as_ref().is_some_and(|(texture, _)| texture.height() as usize >= rows) {
            return Ok(false);
        }
        let most = gpu.device.limits().max_texture_dimension_2d;
        let Some(rows) = u32::try_from(rows).ok().filter(|rows| *rows <= most) else {
            let bytes_of = |rows: u64| rows * (WIDTH * size) as u64;
            let (bytes, limit) = (bytes_of(rows as u64), bytes_of(u64::from(most)));
            return Err(RenderError::BufferTooLarge { what: label, bytes, limit });
        };
        let height = rows.next_power_of_two().min(most);
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d { width: WIDTH as u32, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: match size {
                16 => wgpu::TextureFormat::Rgba32Uint,
                _ => wgpu::TextureFormat::R32Uint,
            },
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let view = texture.create_view(&Default::default());
        self.texture = Some((texture, view));
        Ok(true)
    }

    /// Uploads a range of entries, for which there must be room. `bytes` holds all entries.
    pub fn write(&self, gpu: &Gpu, bytes: &[u8], entry_size: usize, entries: Range<usize>) {
        let Some((texture, _)) = &self.texture else { return };
        let size = texel_size(entry_size);
        let texels = entries.start * entry_size / size..entries.end * entry_size / size;
        for block in blocks(texels) {
            let bytes = &bytes[block.texels.start * size..block.texels.end * size];
            let row = (block.texels.start / WIDTH) as u32;
            let origin = wgpu::Origin3d { x: (block.texels.start % WIDTH) as u32, y: row, z: 0 };
            gpu.queue.write_texture(
                wgpu::TexelCopyTextureInfo {
                    texture,
                    mip_level: 0,
                    origin,
                    aspect: wgpu::TextureAspect::All,
                },
                bytes,
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some((block.width * size) as u32),
                    rows_per_image: None,
                },
                wgpu::Extent3d {
                    width: block.width as u32,
                    height: (block.texels.len() / block.width) as u32,
                    depth_or_array_layers: 1,
                },
            );
        }
    }
}

/// Texels that form a rectangle of the texture.
#[derive(Debug, PartialEq)]
struct Block {
    texels: Range<usize>,
    width: usize,
}

/// Splits a range of texels into at most three rectangles: the rest of a row, whole rows, and the beginning
/// of a row.
fn blocks(texels: Range<usize>) -> Vec<Block> {
    let first_row = texels.start.next_multiple_of(WIDTH).min(texels.end);
    let last_row = (texels.end / WIDTH * WIDTH).max(first_row);
    let ranges = [texels.start..first_row, first_row..last_row, last_row..texels.end];
    let block = |texels: Range<usize>| Block { width: texels.len().min(WIDTH), texels };
    ranges.into_iter().filter(|range| !range.is_empty()).map(block).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_of_texels_is_rectangles_that_hold_each_once() {
        for (start, end) in [(0, 1), (0, 1024), (5, 9), (1000, 1030), (1023, 2048), (3, 5000), (1024, 4096)] {
            let blocks = blocks(start..end);
            let texels: Vec<usize> = blocks.iter().flat_map(|block| block.texels.clone()).collect();
            assert_eq!(texels, Vec::from_iter(start..end));
            for Block { texels, width } in &blocks {
                assert_eq!(texels.len() % width, 0);
                let column = texels.start % WIDTH;
                assert!(column + width <= WIDTH && (column == 0 || texels.len() == *width), "{blocks:?}");
            }
        }
        assert_eq!(blocks(7..7), []);
    }
}
