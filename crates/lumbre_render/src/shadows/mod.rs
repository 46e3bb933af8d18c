//! Shadow maps of the lights that ask for them: their views, their tiles in one atlas, the casters in each,
//! and which maps have to be drawn again. How a surface reads them is in shaders/shadows.wesl; the pass that
//! draws them is `effects::shadows`.

mod atlas;
mod views;

use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DMat4, DVec3, DVec4, Mat4};

use crate::extract::{CameraView, Object, Objects};
use crate::full_screen;
use crate::growable_buffer::GrowableBuffer;
use crate::layout::InverseSquareLightData;
use crate::mesh_buffers::{Attribute, MeshBuffers, MeshKey};
use crate::pending::Pending;
use crate::shader::{self, TABLES_IN_TEXTURES};
use crate::shadow_light::{MAX_VIEWS, ShadowKind, ShadowLight};
use crate::table_texture::table_binding;
use crate::{Gpu, RenderError, Uploads};

/// Largest side of the atlas, in texels.
const MAX_TEXELS: u32 = 4096;
/// Format of the planes of maps, which have a texel for each block of the atlas of this side.
pub(crate) const PLANES_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;
pub(crate) const BLOCK: u32 = 4;
/// Stride of records that are bound at a dynamic offset: the largest alignment that WebGPU may require.
const STRIDE: usize = 256;

/// `ShadowView` of shaders/shadows.wesl.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
struct ViewData {
    /// Of an orthographic view, the transform of frame space to the coordinates of the map and its depth; of a
    /// perspective one its directions to the right, up and forward.
    axes: [[f32; 4]; 3],
    /// Corner and side in the atlas, in texels; 0.
    tile: [f32; 4],
    /// Size of a texel in metres (in a perspective view at a distance of one metre), near plane or negative
    /// depth range, size of the light, end of a cascade.
    parameters: [f32; 4],
}

/// A record of `shadowed_lights` in shaders/shadows.wesl: a light with a compact record, and the views of its shadow.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
struct ShadowedLightData {
    light: InverseSquareLightData,
    /// Of a cone, the directions of its view to the right, up and forward; of a cube, the corners of its maps,
    /// in texels, two in each. A corner is negative if there is no map.
    axes_or_corners: [[f32; 4]; 3],
    /// Corner of a cone's map; side of all its maps in texels; 1 for a cone, 2 for a cube, 0 for none.
    tile: [f32; 4],
    parameters: [f32; 4],
}

// `shadowed_lights` in shaders/shadows.wesl has room for this many texels.
const _: () = assert!(size_of::<ShadowedLightData>() == 8 * 16 && (MAX_VIEWS + 1) * 8 == 1032);

impl ShadowedLightData {
    /// Creates the record of a light with these views.
    fn new(light: InverseSquareLightData, kind: ShadowKind, views: &[ViewData]) -> Self {
        // All maps of a light are equally large.
        let placed = views.iter().find(|view| view.tile[2] > 0.0);
        let Some(ViewData { axes, tile: [x, y, side, _], parameters }) = placed.copied() else {
            return Self { light, ..Self::zeroed() };
        };
        let mut axes_or_corners = [[-1.0; 4]; 3];
        match kind {
            ShadowKind::Cube => {
                for (view, place) in views.iter().zip(axes_or_corners.as_flattened_mut().chunks_exact_mut(2))
                {
                    if view.tile[2] > 0.0 {
                        place.copy_from_slice(&view.tile[..2]);
                    }
                }
            }
            ShadowKind::Cone | ShadowKind::Cascades => {
                axes_or_corners = axes;
            }
        }
        let kind = if kind == ShadowKind::Cube { 2.0 } else { 1.0 };
        Self { light, axes_or_corners, tile: [x, y, side, kind], parameters }
    }
}

/// A caster to draw in a view.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Caster {
    pub mesh: MeshKey,
    /// Its index in the table of objects.
    pub slot: u32,
}

