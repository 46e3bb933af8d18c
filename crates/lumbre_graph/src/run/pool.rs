//! GPU memory of a graph: transient resources by shape, reused from frame to frame, and retained resources by name.

use std::collections::HashMap;

use crate::access::Part;
use crate::resource::{Label, Shape, TextureDescriptor};
use crate::run::error::RunError;

/// Number of frames after which transient memory that no graph used is freed. It is a few frames, so that a pass
/// that runs every other frame does not cause an allocation each time.
pub const KEEP_TRANSIENT_FRAMES: u64 = 4;

/// Number of frames after which a retained resource that no graph declared is dropped: one second at 60 frames per
/// second.
pub const KEEP_RETAINED_FRAMES: u64 = 60;

/// A texture with its views.
#[derive(Clone)]
pub(crate) struct GpuTexture {
    pub texture: wgpu::Texture,
    /// View of the whole texture.
    pub view: wgpu::TextureView,
    /// Views of single parts, created on first use.
    pub parts: Vec<(Part, wgpu::TextureView)>,
}

impl GpuTexture {
    fn create(device: &wgpu::Device, label: &str, shape: &TextureDescriptor) -> Self {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: shape.size,
            mip_level_count: shape.mip_level_count,
            sample_count: shape.sample_count,
            dimension: shape.dimension,
            format: shape.format,
            usage: shape.usage,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        Self { texture, view, parts: Vec::new() }
    }

    /// Returns the view of one part, which is created on first use.
    pub fn part(&mut self, part: Part) -> &wgpu::TextureView {
        let found = self.parts.iter().position(|(held, _)| *held == part);
        let index = found.unwrap_or_else(|| {
            let flat = self.texture.dimension() != wgpu::TextureDimension::D3;
            let view = self.texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: flat.then_some(wgpu::TextureViewDimension::D2),
                base_mip_level: part.mip,
                mip_level_count: Some(1),
                base_array_layer: part.layer,
                array_layer_count: Some(1),
                ..Default::default()
            });
            self.parts.push((part, view));
            self.parts.len() - 1
        });
        &self.parts[index].1
    }
}

/// A texture or a buffer; cloning it clones a reference.
#[derive(Clone)]
pub(crate) enum GpuObject {
    Texture(GpuTexture),
    Buffer(wgpu::Buffer),
}

struct Entry {
    shape: Shape,
    object: GpuObject,
    used_in: u64,
}

/// Counts of the pool's objects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PoolStatistics {
    /// Textures and buffers created since the start, including retained ones.
    pub created: u64,
    /// Transient textures and buffers that exist now.
    pub transients: usize,
    /// Retained textures and buffers that exist now.
    pub retained: usize,
    /// Bytes of both.
    pub bytes: u64,
}

#[derive(Default)]
pub(crate) struct Pool {
    transients: Vec<Entry>,
    retained: HashMap<Label, Entry>,
    created: u64,
}

impl Pool {
    /// Returns memory of this shape that nothing else uses in this frame.
    pub fn transient(
        &mut self,
        device: &wgpu::Device,
        label: &Label,
        shape: &Shape,
        frame: u64,
    ) -> Result<&mut GpuObject, RunError> {
        let free = |entry: &Entry| entry.used_in != frame && entry.shape.serves(shape);
        let index = match self.transients.iter().position(free) {
            Some(index) => index,
            None => {
                let object = self.create(device, label, shape)?;
                self.transients.push(Entry { shape: *shape, object, used_in: frame });
                self.transients.len() - 1
            }
        };
        let entry = &mut self.transients[index];
        entry.used_in = frame;
        Ok(&mut entry.object)
    }

    /// Returns the retained resource with this name, and whether it was only just created and so has no content.
    pub fn retained(
        &mut self,
        device: &wgpu::Device,
        name: &Label,
        shape: &Shape,
        frame: u64,
    ) -> Result<(&mut GpuObject, bool), RunError> {
        let fresh = !self.retained.get(name).is_some_and(|entry| entry.shape.serves(shape));
        if fresh {
            let object = self.create(device, name, shape)?;
            self.retained.insert(name.clone(), Entry { shape: *shape, object, used_in: frame });
        }
        let entry = self.retained.get_mut(name).expect("was there, or was inserted just above");
        entry.used_in = frame;
        Ok((&mut entry.object, fresh))
    }

    /// Frees what has not been used for long. Returns the names of the retained resources that were dropped.
    pub fn trim(&mut self, frame: u64) -> Vec<Label> {
        self.transients.retain(|entry| frame - entry.used_in < KEEP_TRANSIENT_FRAMES);
        let old = |entry: &Entry| frame - entry.used_in >= KEEP_RETAINED_FRAMES;
        let dropped: Vec<Label> =
            self.retained.iter().filter(|(_, entry)| old(entry)).map(|(name, _)| name.clone()).collect();
        for name in &dropped {
            self.retained.remove(name);
        }
        dropped
    }

    pub fn statistics(&self) -> PoolStatistics {
        let all = self.transients.iter().chain(self.retained.values());
        PoolStatistics {
            created: self.created,
            transients: self.transients.len(),
            retained: self.retained.len(),
            bytes: all.fold(0, |sum, entry| entry.shape.bytes().saturating_add(sum)),
        }
    }

    fn create(&mut self, device: &wgpu::Device, name: &Label, shape: &Shape) -> Result<GpuObject, RunError> {
        check_limits(&device.limits(), name, shape)?;
        self.created += 1;
        Ok(match shape {
            Shape::Texture(texture) => GpuObject::Texture(GpuTexture::create(device, name, texture)),
            Shape::Buffer(buffer) => GpuObject::Buffer(device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(name),
                size: buffer.size,
                usage: buffer.usage,
                mapped_at_creation: false,
            })),
        })
    }
}

/// Returns an error that names a resource beyond the device's limits, where wgpu would panic.
fn check_limits(limits: &wgpu::Limits, name: &Label, shape: &Shape) -> Result<(), RunError> {
    let check = |what: &'static str, asked: u64, limit: u64| {
        if asked <= limit {
            return Ok(());
        }
        Err(RunError::Limit { resource: name.clone(), what, asked, limit })
    };
    match shape {
        Shape::Buffer(buffer) => check("a size in bytes", buffer.size, limits.max_buffer_size),
        Shape::Texture(texture) => {
            let size = texture.size;
            let side = size.width.max(size.height);
            if texture.dimension == wgpu::TextureDimension::D3 {
                let side = side.max(size.depth_or_array_layers);
                return check("a side in texels", side.into(), limits.max_texture_dimension_3d.into());
            }
            check("a side in texels", side.into(), limits.max_texture_dimension_2d.into())?;
            check(
                "a number of layers",
                size.depth_or_array_layers.into(),
                limits.max_texture_array_layers.into(),
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::resource::BufferDescriptor;

    #[test]
    fn names_what_is_beyond_the_limits() {
        let limits = wgpu::Limits::default();
        let name: Label = "shadow map".into();
        let side = limits.max_texture_dimension_2d;
        let format = wgpu::TextureFormat::Depth32Float;
        let shape = |side| Shape::Texture(TextureDescriptor::new_2d(side, 1, format));
        assert!(check_limits(&limits, &name, &shape(side)).is_ok());
        let error = check_limits(&limits, &name, &shape(side + 1)).unwrap_err().to_string();
        assert!(error.contains("shadow map") && error.contains("8193") && error.contains("8192"), "{error}");
        let huge = Shape::Buffer(BufferDescriptor::new(limits.max_buffer_size + 4));
        assert!(matches!(check_limits(&limits, &name, &huge), Err(RunError::Limit { .. })));
    }
}
