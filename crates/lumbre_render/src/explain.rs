//! Explains what a scene needs and what it does not, without a device: the census, the passes with their
//! reasons, and the shader variants.

use std::collections::BTreeMap;
use std::fmt::Write;

use bevy_ecs::prelude::*;
use lumbre_graph::{Explanation, PassExplanation, TextureDescriptor};
use lumbre_optics::Shading;
use lumbre_scene::{
    Census, HiddenCone, ObjectCensus, SceneSettings, hidden_cones, shown_objects, usable_irradiance_volumes,
};

use crate::effect_costs::{BY_NEED, FrameCost};
use crate::effects::{self, Effect};
use crate::extract::{LightSet, LitPass};
use crate::facts::SceneFacts;
use crate::features::{self, FrameFeatures};
use crate::frame_bindings::FrameBindings;
use crate::frame_graph::{Last, declare};
use crate::frame_plan::{Ending, FramePlan};
use crate::g_buffer::DeferredVariants;
use crate::lightmap_texels::{LightmapMemory, lightmaps_of};
use crate::shader::Feature;
use crate::shading_by_need::{Conditions, WorldNeeds, is_shaded_by_need};
use crate::shading_need::ShadingNeed;
use crate::{FrameOptions, Gpu, RenderError, Renderer};

/// The explanation of a scene's frame.
#[derive(Clone, Debug, serde::Serialize)]
pub struct SceneExplanation {
    /// What the scene contains and what it does not.
    pub census: Census,
    /// Spotlights whose cone falls between the points at which an object is lit.
    pub hidden_cones: Vec<HiddenCone>,
    /// The passes and resources of a frame.
    pub frame: Explanation,
    /// Whether opaque surfaces are lit forward or deferred, and why.
    pub rendering_path: String,
    /// Which lists lights are found by, and why.
    pub light_lists: Vec<String>,
    /// What was chosen for objects that are shaded by need, and why; empty if there are none.
    pub shading_by_need: Vec<ShadingNeed>,
    /// The lightmaps on the device, with their format.
    pub lightmaps: LightmapMemory,
    /// Each shader variant in use with the number of objects it draws.
    pub variants: BTreeMap<String, usize>,
    /// What each effect costs, if it has been measured (see [`crate::effect_costs`]).
    pub cost: Option<FrameCost>,
}

/// Explains the frame that would be drawn of `world` with these options into a target of this size.
///
/// # Errors
/// [`RenderError::Graph`] if the graph is invalid, [`RenderError::TooManyEmissiveFaces`] if one object has
/// too many.
pub fn explain(
    world: &mut World,
    options: &FrameOptions,
    width: u32,
    height: u32,
) -> Result<SceneExplanation, RenderError> {
    let device = Device { is_software: false, features: Gpu::OPTIONAL_FEATURES };
    explain_with(world, &mut effects::own(&[]), (options, device), width, height)
}

/// What an explanation has to know about a device.
#[derive(Clone, Copy)]
struct Device {
    is_software: bool,
    features: wgpu::Features,
}

impl Renderer {
    /// Explains the frame that would be drawn of `world` with these options into a target of this size,
    /// including this renderer's own effects. Draws nothing.
    ///
    /// # Errors
    /// The same as those of [`explain`].
    pub fn explain(
        &mut self,
        world: &mut World,
        options: &FrameOptions,
        width: u32,
        height: u32,
    ) -> Result<SceneExplanation, RenderError> {
        let options = self.possible(options);
        let gpu = self.gpu();
        let device = Device { is_software: gpu.is_software(), features: gpu.device.features() };
        explain_with(world, self.effects_mut(), (&options, device), width, height)
    }
}

