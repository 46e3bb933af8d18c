//! What a frame is decided to be, and what it was asked for: plain data, so that a frame can go on as the one before, or be that one.

use std::collections::HashSet;
use std::sync::Arc;

use bevy_ecs::entity::Entity;
use bevy_ecs::world::{World, WorldId};
use lumbre_graph::Plan;
use lumbre_optics::FlatRule;
use lumbre_scene::{Census, SceneSettings};

use crate::draws::{Batch, Draws};
use crate::extract::{CameraView, LitPass, SceneLights};
use crate::features::FrameFeatures;
use crate::frame_bindings::FrameBindings;
use crate::frame_plan::{FramePlan, FrameShape};
use crate::mirror_views::MirrorView;
use crate::shader::Feature;
use crate::shading_need::ShadingNeeds;
use crate::{
    FrameOptions, FrameTarget, LitPasses, Measure, MissingPipelines, PassLights, Statistics, Viewport,
};

/// What the variants and passes of a frame follow from.
#[derive(Clone, Debug)]
pub(crate) struct Decision {
    pub options: FrameOptions,
    pub settings: SceneSettings,
    pub plan: FramePlan,
    pub features: FrameFeatures,
}

/// Decisions whose pipelines are there, by the kind of their target.
#[derive(Debug, Default)]
pub(crate) struct Decisions {
    world: Option<WorldId>,
    made: Vec<(TargetKind, Decision)>,
}

/// The format of a target, and whether the frame fills a part of it.
type TargetKind = (wgpu::TextureFormat, bool);

fn target_kind(target: &FrameTarget) -> TargetKind {
    (target.format(), target.viewport.is_some())
}

/// A frame that is decided, ready to be uploaded and encoded.
#[derive(Debug)]
pub(crate) struct Decided {
    pub decision: Decision,
    /// By effect: whether its passes are in the graph, and whether it is called for.
    pub declared: Vec<bool>,
    pub called_for: Vec<bool>,
    pub lights: SceneLights,
    pub draws: Draws,
    /// What is seen in mirrors.
    pub mirrors: Vec<MirrorView>,
    pub light_list: Vec<u32>,
    /// On average.
    pub lights_per_object: f32,
    /// What objects in view take that are shaded by need.
    pub shading_by_need: ShadingNeeds,
    /// An effect that is called for draws the shapes of objects.
    pub draws_objects: bool,
    /// What the frame was decided from.
    pub census: Arc<Census>,
}

/// From where a frame is seen, and where it goes.
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

/// The last frame, for one in which nothing has changed.
#[derive(Debug)]
pub(crate) struct LastFrame {
    pub asked: AskedFrame,
    pub decided: Decided,
    pub statistics: Statistics,
    pub view: CameraView,
    pub exposure: f32,
    /// It waits for pipelines: the next one may be another.
    pub waits: bool,
    /// What was drawn of it, and into which texture.
    pub drawn: Option<(Arc<Plan>, wgpu::Texture)>,
}

impl Decisions {
    /// The decision that a frame can go on with: none if it is to wait for its pipelines, or is the first of its kind.
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

    /// Keeps a decision whose pipelines are there.
    pub fn keep(&mut self, target: &FrameTarget, decision: &Decision) {
        let kind = target_kind(target);
        self.made.retain(|(other, _)| *other != kind);
        self.made.push((kind, decision.clone()));
    }
}

impl Decision {
    /// What effects are told of it.
    pub fn shape(&self, seen: &Seen<'_>) -> FrameShape {
        self.plan.shape(seen.target, self.options.display, seen.exposure)
    }

    pub fn flat_rule(&self) -> FlatRule {
        self.options.flat_rule.unwrap_or(self.settings.flat_rule)
    }
}

impl Decided {
    /// Whether any of its draws counts lights.
    pub fn counts_lights(&self) -> bool {
        self.draws.pipelines().any(|pipeline| pipeline.variant.has(Feature::CountLights))
    }

    /// The draws of each view: the camera's first, then those of mirrors.
    pub fn every_draws(&self) -> impl Iterator<Item = &Draws> {
        std::iter::once(&self.draws).chain(self.mirrors.iter().map(|mirror| &mirror.draws))
    }

    /// Every batch of every view.
    pub fn batches(&self) -> impl Iterator<Item = &Batch> {
        self.every_draws().flat_map(Draws::batches)
    }

    /// What each of its lit passes draws and tests.
    pub fn lit_passes(&self) -> LitPasses {
        LitPasses {
            lightmap: self.pass_lights(LitPass::Lightmap),
            forward: self.pass_lights(LitPass::Forward),
            refraction: self.pass_lights(LitPass::Refraction),
            transparent: self.pass_lights(LitPass::Transparent),
        }
    }

    fn pass_lights(&self, pass: LitPass) -> PassLights {
        let (mut objects, mut entries) = (0, 0);
        let (mut lists, mut lights) = (HashSet::new(), HashSet::<u32>::new());
        let (mut inverse_square, mut ranged) = (false, false);
        let (batches, classes) = (self.draws.of(pass), || self.draws.deferred_of(pass));
        let drawn = batches.iter().map(|batch| &batch.pipeline.variant);
        for variant in drawn.chain(classes().map(|(_, class)| &class.pipeline.variant)) {
            inverse_square |= variant.has(Feature::InverseSquareClusters);
            ranged |= variant.has(Feature::RangedClusters);
        }
        let numbers: Vec<u32> = classes().map(|(number, _)| number).collect();
        let of_pass = |batch: &&Batch| numbers.contains(&batch.class_number);
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
        let of_clusters = [(inverse_square, set.inverse_square.all), (ranged, set.ranged.all)];
        let clustered: u32 = of_clusters.iter().filter(|(read, _)| *read).map(|(_, count)| count).sum();
        PassLights {
            objects,
            draws: batches.len() + classes().count(),
            // Fewer than 2^32 lights have room; one may be in the lists of vertices and of clusters both.
            lights: (lights.len() as u32 + clustered).min(set.every.all),
            lights_per_object: entries as f32 / objects.max(1) as f32,
        }
    }

    /// The buffers of group 0 that any of its draws reads.
    pub fn bindings(&self) -> FrameBindings {
        let pipelines = self.every_draws().flat_map(Draws::pipelines);
        let of = pipelines.map(|pipeline| FrameBindings::of(&pipeline.variant));
        of.fold(FrameBindings::default(), FrameBindings::and)
    }
}

impl AskedFrame {
    pub fn new(world: &World, target: &FrameTarget, options: &FrameOptions) -> Self {
        // Whether it is measured changes nothing of it, unless its shaders count.
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
    /// Whether a frame that was asked for so is this one, if nothing has changed in the World.
    pub fn is(&self, asked: &AskedFrame) -> bool {
        !self.waits && self.asked == *asked
    }

    /// Its plan, if it is in this texture.
    pub fn plan_in(&self, target: &FrameTarget) -> Option<&Arc<Plan>> {
        self.drawn.as_ref().filter(|(_, texture)| *texture == target.texture).map(|(plan, _)| plan)
    }
}

/// The camera that a frame was asked for, in one that goes on as another.
pub(crate) fn with_camera(options: &FrameOptions, camera: Option<Entity>) -> FrameOptions {
    FrameOptions { camera, ..options.clone() }
}
