//! What the passes of a frame draw with: its draws, their pipelines and buffers, and the view. Every pass is lent it; what is drawn was decided before.

use bevy_ecs::entity::Entity;
use glam::{DAffine3, DMat3, DMat4, DVec3, Mat4};
use lumbre_optics::FlatRule;

use crate::draws::{Batch, Draws};
use crate::extract::{CameraView, LitPass, Objects};
use crate::mesh_buffers::{Attribute, GpuMesh, MeshBuffers};
use crate::mirror_views::MirrorView;
use crate::pipelines::Pipelines;
use crate::shader::{Feature, Variant};
use crate::shadows::ShadowMaps;
use crate::view_buffers::{FrameGroup, ViewBuffers};

/// A shape with its normals.
pub(crate) const SHAPE: [Attribute; 2] = [Attribute::Position, Attribute::Normal];

/// A frame's scene, as its passes find it in `context.user`.
pub struct FrameScene<'a> {
    pub(crate) draws: &'a Draws,
    pub(crate) objects: &'a Objects,
    pub(crate) pipelines: &'a Pipelines,
    pub(crate) meshes: &'a MeshBuffers,
    pub(crate) flat_rule: FlatRule,
    /// What is seen in mirrors.
    pub(crate) mirrors: &'a [MirrorView],
    /// The buffers of each view: the camera's first, then those of mirrors.
    pub(crate) views: &'a [ViewBuffers],
    pub(crate) view: CameraView,
    /// Width and height of the frame in texels.
    pub(crate) size: [u32; 2],
    pub(crate) shadows: &'a ShadowMaps,
}

/// The camera of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct FrameView {
    /// Where the camera stands in the world, in metres.
    pub eye: DVec3,
    /// The camera's axes in the world, unit: right, up, backward.
    pub basis: DMat3,
    /// From the world to clip space, reversed-Z: depth 1 at the near plane. Multiply by an object's matrix in f64 before rounding to f32.
    pub clip_from_world: DMat4,
}

/// An object in view, for effects that draw its shape.
#[derive(Clone, Copy)]
pub struct DrawnObject<'a> {
    /// Whose it is.
    pub entity: Entity,
    /// From the mesh to the world.
    pub world_from_mesh: DAffine3,
    /// From the mesh to clip space.
    pub clip_from_mesh: Mat4,
    mesh: &'a GpuMesh,
}

impl<'a> FrameScene<'a> {
    /// The camera.
    pub fn view(&self) -> FrameView {
        let clip_from_world = self.view.clip_from_frame(DVec3::ZERO);
        FrameView { eye: self.view.eye, basis: self.view.basis, clip_from_world }
    }

    /// The objects in view, once each, in an order that stays the same while the scene does. Empty unless an effect that is called for
    /// [draws objects](crate::effects::Effect::draws_objects).
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
                // A few thousand casters at most fill a run.
                pass.draw_indexed(0..slices.count, 0, first..first + run.len() as u32);
            }
        }
    }

    /// What shaders of a view of their own bind in group 0, as the lit surfaces do: what they know of the view (0 is the camera's, 1 the first of those in mirrors), and the
    /// transforms of all objects.
    pub(crate) fn view_and_transforms(&self, view: usize) -> Option<[&wgpu::Buffer; 2]> {
        Some([self.views.get(view)?.frame(), self.objects.transforms.buffer()?])
    }

    /// Draws the shape of an object once, as instance `slot`: these attributes are in the vertex buffers, one each.
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

    /// Draws the opaque surfaces that the camera sees and that a pass does not light from the G-buffer. No pass lights the G-buffer after any of them: what it
    /// lights may lie behind them.
    pub(crate) fn draw_opaque(&self, pass: &mut wgpu::RenderPass<'static>, lit_pass: LitPass) {
        let later = self.lights_deferred(LitPass::Forward);
        if lit_pass == LitPass::Forward && later {
            self.draw(pass, LitPass::Lightmap);
        }
        if lit_pass != LitPass::Lightmap || !later {
            self.draw(pass, lit_pass);
        }
    }

    /// Draws the surfaces of a pass that a view shows: 0 is the camera's, 1 the first of those in mirrors.
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

    /// Draws into the G-buffer what the camera sees and is lit from there.
    pub(crate) fn draw_g_buffer(&self, pass: &mut wgpu::RenderPass<'static>) {
        let Some(buffers) = self.views.first() else { return };
        let view = (self.draws, buffers);
        self.draw_batches(pass, &self.draws.geometry, view, &FrameGroup::of_geometry);
    }

    /// Whether the camera sees anything of a pass that is lit from the G-buffer.
    pub(crate) fn lights_deferred(&self, lit_pass: LitPass) -> bool {
        self.draws.deferred_of(lit_pass).next().is_some()
    }

    /// The layout of the group that lighting from the G-buffer binds it in.
    pub(crate) fn g_buffer_layout(&self) -> &wgpu::BindGroupLayout {
        self.pipelines.g_buffer_layout()
    }

    /// Lights what the G-buffer holds of a pass.
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
            pass.set_pipeline(&pipeline.pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.set_bind_group(1, g_buffer, &[]);
            if self.bind_light(pass, variant, class.baked_light.as_deref()) {
                let [x, y, width, height] = class.window.pixels(self.size);
                pass.set_scissor_rect(x, y, width, height);
                pass.draw(0..3, number..number + 1);
            }
        }
        pass.set_scissor_rect(0, 0, self.size[0], self.size[1]);
    }

    /// Draws batches of a view; `group` answers with what a variant is bound in group 0.
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
            pass.set_pipeline(&pipeline.pipeline);
            let wanted = group(variant);
            if bound != Some(wanted) {
                let Some(group) = buffers.group(&wanted) else { continue };
                pass.set_bind_group(0, group, &[]);
                bound = Some(wanted);
            }
            if let Some(set) = &batch.texture_set {
                pass.set_bind_group(1, &set.bind_group, &[]);
            }
            if !self.bind_light(pass, variant, batch.baked_light.as_deref()) {
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

    /// Binds baked light and shadow maps, as far as a variant reads them; false if the maps are not there.
    fn bind_light(
        &self,
        pass: &mut wgpu::RenderPass<'static>,
        variant: &Variant,
        baked_light: Option<&wgpu::BindGroup>,
    ) -> bool {
        // A group behind one that the pipeline before had and this one has not: wgpu-core 30 takes the same group for bound still and leaves it
        // out, though the device has dropped it. Taken away first, it is bound again.
        let mut bind_again = |index: u32, group: &wgpu::BindGroup| {
            pass.set_bind_group(index, None::<&wgpu::BindGroup>, &[]);
            pass.set_bind_group(index, group, &[]);
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
    /// Draws its triangles once with the pipeline and the bind groups that are set: vertex buffer 0 has positions in the mesh's space, three f32 a vertex.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        let slices = self.mesh.slices(&[Attribute::Position], None);
        let (Some(positions), Some(indices)) = (slices.attributes.first(), slices.indices) else { return };
        pass.set_vertex_buffer(0, positions.slice(..));
        pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..slices.count, 0, 0..1);
    }
}
