//! Puts a finished bake into the World: meshes with `uv1`, lightmaps, the volume for what moves. The only place that changes the World.

use std::collections::HashSet;
use std::sync::Arc;

use bevy_ecs::prelude::{Entity, With, World};
use lumbre_scene::{
    Children, IrradianceVolume, Lightmap, Mesh, Name, SeparateLight, Transform, update_transforms,
};

use crate::UnwrappedFrom;
use crate::finish::baked_scene::BakedObject;
use crate::finish::baked_scene::{BakedScene, TexelErrors};
use crate::scene::{Entities, StaticScene};

/// Gives every object its map. Where there was nothing to bake, what a former bake has left goes.
pub(crate) fn apply(world: &mut World, scene: &StaticScene, entities: &Entities, baked: &mut BakedScene) {
    let lit = if baked.objects.is_empty() { &[][..] } else { entities };
    forget_lightmaps(world, lit);
    for ((object, entities), made) in scene.objects.iter().zip(lit).zip(&baked.objects) {
        let map = &baked.maps[made.map];
        let BakedObject { meshes, textures, .. } = made;
        for (((part, &entity), made), textures) in
            object.primitives.iter().zip(entities).zip(meshes).zip(textures)
        {
            let Ok(mut entity) = world.get_entity_mut(entity) else { continue };
            if let Some(textures) = textures.as_ref().filter(|own| entity.get() != Some(*own)) {
                entity.insert(textures.clone());
            }
            if Arc::ptr_eq(&part.mesh, made) {
                entity.remove::<UnwrappedFrom>();
            } else {
                let source = (Arc::clone(&part.mesh), part.textures.clone());
                entity.insert(UnwrappedFrom::new(source, (Arc::clone(made), textures.clone())));
            }
            if !entity.get::<Mesh>().is_some_and(|own| Arc::ptr_eq(&own.0, made)) {
                entity.insert(Mesh(Arc::clone(made)));
            }
            entity.insert((Lightmap { image: Arc::clone(&map.image) }, map.errors.clone()));
            match &map.separate {
                Some(separate) => entity.insert(separate.clone()),
                None => entity.remove::<SeparateLight>(),
            };
        }
    }
    place_volume(world, baked.volume.take());
}

/// Takes away the lightmaps of an earlier bake from everything but `kept`: their light would count twice.
fn forget_lightmaps(world: &mut World, kept: &[Vec<Entity>]) {
    let kept: HashSet<_> = kept.iter().flatten().collect();
    let mut mapped = world.query_filtered::<Entity, With<Lightmap>>();
    let stale: Vec<Entity> = mapped.iter(world).filter(|entity| !kept.contains(entity)).collect();
    for entity in stale {
        world.entity_mut(entity).remove::<(Lightmap, TexelErrors, SeparateLight)>();
    }
}

/// Puts the light for what moves in its place, and takes away that of an earlier bake.
fn place_volume(world: &mut World, volume: Option<(Transform, IrradianceVolume)>) {
    let mut query = world.query_filtered::<Entity, With<IrradianceVolume>>();
    let stale: Vec<Entity> = query.iter(world).collect();
    for entity in stale {
        // What hangs below it is not the bake's.
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
