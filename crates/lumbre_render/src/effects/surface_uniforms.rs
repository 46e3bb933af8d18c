//! A uniform buffer with the shader data of several surfaces, each at a dynamic offset.

use bytemuck::Pod;

use crate::Gpu;

/// Bytes between two surfaces: the largest alignment that a device may require.
const STRIDE: usize = 256;

/// The data of a frame's surfaces on the GPU.
#[derive(Debug, Default)]
pub(super) struct SurfaceUniforms {
    buffer: Option<wgpu::Buffer>,
    /// The content of the buffer.
    written: Vec<u8>,
    /// Bytes written so far.
    pub uploaded: u64,
}

impl SurfaceUniforms {
    /// Uploads the data of a frame's surfaces, if it changed.
    pub fn write<T: Pod>(&mut self, gpu: &Gpu, surfaces: &[T]) {
        let mut bytes = vec![0; surfaces.len() * STRIDE];
        for (place, surface) in bytes.chunks_exact_mut(STRIDE).zip(surfaces) {
            place[..size_of::<T>()].copy_from_slice(bytemuck::bytes_of(surface));
        }
        let size = bytes.len() as u64;
        let buffer = match self.buffer.take().filter(|buffer| buffer.size() >= size) {
            Some(buffer) => buffer,
            None => {
                self.written.clear();
                gpu.device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("surfaces"),
                    size: size.next_power_of_two(),
                    usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                    mapped_at_creation: false,
                })
            }
        };
        if self.written != bytes {
            gpu.queue.write_buffer(&buffer, 0, &bytes);
            self.uploaded += size;
            self.written = bytes;
        }
        self.buffer = Some(buffer);
    }

    /// Returns the binding of the first surface. The others are at their [`offset`](Self::offset).
    pub fn binding<T: Pod>(&self) -> Option<wgpu::BindingResource<'_>> {
        let size = wgpu::BufferSize::new(size_of::<T>() as u64);
        let bound = wgpu::BufferBinding { buffer: self.buffer.as_ref()?, offset: 0, size };
        Some(wgpu::BindingResource::Buffer(bound))
    }

    /// Returns the dynamic offset of a surface.
    pub fn offset(index: usize) -> u32 {
        // Fewer than 2^24 surfaces fit into a uniform buffer.
        (index * STRIDE) as u32
    }
}
