//! The baker's input as plain data: placed meshes with their materials, lights, the sky, and the places of moving
//! objects. `from_world` reads it from a World; callers without a World fill it in themselves. `triangles` derives from
//! it the scene that the baker computes with.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{Light, LightKind, Material};
use lumbre_scene::MaterialTextures;

use super::Canonical;
use crate::options::Probes;
use crate::{BakeError, BakeOptions};

/// A mesh placed in the world, with its material.
#[derive(Clone, Debug, Default)]
pub struct PlacedPrimitive {
    /// The mesh, in metres in its local space. It keeps its `uv1` as lightmap coordinates if they lie in [0, 1] without
    /// overlaps; otherwise it is unwrapped.
    pub mesh: Arc<TriangleMesh>,
    /// Its reflectance, emission and opacity. An unlit one absorbs all light; a World's unlit meshes are left out instead.
    pub material: Material,
    /// Images that the material's factors are multiplied by.
    pub textures: Option<MaterialTextures>,
    /// From the mesh's local space to the world.
    pub transform: DAffine3,
    /// The renderer draws its emission as polygon lights in each frame, so probes leave that light out; lightmaps
    /// include it.
    pub lights_frames: bool,
}

/// Meshes that share one lightmap, as the primitives of a glTF node do.
#[derive(Clone, Debug)]
pub struct SceneObject {
    /// For warnings and file names.
    pub name: String,
    /// At least one.
    pub primitives: Vec<PlacedPrimitive>,
    /// Its texel density (texels per metre) relative to the rest of the scene: positive and finite, usually 1.
    pub lightmap_scale: f64,
}

/// A point, spot or directional light placed in the world.
#[derive(Clone, Debug)]
pub struct PlacedLight {
    /// Its kind, colour and cone. With `BakeMode::Static` all of its light is baked, with `Mixed` only its bounces.
    pub light: Light,
    /// Position in the world, metres.
    pub position: DVec3,
    /// Unit vector along which it shines.
    pub axis: DVec3,
}

/// The input of a bake as plain data. The order of objects and lights decides the random numbers, so the same order
/// gives the same bits.
#[derive(Clone, Debug, Default)]
pub struct StaticScene {
    /// The static geometry: everything that receives, reflects, emits or blocks light.
    pub objects: Vec<SceneObject>,
    /// The lights to bake.
    pub lights: Vec<PlacedLight>,
    /// Radiance of the sky, W/(m² sr), not negative.
    pub sky: Vec3,
    /// Points that bound the moving objects, metres; the probe grid extends over them. `None` if nothing moves.
    pub moving: Option<Vec<DVec3>>,
}

impl SceneObject {
    /// An object at the scene's usual texel density.
    pub fn new(name: impl Into<String>, primitives: Vec<PlacedPrimitive>) -> Self {
        Self { name: name.into(), primitives, lightmap_scale: 1.0 }
    }
}

impl PlacedLight {
    /// Whether it has a size: an angle for directional lights, a radius for the others. Each kind ignores the other
    /// value.
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
    /// Validates the scene, removes lights that are not baked, and clamps the sky to non-negative finite radiance.
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

    /// The canonical space that a bake of it computes in.
    pub(crate) fn space(&self) -> Canonical {
        Canonical::of(
            self.primitives().flat_map(|primitive| world_points(&primitive.transform, &primitive.mesh)),
        )
    }

    /// `Ok` if probes are to be baked, else the reason why not.
    pub(crate) fn calls_for_probes(&self, options: &BakeOptions) -> Result<(), &'static str> {
        match options.probes {
            Probes::Never => Err("they are switched off"),
            Probes::Automatic if self.moving.is_none() => Err("nothing moves"),
            Probes::Automatic | Probes::Always => Ok(()),
        }
    }

    /// The points that bound the moving objects; empty if nothing moves.
    pub(crate) fn moving_points(&self) -> &[DVec3] {
        self.moving.as_deref().unwrap_or_default()
    }
}

/// The positions of a mesh's vertices in the world.
pub(crate) fn world_points<'a>(
    transform: &'a DAffine3,
    mesh: &'a TriangleMesh,
) -> impl Iterator<Item = DVec3> + 'a {
    mesh.positions.iter().map(|p| transform.transform_point3(p.as_dvec3()))
}
