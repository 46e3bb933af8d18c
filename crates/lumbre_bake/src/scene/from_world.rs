//! Reads a World into a [`StaticScene`]: static meshes grouped into objects of one lightmap each, the lights to bake,
//! and the places of dynamic objects.

use std::collections::BTreeMap;

use bevy_ecs::prelude::*;
use bevy_ecs::system::RunSystemOnce;
use glam::{DAffine3, DVec3, Vec3};
use lumbre_optics::{Light, Material};
use lumbre_scene::{
    ChildOf, DynamicObject, EmissiveLight, GlobalTransform, LightmapScale, MaterialTextures, Mesh, Name,
    Primitive, SceneSettings, StaticObject, hidden_entities, propagate_transforms,
};

use super::baked_meshes::{baked_meshes, has_dynamic_ancestor};
use super::{PlacedLight, PlacedPrimitive, SceneObject, StaticScene, world_points};
use crate::UnwrappedFrom;

/// The entities behind a scene: for each object, those of its primitives.
pub(crate) type Entities = Vec<Vec<Entity>>;

/// Updates the World's global transforms and reads the scene.
pub(crate) fn from_world(world: &mut World) -> (StaticScene, Entities) {
    // This fails only if the system cannot run; the transforms then stay as the caller left them.
    if world.run_system_once(propagate_transforms).is_err() {
        tracing::warn!("transforms could not be propagated; baking with those found");
    }
    let (objects, entities) = objects(world);
    let sky = world.get_resource::<SceneSettings>().map_or(Vec3::ZERO, |settings| settings.sky);
    (StaticScene { objects, lights: lights(world), sky, moving: moving(world) }, entities)
}

/// The static objects, in an order that depends on the entities alone.
fn objects(world: &mut World) -> (Vec<SceneObject>, Entities) {
    struct FoundPrimitive {
        index: usize,
        entity: Entity,
        primitive: PlacedPrimitive,
        scale: Option<f64>,
    }
    let mut by_owner: BTreeMap<Entity, Vec<FoundPrimitive>> = BTreeMap::new();
    let baked = baked_meshes(world);
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
        if !baked.contains(&entity) {
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
        by_owner.entry(owner).or_default().push(FoundPrimitive { index, entity, primitive, scale });
    }
    let to_object = |(owner, mut found): (Entity, Vec<FoundPrimitive>)| {
        found.sort_by_key(|primitive| (primitive.index, primitive.entity));
        let name =
            world.get::<Name>(owner).map_or_else(|| format!("object {owner}"), |name| name.to_string());
        // A map has one density: the largest that any primitive requests. `StaticScene::checked` rejects NaN later.
        let scale = found.iter().filter_map(|primitive| primitive.scale).max_by(f64::total_cmp);
        let entities = found.iter().map(|primitive| primitive.entity).collect();
        let primitives = found.into_iter().map(|found| found.primitive).collect();
        (SceneObject { name, primitives, lightmap_scale: scale.unwrap_or(1.0) }, entities)
    };
    by_owner.into_iter().map(to_object).unzip()
}

/// The lights that are baked, fully or for their bounces only, in the order of their entities.
fn lights(world: &mut World) -> Vec<PlacedLight> {
    let mut query = world.query::<(Entity, &Light, Option<&GlobalTransform>)>();
    let baked = query.iter(world).filter(|(_, light, _)| PlacedLight::is_baked(light));
    let mut lights: Vec<_> = baked
        .map(|(entity, light, transform)| {
            let transform = transform.copied().unwrap_or_default();
            let (position, axis) = (transform.translation(), transform.forward());
            (entity, PlacedLight { light: light.clone(), position, axis })
        })
        .collect();
    lights.sort_by_key(|(entity, _)| *entity);
    lights.into_iter().map(|(_, light)| light).collect()
}

/// The vertices of everything that moves and is lit, or `None` if nothing is.
fn moving(world: &mut World) -> Option<Vec<DVec3>> {
    let hidden = hidden_entities(world);
    let mut query = world.query::<(
        Entity,
        &Mesh,
        Option<&GlobalTransform>,
        Option<&Material>,
        Has<DynamicObject>,
        Option<&ChildOf>,
    )>();
    let is_lit = |material: Option<&Material>| material.is_none_or(|material| !material.unlit);
    let lit = query.iter(world).filter(|object| !hidden.contains(&object.0) && is_lit(object.3));
    let moving = lit.filter(|(.., dynamic, parent)| *dynamic || has_dynamic_ancestor(world, *parent));
    moving.fold(None, |points, (_, mesh, transform, ..)| {
        let mut points = points.unwrap_or_default();
        points.extend(world_points(&transform.copied().unwrap_or_default().0, &mesh.0));
        Some(points)
    })
}