/// A map that has to be drawn again.
#[derive(Debug)]
pub(crate) struct StaleMap {
    /// Corner and side in texels.
    pub place: [u32; 3],
    /// Offset of its matrix in the buffer of matrices.
    pub matrix_offset: u32,
    pub casters: Vec<Caster>,
}

/// What the shadow views of a frame need to know about its camera.
#[derive(Clone, Debug)]
pub(crate) struct ShadowedView {
    pub view: CameraView,
    /// The camera's reflections in mirrors.
    pub reflected: Vec<CameraView>,
    /// Rows of the frame.
    pub height: u32,
    /// Nearest and farthest depth of what is in any view, in metres.
    pub depths: [f64; 2],
    /// Factor on the default side of the maps.
    pub resolution: f32,
    /// Whether the maps' planes are read.
    pub planes: bool,
}

/// The shadow maps of a renderer.
#[derive(Debug)]
pub(crate) struct ShadowMaps {
    /// For each view, a hash of what its map shows; 0 if the map has to be drawn.
    drawn: Vec<u64>,
    pub stale: Vec<StaleMap>,
    views: GrowableBuffer<ViewData>,
    /// The lights with a compact record. The buffer has room for a black one after as many as there can be,
    /// which is never written.
    lights: GrowableBuffer<ShadowedLightData>,
    matrices: Vec<u8>,
    casters: Option<Pending<CasterPipelines>>,
    device: Option<OnDevice>,
    /// Side of the next atlas, in texels.
    side: u32,
    /// Whether the maps' planes are drawn, too.
    planes: bool,
}

/// The pipelines that draw casters into a map, and the map's planes.
#[derive(Debug)]
pub(crate) struct CasterPipelines {
    layout: wgpu::BindGroupLayout,
    planes_layout: wgpu::BindGroupLayout,
    pub planes: wgpu::RenderPipeline,
    pub caster: wgpu::RenderPipeline,
    pub clear: wgpu::RenderPipeline,
}

impl CasterPipelines {
    /// Returns the number of pipelines.
    pub fn count(&self) -> usize {
        [&self.caster, &self.clear, &self.planes].len()
    }
}

/// The atlas and its bind groups.
#[derive(Debug)]
pub(crate) struct OnDevice {
    pub atlas: wgpu::Texture,
    pub atlas_view: wgpu::TextureView,
    /// The planes of the maps, if there are any; else a single texel.
    pub planes: wgpu::TextureView,
    has_planes: bool,
    pub planes_group: Option<wgpu::BindGroup>,
    matrices: wgpu::Buffer,
    pub caster_group: Option<wgpu::BindGroup>,
    pub receiver_group: Option<wgpu::BindGroup>,
}

impl ShadowMaps {
    pub fn new() -> Self {
        Self {
            drawn: Vec::new(),
            stale: Vec::new(),
            views: GrowableBuffer::table("shadow views"),
            lights: GrowableBuffer::uniform("lights with a shadow", MAX_VIEWS + 1),
            matrices: Vec::new(),
            casters: None,
            device: None,
            side: 0,
            planes: false,
        }
    }

    /// Starts to create the pipelines that draw casters, unless they exist or are being created. Returns true
    /// if they exist, which is always the case with `wait`. Without `wait`, the job that `afterwards` returns
    /// runs before they count as existing.
    ///
    /// # Errors
    /// [`RenderError::Shader`], which is a bug in this crate.
    pub fn prepare(
        &mut self,
        gpu: &Gpu,
        wait: bool,
        afterwards: impl FnOnce() -> Option<Box<dyn FnOnce() + Send>>,
    ) -> Result<bool, RenderError> {
        let casters = self.casters.get_or_insert_with(|| {
            let (device, tables_in_textures) = (gpu.device.clone(), gpu.reads_tables_from_textures());
            let afterwards = if wait { None } else { afterwards() };
            let make = move || {
                let casters = CasterPipelines::new(&device, tables_in_textures)?;
                afterwards.into_iter().for_each(|afterwards| afterwards());
                Ok(casters)
            };
            if wait { Pending::make(make) } else { Pending::begin(gpu, make) }
        });
        let variant = || "shadow_caster".to_owned();
        casters.is_there(wait).map_err(|message| RenderError::Shader { variant: variant(), message })
    }

