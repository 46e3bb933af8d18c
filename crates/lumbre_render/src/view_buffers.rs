//! The buffers that one view of a frame has for itself: its matrices, its clusters of lights, the classes of
//! surfaces that compute shaders light, and the bind groups 0 that refer to them. What all views of a frame
//! share (objects, materials, lights) belongs to the renderer.

use std::collections::{HashMap, HashSet};

use glam::{DVec3, Vec3};
use lumbre_scene::SceneSettings;

use crate::Gpu;
use crate::cluster_buffers::ClusterBuffers;
use crate::draws::Draws;
use crate::extract::{CameraView, LightSet, LitPass};
use crate::frame_bindings::{FrameBindings, FrameBuffer};
use crate::g_buffer::LitClass;
use crate::growable_buffer::GrowableBuffer;
use crate::layout::{FrameData, radiance};
use crate::light_counter::{CountedPass, LightCounter};
use crate::shader::{Feature, Variant};

/// The buffers of group 0 that all views of a frame share, as far as they exist.
pub(crate) struct SharedBuffers<'a> {
    pub objects: Option<wgpu::BindingResource<'a>>,
    pub materials: Option<wgpu::BindingResource<'a>>,
    pub instances: Option<wgpu::BindingResource<'a>>,
    pub lights: Option<wgpu::BindingResource<'a>>,
    pub light_list: Option<wgpu::BindingResource<'a>>,
    /// The buffers that lights are counted in.
    pub counter: &'a LightCounter,
}

/// Identifies a bind group 0: its buffers, and the pass if lights are counted, which is done by pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct FrameGroup {
    pub bindings: FrameBindings,
    pub counted_in: Option<CountedPass>,
}

impl FrameGroup {
    /// Returns the group that a variant needs in a pass.
    pub fn of(variant: &Variant, pass: LitPass) -> Self {
        let bindings = FrameBindings::of(variant);
        let counted_in = match variant.has(Feature::InCompute) {
            true => CountedPass::DeferredLighting,
            false => CountedPass::Drawn(pass),
        };
        Self { bindings, counted_in: bindings.count_lights().then_some(counted_in) }
    }

    /// Returns the group of a variant that draws into the G-buffer.
    pub fn of_geometry(variant: &Variant) -> Self {
        Self { bindings: FrameBindings::of(variant), counted_in: None }
    }
}

/// The buffers of a view on the GPU.
#[derive(Debug)]
pub(crate) struct ViewBuffers {
    frame: wgpu::Buffer,
    pub clusters: ClusterBuffers,
    /// The classes of deferred surfaces, if compute shaders light them.
    pub lit_classes: GrowableBuffer<LitClass>,
    groups: HashMap<FrameGroup, wgpu::BindGroup>,
}

impl ViewBuffers {
    pub fn new(gpu: &Gpu) -> Self {
        let frame = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("frame"),
            size: size_of::<FrameData>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self {
            frame,
            clusters: ClusterBuffers::new(),
            lit_classes: GrowableBuffer::uniform("lit classes", 1),
            groups: HashMap::new(),
        }
    }

    /// Uploads the matrices of a view and what its shaders need to know of the scene. `origin` is the origin
    /// of frame space.
    pub fn write(
        &self,
        gpu: &Gpu,
        (view, origin, size): (&CameraView, DVec3, [u32; 2]),
        settings: &SceneSettings,
        lights: &LightSet,
        exposure: f32,
    ) {
        let fog = settings.fog.as_ref();
        let pixels = view.pixel_rays(size);
        let data = FrameData {
            clip_from_frame: view.clip_from_frame(origin).as_mat4().to_cols_array_2d(),
            eye: (view.eye - origin).as_vec3(),
            exposure,
            backward: view.basis.z_axis.as_vec3(),
            padding: 0.0,
            ambient: radiance(settings.ambient_with_sky()) + lights.ambient,
            padding_2: 0.0,
            fog_color: fog.map_or(Vec3::ZERO, |fog| radiance(fog.color)),
            padding_3: 0.0,
            fog_parameters: fog.map_or([0.0; 4], |fog| fog.mode.parameters()),
            corner: pixels.corner.as_vec3(),
            parallel: if pixels.parallel { 1.0 } else { 0.0 },
            pixel_right: pixels.right.as_vec3(),
            padding_4: 0.0,
            pixel_down: pixels.down.as_vec3(),
            padding_5: 0.0,
        };
        gpu.queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(&data));
    }

    /// Returns a binding of group 0, once it exists. Each pass has its own light counts.
    pub fn bound<'a>(
        &'a self,
        buffer: FrameBuffer,
        counted_in: Option<CountedPass>,
        shared: &SharedBuffers<'a>,
    ) -> Option<wgpu::BindingResource<'a>> {
        match buffer {
            FrameBuffer::Frame => Some(self.frame.as_entire_binding()),
            FrameBuffer::Objects => shared.objects.clone(),
            FrameBuffer::Materials => shared.materials.clone(),
            FrameBuffer::Instances => shared.instances.clone(),
            FrameBuffer::Lights => shared.lights.clone(),
            FrameBuffer::LightList => shared.light_list.clone(),
            FrameBuffer::LightCounts | FrameBuffer::VertexLightCounts => {
                shared.counter.binding(counted_in?).map(wgpu::BindingResource::Buffer)
            }
            of_clusters => self.clusters.bound(of_clusters),
        }
    }

    /// Returns the uniform buffer of the view.
    pub fn frame(&self) -> &wgpu::Buffer {
        &self.frame
    }

    /// Drops the bind groups, because a buffer that they refer to was replaced.
    pub fn forget_groups(&mut self) {
        self.groups.clear();
    }

    /// Returns a bind group 0, once it has been created.
    pub fn group(&self, wanted: &FrameGroup) -> Option<&wgpu::BindGroup> {
        self.groups.get(wanted)
    }

    /// Returns the bind groups 0 that these draws need and that do not exist yet.
    pub fn missing_groups(&self, draws: &Draws) -> HashSet<FrameGroup> {
        let of_geometry = draws.geometry.iter().map(|batch| FrameGroup::of_geometry(&batch.pipeline.variant));
        let groups = LitPass::ALL.into_iter().flat_map(|pass| {
            let drawn = draws.of(pass).iter().map(|batch| &batch.pipeline.variant);
            let variants = drawn.chain(draws.deferred_of(pass).map(|(_, class)| &class.pipeline.variant));
            variants.map(move |variant| FrameGroup::of(variant, pass))
        });
        of_geometry.chain(groups).filter(|wanted| !self.groups.contains_key(wanted)).collect()
    }

    /// Creates a bind group 0.
    pub fn make_group(
        &mut self,
        gpu: &Gpu,
        wanted: FrameGroup,
        layout: &wgpu::BindGroupLayout,
        shared: &SharedBuffers<'_>,
    ) {
        let entry = |buffer: FrameBuffer| {
            let resource = self.bound(buffer, wanted.counted_in, shared)?;
            Some(wgpu::BindGroupEntry { binding: buffer.binding(), resource })
        };
        let entries: Vec<_> = wanted.bindings.buffers().filter_map(entry).collect();
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("frame"),
            layout,
            entries: &entries,
        });
        self.groups.insert(wanted, group);
    }
}
