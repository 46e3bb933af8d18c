//! Declares the passes of a frame, records them and submits them, and opens the frame's account.

use std::sync::Arc;

use lumbre_scene::{RefractiveShape, SceneSettings};

use super::Renderer;
use crate::accounting::FrameShares;
use crate::extract::{CameraView, RefractorData, RefractorSurface};
use crate::frame_decision::{Decided, LastFrame, Seen};
use crate::frame_graph::{Last, Overlay, run_graph};
use crate::frame_plan::ShadowAtlas;
use crate::frame_scene::FrameScene;
use crate::layout::radiance;
use crate::ledger::OpenFrame;
use crate::light_counter::CountedStages;
use crate::shadows::CasterPipelines;
use crate::stage_clock::{StageClock, timed};
use crate::{FrameOptions, FrameReport, FrameTarget, Measure, RenderError};

impl Renderer {
    /// Declares the passes of a frame, records them and submits them.
    pub(super) fn encode(
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
}