    /// Returns the pipelines, once `prepare` has created them.
    pub fn pipelines(&self) -> Option<&CasterPipelines> {
        self.casters.as_ref()?.get()?.ok()
    }

    /// Chooses views and tiles for the lights of a frame, and finds out which maps are out of date.
    pub fn plan(&mut self, lights: &[ShadowLight], objects: &Objects, seen: &ShadowedView) {
        let casters = objects.iter().filter(|(_, object)| object.casts_shadow());
        let (low, high) = casters.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), (_, object)| {
            let center = object.center - objects.origin;
            (low.min(center - object.half_size), high.max(center + object.half_size))
        });
        let around = match low.cmple(high).all() {
            true => (0.5 * (low + high), 0.5 * (high - low).length()),
            false => (DVec3::ZERO, 1.0),
        };
        let planes = seen.planes;
        let seen = views::Seen {
            view: seen.view,
            reflected: seen.reflected.clone(),
            origin: objects.origin,
            depths: seen.depths,
            height: seen.height,
            casters: around,
            resolution: f64::from(seen.resolution),
        };
        let mut found = Vec::new();
        for light in lights {
            let lamp = views::Lamp {
                kind: light.kind,
                position: light.position - objects.origin,
                axis: light.axis,
                cone: light.cone,
                range: light.range,
            };
            found.extend(views::views(&lamp, &seen).into_iter().map(|view| (light, view)));
        }
        let wanted: Vec<f64> = found.iter().map(|(_, view)| view.wanted).collect();
        let (side, tiles) = atlas::pack(&wanted, seen.most_texels(), MAX_TEXELS);
        if (side, planes) != (self.side, self.planes) {
            (self.side, self.planes) = (side, planes);
            self.drawn.clear();
        }
        self.drawn.resize(found.len(), 0);
        self.stale.clear();
        self.matrices.clear();
        let mut data = Vec::with_capacity(found.len());
        for (((light, view), tile), drawn) in found.iter().zip(&tiles).zip(&mut self.drawn) {
            let Some(tile) = tile else {
                // This view has no map, so it hides nothing.
                data.push(ViewData::default());
                continue;
            };
            let place = [f64::from(tile.x), f64::from(tile.y), f64::from(tile.side), 0.0];
            let parameters = [view.width / f64::from(tile.side), view.near_or_depth, light.size, view.end];
            // From clip space to the map's coordinates, which are [0, 1] with y downwards.
            let map_from_clip = DMat4::from_cols(
                DVec4::new(0.5, 0.0, 0.0, 0.0),
                DVec4::new(0.0, -0.5, 0.0, 0.0),
                DVec4::new(0.0, 0.0, 1.0, 0.0),
                DVec4::new(0.5, 0.5, 0.0, 1.0),
            );
            let clip_from_frame = view.clip_from_frame.as_mat4();
            let [right, up, forward] = [view.basis.x_axis, view.basis.y_axis, -view.basis.z_axis];
            let axes = match light.kind {
                ShadowKind::Cascades => (map_from_clip * view.clip_from_frame).transpose(),
                ShadowKind::Cone | ShadowKind::Cube => DMat4::from_mat3(DMat3::from_cols(right, up, forward)),
            };
            let [x, y, z, _] = axes.as_mat4().to_cols_array_2d();
            data.push(ViewData {
                axes: [x, y, z],
                tile: place.map(|number| number as f32),
                parameters: parameters.map(|number| number as f32),
            });
            let (casters, shows) =
                casters_of(objects, light, view, clip_from_frame, [tile.x, tile.y, tile.side]);
            if *drawn != shows {
                *drawn = shows;
                // Less than MAX_VIEWS strides.
                let matrix_offset = self.matrices.len() as u32;
                self.matrices.extend_from_slice(bytemuck::bytes_of(&clip_from_frame.to_cols_array_2d()));
                self.matrices.resize(matrix_offset as usize + STRIDE, 0);
                self.stale.push(StaleMap { place: [tile.x, tile.y, tile.side], matrix_offset, casters });
            }
        }
        let mut views = data.as_slice();
        let compact = lights.iter().filter_map(|light| {
            let (own, others) = views.split_at(light.views().min(views.len()));
            views = others;
            Some(ShadowedLightData::new(light.compact?, light.kind, own))
        });
        // There is a buffer to bind even if no light has such a record.
        self.lights.replace(compact.chain([ShadowedLightData::zeroed()]).take(MAX_VIEWS));
        self.views.replace(data);
    }

    /// Creates and uploads what the stale maps are drawn with and what surfaces read, after `prepare`.
    /// `objects` is the table of transforms.
    ///
    /// # Errors
    /// [`RenderError::Shader`], which is a bug in this crate; [`RenderError::BufferTooLarge`].
    pub fn upload(
        &mut self,
        gpu: &Gpu,
        objects: wgpu::BindingResource<'_>,
        meshes: &mut MeshBuffers,
        layout: &wgpu::BindGroupLayout,
    ) -> Result<Uploads, RenderError> {
        let kept = self.device.as_ref().map(|device| (device.atlas.width(), device.has_planes));
        let side = self.side.min(gpu.device.limits().max_texture_dimension_2d);
        if kept != Some((side, self.planes)) {
            self.device = Some(OnDevice::new(gpu, side, self.planes));
        }
        let shadows = self.views.pending_bytes() + self.lights.pending_bytes() + self.matrices.len() as u64;
        let mut uploads = Uploads { shadows, ..Uploads::default() };
        let renewed = self.views.upload(gpu)? | self.lights.upload(gpu)?;
        let Some(device) = &mut self.device else { return Ok(uploads) };
        if !self.matrices.is_empty() {
            gpu.queue.write_buffer(&device.matrices, 0, &self.matrices);
        }
        if renewed || device.receiver_group.is_none() {
            let bound = self.views.bound().zip(self.lights.buffer());
            device.receiver_group = bound.map(|(views, lights)| device.receivers(gpu, views, lights, layout));
        }
        let pipelines = self.casters.as_ref().and_then(|casters| casters.get()?.ok());
        device.caster_group =
            pipelines.map(|pipelines| pipelines.group(&gpu.device, objects, &device.matrices));
        if device.planes_group.is_none() {
            device.planes_group =
                pipelines.map(|pipelines| pipelines.planes_group(&gpu.device, &device.atlas_view));
        }
        for caster in self.stale.iter().flat_map(|map| &map.casters) {
            if let Some(mesh) = meshes.get_mut(caster.mesh) {
                uploads.meshes += mesh.prepare(gpu, &[Attribute::Position], None);
            }
        }
        Ok(uploads)
    }

    /// Returns the maps, once `upload` has created them.
    pub fn device(&self) -> Option<&OnDevice> {
        self.device.as_ref()
    }

    /// Marks all maps as out of date.
    pub fn forget(&mut self) {
        self.drawn.clear();
    }
}

