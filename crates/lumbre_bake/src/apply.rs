//! Writes a finished bake into the World: meshes with `uv1`, lightmaps, and the irradiance volume for moving objects.
//! Apart from global transforms, which `from_world` updates, nothing else in this crate changes the World.

use std::collections::HashSet;
use std::sync::Arc;

use bevy_ecs::prelude::{Entity, With, World};
use lumbre_scene::{
    Children, IrradianceVolume, Lightmap, Mesh, Name, SeparateLight, Transform, update_transforms,
};

use crate::UnwrappedFrom;
use crate::baked_scene::BakedScene;
use crate::finish::{BakedObject, TexelErrors};
use crate::scene::{Entities, StaticScene};

/// Gives every object its lightmap and removes those of earlier bakes from all other entities; from every entity, if
/// nothing was baked.
pub(crate) fn apply(world: &mut World, scene: &StaticScene, entities: &Entities, baked: &mut BakedScene) {
    let lit = if baked.objects.is_empty() { &[][..] } else { entities };
    remove_stale_lightmaps(world, lit);
    for ((object, entities), baked_object) in scene.objects.iter().zip(lit).zip(&baked.objects) {
        let map = &baked.maps[baked_object.map];
        let BakedObject { meshes, textures, .. } = baked_object;
        for (((primitive, &entity), mesh), textures) in
            object.primitives.iter().zip(entities).zip(meshes).zip(textures)
        {
            let Ok(mut entity) = world.get_entity_mut(entity) else { continue };
            if let Some(textures) = textures.as_ref().filter(|textures| entity.get() != Some(*textures)) {
                entity.insert(textures.clone());
            }
            if Arc::ptr_eq(&primitive.mesh, mesh) {
                entity.remove::<UnwrappedFrom>();
            } else {
                let source = (Arc::clone(&primitive.mesh), primitive.textures.clone());
                entity.insert(UnwrappedFrom::new(source, (Arc::clone(mesh), textures.clone())));
            }
            if !entity.get::<Mesh>().is_some_and(|current| Arc::ptr_eq(&current.0, mesh)) {
                entity.insert(Mesh(Arc::clone(mesh)));
            }
            entity.insert((Lightmap { image: Arc::clone(&map.image) }, map.errors.clone()));
            match &map.separate {
                Some(separate) => entity.insert(separate.clone()),
                None => entity.remove::<SeparateLight>(),
            };
        }
    }
    replace_volume(world, baked.volume.take());
}

/// Removes the lightmaps of an earlier bake from all entities but those of `lit`, whose light would otherwise count
/// twice.
fn remove_stale_lightmaps(world: &mut World, lit: &[Vec<Entity>]) {
    let lit: HashSet<_> = lit.iter().flatten().collect();
    let mut mapped = world.query_filtered::<Entity, With<Lightmap>>();
    let stale: Vec<Entity> = mapped.iter(world).filter(|entity| !lit.contains(entity)).collect();
    for entity in stale {
        world.entity_mut(entity).remove::<(Lightmap, TexelErrors, SeparateLight)>();
    }
}

/// Spawns the irradiance volume, if there is one, and removes those of earlier bakes.
fn replace_volume(world: &mut World, volume: Option<(Transform, IrradianceVolume)>) {
    let mut query = world.query_filtered::<Entity, With<IrradianceVolume>>();
    let stale: Vec<Entity> = query.iter(world).collect();
    for entity in stale {
        // Children are not the bake's to despawn.
        if world.get::<Children>(entity).is_some_and(|children| !children.is_empty()) {
            world.entity_mut(entity).remove::<IrradianceVolume>();
        } else {
            world.despawn(entity);
        }
    }
    if let Some((transform, volume)) = volume {
        world.spawn((Name::new("irradiance volume"), transform, volume));
        update_transforms(world);
    }
}