/// Like [`explain`], for a frame with these effects on this device.
fn explain_with(
    world: &mut World,
    effects: &mut [Box<dyn Effect>],
    (options, device): (&FrameOptions, Device),
    width: u32,
    height: u32,
) -> Result<SceneExplanation, RenderError> {
    let software = device.is_software;
    let target_format = wgpu::TextureFormat::Rgba8Unorm;
    let settings = world.get_resource::<SceneSettings>().copied().unwrap_or_default();
    let mut lights = LightSet::of(world, options.shadows)?;
    if !options.lightmaps {
        lights = lights.without_lightmaps();
    }
    let objects = shown_objects(world);
    let counted = ObjectCensus::of(&objects);
    let volumes = usable_irradiance_volumes(world);
    let facts = SceneFacts::new(&counted, &lights, volumes, &settings, options, (software, [width, height]));
    let mut radiance = false;
    for effect in effects.iter_mut() {
        let called_for = effect.extract(world, &facts, options);
        radiance |= called_for && effect.needs_radiance();
    }
    let plan = FramePlan::new(&facts, options, target_format, radiance);
    let half = plan.ending == Ending::DisplayPass && !options.full_precision;
    let common = FrameFeatures::new(options, &settings, &facts, lights, (plan.ending, target_format, half));
    let mut variants = BTreeMap::new();
    let (mut clustered, mut bindings) = (0, FrameBindings::default());
    let flat_rule = options.flat_rule.unwrap_or(settings.flat_rule);
    let conditions = Conditions::new(&SceneSettings { flat_rule, ..settings }, &common);
    let mut needs = match is_shaded_by_need(&counted, options, &settings) {
        true => WorldNeeds::of(world, &conditions, options, [width, height])?,
        false => WorldNeeds::default(),
    };
    for (index, (object, _)) in objects.iter().enumerate() {
        let shading = match features::asked_shading(object, &settings, &common) {
            Shading::Auto { max_error } => needs.choose(index, max_error),
            asked => asked,
        };
        let forward = features::variant(object, shading, &settings, &common);
        let pass = LitPass::of(object, common.lightmaps, common.refraction);
        let deferred = DeferredVariants::of(&forward, pass, common.g_buffer);
        let variant = deferred.map_or(forward, |deferred| deferred.lighting);
        clustered += usize::from(variant.has(Feature::Clusters));
        bindings = bindings.and(FrameBindings::of(&variant));
        *variants.entry(variant.to_string()).or_insert(0) += 1;
    }
    let rendering_path = facts.path.to_string();
    let light_lists = lights.listing(options.light_lists, clustered, objects.len());
    let target = TextureDescriptor::new_2d(width, height, target_format);
    let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::STORAGE;
    // Tables in textures are not resources of the graph.
    let light = bindings.light_resources().filter(|(_, buffer)| !(software && buffer.is_table()));
    let light = light.map(|(name, buffer)| (name, buffer, usage));
    let frame =
        declare(effects.iter(), &plan, (target, None, &mut { light }), Last::default()).compile()?.explain();
    let hidden_cones = match options.shading {
        // This overrides what the objects ask for, and no cone falls between fragments.
        Some(Shading::Phong) => Vec::new(),
        _ => hidden_cones(world),
    };
    let census = Census::clone(&facts.census);
    Ok(SceneExplanation {
        census,
        hidden_cones,
        frame,
        rendering_path,
        light_lists,
        shading_by_need: needs.groups(),
        lightmaps: lightmaps_of(world, device.features, settings.frame.lightmap_format),
        variants,
        cost: None,
    })
}

