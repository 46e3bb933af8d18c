//! Decides what a frame consists of: extracts the lights, asks the effects, and collects what is drawn in each view.

use bevy_ecs::prelude::World;
use lumbre_optics::{ErrorBound, Shading};
use lumbre_scene::SceneSettings;

use super::Renderer;
use crate::draws::{ChooseShading, Draws, VisibleObjects};
use crate::effects::Stage;
use crate::extract::{CameraView, KnownLights, LightPlace, Object, extract_lights};
use crate::facts::SceneFacts;
use crate::features::FrameFeatures;
use crate::frame_decision::{Decided, Decision, Seen};
use crate::frame_plan::Ending;
use crate::light_lists::ObjectLightLists;
use crate::mirror_views::{MirrorLook, draw_mirrors, mirror_views};
use crate::pipelines::PipelineKey;
use crate::shading_by_need::{Conditions, SizedView, is_shaded_by_need};
use crate::shading_need::ShadingNeeds;
use crate::stage_clock::{StageClock, timed};
use crate::table_texture::most_bytes_of_words;
use crate::{FrameOptions, LightLists, RenderError};

impl Renderer {
    /// Decides what the frame consists of. Without `former`, this follows from the World, options and
    /// settings; with a former decision, it is what that decision can show of the World with the existing
    /// pipelines.
    pub(super) fn decide(
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
}
