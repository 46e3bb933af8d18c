//! The renderer: from a World to a frame. It extracts, decides what the scene calls for, declares the graph and runs it; each of
//! these has its own file.

use std::collections::BTreeMap;
use std::time::Instant;

use bevy_ecs::prelude::*;
use lumbre_graph::Executor;
use lumbre_scene::{SceneSettings, propagate_transforms};

use crate::cluster_buffers::ClusterBuffers;
use crate::draws::Draws;
use crate::effects::{self, Effect, Stage};
use crate::extract::{CameraView, Emitters, LightSet, Objects, extract_lights, find_camera};
use crate::facts::SceneFacts;
use crate::features::FrameFeatures;
use crate::frame_graph::{Overlay, run_graph};
use crate::frame_plan::{FramePlan, ShadowAtlas};
use crate::frame_scene::FrameScene;
use crate::growable_buffer::GrowableBuffer;
use crate::layout::{FrameData, InstanceData, LightData, radiance};
use crate::light_clusters::ClusteredView;
use crate::light_lists::ObjectLightLists;
use crate::mesh_buffers::{Attribute, MeshBuffers};
use crate::pipelines::{Pipelines, attributes, is_flat};
use crate::shader::Variant;
use crate::shadows::{ShadowMaps, ShadowedView};
use crate::texture_sets::TextureSets;
use crate::textures::Textures;
use crate::{
    CpuStages, FrameOptions, FrameReport, FrameTarget, Gpu, LightListing, LightLists, Measure, RenderError,
    Statistics,
};

/// Draws Worlds. One renderer may serve several Worlds in turn; what it keeps on the GPU belongs to the last one.
#[derive(Resource)]
pub struct Renderer {
    gpu: Gpu,
    executor: Executor,
    objects: Objects,
    emitters: Emitters,
    lights: GrowableBuffer<LightData>,
    instances: GrowableBuffer<InstanceData>,
    light_list: GrowableBuffer<u32>,
    clusters: ClusterBuffers,
    shadows: ShadowMaps,
    meshes: MeshBuffers,
    textures: Textures,
    sets: TextureSets,
    pipelines: Pipelines,
    effects: Vec<Box<dyn Effect>>,
    frame_uniform: wgpu::Buffer,
    frame_group: Option<wgpu::BindGroup>,
    clustered_group: Option<wgpu::BindGroup>,
    /// Of the last frame.
    left_out: Vec<String>,
    /// Of the last frame: variants with the objects that each drew, in the order of the draws.
    drawn: Vec<(Variant, usize)>,
}

/// What a renderer is made of beside its own effects.
#[derive(Default)]
pub struct RendererBuilder {
    effects: Vec<Box<dyn Effect>>,
}

impl RendererBuilder {
    /// Adds an effect. Among those of one [`Stage`] the order is that of these calls, after the renderer's own.
    #[must_use]
    pub fn with(mut self, effect: impl Effect + 'static) -> Self {
        self.effects.push(Box::new(effect));
        self
    }

    /// The renderer on a device.
    #[must_use]
    pub fn build(self, gpu: &Gpu) -> Renderer {
        let mut renderer = Renderer::new(gpu);
        renderer.effects.extend(self.effects);
        effects::in_order(&mut renderer.effects);
        renderer
    }
}

impl Renderer {
    /// Begins a renderer with effects of a program's own.
    pub fn builder() -> RendererBuilder {
        RendererBuilder::default()
    }

    /// A renderer on a device, without effects but its own.
    pub fn new(gpu: &Gpu) -> Self {
        Self {
            gpu: gpu.clone(),
            executor: Executor::new(),
            objects: Objects::new(),
            emitters: Emitters::default(),
            lights: GrowableBuffer::new("lights"),
            instances: GrowableBuffer::new("instances"),
            light_list: GrowableBuffer::new("light list"),
            clusters: ClusterBuffers::new(),
            shadows: ShadowMaps::new(),
            meshes: MeshBuffers::default(),
            textures: Textures::default(),
            sets: TextureSets::default(),
            pipelines: Pipelines::new(gpu),
            effects: effects::own(),
            frame_uniform: gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("frame"),
                size: size_of::<FrameData>() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            frame_group: None,
            clustered_group: None,
            left_out: Vec::new(),
            drawn: Vec::new(),
        }
    }