impl SceneExplanation {
    /// Formats the explanation briefly: what runs. [`Self::to_text`] also lists what does not run, and why.
    pub fn to_short_text(&self) -> String {
        let lines = self.census.lines();
        let mut text = self.heading();
        for line in lines.iter().filter(|line| line.called_for) {
            // Writing to a String cannot fail.
            let _ = writeln!(text, "  + {}: {}{}", line.effect, line.reason, self.cost_of(line.effect));
        }
        for cone in &self.hidden_cones {
            let _ = writeln!(text, "  + cones between vertices: {cone}");
        }
        let without: Vec<_> = lines.iter().filter(|line| !line.called_for).map(|line| line.effect).collect();
        let _ = writeln!(text, "  - not called for: {}", without.join(", "));
        let (run, skipped): (Vec<_>, Vec<_>) =
            self.frame.passes.iter().partition(|pass| pass.group.is_some());
        let names = |passes: Vec<&PassExplanation>, between: &str| {
            passes.iter().map(|pass| pass.name.as_str()).collect::<Vec<_>>().join(between)
        };
        let _ = write!(text, "\nThe frame\n  {}", names(run, " -> "));
        if !skipped.is_empty() {
            let _ = write!(text, "; without {}", names(skipped, ", "));
        }
        let objects: usize = self.variants.values().sum();
        let _ = writeln!(text, "\n  {} shader variants for {objects} objects", self.variants.len());
        if self.lightmaps.textures > 0 {
            let _ = writeln!(text, "  lightmaps on the device: {}", self.lightmaps);
        }
        self.write_needs(&mut text);
        text + &self.account()
    }

    fn heading(&self) -> String {
        match &self.cost {
            None => "The scene\n".to_owned(),
            Some(FrameCost { device, size: [width, height], milliseconds, rounds, .. }) => format!(
                "The scene: {milliseconds:.1} ms a frame of {width} x {height} on {device}; with each effect what it adds to that and how much the \
                 picture changes without it (median and spread of {rounds} rounds)\n"
            ),
        }
    }

    fn cost_of(&self, effect: &str) -> String {
        let cost = self.cost.iter().flat_map(|cost| &cost.effects).find(|cost| cost.effect == effect);
        cost.map_or(String::new(), |cost| {
            format!(
                " ({:+.1} ± {:.1} ms, {:.1} % of the picture)",
                cost.milliseconds,
                cost.spread,
                100.0 * cost.difference
            )
        })
    }

    /// Formats the whole explanation: every effect and every pass, with the reason why it runs or does not.
    pub fn to_text(&self) -> String {
        let mut text = self.heading();
        for line in self.census.lines() {
            let mark = if line.called_for { '+' } else { '-' };
            // Writing to a String cannot fail.
            let _ = writeln!(text, "  {mark} {}: {}{}", line.effect, line.reason, self.cost_of(line.effect));
        }
        for cone in &self.hidden_cones {
            let _ = writeln!(text, "  + cones between vertices: {cone}");
        }
        if self.hidden_cones.is_empty() {
            text.push_str(
                "  - cones between vertices: no cone falls between the points where a mesh is lit\n",
            );
        }
        text.push_str("\nThe frame\n");
        for line in self.frame.to_text().lines() {
            let _ = writeln!(text, "  {line}");
        }
        let _ = writeln!(text, "\nRendering path\n  {}", self.rendering_path);
        text.push_str("\nLight lists\n");
        for line in &self.light_lists {
            let _ = writeln!(text, "  {line}");
        }
        if self.lightmaps.textures > 0 {
            let _ = writeln!(text, "\nLightmaps on the device\n  {}", self.lightmaps);
        }
        self.write_needs(&mut text);
        text.push_str("\nShader variants\n");
        for (variant, count) in &self.variants {
            let _ = writeln!(text, "  {count} x {variant}");
        }
        text + &self.account()
    }

    /// Writes what was chosen for objects that are shaded by need.
    fn write_needs(&self, text: &mut String) {
        if self.shading_by_need.is_empty() {
            return;
        }
        let _ = writeln!(text, "\nShading by need{}", self.cost_of(BY_NEED));
        for need in &self.shading_by_need {
            let _ = writeln!(text, "  {}", need.line());
        }
    }

    /// Formats the account of the measured frame, if there is one.
    fn account(&self) -> String {
        let accounting = self.cost.as_ref().and_then(|cost| cost.accounting.as_ref());
        accounting.map_or_else(String::new, |accounting| {
            format!("\nThe account of a frame\n{}", accounting.to_text())
        })
    }
}
