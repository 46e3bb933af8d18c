//! What was asked of a frame and what was decided for it. This is plain data, so that a later frame can reuse
//! the decision while pipelines are missing, or be recognized as unchanged.

use std::collections::HashSet;
use std::sync::Arc;

use bevy_ecs::entity::Entity;
use bevy_ecs::world::{World, WorldId};
use lumbre_graph::Plan;
use lumbre_optics::FlatRule;
use lumbre_scene::{Census, SceneSettings};

use crate::draws::{Batch, DeferredClass, Draws};
use crate::extract::{CameraView, LightSet, LitPass, SceneLights};
use crate::facts::SceneFacts;
use crate::features::FrameFeatures;
use crate::frame_bindings::FrameBindings;
use crate::frame_plan::{FramePlan, FrameShape};
use crate::light_counter::CountedStages;
use crate::mirror_views::MirrorView;
use crate::shader::Feature;
use crate::shading_need::ShadingNeeds;
use crate::{
    FrameOptions, FrameTarget, Gpu, LitPasses, Measure, MissingPipelines, PassLights, Statistics, Viewport,
};

/// What the shader variants and passes of a frame follow from.
#[derive(Clone, Debug)]
pub(crate) struct Decision {
    pub options: FrameOptions,
    pub settings: SceneSettings,
    pub plan: FramePlan,
    pub features: FrameFeatures,
}

/// Decisions whose pipelines all exist, by the kind of their target.
#[derive(Debug, Default)]
pub(crate) struct Decisions {
    world: Option<WorldId>,
    made: Vec<(TargetKind, Decision)>,
}

/// The format of a target, and whether the frame fills only a part of it.
type TargetKind = (wgpu::TextureFormat, bool);

fn target_kind(target: &FrameTarget) -> TargetKind {
    (target.format(), target.viewport.is_some())
}

/// A frame that has been decided, ready to be uploaded and encoded.
#[derive(Debug)]
pub(crate) struct Decided {
    pub decision: Decision,
    /// For each effect: whether its passes are in the graph, and whether it is called for.
    pub declared: Vec<bool>,
    pub called_for: Vec<bool>,
    pub lights: SceneLights,
    pub draws: Draws,
    /// What is visible in mirrors.
    pub mirrors: Vec<MirrorView>,
    pub light_list: Vec<u32>,
    /// Average over the objects.
    pub lights_per_object: f32,
    /// What was chosen for the objects in view that are shaded by need.
    pub shading_by_need: ShadingNeeds,
    /// Whether an effect that is called for draws the shapes of objects.
    pub draws_objects: bool,
    /// The census that the frame was decided from.
    pub census: Arc<Census>,
}

/// The view of a frame and its target.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen<'a> {
    pub target: &'a FrameTarget,
    pub view: CameraView,
    pub exposure: f32,
}

/// What a frame was asked for.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct AskedFrame {
    world: WorldId,
    options: FrameOptions,
    size: (u32, u32),
    viewport: Option<Viewport>,
    format: wgpu::TextureFormat,
}

/// The last frame, which is drawn again if nothing has changed.
#[derive(Debug)]
pub(crate) struct LastFrame {
    pub asked: AskedFrame,
    pub decided: Decided,
    pub statistics: Statistics,
    pub view: CameraView,
    pub exposure: f32,
    /// It was drawn while pipelines were missing, so the next frame may differ.
    pub waits: bool,
    /// The plan that was run, and the texture that was drawn into.
    pub drawn: Option<(Arc<Plan>, wgpu::Texture)>,
}

impl Decisions {
    /// Returns the decision that a frame can be drawn with while pipelines are missing; `None` if it has to
    /// wait for them, or is the first of its kind.
    pub fn former(
        &mut self,
        world: &World,
        target: &FrameTarget,
        options: &FrameOptions,
    ) -> Option<Decision> {
        if self.world != Some(world.id()) {
            *self = Self { world: Some(world.id()), made: Vec::new() };
        }
        let waits = options.missing_pipelines == MissingPipelines::Wait || options.probe;
        let former = self.made.iter().find(|(kind, _)| *kind == target_kind(target));
        former.filter(|_| !waits).map(|(_, decision)| decision.clone())
    }

    /// Keeps a decision whose pipelines all exist.
    pub fn keep(&mut self, target: &FrameTarget, decision: &Decision) {
        let kind = target_kind(target);
        self.made.retain(|(other, _)| *other != kind);
        self.made.push((kind, decision.clone()));
    }
}

impl Decision {
    /// Decides the plan and the features of a frame from what the scene calls for. `needs_radiance` tells
    /// whether one of its effects needs the radiance of the lit passes.
    pub fn new(
        (options, settings): (&FrameOptions, &SceneSettings),
        facts: &SceneFacts,
        lights: LightSet,
        needs_radiance: bool,
        (gpu, seen): (&Gpu, &Seen<'_>),
    ) -> Self {
        let plan = FramePlan::for_device(facts, options, needs_radiance, (gpu, seen.target, seen.exposure));
        let half = plan.lit_format == wgpu::TextureFormat::Rgba16Float;
        let ending = (plan.ending, seen.target.format, half);
        let counted = match options.measure {
            Measure::Lights => CountedStages::of(gpu).0,
            _ => CountedStages::default(),
        };
        let features =
            FrameFeatures { counted, ..FrameFeatures::new(options, settings, facts, lights, ending) };
        Self { options: options.clone(), settings: *settings, plan, features }
    }

    /// Returns what effects need to know about the frame.
    pub fn shape(&self, seen: &Seen<'_>) -> FrameShape {
        self.plan.shape(seen.target, self.options.display, seen.exposure)
    }

    pub fn flat_rule(&self) -> FlatRule {
        self.options.flat_rule.unwrap_or(self.settings.flat_rule)
    }
}

impl Decided {
    /// Returns true if any of its draws counts lights.
    pub fn counts_lights(&self) -> bool {
        self.draws.pipelines().any(|pipeline| pipeline.variant.has(Feature::CountLights))
    }

