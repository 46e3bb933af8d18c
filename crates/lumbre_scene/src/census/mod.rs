//! The census: counts of everything in a World that decides which render passes and shader variants are
//! needed. The same record is printed for the user. The decisions themselves are made in the renderer.
//!
//! ```text
//!  components ──► ObjectTraits, one object ──► ObjectCensus, all of them ─┐
//!  lights     ──► LightCensus ────────────────────────────────────────────┼──► Census ──► lines
//!  volumes    ──► how many can be used ───────────────────────────────────┤
//!  SceneSettings ─────────────────────────────────────────────────────────┘
//! ```

mod lights;
mod lines;
mod object;
mod object_census;

use std::collections::BTreeMap;

use bevy_ecs::prelude::*;
use glam::Vec3;
use lumbre_optics::{ReflectionModel, Shading};
use serde::Serialize;

pub use lights::{LightCensus, light_place, shines};
pub use lines::CensusLine;
pub use object::{
    Mobility, ObjectComponents, ObjectItem, ObjectTraits, RefractiveShape, planar_mirror, shown_objects,
};
pub use object_census::ObjectCensus;

use crate::{SceneSettings, usable_irradiance_volumes};

/// Counts of what is in a World. Disabled lights count only as `lights_off`, and hidden meshes not at all.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Census {
    /// Counts of the lights.
    #[serde(flatten)]
    pub lights: LightCensus,
    /// Whether the global ambient light is not black.
    pub global_ambient: bool,
    /// Whether the sky is not black.
    pub sky: bool,
    /// Meshes that are not hidden.
    pub meshes: usize,
    /// Triangles of these meshes.
    pub triangles: usize,
    /// Meshes that the baker includes.
    pub static_objects: usize,
    /// Meshes marked as moving.
    pub dynamic_objects: usize,
    /// Meshes lit by a lightmap.
    pub lightmapped: usize,
    /// Irradiance volumes that are valid and placed.
    pub irradiance_volumes: usize,
    /// Lit meshes without a lightmap, if there is a usable irradiance volume.
    pub lit_by_volume: usize,
    /// Metals among the meshes lit by a lightmap or an irradiance volume.
    pub baked_metals: usize,
    /// Meshes with a texture of any kind.
    pub textured: usize,
    /// Meshes with a base colour texture.
    pub base_color_textures: usize,
    /// Meshes with an emissive texture.
    pub emissive_textures: usize,
    /// Meshes with a metallic-roughness texture.
    pub metallic_roughness_textures: usize,
    /// Meshes with a normal texture.
    pub normal_textures: usize,
    /// Meshes with an occlusion texture.
    pub occlusion_textures: usize,
    /// Meshes with vertex colours.
    pub vertex_colors: usize,
    /// Meshes with an alpha mask.
    pub alpha_mask: usize,
    /// Meshes with alpha blending.
    pub alpha_blend: usize,
    /// Meshes lit from both sides.
    pub two_sided: usize,
    /// Of these, meshes with a separate material on the back.
    pub back_materials: usize,
    /// Unlit meshes.
    pub unlit: usize,
    /// Meshes that emit light.
    pub emissive: usize,
    /// Emissive meshes whose faces light others in real time.
    pub emissive_lights: usize,
    /// Meshes with specular reflection.
    pub specular: usize,
    /// Meshes with mirror reflection.
    pub mirrors: usize,
    /// Mirroring meshes that are flat, so that the reflection can be drawn as a view of its own.
    pub planar_mirrors: usize,
    /// Meshes that transmit light.
    pub transmission: usize,
    /// Transmissive meshes through which the scene behind them can be drawn.
    pub refractive: usize,
    /// Meshes shaded per face.
    pub flat: usize,
    /// Meshes shaded per vertex.
    pub gouraud: usize,
    /// Meshes shaded per fragment.
    pub phong: usize,
    /// Meshes with shading by need, i.e. the cheapest rate within an error bound.
    pub shaded_by_need: usize,
    /// Lit meshes with a specular model of their own.
    pub own_reflection: usize,
    /// Lit meshes with specular reflection, by the name of their reflection model. Models without meshes are
    /// absent.
    pub reflection_models: BTreeMap<&'static str, usize>,
    /// Whether the scene has fog.
    pub fog: bool,
}

impl Census {
    /// Counts what is in a World. Global transforms must be up to date.
    pub fn of(world: &mut World) -> Self {
        let settings = world.get_resource::<SceneSettings>().copied().unwrap_or_default();
        let objects = ObjectCensus::of(&shown_objects(world));
        Self::new(&objects, LightCensus::of(world), usable_irradiance_volumes(world), &settings)
    }

    /// Combines the counts of objects, lights and usable irradiance volumes under the settings of their
    /// scene.
    pub fn new(
        objects: &ObjectCensus,
        lights: LightCensus,
        irradiance_volumes: usize,
        settings: &SceneSettings,
    ) -> Self {
        let [base_color, emissive, metallic_roughness, normal, occlusion] = objects.textures;
        let two_sided = |count| if settings.two_sided { count } else { 0 };
        let by_volume = |count| if irradiance_volumes > 0 { count } else { 0 };
        let highlights = ReflectionModel::ALL
            .iter()
            .map(|model| (model.name(), objects.highlights_of(*model, settings.reflection)))
            .filter(|(_, count)| *count > 0)
            .collect();
        let shaded = |rate| objects.shaded(rate, settings.shading);
        Self {
            lights,
            global_ambient: settings.ambient != Vec3::ZERO,
            sky: settings.sky != Vec3::ZERO,
            meshes: objects.meshes,
            triangles: objects.triangles,
            static_objects: objects.static_objects,
            dynamic_objects: objects.dynamic_objects,
            lightmapped: objects.lightmapped,
            irradiance_volumes,
            lit_by_volume: by_volume(objects.without_lightmap),
            baked_metals: objects.lightmapped_metals + by_volume(objects.metals_without_lightmap),
            textured: objects.textured,
            base_color_textures: base_color,
            emissive_textures: emissive,
            metallic_roughness_textures: metallic_roughness,
            normal_textures: normal,
            occlusion_textures: occlusion,
            vertex_colors: objects.vertex_colors,
            alpha_mask: objects.alpha_mask,
            alpha_blend: objects.alpha_blend,
            two_sided: two_sided(objects.double_sided),
            back_materials: two_sided(objects.back_materials),
            unlit: objects.unlit,
            emissive: objects.glowing + two_sided(objects.glowing_behind),
            emissive_lights: objects.emissive_lights,
            specular: objects.highlights.iter().sum(),
            mirrors: objects.mirrors,
            planar_mirrors: objects.planar_mirrors,
            transmission: objects.transmission,
            refractive: objects.refractive,
            flat: shaded(Shading::Flat),
            gouraud: shaded(Shading::Gouraud),
            phong: shaded(Shading::Phong),
            shaded_by_need: objects.shaded_by_need(settings.shading),
            own_reflection: objects.reflection[1..].iter().sum(),
            reflection_models: highlights,
            fog: settings.fog.is_some(),
        }
    }
}
