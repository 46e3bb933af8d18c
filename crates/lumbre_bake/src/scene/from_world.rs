//! Reads a World: static meshes, grouped into objects of one lightmap each, the lights that are baked, and where something moves.

use std::collections::BTreeMap;

use bevy_ecs::prelude::*;
use bevy_ecs::system::RunSystemOnce;
use glam::{DAffine3, DVec3, Vec3};
use lumbre_optics::{Light, Material};
use lumbre_scene::{
    ChildOf, DynamicObject, EmissiveLight, GlobalTransform, LightmapScale, MaterialTextures, Mesh, Name,
    Primitive, SceneSettings, StaticObject, hidden_entities, propagate_transforms,
};

use super::{PlacedLight, PlacedPrimitive, SceneObject, StaticScene, world_points};
use crate::UnwrappedFrom;

/// The entities behind a scene: of each object, those of its primitives.
pub(crate) type Entities = Vec<Vec<Entity>>;

/// Reads the World, whose global transforms are brought up to date.
pub(crate) fn from_world(world: &mut World) -> (StaticScene, Entities) {
    // The only way to fail is a system that cannot run; the transforms are then as the caller left them.
    if world.run_system_once(propagate_transforms).is_err() {
        tracing::warn!("transforms could not be propagated; baking with those found");
    }
    let (objects, entities) = objects(world);
    let sky = world.get_resource::<SceneSettings>().map_or(Vec3::ZERO, |settings| settings.sky);
    (StaticScene { objects, lights: lights(world), sky, moving: moving(world) }, entities)
}

/// The static objects, in an order that depends on the entities only.
fn objects(world: &mut World) -> (Vec<SceneObject>, Entities) {
    struct Part {
        index: usize,
        entity: Entity,
        primitive: PlacedPrimitive,
        scale: Option<f64>,
    }
    let mut parts: BTreeMap<Entity, Vec<Part>> = BTreeMap::new();
    let hidden = hidden_entities(world);
    let mut query = world.query_filtered::<(
        Entity,
        (&Mesh, &Material, Option<&MaterialTextures>),
        Option<&GlobalTransform>,
        Option<&Primitive>,
        Option<&ChildOf>,
        Option<&UnwrappedFrom>,
        (Has<EmissiveLight>, Option<&LightmapScale>),
    ), (With<StaticObject>, Without<DynamicObject>)>();
    for (
        entity,
        (mesh, material, textures),
        transform,
        primitive,
        parent,
        unwrapped,
        (lights_frames, scale),
    ) in query.iter(world)
    {
        if hidden.contains(&entity) || under_a_dynamic_object(world, parent) {
            continue;
        }
        let (mesh, textures) = UnwrappedFrom::read(unwrapped, mesh, textures);
        let (owner, index) = match (primitive, parent) {
            (Some(primitive), Some(parent)) => (parent.parent(), primitive.index),
            _ => (entity, 0),
        };
        let transform = transform.map_or(DAffine3::IDENTITY, |transform| transform.0);
        let primitive =
            PlacedPrimitive { mesh, material: material.clone(), textures, transform, lights_frames };
        let scale = scale.map(|scale| scale.0);
        parts.entry(owner).or_default().push(Part { index, entity, primitive, scale });
    }
    let of_owner = |(owner, mut parts): (Entity, Vec<Part>)| {
        parts.sort_by_key(|part| (part.index, part.entity));
        let name =
            world.get::<Name>(owner).map_or_else(|| format!("object {owner}"), |name| name.to_string());
        // One map has one density: the largest that is asked for. What is no number is no order either, and is refused later.
        let scale = parts.iter().filter_map(|part| part.scale).max_by(f64::total_cmp);
        let entities = parts.iter().map(|part| part.entity).collect();
        let primitives = parts.into_iter().map(|part| part.primitive).collect();
        (SceneObject { name, primitives, lightmap_scale: scale.unwrap_or(1.0) }, entities)
    };
    parts.into_iter().map(of_owner).unzip()
}

/// The lights that are baked whole or for their bounces, in the order of their entities.
fn lights(world: &mut World) -> Vec<PlacedLight> {
    let mut query = world.query::<(Entity, &Light, Option<&GlobalTransform>)>();
    let baked = query.iter(world).filter(|(_, light, _)| PlacedLight::is_baked(light));
    let mut found: Vec<_> = baked
        .map(|(entity, light, transform)| {
            let transform = transform.copied().unwrap_or_default();
            let (position, axis) = (transform.translation(), transform.forward());
            (entity, PlacedLight { light: light.clone(), position, axis })
        })
        .collect();
    found.sort_by_key(|(entity, _)| *entity);
    found.into_iter().map(|(_, light)| light).collect()
}

/// The corners of what moves, if anything does.
fn moving(world: &mut World) -> Option<Vec<DVec3>> {
    let hidden = hidden_entities(world);
    let mut query =
        world.query::<(Entity, &Mesh, Option<&GlobalTransform>, Has<DynamicObject>, Option<&ChildOf>)>();
    let shown = query.iter(world).filter(|object| !hidden.contains(&object.0));
    let moving = shown.filter(|(.., dynamic, parent)| *dynamic || under_a_dynamic_object(world, *parent));
    moving.fold(None, |points, (_, mesh, transform, ..)| {
        let mut points = points.unwrap_or_default();
        points.extend(world_points(&transform.copied().unwrap_or_default().0, &mesh.0));
        Some(points)
    })
}

/// Whether something moves with what is above it.
fn under_a_dynamic_object(world: &World, parent: Option<&ChildOf>) -> bool {
    let mut above = parent.map(ChildOf::parent);
    while let Some(entity) = above {
        if world.get::<DynamicObject>(entity).is_some() {
            return true;
        }
        above = world.get::<ChildOf>(entity).map(ChildOf::parent);
    }
    false
}