    /// Returns the draws of each view: the camera's first, then those in mirrors.
    pub fn every_draws(&self) -> impl Iterator<Item = &Draws> {
        std::iter::once(&self.draws).chain(self.mirrors.iter().map(|mirror| &mirror.draws))
    }

    /// Returns every batch of every view.
    pub fn batches(&self) -> impl Iterator<Item = &Batch> {
        self.every_draws().flat_map(Draws::batches)
    }

    /// Returns what each of its lit passes draws and tests.
    pub fn lit_passes(&self) -> LitPasses {
        // Compute shaders light the classes of all passes in one of their own.
        let in_compute = |class: &DeferredClass| class.pipeline.variant.has(Feature::InCompute);
        let (computed, drawn): (Vec<_>, Vec<_>) =
            (1..).zip(&self.draws.deferred).partition(|(_, class)| in_compute(class));
        let of = |pass: LitPass| {
            let classes = drawn.iter().filter(|(_, class)| class.pass == pass).copied().collect();
            self.pass_lights(self.draws.of(pass), classes)
        };
        LitPasses {
            deferred_lighting: self.pass_lights(&[], computed),
            lightmap: of(LitPass::Lightmap),
            forward: of(LitPass::Forward),
            refraction: of(LitPass::Refraction),
            transparent: of(LitPass::Transparent),
        }
    }

    /// Returns what a pass lights: batches that it draws, and deferred classes with their numbers.
    fn pass_lights(&self, batches: &[Batch], classes: Vec<(u32, &DeferredClass)>) -> PassLights {
        let (mut objects, mut entries) = (0, 0);
        let (mut lists, mut lights) = (HashSet::new(), HashSet::<u32>::new());
        let (mut inverse_square, mut shadowed, mut ranged) = (false, false, false);
        let drawn = batches.iter().map(|batch| &batch.pipeline.variant);
        for variant in drawn.chain(classes.iter().map(|(_, class)| &class.pipeline.variant)) {
            inverse_square |= variant.has(Feature::InverseSquareClusters);
            shadowed |= variant.has(Feature::ShadowedClusters);
            ranged |= variant.has(Feature::RangedClusters);
        }
        let of_pass = |batch: &&Batch| classes.iter().any(|(number, _)| *number == batch.class_number);
        for batch in batches.iter().chain(self.draws.geometry.iter().filter(of_pass)) {
            for instance in
                &self.draws.instances[batch.instances.start as usize..batch.instances.end as usize]
            {
                let list = instance.first_light as usize..instance.static_end as usize;
                (objects, entries) = (objects + 1, entries + list.len());
                // Objects share lists.
                if lists.insert(list.clone()) {
                    lights.extend(&self.light_list[list]);
                }
            }
        }
        let set = &self.lights.set;
        let of_clusters = [
            (inverse_square, set.inverse_square.all),
            (shadowed, set.shadowed.all),
            (ranged, set.ranged.all),
        ];
        let clustered: u32 = of_clusters.iter().filter(|(read, _)| *read).map(|(_, count)| count).sum();
        PassLights {
            objects,
            draws: batches.len() + classes.len(),
            // There are fewer than 2^32 lights. A light may be in the lists of objects and in those of
            // clusters, hence the minimum.
            lights: (lights.len() as u32 + clustered).min(set.every.all),
            lights_per_object: entries as f32 / objects.max(1) as f32,
        }
    }

    /// Returns the buffers of group 0 that any of its draws reads.
    pub fn bindings(&self) -> FrameBindings {
        let pipelines = self.every_draws().flat_map(Draws::pipelines);
        let of = pipelines.map(|pipeline| FrameBindings::of(&pipeline.variant));
        of.fold(FrameBindings::default(), FrameBindings::and)
    }
}

impl AskedFrame {
    pub fn new(world: &World, target: &FrameTarget, options: &FrameOptions) -> Self {
        // Measuring does not change the picture or its draws, unless lights are counted.
        let measure = if options.measure == Measure::Lights { Measure::Lights } else { Measure::Nothing };
        let options = FrameOptions { measure, keep_unchanged: false, ..options.clone() };
        Self {
            world: world.id(),
            options,
            size: target.size(),
            viewport: target.viewport,
            format: target.format(),
        }
    }
}

impl LastFrame {
    /// Returns true if a frame that was asked for like this equals this one, provided that nothing has
    /// changed in the World.
    pub fn is(&self, asked: &AskedFrame) -> bool {
        !self.waits && self.asked == *asked
    }

    /// Returns its plan if it was drawn into this texture.
    pub fn plan_in(&self, target: &FrameTarget) -> Option<&Arc<Plan>> {
        self.drawn.as_ref().filter(|(_, texture)| *texture == target.texture).map(|(plan, _)| plan)
    }
}

/// Returns the options with the camera that the current frame was asked for.
pub(crate) fn with_camera(options: &FrameOptions, camera: Option<Entity>) -> FrameOptions {
    FrameOptions { camera, ..options.clone() }
}
