//! Draws what is visible through transmissive surfaces, refracted, and what these reflect by Fresnel's
//! equations. Rays are traced in screen space through the picture of the frame so far
//! (shaders/refraction.wesl). What that picture does not show (behind the camera, outside of the frame,
//! hidden by something nearer, behind another such surface) is missing: such rays take the edge of the
//! picture, or the background. Light that is reflected inside a body is lost.
//!
//! ```text
//!   frame so far ──► copies of its radiance and depths ──┐
//!   back faces of bodies ──► normals and depths ─────────┼──► refraction: added to the refractive surfaces
//!   reflections in flat surfaces (`mirrors`) ────────────┤
//!   [front faces ──► normals and objects] ───────────────┘
//! ```
//!
//! Light is added triangle by triangle, or, of surfaces with many triangles, pixel by pixel (`rendering_path` chooses):
//! then their visible front faces are drawn first, and each surface's light is added over its part of the frame.

use std::collections::HashMap;

use bevy_ecs::world::World;
use glam::Vec3;
use lumbre_graph::{
    LoadOp, PassResources, RasterContext, RunError, TextureDescriptor, TextureHandle, TextureRead,
    TextureWrite, TransferContext,
};
use lumbre_scene::RefractiveShape;

use super::mirrors::MirrorPictures;
use super::surface_uniforms::SurfaceUniforms;
use super::{Board, Effect, EffectWork, FrameGraph, Stage};
use crate::error::EffectError;
use crate::extract::{LitPass, RefractorData, RefractorSurface};
use crate::facts::SceneFacts;
use crate::features::{fog_feature, fog_flags};
use crate::frame_bindings::FrameBuffer;
use crate::frame_plan::{FrameShape, MirrorShape};
use crate::frame_scene::{FrameScene, SHAPE};
use crate::pending::Pending;
use crate::rendering_path::MANY_REFRACTIVE_TRIANGLES;
use crate::shader::{self, Feature};
use crate::target::DEPTH_FORMAT;
use crate::{FrameOptions, Gpu, RenderError};

/// Format of the octahedral normals of back faces.
const BACK_NORMALS: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Float;
/// Where there is no back face: NO_DIRECTION of shaders/octahedral.wesl.
const NO_DIRECTION: wgpu::Color = wgpu::Color { r: 2.0, g: 2.0, b: 0.0, a: 0.0 };

/// Format of visible front faces: their objects and normals, packed by shaders/refraction.wesl.
const FRONT_FACES: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Uint;

#[derive(Debug, Default)]
pub(super) struct Refraction {
    /// Whether the scene has transmissive meshes, and whether refraction is switched on.
    called_for: [bool; 2],
    /// Whether the light of surfaces with many triangles is added pixel by pixel.
    by_pixel: bool,
    fog: Option<Feature>,
    /// The shapes of the scene's transmissive meshes, and whether reflections in flat ones have pictures.
    shapes: Vec<RefractiveShape>,
    has_mirrors: bool,
    /// The surfaces in view.
    surfaces: Vec<RefractorSurface>,
    /// What the pipelines of this frame depend on, once it is decided.
    target: Option<LitTarget>,
    device: Option<OnDevice>,
}

/// What all pipelines that add light to a frame depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct LitTarget {
    format: wgpu::TextureFormat,
    samples: u32,
    fog: Option<Feature>,
}

/// What a pipeline depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Key {
    /// Draws back faces of objects with this winding.
    BackFaces { mirrored: bool },
    /// Draws the visible front faces.
    FrontFaces,
    /// Adds the refracted and reflected light of surfaces of one shape, whose reflection is in a picture or has to be
    /// traced, triangle by triangle or where front faces have been drawn.
    Surfaces { target: LitTarget, shape: RefractiveShape, pictured: bool, from_front_faces: bool },
}

#[derive(Debug)]
struct OnDevice {
    layouts: Layouts,
    pipelines: HashMap<Key, Pending<wgpu::RenderPipeline>>,
    surfaces: SurfaceUniforms,
    /// Bound where no body has back faces; nothing reads it then.
    no_depth: wgpu::TextureView,
}

/// Layouts of the bind groups.
#[derive(Clone, Debug)]
struct Layouts {
    /// A view and the objects.
    view: wgpu::BindGroupLayout,
    /// A surface, and the pictures in which its rays are traced: with one sample per pixel and with several.
    surface: [wgpu::BindGroupLayout; 2],
    /// The same with one sample per pixel, and the front faces.
    front_faces: wgpu::BindGroupLayout,
}

