//! A storage buffer or a table in a texture that mirrors a Vec and uploads only what changed.

use std::ops::Range;

use bytemuck::Pod;

use crate::table_texture::TableTexture;
use crate::{Gpu, RenderError};

/// Largest gap, in values, between two changes that are uploaded together.
const COALESCED: usize = 16;

/// A mirrored storage buffer or table.
#[derive(Debug)]
pub(crate) struct GrowableBuffer<T> {
    label: &'static str,
    pub values: Vec<T>,
    dirty: Vec<Range<usize>>,
    /// Smallest capacity, in values.
    least: usize,
    buffer: Option<wgpu::Buffer>,
    capacity: usize,
    usage: wgpu::BufferUsages,
    kept_in: KeptIn,
    texture: TableTexture,
}

/// Where the values are kept on a device that keeps tables in textures. Any other device has them in a
/// buffer.
#[derive(Clone, Copy, Debug, PartialEq)]
enum KeptIn {
    Buffer,
    Texture,
    Both,
}

impl<T: Pod + PartialEq> GrowableBuffer<T> {
    pub fn new(label: &'static str) -> Self {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        Self {
            label,
            values: Vec::new(),
            dirty: Vec::new(),
            least: 1,
            buffer: None,
            capacity: 0,
            usage,
            kept_in: KeptIn::Buffer,
            texture: TableTexture::new(),
        }
    }

    /// Creates a table, which is a texture on a device that keeps tables in textures.
    pub fn table(label: &'static str) -> Self {
        Self { kept_in: KeptIn::Texture, ..Self::new(label) }
    }

    /// Creates a table that exists as a buffer, too, on every device, for shaders that read the buffer.
    pub fn table_and_buffer(label: &'static str) -> Self {
        Self { kept_in: KeptIn::Both, ..Self::new(label) }
    }

    /// Creates a buffer that is also used as a uniform buffer. It has room for the `least` values that
    /// shaders declare, even if there are fewer.
    pub fn uniform(label: &'static str, least: usize) -> Self {
        let new = Self::new(label);
        Self { least, usage: new.usage | wgpu::BufferUsages::UNIFORM, ..new }
    }

    /// Like [`uniform`](Self::uniform), and also a table for shaders that read more than a uniform buffer
    /// holds.
    pub fn uniform_and_table(label: &'static str, least: usize) -> Self {
        Self { kept_in: KeptIn::Both, ..Self::uniform(label, least) }
    }

    /// Sets one value and marks it for the next upload.
    pub fn set(&mut self, index: usize, value: T) {
        if index >= self.values.len() {
            self.values.resize(index + 1, T::zeroed());
        }
        self.values[index] = value;
        match self.dirty.last_mut() {
            // Sending a few unchanged values is cheaper than another copy.
            Some(last) if index >= last.start && index <= last.end + COALESCED => {
                last.end = last.end.max(index + 1);
            }
            _ => self.dirty.push(index..index + 1),
        }
    }

    /// Replaces all values. Those that are equal to the old ones are not uploaded again.
    pub fn replace(&mut self, values: impl IntoIterator<Item = T>) {
        let mut count = 0;
        for value in values {
            if self.values.get(count) != Some(&value) {
                self.set(count, value);
            }
            count += 1;
        }
        self.values.truncate(count);
        self.dirty.retain_mut(|range| {
            range.end = range.end.min(count);
            range.start < range.end
        });
    }

    /// Returns the number of bytes that the next `upload` will send.
    pub fn pending_bytes(&self) -> u64 {
        let dirty: usize = self.dirty.iter().map(ExactSizeIterator::len).sum();
        (dirty * size_of::<T>()) as u64
    }

    /// Brings the GPU's copies up to date. Returns true if one of them was replaced.
    ///
    /// # Errors
    /// [`RenderError::BufferTooLarge`].
    pub fn upload(&mut self, gpu: &Gpu) -> Result<bool, RenderError> {
        let textured = self.kept_in != KeptIn::Buffer && gpu.reads_tables_from_textures();
        let buffered = self.kept_in != KeptIn::Texture || !textured;
        let mut renewed = false;
        if textured {
            let entries = self.values.len().max(self.least);
            renewed = self.texture.make_room(gpu, self.label, (entries, size_of::<T>()))?;
            if renewed {
                self.send_everything();
            }
        }
        if buffered && (self.buffer.is_none() || self.values.len() > self.capacity) {
            let limit = gpu.device.limits().max_storage_buffer_binding_size;
            let bytes = size_of_val(self.values.as_slice()) as u64;
            if bytes > limit {
                return Err(RenderError::BufferTooLarge { what: self.label, bytes, limit });
            }
            let most = usize::try_from(limit).unwrap_or(usize::MAX) / size_of::<T>();
            self.capacity = self.values.len().next_power_of_two().max(self.least).min(most);
            let size = (self.capacity * size_of::<T>()) as u64;
            self.buffer = Some(gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(self.label),
                size,
                usage: self.usage,
                mapped_at_creation: false,
            }));
            self.send_everything();
            renewed = true;
        }
        for range in self.dirty.drain(..) {
            if textured {
                let bytes = bytemuck::cast_slice(&self.values);
                self.texture.write(gpu, bytes, size_of::<T>(), range.clone());
            }
            if let Some(buffer) = self.buffer.as_ref().filter(|_| buffered) {
                let offset = (range.start * size_of::<T>()) as u64;
                gpu.queue.write_buffer(buffer, offset, bytemuck::cast_slice(&self.values[range]));
            }
        }
        Ok(renewed)
    }

    fn send_everything(&mut self) {
        self.dirty.clear();
        if !self.values.is_empty() {
            self.dirty.push(0..self.values.len());
        }
    }

    /// Returns the binding for the shaders of lit surfaces, once `upload` has created it.
    pub fn bound(&self) -> Option<wgpu::BindingResource<'_>> {
        let texture = self.texture.view().map(wgpu::BindingResource::TextureView);
        texture.or_else(|| self.buffer.as_ref().map(wgpu::Buffer::as_entire_binding))
    }

    /// Returns the copy in a buffer, once `upload` has created it.
    pub fn buffer(&self) -> Option<&wgpu::Buffer> {
        self.buffer.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_differences_are_pending() {
        let mut buffer = GrowableBuffer::<u32>::new("test");
        buffer.replace([1, 2, 3, 4]);
        assert_eq!(buffer.pending_bytes(), 16);
        buffer.dirty.clear();
        buffer.replace([1, 2, 3, 4]);
        assert_eq!(buffer.pending_bytes(), 0);
        buffer.replace([1, 9, 3]);
        assert_eq!((buffer.pending_bytes(), buffer.values.as_slice()), (4, [1, 9, 3].as_slice()));
        // Changes close to each other are sent in one piece, others separately.
        buffer.replace(0..100);
        buffer.dirty.clear();
        buffer.replace((0..100).map(|value| if [3, 9, 90].contains(&value) { 0 } else { value }));
        assert_eq!(buffer.dirty, [3..10, 90..91]);
    }
}
