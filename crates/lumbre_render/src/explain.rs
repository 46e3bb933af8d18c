//! What a scene calls for and what it does not, without a device: the census, the passes with their reasons, the shader variants.

use std::collections::BTreeMap;
use std::fmt::Write;

use bevy_ecs::prelude::*;
use lumbre_graph::{Explanation, TextureDescriptor};
use lumbre_optics::{Material, ReflectionModel, Shading};
use lumbre_scene::{
    Census, Hidden, HiddenCone, Lightmap, MaterialTextures, Mesh, SceneSettings, hidden_cones,
};

use crate::extract::{FrameFeatures, LightSet, Traits};
use crate::frame_graph::{FramePlan, declare};
use crate::shader::Feature;
use crate::{Display, FrameOptions, RenderError};

/// A scene's frame, explained.
#[derive(Clone, Debug, serde::Serialize)]
pub struct SceneExplanation {
    /// What there is, and what there is none of.
    pub census: Census,
    /// Spotlights whose cone falls between the points where an object is lit.
    pub hidden_cones: Vec<HiddenCone>,
    /// The passes and resources of a frame.
    pub frame: Explanation,
    /// By which lists lights are found, and why.
    pub light_lists: Vec<String>,
    /// Each shader variant in use with the number of objects it draws.
    pub variants: BTreeMap<String, usize>,
}

/// Explains the frame that these options would draw of `world`, in a target of this size.
///
/// # Errors
/// Faults of the graph; too many emissive faces on one object.
pub fn explain(
    world: &mut World,
    options: &FrameOptions,
    width: u32,
    height: u32,
) -> Result<SceneExplanation, RenderError> {
    let settings = world.get_resource::<SceneSettings>().copied().unwrap_or_default();
    let mut lights = LightSet::of(world)?;
    if !options.lightmaps {
        lights = lights.without_lightmaps();
    }
    let features = FrameFeatures {
        shading: options.shading,
        reflection: options.reflection,
        specular_antialiasing: options.specular_antialiasing.unwrap_or(settings.specular_antialiasing),
        lightmaps: options.lightmaps,
        clamp: options.display == Display::Clamp,
        half: !options.full_precision,
        lights,
        clustered: lights.are_clustered(options.light_lists),
    };
    let mut query = world.query_filtered::<(
        &Mesh,
        &Material,
        Option<&MaterialTextures>,
        Has<Lightmap>,
        (Option<&Shading>, Option<&ReflectionModel>),
    ), Without<Hidden>>();
    let traits: Vec<Traits> = query
        .iter(world)
        .map(|(mesh, material, maps, lightmap, (shading, reflection))| {
            Traits::new(material, maps, &mesh.0, lightmap, (shading.copied(), reflection.copied()))
        })
        .collect();
    let mut variants = BTreeMap::new();
    let mut clustered = 0;
    for object in &traits {
        let variant = object.variant(&settings, &features);
        clustered += usize::from(variant.has(Feature::Clusters));
        *variants.entry(variant.to_string()).or_insert(0) += 1;
    }
    let light_lists = lights.listing(options.light_lists, clustered, traits.len());
    let plan = FramePlan::new(&traits, options);
    let target = TextureDescriptor::new_2d(width, height, wgpu::TextureFormat::Rgba8Unorm);
    let frame = declare(&plan, target, None, None).compile()?.explain();
    let hidden_cones = match options.shading {
        // Whatever the objects ask for.
        Some(Shading::Phong) => Vec::new(),
        _ => hidden_cones(world),
    };
    Ok(SceneExplanation { census: Census::of(world), hidden_cones, frame, light_lists, variants })
}

impl SceneExplanation {
    /// For people.
    pub fn to_text(&self) -> String {
        let mut text = String::from("The scene\n");
        for line in self.census.lines() {
            let mark = if line.called_for { '+' } else { '-' };
            // Writing to a String cannot fail.
            let _ = writeln!(text, "  {mark} {}: {}", line.effect, line.reason);
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
        text.push_str("\nLight lists\n");
        for line in &self.light_lists {
            let _ = writeln!(text, "  {line}");
        }
        text.push_str("\nShader variants\n");
        for (variant, count) in &self.variants {
            let _ = writeln!(text, "  {count} x {variant}");
        }
        text
    }
}