/// The pictures in which rays are traced.
#[derive(Clone, Copy, Debug)]
struct Pictures {
    behind: TextureHandle,
    behind_depth: TextureHandle,
    /// Normals and depths of back faces, if a body has some.
    back_faces: Option<[TextureHandle; 2]>,
    /// The visible front faces, and the depths of the frame with them, if they have been drawn.
    front_faces: Option<[TextureHandle; 2]>,
}

impl Effect for Refraction {
    fn name(&self) -> &'static str {
        "refraction"
    }

    fn stage(&self) -> Stage {
        Stage::Opaque
    }

    fn extract(&mut self, _: &mut World, facts: &SceneFacts, options: &FrameOptions) -> bool {
        self.called_for = [facts.census.refractive > 0, options.refraction];
        self.by_pixel = facts.refracts_by_pixel;
        self.fog = facts.settings.fog.as_ref().map(|fog| fog_feature(&fog.mode));
        self.shapes.clone_from(&facts.refractive_shapes);
        self.has_mirrors = facts.calls_for_mirrors(options);
        (self.surfaces, self.target) = (Vec::new(), None);
        facts.refractive > 0
    }

    fn is_unchanged(&mut self, _: &mut World) -> bool {
        true
    }

    fn needs_radiance(&self) -> bool {
        true
    }

    fn ready(&mut self, gpu: &Gpu, frame: &FrameShape) -> Result<bool, EffectError> {
        let keys = self.keys_of_scene(self.target_of(frame));
        let device = self.device.get_or_insert_with(|| OnDevice::new(gpu));
        let mut ready = true;
        for key in keys {
            ready &= device.pipeline(gpu, key, false)?;
        }
        Ok(ready)
    }

    fn prepare(&mut self, gpu: &Gpu, frame: &FrameShape) -> Result<(), EffectError> {
        self.surfaces.clone_from(&frame.refractors);
        let target = self.target_of(frame);
        self.target = Some(target);
        let keys = self.keys_of_frame(target, frame.mirrors.as_deref().unwrap_or_default());
        let device = self.device.get_or_insert_with(|| OnDevice::new(gpu));
        for key in keys {
            device.pipeline(gpu, key, true)?;
        }
        if !self.surfaces.is_empty() {
            let data: Vec<RefractorData> = self.surfaces.iter().map(|surface| surface.data).collect();
            device.surfaces.write(gpu, &data);
        }
        Ok(())
    }

    fn work(&self) -> EffectWork {
        let made = |device: &OnDevice| {
            device.pipelines.values().filter(|pipeline| matches!(pipeline.get(), Some(Ok(_)))).count()
        };
        let work = |device: &OnDevice| EffectWork::new(device.surfaces.uploaded, made(device));
        self.device.as_ref().map_or_else(EffectWork::default, work)
    }

    fn declare<'a>(&'a self, graph: &mut FrameGraph<'a>, board: &mut Board) {
        let [in_scene, switched_on] = self.called_for;
        // In an explanation without a device it is not known what is in sight.
        let in_sight = self.target.is_none() || !self.surfaces.is_empty();
        // No ray leaves a pane or the surface of a pool through a back face.
        let solid = match self.target {
            None => self.shapes.contains(&RefractiveShape::Body),
            Some(_) => self.has_bodies(),
        };
        let [width, height] = board.size;
        let described = |format| TextureDescriptor::new_2d(width, height, format);
        let mut behind = graph.texture("behind", described(board.linear_format));
        let several = described(DEPTH_FORMAT).samples(board.samples);
        let mut behind_depth = graph.texture("depth behind", several);
        let mut back_normals = graph.texture("normals of back faces", described(BACK_NORMALS));
        let mut back_depth = graph.texture("depth of back faces", described(DEPTH_FORMAT));
        if in_scene && switched_on && in_sight {
            let copies = [(board.linear, behind), (board.depth, behind_depth)];
            graph
                .transfer_pass("behind")
                .reads(&board.linear, TextureRead::CopySource)
                .reads(&board.depth, TextureRead::CopySource)
                .writes(&mut behind, TextureWrite::CopyDestination)
                .writes(&mut behind_depth, TextureWrite::CopyDestination)
                .run(move |context| copy(context, &copies));
            if solid {
                graph
                    .raster_pass("back faces")
                    .color(&mut back_normals, LoadOp::Clear(NO_DIRECTION))
                    .depth(&mut back_depth, LoadOp::Clear(0.0))
                    .run(move |context| self.draw_back_faces(context));
            }
        }
        board
            .lit_pass(graph, LitPass::Refraction.name(), LoadOp::Load)
            .requires(in_scene, "mesh that light passes through")
            .requires(switched_on, "refraction switched on")
            .requires(in_sight, "such mesh in sight")
            .depth(&mut board.depth, LoadOp::Load)
            .run(|context| {
                context.user.draw(context.pass, LitPass::Refraction);
                Ok(())
            });
        if in_scene && switched_on && in_sight {
            let mirrored =
                board.get::<MirrorPictures>().map(|pictures| pictures.0.clone()).unwrap_or_default();
            let back_faces = solid.then_some([back_normals, back_depth]);
            // The average surface of a scene whose light is added by pixels has many triangles.
            let [by_triangle, by_pixel] = match self.target {
                None => [!self.by_pixel, self.by_pixel],
                Some(_) => [false, true].map(|by_pixel| self.surfaces_by(by_pixel).next().is_some()),
            };
            for (name, pixels, has_surfaces) in
                [(self.name(), false, by_triangle), ("refraction by pixel", true, by_pixel)]
            {
                if !has_surfaces {
                    continue;
                }
                let front_faces = pixels.then(|| {
                    let mut front_faces = graph.texture("front faces", described(FRONT_FACES));
                    graph
                        .raster_pass("front faces")
                        .color(&mut front_faces, LoadOp::Clear(wgpu::Color::TRANSPARENT))
                        .depth(&mut board.depth, LoadOp::Load)
                        .run(move |context| self.draw_front_faces(context));
                    [front_faces, board.depth]
                });
                let mut pass =
                    board.lit_pass(graph, name, LoadOp::Load).samples(&behind).samples(&behind_depth);
                let sampled = back_faces.iter().chain(&front_faces).flatten().chain(mirrored.values());
                for picture in sampled {
                    pass = pass.samples(picture);
                }
                if front_faces.is_none() {
                    pass = pass.depth(&mut board.depth, LoadOp::Load);
                }
                let pictures = Pictures { behind, behind_depth, back_faces, front_faces };
                let mirrored = mirrored.clone();
                pass.run(move |context| self.add_light(context, &pictures, &mirrored));
            }
        }
    }
}

