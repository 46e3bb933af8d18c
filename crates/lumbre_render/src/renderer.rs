//! The renderer, which draws a World into a target. It extracts the World, decides what the frame consists
//! of, declares the render graph and runs it. Each of these steps has its own file.

use std::collections::{BTreeMap, HashSet};
use std::sync::Arc;
use std::time::Instant;

use bevy_ecs::prelude::*;
use lumbre_graph::{Executor, Plan};
use lumbre_optics::{ErrorBound, Shading};
use lumbre_scene::{RefractiveShape, SceneSettings, ShadowFilter, propagate_transforms};

use crate::accounting::FrameShares;
use crate::cluster_grid::ClusteredView;
use crate::draws::{ChooseShading, Draws, VisibleObjects};
use crate::effect_shares::EffectShares;
use crate::effects::{self, BuiltIn, Effect, Stage};
use crate::extract::{
    CameraView, Emitters, KnownLights, LightPlace, LightRecords, Object, Objects, RefractorData,
    RefractorSurface, extract_lights, find_camera,
};
use crate::facts::SceneFacts;
use crate::features::FrameFeatures;
use crate::frame_decision::{AskedFrame, Decided, Decision, Decisions, LastFrame, Seen, with_camera};
use crate::frame_graph::{Last, Overlay, run_graph};
use crate::frame_plan::{Ending, ShadowAtlas};
use crate::frame_scene::{FrameScene, SHAPE};
use crate::growable_buffer::GrowableBuffer;
use crate::irradiance_volumes::IrradianceVolumes;
use crate::layout::{InstanceData, LightData, radiance};
use crate::ledger::{Ledger, OpenFrame};
use crate::light_counter::{CountedStages, LightCounter};
use crate::light_lists::ObjectLightLists;
use crate::mesh_buffers::{Attribute, MeshBuffers};
use crate::mirror_views::{MirrorLook, MirrorView, draw_mirrors, mirror_views};
use crate::pipelines::{PipelineKey, Pipelines, attributes, is_flat};
use crate::shader::Variant;
use crate::shading_by_need::{Conditions, ShadingByNeed, SizedView, is_shaded_by_need};
use crate::shading_need::ShadingNeeds;
use crate::shadows::{CasterPipelines, ShadowMaps, ShadowedView};
use crate::stage_clock::{StageClock, timed};
use crate::table_texture::most_bytes_of_words;
use crate::texture_sets::TextureSets;
use crate::textures::Textures;
use crate::view_buffers::{SharedBuffers, ViewBuffers};
use crate::warm_up::WarmUps;
use crate::world_watch::WorldWatch;
use crate::{
    Accounting, CpuStages, FrameOptions, FrameReport, FrameTarget, Gpu, LightListing, LightLists, LitPasses,
    Measure, RenderError, Statistics, Uploads,
};

/// Draws Worlds. One renderer may draw several Worlds in turn; what it keeps on the GPU belongs to the last
/// one.
#[derive(Resource)]
pub struct Renderer {
    gpu: Gpu,
    executor: Executor,
    objects: Objects,
    emitters: Emitters,
    volumes: IrradianceVolumes,
    light_records: LightRecords,
    lights: GrowableBuffer<LightData>,
    instances: GrowableBuffer<InstanceData>,
    light_list: GrowableBuffer<u32>,
    /// The camera's buffers first, then those of the views in mirrors.
    views: Vec<ViewBuffers>,
    shadows: ShadowMaps,
    meshes: MeshBuffers,
    textures: Textures,
    sets: TextureSets,
    pipelines: Pipelines,
    warm_ups: WarmUps,
    effects: Vec<Box<dyn Effect>>,
    without: Vec<BuiltIn>,
    shares: EffectShares,
    ledger: Ledger,
    light_counter: LightCounter,
    /// Number of pipelines of lit surfaces at the end of the last frame.
    pipelines_before: usize,
    needs: ShadingByNeed,
    watch: WorldWatch,
    decisions: Decisions,
    /// `None` after a frame that failed.
    last: Option<LastFrame>,
    /// Messages of the last frame.
    left_out: Vec<String>,
    /// Variants of the last frame, each with the number of objects that it drew, in the order of the draws.
    drawn: Vec<(Variant, usize)>,
}

/// Builds a renderer with effects of a program, or without some of the built-in ones.
#[derive(Default)]
pub struct RendererBuilder {
    effects: Vec<Box<dyn Effect>>,
    without: Vec<BuiltIn>,
}

impl RendererBuilder {
    /// Adds an effect. Effects of the same [`Stage`] keep the order of these calls, after the built-in ones.
    #[must_use]
    pub fn with(mut self, effect: impl Effect + 'static) -> Self {
        self.effects.push(Box::new(effect));
        self
    }

    /// Leaves out a built-in effect.
    #[must_use]
    pub fn without(mut self, effect: BuiltIn) -> Self {
        self.without.push(effect);
        self
    }

