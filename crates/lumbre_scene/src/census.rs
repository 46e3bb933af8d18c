//! What a World calls for: the numbers that decide which passes and shader variants exist. Not those decisions.

use std::collections::{BTreeMap, HashSet};
use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::Vec3;
use lumbre_optics::{AlphaMode, BakeMode, Light, LightKind, Material, ReflectionModel, Shading, Surface};
use serde::Serialize;

use crate::{
    Camera, DynamicObject, EmissiveLight, Hidden, Lightmap, MaterialTextures, Mesh, SceneSettings,
    StaticObject,
};

/// Counts of what is in a World. Lights that are off and meshes that are hidden count only as such.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Census {
    /// Lights that are on, and all that follow but `lights_off` are among them.
    pub lights: usize,
    /// Lights that are off.
    pub lights_off: usize,
    /// Ambient lights.
    pub ambient_lights: usize,
    /// Directional lights.
    pub directional_lights: usize,
    /// Point lights without a cone.
    pub point_lights: usize,
    /// Point and directional lights with a cone.
    pub spot_lights: usize,
    /// Baked whole.
    pub static_lights: usize,
    /// Baked but for their direct light.
    pub mixed_lights: usize,
    /// Not baked.
    pub dynamic_lights: usize,
    /// Lights that ask for a shadow.
    pub shadow_lights: usize,
    /// Whether there is global ambient light.
    pub global_ambient: bool,
    /// Whether there is a sky.
    pub sky: bool,
    /// Entities with a mesh that is shown.
    pub meshes: usize,
    /// Different meshes among them.
    pub distinct_meshes: usize,
    /// Triangles of all shown meshes.
    pub triangles: usize,
    /// Meshes that are hidden.
    pub hidden: usize,
    /// Meshes that the baker lights.
    pub static_objects: usize,
    /// Meshes that move.
    pub dynamic_objects: usize,
    /// Meshes with a lightmap.
    pub lightmapped: usize,
    /// Lightmap images.
    pub lightmap_images: usize,
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
    /// Texture images.
    pub texture_images: usize,
    /// Meshes with vertex colours.
    pub vertex_colors: usize,
    /// Meshes that are cut out by alpha.
    pub alpha_mask: usize,
    /// Meshes that are blended.
    pub alpha_blend: usize,
    /// Meshes whose back is drawn.
    pub two_sided: usize,
    /// Two-sided meshes with a material of its own on the back.
    pub back_materials: usize,
    /// Meshes that take no light.
    pub unlit: usize,
    /// Meshes that emit light.
    pub emissive: usize,
    /// Emissive meshes whose faces light others in real time.
    pub emissive_lights: usize,
    /// Meshes with a highlight.
    pub specular: usize,
    /// Meshes that mirror.
    pub mirrors: usize,
    /// Meshes that light passes through.
    pub transmission: usize,
    /// Meshes shaded per face.
    pub flat: usize,
    /// Meshes shaded per vertex.
    pub gouraud: usize,
    /// Meshes shaded per fragment.
    pub phong: usize,
    /// Lit meshes with a specular model of their own.
    pub own_reflection: usize,
    /// Lit meshes with a highlight, by the name of their specular model; models that nothing uses are missing.
    pub reflection_models: BTreeMap<&'static str, usize>,
    /// Whether there is fog.
    pub fog: bool,
    /// Cameras.
    pub cameras: usize,
}

/// One effect, whether the scene calls for it, and why.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct CensusLine {
    /// The effect.
    pub effect: &'static str,
    /// Whether the scene calls for it.
    pub called_for: bool,
    /// How many things call for it.
    pub count: usize,
    /// Why, or why not.
    pub reason: String,
}

/// Whether either side that is seen has a specular coefficient.
fn has_highlight(material: &Material, settings: &SceneSettings) -> bool {
    let shines = |surface: &Surface| surface.specular != Vec3::ZERO;
    let two_sided = material.double_sided && settings.two_sided;
    shines(&material.front) || two_sided && material.back.as_ref().is_some_and(shines)
}

impl Census {
    /// Counts what is in a World.
    pub fn of(world: &mut World) -> Self {
        let settings = world.get_resource::<SceneSettings>().copied().unwrap_or_default();
        let mut census = Self {
            fog: settings.fog.is_some(),
            global_ambient: settings.ambient != Vec3::ZERO,
            sky: settings.sky != Vec3::ZERO,
            cameras: world.query::<&Camera>().iter(world).count(),
            ..Self::default()
        };
        for light in world.query::<&Light>().iter(world) {
            census.count_light(light);
        }
        census.count_meshes(world, &settings);
        census
    }