impl Refraction {
    fn target_of(&self, frame: &FrameShape) -> LitTarget {
        LitTarget { format: frame.lit_format, samples: frame.samples, fog: self.fog }
    }

    /// Returns the keys of all pipelines that frames of the scene may need.
    fn keys_of_scene(&self, target: LitTarget) -> Vec<Key> {
        let up_to = |last: bool| [false, true].into_iter().take(1 + usize::from(last));
        let mut keys = keys_of_faces(self.shapes.contains(&RefractiveShape::Body), self.by_pixel);
        for &shape in &self.shapes {
            // A curved reflection has no picture, and that of a flat surface may have to be left out.
            for pictured in up_to(shape != RefractiveShape::Body && self.has_mirrors) {
                for from_front_faces in up_to(self.by_pixel) {
                    keys.push(Key::Surfaces { target, shape, pictured, from_front_faces });
                }
            }
        }
        keys
    }

    /// Returns the keys of the pipelines that draw this frame's surfaces, given the views in its mirrors.
    fn keys_of_frame(&self, target: LitTarget, mirrors: &[MirrorShape]) -> Vec<Key> {
        let pictured = || {
            let seen = mirrors.iter().filter(|view| view.parent == 0).flat_map(|view| &view.surfaces);
            seen.filter(|mirror| mirror.refracts).map(|mirror| mirror.slot)
        };
        let by_pixel = self.surfaces_by(true).next().is_some();
        let mut keys = keys_of_faces(self.has_bodies(), by_pixel);
        for from_front_faces in [false, true] {
            for (_, RefractorSurface { shape, slot, .. }) in self.surfaces_by(from_front_faces) {
                let (shape, pictured) = (*shape, pictured().any(|mirror| mirror == *slot));
                keys.push(Key::Surfaces { target, shape, pictured, from_front_faces });
            }
        }
        keys
    }

    /// Returns true if any surface in view is that of a body.
    fn has_bodies(&self) -> bool {
        self.surfaces.iter().any(|surface| surface.shape == RefractiveShape::Body)
    }