impl Object {
    /// Returns true if the object casts a shadow: it is lit, opaque, and not transparent glass.
    fn casts_shadow(&self) -> bool {
        // Glass transmits most of the light, so no shadow is closer to the truth than a full one.
        let clear = self.refractor.is_some_and(|refractor| refractor.lets_most_pass());
        !self.traits.unlit && self.traits.alpha_mode != lumbre_optics::AlphaMode::Blend && !clear
    }
}

/// Returns the casters of a view, and a hash of everything that its map shows. A lamp casts no shadow of its
/// own light: neither its own mesh nor a glowing bulb with the light inside.
fn casters_of(
    objects: &Objects,
    lamp: &ShadowLight,
    view: &views::View,
    clip: Mat4,
    place: [u32; 3],
) -> (Vec<Caster>, u64) {
    let rows = view.clip_from_frame.transpose();
    // The near plane is not tested: nearer casters are clipped when they are drawn, and an orthographic view
    // begins before its first caster.
    let planes = [
        rows.w_axis + rows.x_axis,
        rows.w_axis - rows.x_axis,
        rows.w_axis + rows.y_axis,
        rows.w_axis - rows.y_axis,
        rows.z_axis,
    ]
    .map(|plane| plane / plane.truncate().length().max(f64::MIN_POSITIVE));
    let mut hash = Hash::new();
    clip.to_cols_array().iter().for_each(|number| hash.add(u64::from(number.to_bits())));
    place.iter().for_each(|number| hash.add(u64::from(*number)));
    let mut casters = Vec::new();
    for (slot, object) in objects.iter() {
        let inside = || (lamp.position - object.center).abs().cmple(object.half_size).all();
        let own = object.entity == lamp.entity
            || object.traits.glows && lamp.kind != ShadowKind::Cascades && inside();
        if !object.casts_shadow() || own {
            continue;
        }
        let center = (object.center - objects.origin).extend(1.0);
        // The last plane of an infinite view is degenerate; its distance is a constant that is not negative.
        if !planes.iter().all(|plane| plane.dot(center) >= -object.radius) {
            continue;
        }
        hash.add(object.mesh.0 as u64);
        object.world_from_mesh.to_cols_array().iter().for_each(|number| hash.add(number.to_bits()));
        // There are at most as many objects as a table holds.
        casters.push(Caster { mesh: object.mesh, slot: slot as u32 });
    }
    // Sorted by mesh, so that its buffers are bound only once.
    casters.sort_unstable_by_key(|caster| (caster.mesh.0, caster.slot));
    (casters, hash.finish())
}

