//! Reads the World: static meshes, grouped into objects of one lightmap each, and the lights that are baked.

use std::collections::BTreeMap;
use std::sync::Arc;

use bevy_ecs::prelude::*;
use bevy_ecs::system::RunSystemOnce;
use glam::{DAffine3, DVec3, Vec3};
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{BakeMode, Light, LightKind, Material};
use lumbre_scene::{
    ChildOf, DynamicObject, GlobalTransform, MaterialTextures, Mesh, Name, Primitive, SceneSettings,
    StaticObject, hidden_entities, propagate_transforms,
};

use crate::{BakeError, UnwrappedFrom};

/// A mesh with its material: one entity.
#[derive(Clone, Debug)]
pub(crate) struct PlacedPrimitive {
    pub entity: Entity,
    pub mesh: Arc<TriangleMesh>,
    pub material: Material,
    pub textures: Option<MaterialTextures>,
    /// Mesh to world.
    pub transform: DAffine3,
}

/// What shares one lightmap: the primitives of a glTF node, or one entity made in code.
#[derive(Clone, Debug)]
pub(crate) struct Object {
    pub name: String,
    pub primitives: Vec<PlacedPrimitive>,
}

/// A point, spot or directional light in its place.
#[derive(Clone, Debug)]
pub(crate) struct PlacedLight {
    pub light: Light,
    pub position: DVec3,
    /// Unit vector along which it shines.
    pub axis: DVec3,
}

impl PlacedLight {
    /// Whether it has a size: lights in the sky an angle, others a radius. The other number of each is not read.
    pub fn is_sized(&self) -> bool {
        match self.light.kind {
            LightKind::Directional => self.light.angle > 0.0,
            _ => self.light.radius > 0.0,
        }
    }
}

/// The static objects, in an order that depends on the entities only.
pub(crate) fn collect(world: &mut World) -> Result<Vec<Object>, BakeError> {
    // The only way to fail is a system that cannot run; the transforms are then as the caller left them.
    if world.run_system_once(propagate_transforms).is_err() {
        tracing::warn!("transforms could not be propagated; baking with those found");
    }
    let mut parts: BTreeMap<Entity, Vec<(usize, PlacedPrimitive)>> = BTreeMap::new();
    let hidden = hidden_entities(world);
    let mut query = world.query_filtered::<(
        Entity,
        &Mesh,
        &Material,
        Option<&MaterialTextures>,
        Option<&GlobalTransform>,
        Option<&Primitive>,
        Option<&ChildOf>,
        Option<&UnwrappedFrom>,
    ), (With<StaticObject>, Without<DynamicObject>)>();
    for (entity, mesh, material, textures, transform, primitive, parent, unwrapped) in query.iter(world) {
        if hidden.contains(&entity) || under_a_dynamic_object(world, parent) {
            continue;
        }
        let (mesh, textures) = UnwrappedFrom::read(unwrapped, mesh, textures);
        let part = PlacedPrimitive {
            entity,
            mesh,
            material: material.clone(),
            textures,
            transform: transform.map_or(DAffine3::IDENTITY, |transform| transform.0),
        };
        let (owner, index) = match (primitive, parent) {
            (Some(primitive), Some(parent)) => (parent.parent(), primitive.index),
            _ => (entity, 0),
        };
        parts.entry(owner).or_default().push((index, part));
    }
    let mut objects = Vec::with_capacity(parts.len());
    for (owner, mut parts) in parts {
        parts.sort_by_key(|(index, part)| (*index, part.entity));
        let name =
            world.get::<Name>(owner).map_or_else(|| format!("object {owner}"), |name| name.to_string());
        for (_, part) in &parts {
            part.mesh.validate().map_err(|source| BakeError::Mesh { object: name.clone(), source })?;
        }
        objects.push(Object { name, primitives: parts.into_iter().map(|(_, part)| part).collect() });
    }
    Ok(objects)
}

/// Whether something moves with what is above it.
pub(crate) fn under_a_dynamic_object(world: &World, parent: Option<&ChildOf>) -> bool {
    let mut above = parent.map(ChildOf::parent);
    while let Some(entity) = above {
        if world.get::<DynamicObject>(entity).is_some() {
            return true;
        }
        above = world.get::<ChildOf>(entity).map(ChildOf::parent);
    }
    false
}

/// The sky's radiance, W/(m² sr); black where the scene says nothing, or nothing that could be light.
pub(crate) fn sky(world: &World) -> Vec3 {
    let sky = world.get_resource::<SceneSettings>().map_or(Vec3::ZERO, |settings| settings.sky);
    if sky.is_finite() { sky.max(Vec3::ZERO) } else { Vec3::ZERO }
}

/// The enabled lights that are baked whole or for their bounces, in the order of their entities.
pub(crate) fn lights(world: &mut World) -> Vec<PlacedLight> {
    let mut query = world.query::<(Entity, &Light, Option<&GlobalTransform>)>();
    let mut found: Vec<_> = query
        .iter(world)
        .filter(|(_, light, _)| {
            light.enabled
                && light.bake != BakeMode::Dynamic
                && light.kind != LightKind::Ambient
                && light.diffuse.max_element() > 0.0
        })
        .map(|(entity, light, transform)| {
            let transform = transform.copied().unwrap_or_default();
            let light = PlacedLight {
                light: light.clone(),
                position: transform.translation(),
                axis: transform.forward(),
            };
            (entity, light)
        })
        .collect();
    found.sort_by_key(|(entity, _)| *entity);
    found.into_iter().map(|(_, light)| light).collect()
}