    /// Returns a pipeline that is ready, and its device objects.
    fn pipeline(&self, key: Key) -> Option<(&OnDevice, &wgpu::RenderPipeline)> {
        let device = self.device.as_ref()?;
        let pipeline = device.pipelines.get(&key).and_then(Pending::get)?.ok()?;
        Some((device, pipeline))
    }

    /// Returns the surfaces whose light is added pixel by pixel, or the others; each with its place in the list.
    fn surfaces_by(&self, pixel: bool) -> impl Iterator<Item = (usize, &RefractorSurface)> {
        let surfaces = self.surfaces.iter().enumerate();
        surfaces.filter(move |(_, surface)| {
            (self.by_pixel && surface.triangles >= MANY_REFRACTIVE_TRIANGLES) == pixel
        })
    }

    fn draw_back_faces(&self, context: &mut RasterContext<'_, FrameScene<'_>>) -> Result<(), EffectError> {
        for mirrored in [false, true] {
            let Some((device, pipeline)) = self.pipeline(Key::BackFaces { mirrored }) else { continue };
            let Some(view) = device.view_group(context) else { return Ok(()) };
            context.pass.set_pipeline(pipeline);
            context.pass.set_bind_group(0, &view, &[]);
            let is_drawn = |surface: &&RefractorSurface| {
                surface.shape == RefractiveShape::Body && surface.mirrored == mirrored
            };
            for surface in self.surfaces.iter().filter(is_drawn) {
                context.user.draw_shape(context.pass, surface.slot, &SHAPE);
            }
        }
        Ok(())
    }

    fn draw_front_faces(&self, context: &mut RasterContext<'_, FrameScene<'_>>) -> Result<(), EffectError> {
        let Some((device, pipeline)) = self.pipeline(Key::FrontFaces) else { return Ok(()) };
        let Some(view) = device.view_group(context) else { return Ok(()) };
        context.pass.set_pipeline(pipeline);
        context.pass.set_bind_group(0, &view, &[]);
        for (_, surface) in self.surfaces_by(true) {
            context.user.draw_shape(context.pass, surface.slot, &SHAPE);
        }
        Ok(())
    }

    fn add_light(
        &self,
        context: &mut RasterContext<'_, FrameScene<'_>>,
        pictures: &Pictures,
        mirrored: &HashMap<usize, TextureHandle>,
    ) -> Result<(), EffectError> {
        let from_front_faces = pictures.front_faces.is_some();
        let (Some(device), Some(target)) = (&self.device, self.target) else { return Ok(()) };
        let Some(view) = device.view_group(context) else { return Ok(()) };
        context.pass.set_bind_group(0, &view, &[]);
        let mut set = None;
        // Surfaces without a reflection picture search for their reflection in the frame so far.
        let plain = device.surface_group(&context.resources, pictures, &pictures.behind)?;
        for (index, surface) in self.surfaces_by(from_front_faces) {
            let picture = mirrored.get(&surface.slot);
            let (shape, pictured) = (surface.shape, picture.is_some());
            let key = Key::Surfaces { target, shape, pictured, from_front_faces };
            let Some((_, pipeline)) = self.pipeline(key) else { continue };
            if set.replace(key) != Some(key) {
                context.pass.set_pipeline(pipeline);
            }
            let own =
                picture.map(|own| device.surface_group(&context.resources, pictures, own)).transpose()?;
            let Some(group) = own.as_ref().map_or(plain.as_ref(), Option::as_ref) else { continue };
            context.pass.set_bind_group(1, group, &[SurfaceUniforms::offset(index)]);
            if !from_front_faces {
                context.user.draw_shape(context.pass, surface.slot, &SHAPE);
            } else if let Ok(object) = u32::try_from(surface.slot) {
                let [x, y, width, height] = surface.window.pixels(context.user.size);
                context.pass.set_scissor_rect(x, y, width, height);
                context.pass.draw(0..3, object..object + 1);
            }
        }
        if from_front_faces {
            let [width, height] = context.user.size;
            context.pass.set_scissor_rect(0, 0, width, height);
        }
        Ok(())
    }
}

/// Returns the keys of the pipelines that draw back and front faces, where these are needed.
fn keys_of_faces(back: bool, front: bool) -> Vec<Key> {
    let back_faces = [false, true].into_iter().filter(|_| back).map(|mirrored| Key::BackFaces { mirrored });
    back_faces.chain(front.then_some(Key::FrontFaces)).collect()
}

