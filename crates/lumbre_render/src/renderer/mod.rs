//! The renderer, which draws a World into a target: [`Renderer::render`] extracts the World, decides what the frame
//! consists of (`decide`), makes the pipelines that it lacks (`pipelines`), uploads what it reads (`upload`), and
//! declares and runs the render graph (`encode`). `builder` chooses the effects that a renderer has.

mod builder;
mod decide;
mod encode;
mod pipelines;
mod upload;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use bevy_ecs::prelude::{Resource, World};
use lumbre_graph::{Executor, Plan};
use lumbre_scene::{SceneSettings, propagate_transforms};

use crate::effect_shares::EffectShares;
use crate::effects::{self, BuiltIn, Effect};
use crate::extract::{CameraView, Emitters, LightRecords, Objects, find_camera};
use crate::frame_decision::{AskedFrame, Decisions, LastFrame, Seen, with_camera};
use crate::frame_graph::Overlay;
use crate::growable_buffer::GrowableBuffer;
use crate::irradiance_volumes::IrradianceVolumes;
use crate::layout::{InstanceData, LightData};
use crate::ledger::Ledger;
use crate::light_counter::LightCounter;
use crate::mesh_buffers::MeshBuffers;
use crate::pipelines::Pipelines;
use crate::shader::Variant;
use crate::shading_by_need::ShadingByNeed;
use crate::shadows::ShadowMaps;
use crate::stage_clock::{StageClock, timed};
use crate::texture_sets::TextureSets;
use crate::textures::Textures;
use crate::view_buffers::ViewBuffers;
use crate::warm_up::WarmUps;
use crate::world_watch::WorldWatch;
use crate::{
    Accounting, CpuStages, FrameOptions, FrameReport, FrameTarget, Gpu, Measure, RenderError, Statistics,
    Uploads,
};

pub use self::builder::RendererBuilder;

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

    /// Logs the messages that the previous frame did not have.
    fn warn_once(&mut self, left_out: &[String]) {
        for fault in left_out.iter().filter(|fault| !self.left_out.contains(fault)) {
            tracing::warn!("left out of the frame: {fault}");
        }
        left_out.clone_into(&mut self.left_out);
    }
}