    fn count_light(&mut self, light: &Light) {
        if !light.enabled {
            self.lights_off += 1;
            return;
        }
        self.lights += 1;
        *match (light.kind, light.spot) {
            (LightKind::Ambient, _) => &mut self.ambient_lights,
            (_, Some(cone)) if !cone.is_everywhere() => &mut self.spot_lights,
            (LightKind::Directional, _) => &mut self.directional_lights,
            (LightKind::Point, _) => &mut self.point_lights,
        } += 1;
        *match light.bake {
            BakeMode::Static => &mut self.static_lights,
            BakeMode::Mixed => &mut self.mixed_lights,
            BakeMode::Dynamic => &mut self.dynamic_lights,
        } += 1;
        self.shadow_lights += usize::from(light.shadow && light.kind != LightKind::Ambient);
    }

    fn count_meshes(&mut self, world: &mut World, settings: &SceneSettings) {
        let mut meshes = HashSet::new();
        let mut lightmaps = HashSet::new();
        let mut images = HashSet::new();
        let mut query = world.query::<(
            (&Mesh, &Material, Has<Hidden>, Has<StaticObject>, Has<DynamicObject>, Has<EmissiveLight>),
            (Option<&MaterialTextures>, Option<&Lightmap>, Option<&Shading>, Option<&ReflectionModel>),
        )>();
        for ((mesh, material, hidden, fixed, moves, shines), (textures, lightmap, shading, reflection)) in
            query.iter(world)
        {
            if hidden {
                self.hidden += 1;
                continue;
            }
            self.meshes += 1;
            self.triangles += mesh.0.triangle_count();
            meshes.insert(Arc::as_ptr(&mesh.0));
            self.static_objects += usize::from(fixed && !moves);
            self.dynamic_objects += usize::from(moves);
            self.vertex_colors += usize::from(!mesh.0.colors.is_empty());
            if let Some(lightmap) = lightmap.filter(|_| !mesh.0.uv1.is_empty()) {
                self.lightmapped += 1;
                lightmaps.insert(Arc::as_ptr(&lightmap.image));
            }
            if let Some(textures) = textures {
                let roughness = textures.metallic_roughness.as_ref().map(|slot| &slot.texture);
                for (count, texture) in [
                    (&mut self.base_color_textures, textures.base_color.as_ref()),
                    (&mut self.emissive_textures, textures.emissive.as_ref()),
                    (&mut self.metallic_roughness_textures, roughness),
                    (&mut self.normal_textures, textures.normal.as_ref().map(|slot| &slot.texture)),
                    (&mut self.occlusion_textures, textures.occlusion.as_ref().map(|slot| &slot.texture)),
                ] {
                    if let Some(texture) = texture {
                        *count += 1;
                        images.insert(Arc::as_ptr(&texture.image));
                    }
                }
            }
            let emits = EmissiveLight::radiance(material) != [Vec3::ZERO; 2];
            self.emissive_lights += usize::from(shines && emits);
            self.count_material(material, settings);
            if !material.unlit {
                self.own_reflection += usize::from(reflection.is_some());
                if has_highlight(material, settings) {
                    let model = reflection.copied().unwrap_or(settings.reflection);
                    *self.reflection_models.entry(model.name()).or_default() += 1;
                }
                *match shading.copied().unwrap_or(settings.shading) {
                    Shading::Flat => &mut self.flat,
                    Shading::Gouraud => &mut self.gouraud,
                    Shading::Phong => &mut self.phong,
                } += 1;
            }
        }
        self.distinct_meshes = meshes.len();
        self.lightmap_images = lightmaps.len();
        self.texture_images = images.len();
    }

    fn count_material(&mut self, material: &Material, settings: &SceneSettings) {
        let two_sided = material.double_sided && settings.two_sided;
        let back = material.back.as_ref().filter(|_| two_sided);
        let emits = |surface: &Surface| surface.emission != Vec3::ZERO;
        self.alpha_mask += usize::from(matches!(material.alpha_mode, AlphaMode::Mask { .. }));
        self.alpha_blend += usize::from(material.alpha_mode == AlphaMode::Blend);
        self.two_sided += usize::from(two_sided);
        self.back_materials += usize::from(back.is_some());
        self.unlit += usize::from(material.unlit);
        self.emissive += usize::from(emits(&material.front) || back.is_some_and(emits));
        self.specular += usize::from(!material.unlit && has_highlight(material, settings));
        self.mirrors += usize::from(material.mirror != Vec3::ZERO);
        self.transmission += usize::from(material.transmission != Vec3::ZERO);
    }