    /// Creates the renderer on a device.
    #[must_use]
    pub fn build(self, gpu: &Gpu) -> Renderer {
        let mut renderer = Renderer::new(gpu);
        renderer.effects = effects::own(&self.without);
        renderer.effects.extend(self.effects);
        renderer.without = self.without;
        effects::in_order(&mut renderer.effects);
        renderer
    }
}

impl Renderer {
    /// Starts to build a renderer with a program's own effects.
    pub fn builder() -> RendererBuilder {
        RendererBuilder::default()
    }

    /// Creates a renderer with the built-in effects only.
    pub fn new(gpu: &Gpu) -> Self {
        Self {
            gpu: gpu.clone(),
            executor: Executor::new(),
            objects: Objects::new(),
            emitters: Emitters::default(),
            light_records: LightRecords::default(),
            volumes: IrradianceVolumes::default(),
            lights: GrowableBuffer::table("lights"),
            instances: GrowableBuffer::table("instances"),
            light_list: GrowableBuffer::table("light list"),
            views: vec![ViewBuffers::new(gpu)],
            shadows: ShadowMaps::new(),
            meshes: MeshBuffers::default(),
            textures: Textures::default(),
            sets: TextureSets::default(),
            pipelines: Pipelines::new(gpu),
            warm_ups: WarmUps::default(),
            effects: effects::own(&[]),
            without: Vec::new(),
            shares: EffectShares::default(),
            ledger: Ledger::default(),
            light_counter: LightCounter::default(),
            pipelines_before: 0,
            needs: ShadingByNeed::default(),
            watch: WorldWatch::default(),
            decisions: Decisions::default(),
            last: None,
            left_out: Vec::new(),
            drawn: Vec::new(),
        }
    }

    /// Draws one frame of `world` into `target` and submits it. Transforms are propagated first.
    ///
    /// # Errors
    /// Returns an error if there is no valid camera, the viewport does not fit, the scene exceeds the
    /// device's limits, the device is lost, an effect fails, or a shader or the graph is invalid.
    pub fn render(
        &mut self,
        world: &mut World,
        target: &FrameTarget,
        options: &FrameOptions,
    ) -> Result<FrameReport, RenderError> {
        self.draw(world, target, options, None)
    }

    /// Like [`render`](Self::render), with a last pass that draws an overlay (a user interface) over the
    /// finished frame.
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

    /// Waits until the GPU has finished, and returns the last frame's measurements if any were asked for.
    ///
    /// # Errors
    /// [`RenderError::Run`] if reading the measurements fails, [`RenderError::DeviceLost`] or
    /// [`RenderError::Refused`] if the device reported an error.
    pub fn wait(&mut self) -> Result<Option<&lumbre_graph::GraphReport>, RenderError> {
        let since = Instant::now();
        self.executor.timings_blocking(&self.gpu.device, &self.gpu.queue)?;
        self.gpu.check()?;
        self.light_counter.wait();
        self.settle(Some(since));
        Ok(self.executor.latest_report())
    }

    /// Returns the account of the newest measured frame whose results have all arrived. After
    /// [`wait`](Self::wait), this is the last frame.
    pub fn accounting(&self) -> Option<&Accounting> {
        self.ledger.newest().map(Arc::as_ref)
    }

    /// Completes the accounts of frames whose results have arrived. `waited` is the time at which waiting for
    /// the last frame began, if it was waited for.
    fn settle(&mut self, waited: Option<Instant>) {
        if let Some(report) = self.executor.latest_report() {
            self.ledger.note_report(report);
        }
        for (frame, lights) in self.light_counter.arrived() {
            self.ledger.note_lights(frame, lights);
        }
        self.ledger.settle(waited);
    }

    /// Returns the shader variants of the last frame by their features, each with the number of objects that
    /// it drew.
    pub fn drawn_variants(&self) -> BTreeMap<String, usize> {
        let mut variants = BTreeMap::new();
        for (variant, count) in &self.drawn {
            *variants.entry(variant.to_string()).or_insert(0) += count;
        }
        variants
    }

    /// Returns the options without what this renderer was built without.
    pub(crate) fn possible(&self, options: &FrameOptions) -> FrameOptions {
        let mut possible = options.clone();
        self.without.iter().for_each(|effect| effect.switch_off(&mut possible));
        possible
    }

