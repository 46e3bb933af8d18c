//! What the passes of a frame draw with: its draws, their pipelines and buffers, and the view. Every pass has
//! access to it; what is drawn has been decided before.

use bevy_ecs::entity::Entity;
use glam::{DAffine3, DMat3, DMat4, DVec3, Mat4};
use lumbre_optics::FlatRule;

use crate::draws::{Batch, Draws};
use crate::extract::{CameraView, LitPass, Objects};
use crate::g_buffer::LitClass;
use crate::mesh_buffers::{Attribute, GpuMesh, MeshBuffers};
use crate::mirror_views::MirrorView;
use crate::pipelines::{Pipeline, Pipelines};
use crate::shader::{Feature, Variant};
use crate::shadows::{BLOCK, ShadowMaps};
use crate::view_buffers::{FrameGroup, ViewBuffers};

/// The attributes of a shape with its normals.
pub(crate) const SHAPE: [Attribute; 2] = [Attribute::Position, Attribute::Normal];

/// The scene of a frame, which passes access as `context.user`.
pub struct FrameScene<'a> {
    pub(crate) draws: &'a Draws,
    pub(crate) objects: &'a Objects,
    pub(crate) pipelines: &'a Pipelines,
    pub(crate) meshes: &'a MeshBuffers,
    pub(crate) flat_rule: FlatRule,
    /// The views in mirrors.
    pub(crate) mirrors: &'a [MirrorView],
    /// The buffers of each view: the camera's first, then those in mirrors.
    pub(crate) views: &'a [ViewBuffers],
    pub(crate) view: CameraView,
    /// Width and height of the frame in texels.
    pub(crate) size: [u32; 2],
    pub(crate) shadows: &'a ShadowMaps,
}

/// The camera view of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct FrameView {
    /// Position of the camera in the world, in metres.
    pub eye: DVec3,
    /// The camera's axes in the world, of unit length: right, up, backward.
    pub basis: DMat3,
    /// Transforms world space to clip space. Depth is reversed-Z: 1 at the near plane. Multiply by an
    /// object's matrix in f64 before rounding to f32.
    pub clip_from_world: DMat4,
}

/// An object in view, for effects that draw its shape.
#[derive(Clone, Copy)]
pub struct DrawnObject<'a> {
    /// The entity of the object.
    pub entity: Entity,
    /// Transforms mesh space to world space.
    pub world_from_mesh: DAffine3,
    /// Transforms mesh space to clip space.
    pub clip_from_mesh: Mat4,
    mesh: &'a GpuMesh,
}

impl<'a> FrameScene<'a> {
    /// Returns the camera view.
    pub fn view(&self) -> FrameView {
        let clip_from_world = self.view.clip_from_frame(DVec3::ZERO);
        FrameView { eye: self.view.eye, basis: self.view.basis, clip_from_world }
    }