    /// Draws one frame of `world` into `target` and submits it. Transforms are propagated first.
    ///
    /// # Errors
    /// No camera or a bad one, too many objects for the device, a lost device, faults of shaders or the graph.
    pub fn render(
        &mut self,
        world: &mut World,
        target: &FrameTarget,
        options: &FrameOptions,
    ) -> Result<FrameReport, RenderError> {
        self.draw(world, target, options, None)
    }

    /// As [`render`](Self::render), with a last pass that draws an overlay (a user interface) over the finished frame.
    ///
    /// # Errors
    /// As [`render`](Self::render).
    pub fn render_with_overlay(
        &mut self,
        world: &mut World,
        target: &FrameTarget,
        options: &FrameOptions,
        overlay: impl FnOnce(&mut wgpu::RenderPass<'static>),
    ) -> Result<FrameReport, RenderError> {
        self.draw(world, target, options, Some(Box::new(overlay)))
    }

    /// Waits until the GPU has finished and answers with the last frame's measurements, if any were asked for.
    ///
    /// # Errors
    /// [`RenderError::Run`] if the device was lost.
    pub fn wait(&mut self) -> Result<Option<&lumbre_graph::GraphReport>, RenderError> {
        let measured = self.executor.timings_blocking(&self.gpu.device, &self.gpu.queue)?;
        self.gpu.check()?;
        Ok(measured)
    }

    /// The shader variants of the last frame, by their features, with the number of objects that each drew.
    pub fn drawn_variants(&self) -> BTreeMap<String, usize> {
        let mut variants = BTreeMap::new();
        for (variant, count) in &self.drawn {
            *variants.entry(variant.to_string()).or_insert(0) += count;
        }
        variants
    }

    /// Its effects, in the order of their stages.
    pub(crate) fn effects_mut(&mut self) -> &mut [Box<dyn Effect>] {
        &mut self.effects
    }

    fn draw(
        &mut self,
        world: &mut World,
        target: &FrameTarget,
        options: &FrameOptions,
        overlay: Option<Overlay<'_>>,
    ) -> Result<FrameReport, RenderError> {
        self.gpu.check()?;
        let begun = Instant::now();
        let mut clock = Clock { last: begun };
        let mut cpu = CpuStages::default();
        // The system cannot fail: it has no parameter that may be missing.
        let _ = world.run_system_cached(propagate_transforms);
        cpu.transforms_ms = clock.lap();
        let mut settings = world.get_resource::<SceneSettings>().copied().unwrap_or_default();
        // As lights, a fog made in code whose numbers no file may have is left out.
        let fog_fault = settings.fog.and_then(|fog| fog.validate("scene").err());
        let mut left_out: Vec<String> = fog_fault.iter().map(ToString::to_string).collect();
        if fog_fault.is_some() {
            settings.fog = None;
        }
        let camera = find_camera(world, options.camera)?;
        let view = CameraView::new(world, camera, target.aspect())?;
        self.objects.extract(
            world,
            &self.gpu,
            (&mut self.meshes, &mut self.textures, &mut self.sets),
            view.eye,
            &mut left_out,
        )?;
        cpu.objects_ms = clock.lap();
        let mut lights =
            extract_lights(world, &mut self.emitters, &mut self.lights, self.objects.origin, &mut left_out)?;
        self.warn_once(&left_out);
        cpu.lights_ms = clock.lap();
        if !options.lightmaps {
            lights.set = lights.set.without_lightmaps();
            lights.reaches.iter_mut().for_each(|reach| reach.baked = false);
        }
        if !options.shadows {
            lights.set = lights.set.without_shadows();
            lights.shadows.clear();
        }
        let exposure = options.exposure.unwrap_or(view.exposure);
        if !(exposure > 0.0 && exposure.is_finite()) {
            let (field, value, wanted) = ("exposure", f64::from(exposure), "greater than 0 and finite");
            return Err(RenderError::BadCamera { entity: camera, field, value, wanted });
        }
        let traits = self.objects.iter().map(|(_, object)| &object.traits);
        let facts = SceneFacts::new(traits, &lights.set, &settings, options);
        let mut called_for = Vec::with_capacity(self.effects.len());
        for effect in &mut self.effects {
            called_for.push(effect.extract(world, &facts, options));
        }
        let called = || self.effects.iter().zip(&called_for).filter(|(_, called)| **called);
        let radiance = called().any(|(effect, _)| effect.stage() == Stage::Radiance);
        let draws_objects = called().any(|(effect, _)| effect.draws_objects());
        let plan = FramePlan::for_device(&facts, options, radiance, (&self.gpu, target, exposure));
        let half = plan.lit_format == wgpu::TextureFormat::Rgba16Float;
        let features = FrameFeatures::new(options, &settings, lights.set, (plan.ending, target.format, half));
        let flat_rule = options.flat_rule.unwrap_or(settings.flat_rule);
        let limit = self.gpu.device.limits().max_storage_buffer_binding_size;
        let everything = options.light_lists == LightLists::Everything;
        let mut lists = ObjectLightLists::new(&lights.reaches, everything, limit);
        let target_kind = (plan.lit_format, plan.samples);
        let draws = Draws::new(&self.objects, &view, &settings, &features, target_kind, &mut lists);
        lists.check()?;
        cpu.draws_ms = clock.lap();
        self.instances.replace(draws.instances.iter().copied());
        self.light_list.replace(lists.indices.iter().copied());
        if let Some(depths) = draws.clustered_depths {
            let (origin, size) = (self.objects.origin, [target.width, target.height]);
            self.clusters.build(&ClusteredView { view, origin, size, depths }, &lights);
        }
        let clustered = draws.clustered_depths.is_some();
        cpu.clusters_ms = clock.lap();
        let shadowed = !lights.shadows.is_empty();
        if shadowed {
            let depths = draws.depths.unwrap_or([0.0, 1.0]);
            self.shadows.plan(
                &lights.shadows,
                &self.objects,
                &ShadowedView { view, height: target.height, depths },
            );
        }
        cpu.shadows_ms = clock.lap();
        let uploaded_bytes = self.upload(&view, &settings, &lights.set, exposure, [clustered, shadowed])?;
        let mut triangles = 0;
        self.drawn.clear();
        for batch in draws.batches() {
            match self.drawn.last_mut() {
                Some((variant, count)) if *variant == batch.pipeline.variant => {
                    *count += batch.instances.len()
                }
                _ => self.drawn.push((batch.pipeline.variant, batch.instances.len())),
            }
            self.pipelines.prepare(&self.gpu, &mut self.sets, batch.pipeline)?;
            let variant = &batch.pipeline.variant;
            if let Some(mesh) = self.meshes.get_mut(batch.mesh) {
                mesh.prepare(&self.gpu, &attributes(variant), is_flat(variant).then_some(flat_rule));
                if draws_objects {
                    mesh.prepare(&self.gpu, &[Attribute::Position], None);
                }
                triangles += mesh.triangles() * batch.instances.len();
            }
        }
        let mut shape = plan.shape(target, options.display, exposure);
        if let Some(maps) = self.shadows.device().filter(|_| shadowed) {
            let stale = !self.shadows.stale.is_empty();
            shape.shadow_atlas = Some(ShadowAtlas { view: maps.atlas_view.clone(), stale });
        }
        for (effect, _) in self.effects.iter_mut().zip(&called_for).filter(|(_, called)| **called) {
            let name = effect.name();
            effect
                .prepare(&self.gpu, &shape)
                .map_err(|source| RenderError::Effect { effect: name, source })?;
        }
        cpu.upload_ms = clock.lap();
        let clusters = &self.clusters.clusters;
        let light_lists = LightListing {
            clustered,
            clusters: if clustered { clusters.grid.size.to_array() } else { [0; 3] },
            tile_side: if clustered { clusters.tile_side } else { 0 },
            entries: if clustered { clusters.entries } else { 0 },
            inverse_square_lights: lights.set.inverse_square.all,
            other_ranged_lights: lights.set.ranged.all,
            unbounded_lights: lights.set.unbounded.all,
        };
        let mut statistics = Statistics {
            light_lists,
            cpu,
            lights: lights.set.every.all,
            static_lights: lights.set.every.all - lights.set.every.dynamic,
            lights_per_object: lists.mean_length(),
            objects: draws.instances.len(),
            objects_outside: draws.outside,
            triangles,
            draws: draws.batches().count(),
            variants: self.pipelines.variants(),
            uploaded_bytes,
        };
        self.executor.set_measure(match options.measure {
            Measure::Nothing => lumbre_graph::Measurements::OFF,
            Measure::Time => lumbre_graph::Measurements::TIMES,
            Measure::TimeAndInvocations => lumbre_graph::Measurements::ALL,
        });
        self.executor.enable_probe(options.probe);
        self.executor.begun_at(begun);
        let mut scene = FrameScene {
            draws: &draws,
            objects: &self.objects,
            pipelines: &self.pipelines,
            meshes: &self.meshes,
            flat_rule,
            frame_groups: [self.frame_group.as_ref(), self.clustered_group.as_ref()],
            view,
            shadows: &self.shadows,
        };
        let frame =
            run_graph(&mut self.executor, &self.gpu, (&self.effects, &plan), target, &mut scene, overlay);
        if frame.is_err() {
            // What was to be drawn may not have been.
            self.shadows.forget();
        }
        let frame = frame?;
        self.gpu.check()?;
        statistics.cpu.encoding_ms = clock.lap();
        statistics.cpu.total_ms = milliseconds(begun);
        let measured = self.executor.latest_report().cloned();
        Ok(FrameReport { statistics, plan: frame.plan, measured, left_out })
    }

    /// Logs what is left out now and was not in the frame before.
    fn warn_once(&mut self, left_out: &[String]) {
        for fault in left_out.iter().filter(|fault| !self.left_out.contains(fault)) {
            tracing::warn!("left out of the frame: {fault}");
        }
        left_out.clone_into(&mut self.left_out);
    }

    /// Uploads what changed; answers with its bytes.
    fn upload(
        &mut self,
        view: &CameraView,
        settings: &SceneSettings,
        lights: &LightSet,
        exposure: f32,
        [clustered, shadowed]: [bool; 2],
    ) -> Result<u64, RenderError> {
        let origin = self.objects.origin;
        let fog = settings.fog.as_ref();
        let data = FrameData {
            clip_from_frame: view.clip_from_frame(origin).as_mat4().to_cols_array_2d(),
            eye: (view.eye - origin).as_vec3(),
            exposure,
            backward: view.basis.z_axis.as_vec3(),
            padding: 0.0,
            ambient: radiance(settings.ambient_with_sky()) + lights.ambient,
            padding_2: 0.0,
            fog_color: fog.map_or(glam::Vec3::ZERO, |fog| radiance(fog.color)),
            padding_3: 0.0,
            fog_parameters: fog.map_or([0.0; 4], |fog| fog.mode.parameters()),
        };
        self.gpu.queue.write_buffer(&self.frame_uniform, 0, bytemuck::bytes_of(&data));
        let mut bytes = self.objects.transforms.pending_bytes()
            + self.objects.materials.pending_bytes()
            + self.lights.pending_bytes()
            + self.instances.pending_bytes()
            + self.light_list.pending_bytes();
        let mut renewed = vec![
            self.objects.transforms.upload(&self.gpu),
            self.objects.materials.upload(&self.gpu),
            self.instances.upload(&self.gpu),
            self.lights.upload(&self.gpu),
            self.light_list.upload(&self.gpu),
        ];
        if clustered {
            bytes += self.clusters.pending_bytes();
            renewed.push(self.clusters.upload(&self.gpu));
        }
        if renewed.iter().any(|renewed| !matches!(renewed, Ok(false))) {
            // Whatever fails below, the old groups name buffers that are gone.
            self.frame_group = None;
            self.clustered_group = None;
        }
        renewed.into_iter().collect::<Result<Vec<bool>, _>>()?;
        if let Some(transforms) = self.objects.transforms.buffer().filter(|_| shadowed) {
            let layout = self.pipelines.shadow_layout();
            bytes += self.shadows.upload(&self.gpu, transforms, &mut self.meshes, layout)?;
        }
        if self.frame_group.is_none() {
            self.frame_group = Some(self.group(false));
        }
        if clustered && self.clustered_group.is_none() {
            self.clustered_group = Some(self.group(true));
        }
        Ok(bytes)
    }

    /// Group 0, of variants that read clusters' lists or of those that do not.
    fn group(&self, clustered: bool) -> wgpu::BindGroup {
        let buffers = [
            Some(&self.frame_uniform),
            self.objects.transforms.buffer(),
            self.objects.materials.buffer(),
            self.instances.buffer(),
            self.lights.buffer(),
            self.light_list.buffer(),
        ];
        let bindings =
            (0..).zip(buffers).filter_map(|(binding, buffer)| Some((binding, buffer?.as_entire_binding())));
        let of_clusters = self.clusters.bindings().filter(|_| clustered).into_iter().flatten();
        let entries: Vec<_> = bindings
            .chain(of_clusters)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(if clustered { "frame with clusters" } else { "frame" }),
            layout: self.pipelines.frame_layout(clustered),
            entries: &entries,
        })
    }
}

/// Times the stages of a frame.
struct Clock {
    last: Instant,
}

impl Clock {
    /// Milliseconds since the last call.
    fn lap(&mut self) -> f64 {
        let lap = milliseconds(self.last);
        self.last = Instant::now();
        lap
    }
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
