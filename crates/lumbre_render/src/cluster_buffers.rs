//! The GPU's copies of a frame's clusters: the grid, the lists, and the compact records of their lights. The
//! content of the lists is computed in `light_clusters`.

use crate::cluster_grid::ClusteredView;
use crate::extract::{LightClass, SceneLights, UNIFORM_LIGHTS};
use crate::frame_bindings::FrameBuffer;
use crate::growable_buffer::GrowableBuffer;
use crate::layout::{ClusterGridData, InverseSquareLightData};
use crate::light_clusters::{BoundingSphere, LightClusters};
use crate::shadow_light::BLACK_SHADOWED;
use crate::table_texture::TableTexture;
use crate::{Gpu, RenderError};

/// Name of the lists in errors and debuggers.
const LISTS: &str = "lists of lights per cluster";

/// The buffers of group 0 that belong to clusters.
#[derive(Debug)]
pub(crate) struct ClusterBuffers {
    pub clusters: LightClusters,
    inverse_square: Vec<BoundingSphere>,
    shadowed: Vec<BoundingSphere>,
    ranged: Vec<BoundingSphere>,
    grid: GrowableBuffer<ClusterGridData>,
    lists: Option<wgpu::Buffer>,
    /// The lists on a device that keeps tables in textures.
    list_table: TableTexture,
    lights: GrowableBuffer<InverseSquareLightData>,
}

impl ClusterBuffers {
    pub fn new() -> Self {
        Self {
            clusters: LightClusters::default(),
            inverse_square: Vec::new(),
            shadowed: Vec::new(),
            ranged: Vec::new(),
            grid: GrowableBuffer::uniform("cluster grid", 1),
            lists: None,
            list_table: TableTexture::new(),
            lights: GrowableBuffer::uniform_and_table("inverse-square lights", UNIFORM_LIGHTS as usize + 1),
        }
    }

    /// Builds the lists of a frame.
    pub fn build(&mut self, view: &ClusteredView, lights: &SceneLights) {
        self.inverse_square.clear();
        self.shadowed.clear();
        self.ranged.clear();
        let number = |before: &[BoundingSphere]| u32::try_from(before.len()).unwrap_or(u32::MAX);
        for (reach, index) in lights.reaches.iter().zip(0..) {
            let sphere = |light| BoundingSphere {
                light,
                center: reach.center,
                radius: reach.radius,
                cone: reach.cone,
            };
            match reach.class {
                LightClass::Unbounded => {}
                LightClass::InverseSquare => {
                    self.inverse_square.push(sphere(number(&self.inverse_square)));
                }
                LightClass::Shadowed => self.shadowed.push(sphere(number(&self.shadowed))),
                LightClass::Ranged => self.ranged.push(sphere(index)),
            }
        }
        // If no light of the third class is left, its shaders read the black light that follows all others.
        let black = u32::try_from(lights.reaches.len()).unwrap_or(u32::MAX);
        let classes = [&self.inverse_square[..], &self.shadowed, &self.ranged];
        self.clusters.build(view, classes, [BLACK_SHADOWED, black]);
        // Baked lights come last.
        let grid = &mut self.clusters.grid;
        grid.first_baked_inverse_square = lights.set.inverse_square.dynamic;
        grid.first_baked_shadowed = lights.set.shadowed.dynamic;
        grid.first_baked_ranged = lights.set.every.dynamic;
        self.grid.replace([*grid]);
        self.lights.replace(lights.inverse_square.iter().copied().chain([InverseSquareLightData::BLACK]));
    }

    /// Returns the number of bytes that the next `upload` will send.
    pub fn pending_bytes(&self) -> u64 {
        self.grid.pending_bytes()
            + self.lights.pending_bytes()
            + size_of_val(self.clusters.values.as_slice()) as u64
    }

    /// Brings the GPU's copies up to date. Returns true if a buffer or texture was replaced.
    ///
    /// # Errors
    /// [`RenderError::BufferTooLarge`].
    pub fn upload(&mut self, gpu: &Gpu) -> Result<bool, RenderError> {
        let mut renewed = self.grid.upload(gpu)? | self.lights.upload(gpu)?;
        let bytes: &[u8] = bytemuck::cast_slice(&self.clusters.values);
        if gpu.reads_tables_from_textures() {
            let (entries, entry_size) = (self.clusters.values.len(), size_of::<u32>());
            renewed |= self.list_table.make_room(gpu, LISTS, (entries, entry_size))?;
            self.list_table.write(gpu, bytes, entry_size, 0..entries);
            return Ok(renewed);
        }
        let size = bytes.len() as u64;
        if self.lists.as_ref().is_none_or(|lists| lists.size() < size) {
            let limit = gpu.device.limits().max_storage_buffer_binding_size;
            if size > limit {
                return Err(RenderError::BufferTooLarge { what: LISTS, bytes: size, limit });
            }
            self.lists = Some(gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(LISTS),
                size: size.next_power_of_two().min(limit),
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }));
            renewed = true;
        }
        if let Some(lists) = &self.lists {
            gpu.queue.write_buffer(lists, 0, bytes);
        }
        Ok(renewed)
    }

    /// Returns the binding of a buffer, once `upload` has created it.
    pub fn bound(&self, buffer: FrameBuffer) -> Option<wgpu::BindingResource<'_>> {
        match buffer {
            FrameBuffer::ClusterGrid => self.grid.buffer().map(wgpu::Buffer::as_entire_binding),
            FrameBuffer::ClusterLists => {
                let texture = self.list_table.view().map(wgpu::BindingResource::TextureView);
                texture.or_else(|| self.lists.as_ref().map(wgpu::Buffer::as_entire_binding))
            }
            FrameBuffer::InverseSquareLights => self.lights.bound(),
            FrameBuffer::UniformLights => self.lights.buffer().map(|buffer| {
                let bytes = u64::from(UNIFORM_LIGHTS + 1) * size_of::<InverseSquareLightData>() as u64;
                let size = wgpu::BufferSize::new(bytes);
                wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset: 0, size })
            }),
            _ => None,
        }
    }
}