    /// Returns the device that it draws on.
    pub(crate) fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Returns the effects in the order of their stages.
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
        let drawn = self.draw_frame(world, target, &self.possible(options), overlay);
        if drawn.is_err() {
            // The frame may have failed before the shadow maps were drawn.
            self.shadows.forget();
        }
        drawn
    }

    fn draw_frame(
        &mut self,
        world: &mut World,
        target: &FrameTarget,
        options: &FrameOptions,
        overlay: Option<Overlay<'_>>,
    ) -> Result<FrameReport, RenderError> {
        let mut clock = StageClock::start();
        self.gpu.check()?;
        target.check()?;
        self.shares.begin(&self.effects);
        let asked = AskedFrame::new(world, target, options);
        let unchanged = self.is_unchanged(world);
        clock.lap(|cpu| &mut cpu.changes_ms);
        let frame = match self.last.take().filter(|last| unchanged && last.is(&asked)) {
            Some(last) => {
                let may_stay =
                    options.keep_unchanged && overlay.is_none() && options.measure == Measure::Nothing;
                if let Some(plan) = last.plan_in(target).filter(|_| may_stay) {
                    let plan = plan.unchanged("nothing has changed, and the target holds it");
                    return Ok(self.report_unchanged(last, plan, &clock));
                }
                self.shadows.stale.clear();
                if last.decided.counts_lights() {
                    self.light_counter.begin(&self.gpu);
                }
                let statistics =
                    Statistics { uploads: Uploads::default(), cpu: CpuStages::default(), ..last.statistics };
                LastFrame { statistics, ..last }
            }
            None => self.prepare(world, target, options, asked, &mut clock)?,
        };
        self.encode(frame, target, options, overlay, &mut clock)
    }

    /// Returns true if nothing that this renderer or one of its effects would notice has changed since the
    /// last frame.
    fn is_unchanged(&mut self, world: &mut World) -> bool {
        // No short-circuit: each call also resets what it compares with next time.
        let unchanged = self.watch.is_unchanged(world);
        let effects = self.effects.iter_mut().zip(&mut self.shares.ms);
        effects.fold(unchanged, |all, (effect, ms)| timed(ms, || effect.is_unchanged(world)) && all)
    }

    /// Returns the report of a frame that is not drawn because the target already holds it.
    fn report_unchanged(&mut self, last: LastFrame, plan: Plan, clock: &StageClock) -> FrameReport {
        let statistics = Statistics { uploads: Uploads::default(), cpu: clock.stages(), ..last.statistics };
        let census = Arc::clone(&last.decided.census);
        self.last = Some(last);
        FrameReport {
            statistics,
            plan: Arc::new(plan),
            census,
            measured: self.executor.latest_report().cloned(),
            left_out: self.left_out.clone(),
            accounting: None,
        }
    }

    /// Does everything that comes before the passes of a frame: extracts what changed in the World, decides
    /// what is drawn, and uploads it.
    fn prepare(
        &mut self,
        world: &mut World,
        target: &FrameTarget,
        options: &FrameOptions,
        asked: AskedFrame,
        clock: &mut StageClock,
    ) -> Result<LastFrame, RenderError> {
        // The system cannot fail: it has no parameter that may be missing.
        let _ = world.run_system_cached(propagate_transforms);
        clock.lap(|cpu| &mut cpu.transforms_ms);
        let mut settings = world.get_resource::<SceneSettings>().copied().unwrap_or_default();
        // Like a light, a fog that was created in code with invalid numbers is left out.
        let fog_fault = settings.fog.and_then(|fog| fog.validate("scene").err());
        let mut left_out: Vec<String> = fog_fault.iter().map(ToString::to_string).collect();
        if fog_fault.is_some() {
            settings.fog = None;
        }
        let camera = find_camera(world, options.camera)?;
        let view = CameraView::new(world, camera, target.aspect())?;
        let exposure = options.exposure.unwrap_or(view.exposure);
        if !(exposure > 0.0 && exposure.is_finite()) {
            let (field, value, wanted) = ("exposure", f64::from(exposure), "greater than 0 and finite");
            return Err(RenderError::BadCamera { entity: camera, field, value, wanted });
        }
        self.objects.extract(
            world,
            &self.gpu,
            (&mut self.meshes, &mut self.textures, &mut self.sets),
            view.eye,
            &mut left_out,
        )?;
        self.volumes.extract(world, &mut left_out);
        clock.lap(|cpu| &mut cpu.objects_ms);
        let seen = Seen { target, view, exposure };
        let mut decided = self.decide(world, &seen, (options, &settings), None, &mut left_out, clock)?;
        self.warn_once(&left_out);
        let former = self.decisions.former(world, target, options);
        // A frame cannot use the decision of an earlier one if the irradiance volumes that it uses have left
        // the World.
        let former = former.filter(|former| !former.features.irradiance_volumes || self.volumes.len() > 0);
        let awaited = self.make_pipelines(&mut decided, &seen, former.is_none())?;
        clock.lap(|cpu| &mut cpu.pipelines_ms);
        match former.filter(|_| awaited > 0) {
            Some(former) => {
                let options = with_camera(&former.options, options.camera);
                let (asked, mut said) = ((&options, &former.settings), Vec::new());
                decided = self.decide(world, &seen, asked, Some(&former), &mut said, clock)?;
                self.leave_out_effects(&mut decided, &seen)?;
                clock.lap(|cpu| &mut cpu.pipelines_ms);
            }
            None => self.decisions.keep(target, &decided.decision),
        }
        let statistics = self.upload(&decided, &seen, options.finest_cluster_tile, clock)?;
        let statistics = Statistics { pipelines_awaited: awaited, ..statistics };
        Ok(LastFrame { asked, decided, statistics, view, exposure, waits: awaited > 0, drawn: None })
    }

    /// Decides what the frame consists of. Without `former`, this follows from the World, options and
    /// settings; with a former decision, it is what that decision can show of the World with the existing
    /// pipelines.
    fn decide(
        &mut self,
        world: &mut World,
        seen: &Seen<'_>,
        (options, settings): (&FrameOptions, &SceneSettings),
        former: Option<&Decision>,
        left_out: &mut Vec<String>,
        clock: &mut StageClock,
    ) -> Result<Decided, RenderError> {
        let known = former.map(|former| KnownLights {
            set: &former.features.lights,
            clustered: former.features.clustered,
            lightmaps: options.lightmaps,
            shadows: options.shadows,
        });
        let by_need = is_shaded_by_need(&self.objects.census, options, settings);
        let place = LightPlace {
            origin: self.objects.origin,
            known,
            lamps: by_need,
            shadows: options.shadows,
            settings: settings.frame,
        };
        let mut lights = extract_lights(
            world,
            (&mut self.emitters, &mut self.light_records),
            &mut self.lights,
            place,
            left_out,
        )?;
        lights.limit_to(options.lightmaps, options.shadows);
        clock.lap(|cpu| &mut cpu.lights_ms);
        let device = (self.gpu.is_software(), [seen.target.width, seen.target.height]);
        let (objects, volumes) = (&self.objects.census, self.volumes.len());
        let mut facts = SceneFacts::new(objects, &lights.set, volumes, settings, options, device);
        if let Some(former) = former {
            // Surfaces are drawn the way they were in the former frame.
            facts.g_buffer = former.features.g_buffer;
        }
        clock.lap(|cpu| &mut cpu.census_ms);
        let effects = self.effects.iter_mut().zip(&mut self.shares.ms);
        let called_for: Vec<bool> =
            effects.map(|(effect, ms)| timed(ms, || effect.extract(world, &facts, options))).collect();
        clock.lap(|cpu| &mut cpu.effects_ms);
        let called = || self.effects.iter().zip(&called_for).filter(|(_, called)| **called);
        let needs_radiance = called().any(|(effect, _)| effect.needs_radiance());
        let draws_objects = called().any(|(effect, _)| effect.draws_objects());
        let decision = former.cloned().unwrap_or_else(|| {
            Decision::new((options, settings), &facts, lights.set, needs_radiance, (&self.gpu, seen))
        });
        if decision.plan.ending == Ending::DisplayPass
            && !self.effects.iter().any(|effect| effect.stage() == Stage::Display)
        {
            return Err(RenderError::NoDisplay);
        }
        let limit = most_bytes_of_words(&self.gpu);
        let everything = options.light_lists == LightLists::Everything;
        let mut lists = ObjectLightLists::new(&lights.reaches, everything, limit);
        clock.lap(|cpu| &mut cpu.draws_ms);
        if decision.features.irradiance_volumes {
            self.volumes.upload(world, &self.gpu, self.pipelines.volume_layout(), self.objects.origin);
        }
        clock.lap(|cpu| &mut cpu.upload_ms);
        let pipelines = &self.pipelines;
        let choose = |wanted: PipelineKey| match former {
            Some(_) if pipelines.get(&wanted).is_none() => pipelines.nearest(&wanted),
            _ => Some(wanted),
        };
        if by_need {
            let settings = SceneSettings { flat_rule: decision.flat_rule(), ..*settings };
            let conditions = Conditions::new(&settings, &decision.features);
            self.needs.begin(conditions, std::mem::take(&mut lights.lamps), &self.objects);
        }
        let size = [seen.target.width, seen.target.height];
        let sized = SizedView { view: seen.view, size, exposure: seen.exposure };
        let (needs, meshes, found) = (&mut self.needs, &self.meshes, &mut lists);
        let mut shading_by_need = ShadingNeeds::default();
        let mut need = |slot: usize, object: &Object, max_error: ErrorBound| {
            let Some(mesh) = meshes.get(object.mesh) else { return Shading::Phong };
            let lights =
                || -> Vec<u32> { found.lights_of(object.entity, object.center, object.half_size).collect() };
            let chosen = needs.choose((slot, object), mesh, &sized, max_error, lights);
            shading_by_need.add(&chosen);
            chosen.shading
        };
        let visible_in =
            |seen: (&CameraView, &[usize]), features: &FrameFeatures, need: &mut ChooseShading<'_>| {
                let format = (decision.plan.lit_format, decision.plan.samples);
                VisibleObjects::new(
                    (&self.objects, &self.volumes),
                    seen,
                    settings,
                    features,
                    format,
                    &choose,
                    need,
                )
            };
        let visible = visible_in((&seen.view, &[]), &decision.features, &mut need);
        clock.lap(|cpu| &mut cpu.visibility_ms);
        let draws = Draws::new(visible, &mut lists, 0);
        let mut mirrors = Vec::new();
        if facts.calls_for_mirrors(options) && decision.plan.ending == Ending::DisplayPass {
            let look = MirrorLook::new(settings, options);
            mirrors = mirror_views(&self.objects, &seen.view, look, options.mirror_depth, left_out);
            let features = decision.features.in_mirrors();
            let phong = &mut |_: usize, _: &Object, _: ErrorBound| Shading::Phong;
            draw_mirrors(&mut mirrors, draws.instances.len(), &mut lists, |view, mirrors| {
                visible_in((view, mirrors), &features, phong)
            });
        }
        lists.check()?;
        clock.lap(|cpu| &mut cpu.draws_ms);
        let (lights_per_object, light_list) = (lists.mean_length(), lists.indices);
        let declared = vec![true; called_for.len()];
        Ok(Decided {
            decision,
            declared,
            called_for,
            lights,
            draws,
            mirrors,
            light_list,
            lights_per_object,
            shading_by_need,
            draws_objects,
            census: facts.census,
        })
    }

    /// Creates the missing pipelines of a frame, or starts to. Returns how many are still being created,
    /// which is 0 with `wait`.
    fn make_pipelines(
        &mut self,
        decided: &mut Decided,
        seen: &Seen<'_>,
        wait: bool,
    ) -> Result<usize, RenderError> {
        let mut awaited = HashSet::new();
        let drawn = decided.batches().map(|batch| (batch.pipeline, batch.texture_set.as_deref()));
        let lit = decided.draws.deferred.iter().map(|class| (class.pipeline, None));
        for (key, set) in drawn.chain(lit) {
            let warm_up = || self.warm_ups.of(&self.gpu, key, (set, self.objects.lightmap_format()));
            if !self.pipelines.prepare(&self.gpu, &mut self.sets, key, wait, warm_up)? {
                awaited.insert(key);
            }
        }
        let mut count = awaited.len();
        if !decided.lights.shadows.is_empty() {
            let warm_up = || self.warm_ups.of_casters(&self.gpu);
            count += usize::from(!self.shadows.prepare(&self.gpu, wait, warm_up)?);
        }
        if !wait {
            count += self.ready_effects(decided, seen)?.iter().filter(|ready| !**ready).count();
        }
        Ok(count)
    }

    /// Returns for each effect whether it can be drawn without waiting.
    fn ready_effects(&mut self, decided: &Decided, seen: &Seen<'_>) -> Result<Vec<bool>, RenderError> {
        let mut shape = decided.decision.shape(seen);
        shape.warm_ups = Some(self.warm_ups.clone());
        let effects = self.effects.iter_mut().zip(&mut self.shares.ms).zip(&decided.called_for);
        let ready = effects.map(|((effect, ms), called)| {
            let (called, name) = (*called, effect.name());
            let ready = if called { timed(ms, || effect.ready(&self.gpu, &shape)) } else { Ok(true) };
            ready.map_err(|source| RenderError::Effect { effect: name, source })
        });
        ready.collect()
    }

    /// Leaves out effects that are not ready, or that need radiance where the former decision does not keep
    /// it.
    fn leave_out_effects(&mut self, decided: &mut Decided, seen: &Seen<'_>) -> Result<(), RenderError> {
        decided.declared = self.ready_effects(decided, seen)?;
        let linear = decided.decision.plan.ending == Ending::DisplayPass;
        for (effect, declared) in self.effects.iter().zip(&mut decided.declared) {
            *declared &= !effect.needs_radiance() || linear;
        }
        for (called, declared) in decided.called_for.iter_mut().zip(&decided.declared) {
            *called &= declared;
        }
        let mut declared = self.effects.iter().zip(&decided.declared).filter(|(_, declared)| **declared);
        if !declared.any(|(effect, _)| effect.name() == BuiltIn::Refraction.name()) {
            decided.draws.draw_refractive_opaque();
        }
        Ok(())
    }

    /// Uploads what the frame reads, and returns its statistics.
    fn upload(
        &mut self,
        decided: &Decided,
        seen: &Seen<'_>,
        finest_tile: u32,
        clock: &mut StageClock,
    ) -> Result<Statistics, RenderError> {
        let Decided { draws, mirrors, lights, light_list, .. } = decided;
        self.instances.replace(decided.every_draws().flat_map(|draws| draws.instances.iter().copied()));
        self.light_list.replace(light_list.iter().copied());
        let views = 1 + mirrors.len();
        if self.views.len() < views {
            self.views.resize_with(views, || ViewBuffers::new(&self.gpu));
        }
        let (origin, size) = (self.objects.origin, [seen.target.width, seen.target.height]);
        for ((view, draws), buffers) in views_of(decided, seen).zip(&mut self.views) {
            if let Some(depths) = draws.clustered_depths {
                buffers.clusters.build(&ClusteredView { view, origin, size, depths, finest_tile }, lights);
            }
        }
        let clustered = draws.clustered_depths.is_some();
        clock.lap(|cpu| &mut cpu.clusters_ms);
        let shadowed = !lights.shadows.is_empty();
        if shadowed {
            let depths = decided.every_draws().filter_map(|draws| draws.depths);
            let depths = depths.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]).unwrap_or([0.0, 1.0]);
            let resolution = decided.decision.settings.frame.shadow_resolution();
            let reflected = mirrors.iter().map(|mirror| mirror.view).collect();
            let height = seen.target.height;
            let planes = decided.decision.settings.frame.shadow_filter != ShadowFilter::Hard;
            let view = ShadowedView { view: seen.view, reflected, height, depths, resolution, planes };
            self.shadows.plan(&lights.shadows, &self.objects, &view);
        }
        clock.lap(|cpu| &mut cpu.shadows_ms);
        let mut uploads = self.upload_buffers(decided, seen, shadowed)?;
        if decided.counts_lights() {
            self.light_counter.begin(&self.gpu);
        }
        self.make_groups(decided);
        let flat_rule = decided.decision.flat_rule();
        let mut triangles = 0;
        self.drawn.clear();
        for (batch, lit_with) in decided.every_draws().flat_map(Draws::lit_batches) {
            match self.drawn.last_mut() {
                Some((variant, count)) if variant == lit_with => *count += batch.instances.len(),
                _ => self.drawn.push((*lit_with, batch.instances.len())),
            }
            let variant = &batch.pipeline.variant;
            if let Some(mesh) = self.meshes.get_mut(batch.mesh) {
                let flat = is_flat(variant).then_some(flat_rule);
                uploads.meshes += mesh.prepare(&self.gpu, &attributes(variant), flat);
                if decided.draws_objects {
                    uploads.meshes += mesh.prepare(&self.gpu, &[Attribute::Position], None);
                }
                triangles += mesh.triangles() * batch.instances.len();
            }
        }
        for batch in &draws.refractive {
            if let Some(mesh) = self.meshes.get_mut(batch.mesh) {
                uploads.meshes += mesh.prepare(&self.gpu, &SHAPE, None);
            }
        }
        for surface in mirrors.iter().flat_map(|mirror| &mirror.mirrors) {
            let object = self.objects.get(surface.slot);
            if let Some(mesh) = object.and_then(|object| self.meshes.get_mut(object.mesh)) {
                uploads.meshes += mesh.prepare(&self.gpu, &[Attribute::Position], None);
            }
        }
        [uploads.textures, uploads.lightmaps] = self.textures.take_uploaded();
        uploads.irradiance_volumes = self.volumes.take_uploaded();
        clock.lap(|cpu| &mut cpu.upload_ms);
        let clusters = &self.views[0].clusters.clusters;
        let light_lists = LightListing {
            clustered,
            clusters: if clustered { clusters.grid.size.to_array() } else { [0; 3] },
            tile_side: if clustered { clusters.tile_side } else { 0 },
            entries: if clustered { clusters.entries } else { 0 },
            inverse_square_lights: lights.set.inverse_square.all,
            shadowed_lights: lights.set.shadowed.all,
            other_ranged_lights: lights.set.ranged.all,
            unbounded_lights: lights.set.unbounded.all,
        };
        Ok(Statistics {
            light_lists,
            lit_passes: LitPasses::default(),
            cpu: CpuStages::default(),
            lights: lights.set.every.all,
            static_lights: lights.set.every.all - lights.set.every.dynamic,
            lights_per_object: decided.lights_per_object,
            shading_by_need: decided.shading_by_need,
            objects: draws.instances.len(),
            objects_outside: draws.outside,
            triangles,
            draws: decided.batches().count() + draws.deferred.len(),
            mirror_views: mirrors.len(),
            variants: self.pipelines.variants(),
            pipelines_made: self.pipelines.made(),
            pipelines_awaited: 0,
            uploads,
            lightmaps: self.textures.lightmap_memory(),
        })
    }

    /// Declares the passes of a frame, records them and submits them.
    fn encode(
        &mut self,
        mut frame: LastFrame,
        target: &FrameTarget,
        options: &FrameOptions,
        overlay: Option<Overlay<'_>>,
        clock: &mut StageClock,
    ) -> Result<FrameReport, RenderError> {
        let decided = &frame.decided;
        let mut shape = decided.decision.shape(&Seen { target, view: frame.view, exposure: frame.exposure });
        if let Some(maps) = self.shadows.device().filter(|_| !decided.lights.shadows.is_empty()) {
            let stale = !self.shadows.stale.is_empty();
            let pipelines = self.shadows.pipelines().map_or(0, CasterPipelines::count);
            shape.shadow_atlas = Some(ShadowAtlas {
                view: maps.atlas_view.clone(),
                planes: maps.planes.clone(),
                stale,
                pipelines,
            });
        }
        shape.mirrors = Some(decided.mirrors.iter().map(|mirror| mirror.shape(shape.size)).collect());
        shape.refractors = self.refractors(decided, &frame.view);
        shape.uploads = frame.statistics.uploads;
        let effects = self.effects.iter_mut().zip(&mut self.shares.ms).zip(&decided.called_for);
        for ((effect, ms), _) in effects.filter(|(_, called)| **called) {
            let name = effect.name();
            timed(ms, || effect.prepare(&self.gpu, &shape))
                .map_err(|source| RenderError::Effect { effect: name, source })?;
        }
        clock.lap(|cpu| &mut cpu.effects_ms);
        self.executor.set_measure(match options.measure {
            Measure::Nothing => lumbre_graph::Measurements::OFF,
            Measure::Time => lumbre_graph::Measurements::TIMES,
            Measure::TimeAndInvocations | Measure::Lights => lumbre_graph::Measurements::ALL,
        });
        self.executor.enable_probe(options.probe);
        self.executor.begun_at(clock.begun);
        let mut scene = FrameScene {
            draws: &decided.draws,
            objects: &self.objects,
            pipelines: &self.pipelines,
            meshes: &self.meshes,
            flat_rule: decided.decision.flat_rule(),
            mirrors: &decided.mirrors,
            views: &self.views,
            view: frame.view,
            size: shape.size,
            shadows: &self.shadows,
        };
        let effects = (self.effects.as_slice(), decided.declared.as_slice(), &decided.decision.plan);
        let light = decided.bindings().light_resources();
        let shared = self.shared_buffers();
        // Tables in textures are not resources of the graph.
        let bound = |buffer| match self.views[0].bound(buffer, None, &shared) {
            Some(wgpu::BindingResource::Buffer(bound)) => Some(bound.buffer.clone()),
            _ => None,
        };
        let light: Vec<_> = light.filter_map(|(name, of)| Some((name, of, bound(of)?))).collect();
        let counts = if decided.counts_lights() { self.light_counter.copy(&self.gpu) } else { None };
        let last = Last { overlay, counts: counts.clone() };
        let drawn = run_graph(&mut self.executor, &self.gpu, effects, (target, &light), &mut scene, last)?;
        let counts_lights = counts.is_some();
        counts.into_iter().for_each(|[_, copy]| self.light_counter.send_for(drawn.number, copy));
        self.gpu.check()?;
        if options.measure != Measure::Nothing {
            frame.statistics.lit_passes = decided.lit_passes();
        }
        clock.lap(|cpu| &mut cpu.encoding_ms);
        drawn.stages.into_iter().for_each(|stages| clock.note_execution(stages));
        let effects = self.shares.end(&self.effects, &mut frame.statistics.uploads);
        frame.drawn = Some((Arc::clone(&drawn.plan), target.texture.clone()));
        let census = Arc::clone(&frame.decided.census);
        frame.statistics.cpu = clock.stages();
        match options.measure {
            // An unmeasured frame, for example a metered one, may come between two measured frames.
            Measure::Nothing => self.ledger.pass_over(),
            measure => {
                let shares = FrameShares {
                    stages: frame.statistics.cpu,
                    uploads: frame.statistics.uploads,
                    lightmaps: frame.statistics.lightmaps,
                    effects,
                    pipelines_made: frame.statistics.pipelines_made.saturating_sub(self.pipelines_before),
                };
                let notes =
                    if measure == Measure::Lights { CountedStages::of(&self.gpu).1 } else { Vec::new() };
                let (begun, report, lights) = (clock.begun, None, None);
                self.ledger.open(OpenFrame {
                    frame: drawn.number,
                    begun,
                    shares,
                    counts_lights,
                    notes,
                    report,
                    lights,
                });
                self.settle(None);
            }
        }
        self.pipelines_before = frame.statistics.pipelines_made;
        let report = FrameReport {
            statistics: frame.statistics,
            plan: drawn.plan,
            census,
            measured: self.executor.latest_report().cloned(),
            left_out: self.left_out.clone(),
            accounting: self.ledger.newest().filter(|_| options.measure != Measure::Nothing).cloned(),
        };
        self.last = Some(frame);
        Ok(report)
    }

    /// Returns the transmissive surfaces in view.
    fn refractors(&self, decided: &Decided, view: &CameraView) -> Vec<RefractorSurface> {
        let background = radiance(SceneSettings::shown_background(&decided.decision.settings));
        let parallel = view.viewer().w == 0.0;
        let draws = &decided.draws;
        let instances = draws.refractive.iter().flat_map(|batch| batch.instances.clone());
        let surfaces = instances.filter_map(|instance| {
            let slot = draws.instances.get(instance as usize)?.object() as usize;
            let object = self.objects.get(slot)?;
            let refractor = object.refractor.as_ref()?;
            let flat = object.planar_mirror.is_some();
            let data = RefractorData::new(refractor, object.radius, parallel, background);
            Some(RefractorSurface {
                slot,
                shape: RefractiveShape::new(refractor.thin, flat),
                mirrored: object.mirrored,
                triangles: object.triangles,
                window: view.window_of_box(object.center, object.half_size).unwrap_or(view.window),
                data,
            })
        });
        surfaces.collect()
    }

    /// Logs the messages that the previous frame did not have.
    fn warn_once(&mut self, left_out: &[String]) {
        for fault in left_out.iter().filter(|fault| !self.left_out.contains(fault)) {
            tracing::warn!("left out of the frame: {fault}");
        }
        left_out.clone_into(&mut self.left_out);
    }

    /// Uploads the components that changed, and returns the uploaded bytes.
    fn upload_buffers(
        &mut self,
        decided: &Decided,
        seen: &Seen<'_>,
        shadowed: bool,
    ) -> Result<Uploads, RenderError> {
        let origin = self.objects.origin;
        let (settings, lights) = (&decided.decision.settings, &decided.lights.set);
        let mut uploads = Uploads {
            transforms: self.objects.transforms.pending_bytes(),
            materials: self.objects.materials.pending_bytes(),
            instances: self.instances.pending_bytes(),
            lights: self.lights.pending_bytes(),
            light_lists: self.light_list.pending_bytes(),
            ..Uploads::default()
        };
        let mut renewed = vec![
            self.objects.transforms.upload(&self.gpu),
            self.objects.materials.upload(&self.gpu),
            self.instances.upload(&self.gpu),
            self.lights.upload(&self.gpu),
            self.light_list.upload(&self.gpu),
        ];
        for ((view, draws), buffers) in views_of(decided, seen).zip(&mut self.views) {
            let size = [seen.target.width, seen.target.height];
            buffers.write(&self.gpu, (&view, origin, size), settings, lights, seen.exposure);
            if draws.clustered_depths.is_some() {
                uploads.clusters += buffers.clusters.pending_bytes();
                renewed.push(buffers.clusters.upload(&self.gpu));
            }
            buffers.lit_classes.replace(draws.dispatches(size).map(|(_, dispatch)| dispatch.class));
            if !buffers.lit_classes.values.is_empty() {
                uploads.instances += buffers.lit_classes.pending_bytes();
                // The bind group that refers to it is made for each frame.
                buffers.lit_classes.upload(&self.gpu)?;
            }
        }
        if renewed.iter().any(|renewed| !matches!(renewed, Ok(false))) {
            // Even if an upload failed, the old bind groups refer to buffers that no longer exist.
            self.views.iter_mut().for_each(ViewBuffers::forget_groups);
        }
        renewed.into_iter().collect::<Result<Vec<bool>, _>>()?;
        if let Some(transforms) = self.objects.transforms.bound().filter(|_| shadowed) {
            let layout = self.pipelines.shadow_layout();
            let of_shadows = self.shadows.upload(&self.gpu, transforms, &mut self.meshes, layout)?;
            (uploads.shadows, uploads.meshes) = (of_shadows.shadows, of_shadows.meshes);
        }
        Ok(uploads)
    }

    /// Returns the buffers of group 0 that all views share.
    fn shared_buffers(&self) -> SharedBuffers<'_> {
        SharedBuffers {
            objects: self.objects.transforms.bound(),
            materials: self.objects.materials.bound(),
            instances: self.instances.bound(),
            lights: self.lights.bound(),
            light_list: self.light_list.bound(),
            counter: &self.light_counter,
        }
    }

    /// Creates the missing bind groups 0 of a frame's draws.
    fn make_groups(&mut self, decided: &Decided) {
        let mut views = std::mem::take(&mut self.views);
        for (draws, buffers) in decided.every_draws().zip(&mut views) {
            for wanted in buffers.missing_groups(draws) {
                let layout = self.pipelines.frame_layout(&self.gpu, wanted.bindings).clone();
                buffers.make_group(&self.gpu, wanted, &layout, &self.shared_buffers());
            }
        }
        self.views = views;
    }
}

/// Returns the views of a frame and what is drawn in each: the camera's view first, then those in mirrors.
fn views_of<'a>(
    decided: &'a Decided,
    seen: &Seen<'_>,
) -> impl Iterator<Item = (CameraView, &'a Draws)> + use<'a> {
    let mirrored = |mirror: &'a MirrorView| (mirror.view, &mirror.draws);
    std::iter::once((seen.view, &decided.draws)).chain(decided.mirrors.iter().map(mirrored))
}
