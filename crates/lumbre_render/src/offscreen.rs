//! Frames without a window: a texture to draw into, and reading it back to memory.

use glam::Vec4;

use crate::{FrameTarget, Gpu, RenderError};

/// Texel format of an offscreen frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum OffscreenFormat {
    /// Eight bits per channel.
    Rgba8,
    /// f32 per channel, linear.
    LinearFloat,
}

impl OffscreenFormat {
    /// Returns the texture format.
    pub fn texture_format(self) -> wgpu::TextureFormat {
        match self {
            Self::Rgba8 => wgpu::TextureFormat::Rgba8Unorm,
            Self::LinearFloat => wgpu::TextureFormat::Rgba32Float,
        }
    }
}

/// A texture to draw frames into and read them back from.
#[derive(Debug)]
pub struct Offscreen {
    texture: wgpu::Texture,
    format: OffscreenFormat,
}

impl Offscreen {
    /// Creates a target of `width` x `height` texels, both at least 1.
    ///
    /// # Errors
    /// [`RenderError::TargetTooLarge`].
    pub fn new(gpu: &Gpu, width: u32, height: u32, format: OffscreenFormat) -> Result<Self, RenderError> {
        let limit = gpu.device.limits().max_texture_dimension_2d;
        if width == 0 || height == 0 || width > limit || height > limit {
            return Err(RenderError::TargetTooLarge { width, height, limit });
        }
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("offscreen frame"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: format.texture_format(),
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                | wgpu::TextureUsages::COPY_SRC
                | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        Ok(Self { texture, format })
    }

    /// Returns the target to draw into.
    pub fn target(&self) -> FrameTarget {
        FrameTarget::from_texture(&self.texture)
    }

    /// Returns width and height in texels.
    pub fn size(&self) -> (u32, u32) {
        (self.texture.width(), self.texture.height())
    }

    /// Reads the frame as RGBA bytes, top row first. Linear floats are clamped and rounded.
    ///
    /// # Errors
    /// [`RenderError::ReadBack`].
    pub fn read_rgba8(&self, gpu: &Gpu) -> Result<Vec<u8>, RenderError> {
        let bytes = read_texture(gpu, &self.texture)?;
        Ok(match self.format {
            OffscreenFormat::Rgba8 => bytes,
            OffscreenFormat::LinearFloat => {
                floats(&bytes).map(|value| (value.clamp(0.0, 1.0) * 255.0).round() as u8).collect()
            }
        })
    }

    /// Writes the frame as a PNG file with eight bits per channel. Linear floats are clamped and rounded.
    ///
    /// # Errors
    /// [`RenderError::ReadBack`], [`RenderError::Picture`].
    pub fn save_png(&self, gpu: &Gpu, path: impl AsRef<std::path::Path>) -> Result<(), RenderError> {
        let (path, (width, height)) = (path.as_ref(), self.size());
        let bytes = self.read_rgba8(gpu)?;
        let color = image::ExtendedColorType::Rgba8;
        image::save_buffer_with_format(path, &bytes, width, height, color, image::ImageFormat::Png)
            .map_err(|source| RenderError::Picture { path: path.to_owned(), source })
    }

    /// Reads the frame as RGBA floats, top row first. Eight-bit values are divided by 255.
    ///
    /// # Errors
    /// [`RenderError::ReadBack`].
    pub fn read_linear(&self, gpu: &Gpu) -> Result<Vec<Vec4>, RenderError> {
        let bytes = read_texture(gpu, &self.texture)?;
        let values: Vec<f32> = match self.format {
            OffscreenFormat::Rgba8 => bytes.iter().map(|&byte| f32::from(byte) / 255.0).collect(),
            OffscreenFormat::LinearFloat => floats(&bytes).collect(),
        };
        Ok(values.chunks_exact(4).map(Vec4::from_slice).collect())
    }
}

fn floats(bytes: &[u8]) -> impl Iterator<Item = f32> + '_ {
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
}

/// Reads all texels of a 2D texture with one layer and COPY_SRC usage, as rows without padding.
///
/// # Errors
/// [`RenderError::ReadBack`], [`RenderError::DeviceLost`].
pub fn read_texture(gpu: &Gpu, texture: &wgpu::Texture) -> Result<Vec<u8>, RenderError> {
    let (width, height) = (texture.width(), texture.height());
    let texel = texture.format().block_copy_size(None).unwrap_or(4);
    let row = width * texel;
    let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("frame read-back"),
        size: u64::from(padded) * u64::from(height),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(padded),
                rows_per_image: None,
            },
        },
        texture.size(),
    );
    gpu.queue.submit([encoder.finish()]);
    gpu.check()?;
    let slice = buffer.slice(..);
    let (sender, receiver) = std::sync::mpsc::channel();
    slice.map_async(wgpu::MapMode::Read, move |result| {
        // The receiver waits below. If it is gone, the result is no longer needed.
        let _ = sender.send(result);
    });
    gpu.device
        .poll(wgpu::PollType::wait_indefinitely())
        .map_err(|error| RenderError::ReadBack(error.to_string()))?;
    receiver
        .recv()
        .map_err(|_| RenderError::DeviceLost)?
        .map_err(|error| RenderError::ReadBack(error.to_string()))?;
    let view = slice.get_mapped_range().map_err(|error| RenderError::ReadBack(error.to_string()))?;
    let mut bytes = Vec::with_capacity(row as usize * height as usize);
    for line in view.chunks_exact(padded as usize) {
        bytes.extend_from_slice(&line[..row as usize]);
    }
    drop(view);
    buffer.unmap();
    Ok(bytes)
}