/// FNV-1a over words. It only has to detect changes, not to resist attacks.
struct Hash(u64);

impl Hash {
    fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn add(&mut self, word: u64) {
        self.0 = (self.0 ^ word).wrapping_mul(0x0100_0000_01b3).rotate_left(29);
    }

    /// Never 0, which stands for a map that has not been drawn.
    fn finish(&self) -> u64 {
        self.0 | 1
    }
}

const ATLAS_BINDING: wgpu::BindingType = wgpu::BindingType::Texture {
    sample_type: wgpu::TextureSampleType::Depth,
    view_dimension: wgpu::TextureViewDimension::D2,
    multisampled: false,
};

/// Creates the layout of the group that surfaces read shadows from.
pub(crate) fn receiver_layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::VERTEX_FRAGMENT | wgpu::ShaderStages::COMPUTE,
        ty,
        count: None,
    };
    let views = table_binding(gpu.reads_tables_from_textures());
    let planes = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: false },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let lights = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("shadows"),
        entries: &[entry(0, ATLAS_BINDING), entry(1, views), entry(2, lights), entry(3, planes)],
    })
}

impl CasterPipelines {
    /// Creates the pipelines for a device that keeps tables in textures or in buffers.
    pub fn new(device: &wgpu::Device, tables_in_textures: bool) -> Result<Self, RenderError> {
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::VERTEX,
            ty,
            count: None,
        };
        let table = table_binding(tables_in_textures);
        let matrix = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: true,
            min_binding_size: None,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("shadow casters"),
            entries: &[entry(0, table), entry(1, matrix)],
        });
        let planes_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("shadow planes"),
            entries: &[wgpu::BindGroupLayoutEntry {
                visibility: wgpu::ShaderStages::FRAGMENT,
                ..entry(0, ATLAS_BINDING)
            }],
        });
        let flags = [(TABLES_IN_TEXTURES, tables_in_textures)];
        let module = shader::compile(device, "shadow_caster", &flags)?;
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("shadow casters"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let positions = [Some(wgpu::VertexBufferLayout {
            array_stride: 12,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &wgpu::vertex_attr_array![0 => Float32x3],
        })];
        let make = |entry_point: &str, buffers: &[Option<wgpu::VertexBufferLayout<'_>>], compare| {
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(entry_point),
                layout: Some(&pipeline_layout),
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some(entry_point),
                    compilation_options: Default::default(),
                    buffers,
                },
                // Both sides cast, so that a sheet has a shadow from behind, too.
                primitive: Default::default(),
                depth_stencil: Some(wgpu::DepthStencilState {
                    format: crate::target::DEPTH_FORMAT,
                    depth_write_enabled: Some(true),
                    depth_compare: Some(compare),
                    stencil: Default::default(),
                    bias: Default::default(),
                }),
                multisample: Default::default(),
                fragment: None,
                multiview_mask: None,
                cache: None,
            })
        };
        Ok(Self {
            caster: make("caster", &positions, wgpu::CompareFunction::Greater),
            clear: make("clear", &[], wgpu::CompareFunction::Always),
            layout,
            planes: planes_pipeline(device, &planes_layout)?,
            planes_layout,
        })
    }

    /// Creates the bind group of the planes.
    pub fn planes_group(&self, device: &wgpu::Device, atlas: &wgpu::TextureView) -> wgpu::BindGroup {
        let resource = wgpu::BindingResource::TextureView(atlas);
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("shadow planes"),
            layout: &self.planes_layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource }],
        })
    }

    /// Creates the casters' bind group: the table of objects, and a matrix at a dynamic offset.
    pub fn group(
        &self,
        device: &wgpu::Device,
        objects: wgpu::BindingResource<'_>,
        matrices: &wgpu::Buffer,
    ) -> wgpu::BindGroup {
        let matrix = wgpu::BufferBinding { buffer: matrices, offset: 0, size: wgpu::BufferSize::new(64) };
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("shadow casters"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: objects },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Buffer(matrix) },
            ],
        })
    }
}