/// Copies whole textures to others of the same size.
fn copy(
    context: &mut TransferContext<'_, FrameScene<'_>>,
    copies: &[(TextureHandle, TextureHandle)],
) -> Result<(), EffectError> {
    for (from, to) in copies {
        let [from, to] = [context.resources.texture(from)?, context.resources.texture(to)?];
        context.encoder.copy_texture_to_texture(from.as_image_copy(), to.as_image_copy(), from.size());
    }
    Ok(())
}

fn group(
    device: &wgpu::Device,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    resources: &[wgpu::BindingResource<'_>],
) -> wgpu::BindGroup {
    let entries = (0..).zip(resources);
    let entries: Vec<_> = entries
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries })
}

impl OnDevice {
    fn new(gpu: &Gpu) -> Self {
        let no_depth = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("no back faces"),
            size: wgpu::Extent3d { width: 1, height: 1, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: DEPTH_FORMAT,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        Self {
            layouts: Layouts::new(&gpu.device),
            pipelines: HashMap::new(),
            surfaces: SurfaceUniforms::default(),
            no_depth: no_depth.create_view(&Default::default()),
        }
    }

    /// Creates a pipeline, or starts to. Returns true if it exists, which is always the case with `wait`.
    fn pipeline(&mut self, gpu: &Gpu, key: Key, wait: bool) -> Result<bool, EffectError> {
        let pipeline = self.pipelines.entry(key).or_insert_with(|| {
            let (device, layouts) = (gpu.device.clone(), self.layouts.clone());
            let make = move || Ok(make(&device, &layouts, key)?);
            if wait { Pending::make(make) } else { Pending::begin(gpu, make) }
        });
        Ok(pipeline.is_there(wait)?)
    }

    /// Returns group 0: the camera's view and the objects.
    fn view_group(&self, context: &RasterContext<'_, FrameScene<'_>>) -> Option<wgpu::BindGroup> {
        let bound = context.user.view_and_transforms(0)?.map(wgpu::Buffer::as_entire_binding);
        Some(group(context.resources.device, "view of refraction", &self.layouts.view, &bound))
    }

    fn surface_group(
        &self,
        resources: &PassResources<'_>,
        pictures: &Pictures,
        mirrored: &TextureHandle,
    ) -> Result<Option<wgpu::BindGroup>, RunError> {
        let Some(surface) = self.surfaces.binding::<RefractorData>() else { return Ok(None) };
        let view = |handle| resources.view(handle);
        let back_faces = match &pictures.back_faces {
            Some([normals, depths]) => [view(normals)?, view(depths)?],
            None => [view(&pictures.behind)?, &self.no_depth],
        };
        let [normals, depths] = back_faces.map(wgpu::BindingResource::TextureView);
        let picture = |handle| view(handle).map(wgpu::BindingResource::TextureView);
        let several = resources.texture(&pictures.behind_depth)?.sample_count() > 1;
        let mut bound = vec![
            surface,
            picture(&pictures.behind)?,
            picture(&pictures.behind_depth)?,
            normals,
            depths,
            picture(mirrored)?,
        ];
        let mut layout = &self.layouts.surface[usize::from(several)];
        if let Some(front_faces) = &pictures.front_faces {
            layout = &self.layouts.front_faces;
            for faces in front_faces {
                bound.push(picture(faces)?);
            }
        }
        Ok(Some(group(resources.device, "refraction", layout, &bound)))
    }
}

impl Layouts {
    fn new(device: &wgpu::Device) -> Self {
        let (vertex, fragment) = (wgpu::ShaderStages::VERTEX, wgpu::ShaderStages::FRAGMENT);
        let texture = |sample_type, multisampled| wgpu::BindingType::Texture {
            sample_type,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled,
        };
        let color = || texture(wgpu::TextureSampleType::Float { filterable: false }, false);
        let buffer = |ty, has_dynamic_offset| wgpu::BindingType::Buffer {
            ty,
            has_dynamic_offset,
            min_binding_size: None,
        };
        let layout = |label, entries: &[(wgpu::ShaderStages, wgpu::BindingType)]| {
            let entry = |(binding, (visibility, ty)): (u32, &(wgpu::ShaderStages, wgpu::BindingType))| {
                wgpu::BindGroupLayoutEntry { binding, visibility: *visibility, ty: *ty, count: None }
            };
            let entries: Vec<_> = (0..).zip(entries).map(entry).collect();
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some(label),
                entries: &entries,
            })
        };
        // The layout uses the bindings of `FrameBuffer`.
        debug_assert_eq!([FrameBuffer::Frame.binding(), FrameBuffer::Objects.binding()], [0, 1]);
        let uniform = |dynamic| buffer(wgpu::BufferBindingType::Uniform, dynamic);
        let transforms = buffer(wgpu::BufferBindingType::Storage { read_only: true }, false);
        let depth = |multisampled| texture(wgpu::TextureSampleType::Depth, multisampled);
        let surface = |several| {
            let pictures = [color(), depth(several), color(), depth(false), color()];
            [uniform(true)].into_iter().chain(pictures).map(|ty| (fragment, ty)).collect::<Vec<_>>()
        };
        let words = texture(wgpu::TextureSampleType::Uint, false);
        let front_faces = [(fragment, words), (fragment, depth(false))];
        Self {
            view: layout("view of refraction", &[(vertex | fragment, uniform(false)), (vertex, transforms)]),
            surface: [false, true].map(|several| layout("refraction", &surface(several))),
            front_faces: layout(
                "refraction of front faces",
                &[surface(false), front_faces.to_vec()].concat(),
            ),
        }
    }
}