    /// Returns the objects in view, each once, in an order that stays the same while the scene does. Empty
    /// unless an effect that is called for [draws objects](crate::effects::Effect::draws_objects).
    pub fn objects(&self) -> impl Iterator<Item = DrawnObject<'a>> {
        let clip_from_world = self.view.clip_from_frame(DVec3::ZERO);
        let (objects, meshes) = (self.objects, self.meshes);
        self.draws.instances.iter().filter_map(move |instance| {
            let object = objects.get(instance.object() as usize)?;
            let mesh = meshes.get(object.mesh).filter(|mesh| mesh.has_positions())?;
            let world_from_mesh = object.world_from_mesh;
            let clip_from_mesh = (clip_from_world * DMat4::from(world_from_mesh)).as_mat4();
            Some(DrawnObject { entity: object.entity, world_from_mesh, clip_from_mesh, mesh })
        })
    }

    /// Draws the shadow maps that changed, each into its part of the atlas.
    pub(crate) fn draw_shadow_maps(&self, pass: &mut wgpu::RenderPass<'static>) {
        let Some(maps) = self.shadows.device() else { return };
        let (Some(group), Some(pipelines)) = (&maps.caster_group, self.shadows.pipelines()) else { return };
        for map in &self.shadows.stale {
            let [x, y, side] = map.place;
            pass.set_viewport(x as f32, y as f32, side as f32, side as f32, 0.0, 1.0);
            pass.set_scissor_rect(x, y, side, side);
            pass.set_bind_group(0, group, &[map.matrix_offset]);
            pass.set_pipeline(&pipelines.clear);
            pass.draw(0..3, 0..1);
            pass.set_pipeline(&pipelines.caster);
            for run in map.casters.chunk_by(|a, b| a.mesh == b.mesh && a.slot + 1 == b.slot) {
                let Some(mesh) = self.meshes.get(run[0].mesh) else { continue };
                let slices = mesh.slices(&[Attribute::Position], None);
                let (Some(positions), Some(indices)) = (slices.attributes.first(), slices.indices) else {
                    continue;
                };
                let first = run[0].slot;
                pass.set_vertex_buffer(0, positions.slice(..));
                pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
                // A run has at most as many casters as there are objects, fewer than 2^24.
                pass.draw_indexed(0..slices.count, 0, first..first + run.len() as u32);
            }
        }
    }

    /// Draws the planes of the shadow maps that changed.
    pub(crate) fn draw_shadow_planes(&self, pass: &mut wgpu::RenderPass<'static>) {
        let Some(maps) = self.shadows.device() else { return };
        let (Some(group), Some(pipelines)) = (&maps.planes_group, self.shadows.pipelines()) else { return };
        pass.set_bind_group(0, group, &[]);
        pass.set_pipeline(&pipelines.planes);
        for map in &self.shadows.stale {
            let [x, y, side] = map.place.map(|texels| texels / BLOCK);
            pass.set_viewport(x as f32, y as f32, side as f32, side as f32, 0.0, 1.0);
            pass.set_scissor_rect(x, y, side, side);
            pass.draw(0..3, 0..1);
        }
    }

    /// Returns the buffers that the effects' own shaders bind in group 0 like the lit surfaces: the uniform
    /// of a view (0 is the camera's, 1 is the first view in a mirror), and the transforms of all objects.
    pub(crate) fn view_and_transforms(&self, view: usize) -> Option<[&wgpu::Buffer; 2]> {
        Some([self.views.get(view)?.frame(), self.objects.transforms.buffer()?])
    }

    /// Draws the shape of an object once, with its slot as the instance index. Each attribute is in a vertex
    /// buffer of its own.
    pub(crate) fn draw_shape(
        &self,
        pass: &mut wgpu::RenderPass<'static>,
        slot: usize,
        attributes: &[Attribute],
    ) {
        let object = self.objects.get(slot);
        let Some(mesh) = object.and_then(|object| self.meshes.get(object.mesh)) else { return };
        let slices = mesh.slices(attributes, None);
        let (Some(indices), Ok(instance)) = (slices.indices, u32::try_from(slot)) else { return };
        for (slot, buffer) in (0..).zip(&slices.attributes) {
            pass.set_vertex_buffer(slot, buffer.slice(..));
        }
        pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..slices.count, 0, instance..instance + 1);
    }

    /// Draws the surfaces of a pass that the camera sees.
    pub(crate) fn draw(&self, pass: &mut wgpu::RenderPass<'static>, lit_pass: LitPass) {
        self.draw_view(pass, lit_pass, 0);
    }

    /// Draws the opaque surfaces of a pass that are lit forward. They are drawn only after every pass has lit
    /// the G-buffer, because deferred surfaces may lie behind them.
    pub(crate) fn draw_opaque(&self, pass: &mut wgpu::RenderPass<'static>, lit_pass: LitPass) {
        let later = self.lights_deferred(LitPass::Forward);
        if lit_pass == LitPass::Forward && later {
            self.draw(pass, LitPass::Lightmap);
        }
        if lit_pass != LitPass::Lightmap || !later {
            self.draw(pass, lit_pass);
        }
    }

    /// Draws the surfaces of a pass that a view shows: 0 is the camera's, 1 is the first view in a mirror.
    pub(crate) fn draw_view(&self, pass: &mut wgpu::RenderPass<'static>, lit_pass: LitPass, view: usize) {
        let draws = match view {
            0 => Some(self.draws),
            mirrored => self.mirrors.get(mirrored - 1).map(|mirror| &mirror.draws),
        };
        let (Some(draws), Some(buffers)) = (draws, self.views.get(view)) else { return };
        self.draw_batches(pass, draws.of(lit_pass), (draws, buffers), &|variant| {
            FrameGroup::of(variant, lit_pass)
        });
    }

    /// Draws the deferred surfaces that the camera sees into the G-buffer.
    pub(crate) fn draw_g_buffer(&self, pass: &mut wgpu::RenderPass<'static>) {
        let Some(buffers) = self.views.first() else { return };
        let view = (self.draws, buffers);
        self.draw_batches(pass, &self.draws.geometry, view, &FrameGroup::of_geometry);
    }

    /// Returns true if the camera sees any deferred surface of a pass.
    pub(crate) fn lights_deferred(&self, lit_pass: LitPass) -> bool {
        self.draws.deferred_of(lit_pass).next().is_some()
    }

    /// Returns the layout of the G-buffer's bind group.
    pub(crate) fn g_buffer_layout(&self) -> &wgpu::BindGroupLayout {
        self.pipelines.g_buffer_layout()
    }

    /// Returns the layout of the G-buffer's bind group in compute shaders.
    pub(crate) fn g_buffer_compute_layout(&self) -> &wgpu::BindGroupLayout {
        self.pipelines.g_buffer_compute_layout()
    }

    /// Returns true if the lines of sight are parallel.
    pub(crate) fn is_parallel(&self) -> bool {
        self.view.viewer().w == 0.0
    }

    /// Lights the deferred surfaces of a pass in fragments.
    pub(crate) fn light_deferred(
        &self,
        pass: &mut wgpu::RenderPass<'static>,
        lit_pass: LitPass,
        g_buffer: &wgpu::BindGroup,
    ) {
        let Some(buffers) = self.views.first() else { return };
        for (number, class) in self.draws.deferred_of(lit_pass) {
            let variant = &class.pipeline.variant;
            let (Some(pipeline), Some(group)) =
                (self.pipelines.get(&class.pipeline), buffers.group(&FrameGroup::of(variant, lit_pass)))
            else {
                continue;
            };
            let Some(pipeline) = pipeline.render() else { continue };
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.set_bind_group(1, g_buffer, &[]);
            if self.bind_light(variant, class.baked_light.as_deref(), |index, group| {
                pass.set_bind_group(index, group, &[]);
            }) {
                let [x, y, width, height] = class.window.pixels(self.size);
                pass.set_scissor_rect(x, y, width, height);
                pass.draw(0..3, number..number + 1);
            }
        }
        pass.set_scissor_rect(0, 0, self.size[0], self.size[1]);
    }

    /// Lights the deferred surfaces of all passes in compute shaders. `g_buffer` is group 1, of
    /// [`lit_classes`](Self::lit_classes), one for each dispatch.
    pub(crate) fn light_in_compute(&self, pass: &mut wgpu::ComputePass<'static>, g_buffer: &wgpu::BindGroup) {
        let Some(buffers) = self.views.first() else { return };
        let offsets = (0..).step_by(size_of::<LitClass>());
        for ((class, dispatch), offset) in self.draws.dispatches(self.size).zip(offsets) {
            let variant = &class.pipeline.variant;
            let pipeline = self.pipelines.get(&class.pipeline).and_then(Pipeline::compute);
            let (Some(pipeline), Some(group)) =
                (pipeline, buffers.group(&FrameGroup::of(variant, class.pass)))
            else {
                continue;
            };
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.set_bind_group(1, g_buffer, &[offset]);
            if self.bind_light(variant, class.baked_light.as_deref(), |index, group| {
                pass.set_bind_group(index, group, &[]);
            }) {
                let [columns, rows] = dispatch.workgroups;
                pass.dispatch_workgroups(columns, rows, 1);
            }
        }
    }

    /// Returns the buffer of the classes of deferred surfaces.
    pub(crate) fn lit_classes(&self) -> Option<&wgpu::Buffer> {
        self.views.first()?.lit_classes.buffer()
    }

    /// Draws batches of a view. `group` returns the bind group 0 of a variant.
    fn draw_batches(
        &self,
        pass: &mut wgpu::RenderPass<'static>,
        batches: &[Batch],
        (draws, buffers): (&Draws, &ViewBuffers),
        group: &dyn Fn(&Variant) -> FrameGroup,
    ) {
        let mut bound = None;
        for batch in batches {
            let variant = &batch.pipeline.variant;
            let (Some(pipeline), Some(mesh)) =
                (self.pipelines.get(&batch.pipeline), self.meshes.get(batch.mesh))
            else {
                continue;
            };
            let slices = mesh.slices(&pipeline.attributes, pipeline.flat.then_some(self.flat_rule));
            if slices.count == 0 {
                continue;
            }
            let Some(drawing) = pipeline.render() else { continue };
            pass.set_pipeline(drawing);
            let wanted = group(variant);
            if bound != Some(wanted) {
                let Some(group) = buffers.group(&wanted) else { continue };
                pass.set_bind_group(0, group, &[]);
                bound = Some(wanted);
            }
            if let Some(set) = &batch.texture_set {
                pass.set_bind_group(1, &set.bind_group, &[]);
            }
            if !self.bind_light(variant, batch.baked_light.as_deref(), |index, group| {
                pass.set_bind_group(index, group, &[]);
            }) {
                continue;
            }
            for (slot, buffer) in (0..).zip(&slices.attributes) {
                pass.set_vertex_buffer(slot, buffer.slice(..));
            }
            match slices.indices {
                Some(indices) => {
                    pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
                    pass.draw_indexed(0..slices.count, 0, draws.instances_of(batch));
                }
                None => pass.draw(0..slices.count, draws.instances_of(batch)),
            }
        }
    }

    /// Binds baked light and shadow maps with `set`, as far as a variant reads them. Returns false if the shadow
    /// maps do not exist.
    fn bind_light(
        &self,
        variant: &Variant,
        baked_light: Option<&wgpu::BindGroup>,
        mut set: impl FnMut(u32, Option<&wgpu::BindGroup>),
    ) -> bool {
        // When the previous pipeline has a group that this one lacks, wgpu-core 30 considers groups with a
        // higher index to be still bound and skips setting the same one again, although the device has
        // dropped it. Unsetting the group first makes wgpu bind it again.
        let mut bind_again = |index: u32, group: &wgpu::BindGroup| {
            set(index, None);
            set(index, Some(group));
        };
        if let Some(baked_light) = baked_light {
            bind_again(2, baked_light);
        }
        if variant.has(Feature::Shadows) {
            let maps = self.shadows.device().and_then(|maps| maps.receiver_group.as_ref());
            let Some(group) = maps else { return false };
            bind_again(3, group);
        }
        true
    }
}

impl DrawnObject<'_> {
    /// Draws its triangles once with the current pipeline and bind groups. Vertex buffer 0 holds positions in
    /// mesh space, three f32 per vertex.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        let slices = self.mesh.slices(&[Attribute::Position], None);
        let (Some(positions), Some(indices)) = (slices.attributes.first(), slices.indices) else { return };
        pass.set_vertex_buffer(0, positions.slice(..));
        pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..slices.count, 0, 0..1);
    }
}