fn planes_pipeline(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
) -> Result<wgpu::RenderPipeline, RenderError> {
    const NAME: &str = "shadow_planes";
    let module = shader::compile(device, NAME, &[])?;
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(NAME),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    Ok(full_screen::pipeline(device, NAME, &module, Some(&layout), (PLANES_FORMAT, None)))
}

impl OnDevice {
    fn new(gpu: &Gpu, side: u32, has_planes: bool) -> Self {
        let device = &gpu.device;
        let atlas = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("shadow atlas"),
            size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: crate::target::DEPTH_FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        // Where no filter reads planes, there is still a texture to bind.
        let side = if has_planes { side.div_ceil(BLOCK) } else { 1 };
        let planes = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("shadow planes"),
            size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: PLANES_FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let matrices = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("shadow matrices"),
            size: (MAX_VIEWS * STRIDE) as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self {
            atlas_view: atlas.create_view(&Default::default()),
            atlas,
            matrices,
            planes: planes.create_view(&Default::default()),
            has_planes,
            planes_group: None,
            caster_group: None,
            receiver_group: None,
        }
    }

    fn receivers(
        &self,
        gpu: &Gpu,
        views: wgpu::BindingResource<'_>,
        lights: &wgpu::Buffer,
        layout: &wgpu::BindGroupLayout,
    ) -> wgpu::BindGroup {
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("shadows"),
            layout,
            entries: &[
                entry(0, wgpu::BindingResource::TextureView(&self.atlas_view)),
                entry(1, views),
                entry(2, lights.as_entire_binding()),
                entry(3, wgpu::BindingResource::TextureView(&self.planes)),
            ],
        })
    }
}