    /// Every effect in the order in which a frame is made, called for or not.
    pub fn lines(&self) -> Vec<CensusLine> {
        let line = |effect, count: usize, singular: &str, plural: &str, none: &str| CensusLine {
            effect,
            called_for: count > 0,
            count,
            reason: match count {
                0 => none.to_owned(),
                1 => format!("1 {singular}"),
                count => format!("{count} {plural}"),
            },
        };
        let mesh = |effect, count, what: &str, none: &str| {
            line(effect, count, &format!("mesh {what}"), &format!("meshes {what}"), none)
        };
        let light = |effect, count, kind: &str| {
            let off = if self.lights_off > 0 {
                format!(" ({} lights are off)", self.lights_off)
            } else {
                String::new()
            };
            let none = format!("no {kind} light is on{off}");
            line(effect, count, &format!("{kind} light"), &format!("{kind} lights"), &none)
        };
        let model = |effect, model: ReflectionModel| {
            let count = self.reflection_models.get(model.name()).copied().unwrap_or_default();
            mesh(effect, count, "with a highlight of that model", "no highlight is of that model")
        };
        // What no frame does, however much calls for it.
        let elsewhere = |effect, count, none: &str, (singular, plural): (&str, &str), why: &str| {
            let counted = line(effect, count, singular, plural, none);
            let reason = if count > 0 { format!("{}, but {why}", counted.reason) } else { counted.reason };
            CensusLine { called_for: false, reason, ..counted }
        };
        let textured = [
            self.emissive_textures,
            self.metallic_roughness_textures,
            self.normal_textures,
            self.occlusion_textures,
        ]
        .into_iter()
        .fold(self.base_color_textures, usize::max);
        let scene = |effect, on: bool, yes: &str, no: &str| CensusLine {
            effect,
            called_for: on,
            count: usize::from(on),
            reason: (if on { yes } else { no }).to_owned(),
        };
        vec![
            mesh("meshes", self.meshes, "to draw", "no mesh is shown"),
            mesh("flat shading", self.flat, "shaded per face", "no lit mesh asks for it"),
            mesh("Gouraud shading", self.gouraud, "shaded per vertex", "no lit mesh asks for it"),
            mesh("Phong shading", self.phong, "shaded per fragment", "no lit mesh asks for it"),
            mesh(
                "own reflection models",
                self.own_reflection,
                "with another specular model than the scene",
                "all take the scene's",
            ),
            model("Phong reflection", ReflectionModel::Phong),
            model("Blinn reflection", ReflectionModel::Blinn),
            model("Blinn 4n reflection", ReflectionModel::Blinn4n),
            model("matched Blinn reflection", ReflectionModel::BlinnMatched),
            model("Torrance-Sparrow reflection", ReflectionModel::TorranceSparrow),
            scene(
                "global ambient",
                self.global_ambient,
                "the scene's ambient light is not black",
                "the scene's ambient light is black",
            ),
            scene(
                "sky",
                self.sky,
                "the scene's sky shines: as background, and as ambient light of what has no lightmap",
                "the scene's sky is black",
            ),
            light("ambient lights", self.ambient_lights, "ambient"),
            light("directional lights", self.directional_lights, "directional"),
            light("point lights", self.point_lights, "point"),
            light("spot lights", self.spot_lights, "spot"),
            mesh(
                "polygon lights",
                self.emissive_lights,
                "whose emissive faces light others",
                "no emissive mesh asks to light others",
            ),
            light("dynamic lights", self.dynamic_lights, "dynamic"),
            light("mixed lights", self.mixed_lights, "mixed"),
            light("static lights", self.static_lights, "static"),
            line(
                "shadows",
                self.shadow_lights,
                "light asks for one",
                "lights ask for one",
                "no light that is on asks for one",
            ),
            mesh("specular", self.specular, "with a highlight", "every specular coefficient is 0"),
            mesh("emission", self.emissive, "with emission", "no material emits"),
            mesh("lightmaps", self.lightmapped, "with a lightmap", "no mesh has a lightmap"),
            mesh("textures", textured, "with a textured material", "no material has a texture"),
            mesh("base colour textures", self.base_color_textures, "with one", "no material has one"),
            mesh("emissive textures", self.emissive_textures, "with one", "no material has one"),
            mesh(
                "metallic-roughness textures",
                self.metallic_roughness_textures,
                "with one",
                "no material has one",
            ),
            mesh("normal textures", self.normal_textures, "with one", "no material has one"),
            mesh("occlusion textures", self.occlusion_textures, "with one", "no material has one"),
            mesh("vertex colours", self.vertex_colors, "with COLOR_0", "no mesh has COLOR_0"),
            mesh("alpha mask", self.alpha_mask, "cut out by alpha", "no material is masked"),
            mesh("alpha blending", self.alpha_blend, "blended", "no material is blended"),
            mesh("two-sided", self.two_sided, "lit from both sides", "no surface is lit from both sides"),
            mesh(
                "back materials",
                self.back_materials,
                "with a material on the back",
                "no visible back has a material of its own",
            ),
            mesh("unlit", self.unlit, "taking no light", "every material takes light"),
            elsewhere(
                "mirrors",
                self.mirrors,
                "every mirror coefficient is 0",
                ("mesh with a mirror coefficient", "meshes with a mirror coefficient"),
                "frames do not reflect",
            ),
            elsewhere(
                "transmission",
                self.transmission,
                "every transmission coefficient is 0",
                ("mesh that light passes through", "meshes that light passes through"),
                "frames do not bend light",
            ),
            scene("fog", self.fog, "the scene has fog", "the scene has no fog"),
            mesh("dynamic objects", self.dynamic_objects, "marked as moving", "nothing moves"),
            mesh("static objects", self.static_objects, "for the baker", "no mesh is static"),
        ]
    }
}
