//! The census in words: for each effect a frame may have, whether the scene uses it, and why.

use lumbre_optics::ReflectionModel;
use serde::Serialize;

use super::Census;

/// One effect, whether the scene uses it, and why.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct CensusLine {
    /// Name of the effect.
    pub effect: &'static str,
    /// Whether the scene uses it.
    pub called_for: bool,
    /// How many lights, meshes or settings use it.
    pub count: usize,
    /// Why it is used or not, as text.
    pub reason: String,
}

impl Census {
    /// The line on irradiance volumes: what they light, why there is none, or that one is missing.
    fn volumes(&self) -> CensusLine {
        let count = |count: usize, singular: &str, plural: &str| match count {
            1 => format!("1 {singular}"),
            count => format!("{count} {plural}"),
        };
        let volumes = count(self.irradiance_volumes, "volume", "volumes");
        let lit = count(self.lit_by_volume, "mesh", "meshes");
        let moving = count(self.dynamic_objects, "mesh moves", "meshes move");
        let reason = match (self.lit_by_volume, self.irradiance_volumes, self.dynamic_objects) {
            (1.., ..) => format!("{lit} without a lightmap, lit by {volumes}"),
            (0, 1.., _) => format!("{volumes}, and no lit mesh without a lightmap"),
            (0, 0, 1..) => format!("no volume, though {moving}: `lumbre bake` puts one into the file"),
            (0, 0, 0) => "no volume, and nothing moves".to_owned(),
        };
        let count = self.lit_by_volume;
        CensusLine { effect: "irradiance volumes", called_for: count > 0, count, reason }
    }

    /// One line for every effect a frame may have, used or not, in the order in which a frame is built.
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
            let off = if self.lights.lights_off > 0 {
                format!(" ({} lights are off)", self.lights.lights_off)
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
                "shading by need",
                self.shaded_by_need,
                "shaded as rarely as an error allows",
                "no lit mesh asks for it",
            ),
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
            light("ambient lights", self.lights.ambient_lights, "ambient"),
            light("directional lights", self.lights.directional_lights, "directional"),
            light("point lights", self.lights.point_lights, "point"),
            light("spot lights", self.lights.spot_lights, "spot"),
            mesh(
                "polygon lights",
                self.emissive_lights,
                "whose emissive faces light others",
                "no emissive mesh asks to light others",
            ),
            light("dynamic lights", self.lights.dynamic_lights, "dynamic"),
            light("mixed lights", self.lights.mixed_lights, "mixed"),
            light("static lights", self.lights.static_lights, "static"),
            line(
                "shadows",
                self.lights.shadow_lights,
                "light asks for one",
                "lights ask for one",
                "no light that is on asks for one",
            ),
            mesh("specular", self.specular, "with a highlight", "every specular coefficient is 0"),
            mesh("emission", self.emissive, "with emission", "no material emits"),
            mesh("lightmaps", self.lightmapped, "with a lightmap", "no mesh has a lightmap"),
            self.volumes(),
            mesh(
                "metals under baked light",
                self.baked_metals,
                "of metal in baked light, which shows by the albedo of its highlight",
                "no metal has baked light",
            ),
            mesh("textures", self.textured, "with a textured material", "no material has a texture"),
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
            mesh("refraction", self.refractive, "that light passes through", "light passes through no mesh"),
            mesh(
                "planar mirrors",
                self.planar_mirrors,
                "mirroring in a plane",
                "no flat opaque mesh mirrors",
            ),
            scene("fog", self.fog, "the scene has fog", "the scene has no fog"),
            mesh("dynamic objects", self.dynamic_objects, "marked as moving", "nothing moves"),
            mesh("static objects", self.static_objects, "for the baker", "no lit mesh is static"),
        ]
    }
}
