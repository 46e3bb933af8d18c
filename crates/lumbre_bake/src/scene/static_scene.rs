//! What is baked, as plain data: meshes in their places with their materials, lights, the sky, and where something moves. Whoever has no World fills
//! it in; `from_world` reads it from one. Not the scene as light meets it: that is `triangles`.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{Light, LightKind, Material};
use lumbre_scene::MaterialTextures;

use super::{Canonical, world_points};
use crate::options::Probes;
use crate::{BakeError, BakeOptions};

/// A mesh in its place, with its material.
#[derive(Clone, Debug, Default)]
pub struct PlacedPrimitive {
    /// Its points, in metres of its own space; with `uv1` in [0, 1] without overlaps it keeps these coordinates, else it is unwrapped.
    pub mesh: Arc<TriangleMesh>,
    /// What it reflects, emits and lets through.
    pub material: Material,
    /// Images that the material is multiplied by.
    pub textures: Option<MaterialTextures>,
    /// From the mesh's space to the world's.
    pub transform: DAffine3,
    /// Frames show its emission as polygon lights, so that probes leave it out; lightmaps do not.
    pub lights_frames: bool,
}

/// Meshes that share one lightmap, as the primitives of a glTF node do.
#[derive(Clone, Debug)]
pub struct SceneObject {
    /// For warnings and file names.
    pub name: String,
    /// At least one.
    pub primitives: Vec<PlacedPrimitive>,
    /// Texels along one metre of it, relative to the rest of the scene: positive and finite, usually 1.
    pub lightmap_scale: f64,
}

/// A point, spot or directional light in its place.
#[derive(Clone, Debug)]
pub struct PlacedLight {
    /// Its kind, colour and cone. With `BakeMode::Static` all its light is baked, with `Mixed` its bounces.
    pub light: Light,
    /// Metres.
    pub position: DVec3,
    /// Unit vector along which it shines.
    pub axis: DVec3,
}

/// What is baked, in plain data. The order of objects and lights decides the random numbers: the same order gives the same bits.
#[derive(Clone, Debug, Default)]
pub struct StaticScene {
    /// Everything that is lit and that light meets.
    pub objects: Vec<SceneObject>,
    /// The lights that are baked.
    pub lights: Vec<PlacedLight>,
    /// Radiance of the sky, W/(m² sr), not negative.
    pub sky: Vec3,
    /// Points around what moves, metres: the probes reach as far. None where nothing moves.
    pub moving: Option<Vec<DVec3>>,
}

impl SceneObject {
    /// A name and what is drawn under it, at the density of the rest.
    pub fn new(name: impl Into<String>, primitives: Vec<PlacedPrimitive>) -> Self {
        Self { name: name.into(), primitives, lightmap_scale: 1.0 }
    }
}

impl PlacedLight {
    /// Whether it has a size: lights in the sky an angle, others a radius. The other number of each is not read.
    pub(crate) fn is_sized(&self) -> bool {
        match self.light.kind {
            LightKind::Directional => self.light.angle > 0.0,
            _ => self.light.radius > 0.0,
        }
    }

    /// Whether any of its light is baked.
    pub(crate) fn is_baked(light: &Light) -> bool {
        light.enabled
            && light.bake != lumbre_optics::BakeMode::Dynamic
            && light.kind != LightKind::Ambient
            && light.diffuse.max_element() > 0.0
    }
}

impl StaticScene {
    /// The scene as it is baked: without lights that are not baked, and with a sky that is light.
    ///
    /// # Errors
    /// [`BakeError`], which names the object.
    pub(crate) fn checked(mut self) -> Result<Self, BakeError> {
        for object in &self.objects {
            for primitive in &object.primitives {
                primitive
                    .mesh
                    .validate()
                    .map_err(|source| BakeError::Mesh { object: object.name.clone(), source })?;
            }
            if !(object.lightmap_scale.is_finite() && object.lightmap_scale > 0.0) {
                let (object, found) = (object.name.clone(), object.lightmap_scale);
                return Err(BakeError::LightmapScale { object, found: found.to_string() });
            }
        }
        self.lights.retain(|placed| PlacedLight::is_baked(&placed.light));
        self.sky = if self.sky.is_finite() { self.sky.max(Vec3::ZERO) } else { Vec3::ZERO };
        Ok(self)
    }

    /// All primitives, in the order of their surfaces.
    pub(crate) fn primitives(&self) -> impl Iterator<Item = &PlacedPrimitive> {
        self.objects.iter().flat_map(|object| &object.primitives)
    }

    /// The space in which a bake of it computes.
    pub(crate) fn space(&self) -> Canonical {
        Canonical::of(self.primitives().flat_map(|part| world_points(&part.transform, &part.mesh)))
    }

    /// Whether probes are called for, or why not.
    pub(crate) fn calls_for_probes(&self, options: &BakeOptions) -> Result<(), &'static str> {
        match options.probes {
            Probes::Never => Err("they are switched off"),
            Probes::Automatic if self.moving.is_none() => Err("nothing moves"),
            Probes::Automatic | Probes::Always => Ok(()),
        }
    }

    /// The points around what moves.
    pub(crate) fn moving_points(&self) -> &[DVec3] {
        self.moving.as_deref().unwrap_or_default()
    }
}