fn make(device: &wgpu::Device, layouts: &Layouts, key: Key) -> Result<wgpu::RenderPipeline, RenderError> {
    let target =
        |format, blend| Some(wgpu::ColorTargetState { format, blend, write_mask: wgpu::ColorWrites::ALL });
    let depth = |write, compare| wgpu::DepthStencilState {
        format: DEPTH_FORMAT,
        depth_write_enabled: Some(write),
        depth_compare: Some(compare),
        stencil: Default::default(),
        bias: Default::default(),
    };
    let add = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    };
    let add = Some(wgpu::BlendState { color: add, alpha: add });
    let mut primitive = wgpu::PrimitiveState::default();
    let mut samples = 1;
    let mut fog = None;
    let mut front_faces = false;
    // Faces alone have no light.
    let (mut shape, mut pictured) = (RefractiveShape::Sheet, true);
    let (entry, groups, target, depth_stencil) = match key {
        Key::BackFaces { mirrored } => {
            primitive.front_face = if mirrored { wgpu::FrontFace::Cw } else { wgpu::FrontFace::Ccw };
            primitive.cull_mode = Some(wgpu::Face::Front);
            let nearest = depth(true, wgpu::CompareFunction::Greater);
            ("back_face", vec![Some(&layouts.view)], target(BACK_NORMALS, None), Some(nearest))
        }
        Key::FrontFaces => {
            let here = depth(false, wgpu::CompareFunction::Equal);
            ("front_face", vec![Some(&layouts.view)], target(FRONT_FACES, None), Some(here))
        }
        Key::Surfaces { target: lit, shape: of_surface, pictured: has_picture, from_front_faces } => {
            (samples, fog, front_faces) = (lit.samples, lit.fog, from_front_faces);
            (shape, pictured) = (of_surface, has_picture);
            let here = depth(false, wgpu::CompareFunction::Equal);
            let surface = match from_front_faces {
                true => &layouts.front_faces,
                false => &layouts.surface[usize::from(samples > 1)],
            };
            let groups = vec![Some(&layouts.view), Some(surface)];
            ("fragment", groups, target(lit.format, add), (!from_front_faces).then_some(here))
        }
    };
    let mut flags = fog_flags(fog);
    flags.extend([
        ("MULTISAMPLED", samples > 1),
        ("FRONT_FACES", front_faces),
        ("SHEET", shape == RefractiveShape::Sheet),
        ("BODY", shape == RefractiveShape::Body),
        ("PICTURED", pictured),
    ]);
    let module = shader::compile(device, "refraction", &flags)?;
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("refraction"),
        bind_group_layouts: &groups,
        immediate_size: 0,
    });
    let attribute = |shader_location| {
        [wgpu::VertexAttribute { format: wgpu::VertexFormat::Float32x3, offset: 0, shader_location }]
    };
    let attributes = [attribute(0), attribute(1)];
    let shape = attributes.each_ref().map(|attributes| {
        Some(wgpu::VertexBufferLayout {
            array_stride: size_of::<Vec3>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes,
        })
    });
    Ok(device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("refraction"),
        layout: Some(&pipeline_layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some(if front_faces { "whole_frame" } else { "vertex" }),
            compilation_options: Default::default(),
            buffers: if front_faces { &[] } else { &shape },
        },
        primitive,
        depth_stencil,
        multisample: wgpu::MultisampleState { count: samples, ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(entry),
            compilation_options: Default::default(),
            targets: &[target],
        }),
        multiview_mask: None,
        cache: None,
    }))
}
