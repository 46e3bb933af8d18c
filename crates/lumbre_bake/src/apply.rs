//! Writes a finished bake into the World: meshes with `uv1`, and lightmaps. The only place that changes it.

use std::collections::HashSet;
use std::f32::consts::PI;
use std::sync::Arc;

use bevy_ecs::prelude::{Component, Entity, With, World};
use glam::Vec3;
use lumbre_scene::{
    Children, IrradianceVolume, Lightmap, LightmapEncoding, LightmapImage, Mesh, Name, Transform,
    update_transforms,
};

use crate::UnwrappedFrom;
use crate::pages::Pages;
use crate::scene::{LightmapLayout, Object, textures_of};

/// How far each texel of an entity's [`Lightmap`] may be off: one standard error in the map's own unit (E/π, mean of the channels), row
/// by row; NaN where the map shows no surface. Against a converged bake of the same map at least 95 % of the texels are within two.
#[derive(Component, Clone, Debug)]
pub struct TexelErrors(pub Arc<[f32]>);

/// Gives every object its map: E/π, and 0 where nothing is known; and its errors.
pub(crate) fn apply(
    world: &mut World,
    objects: &[Object],
    layout: &LightmapLayout,
    irradiance: &[Vec3],
    variances: &[f32],
    pages: &Pages,
) {
    forget_lightmaps(world, objects);
    let mut names = HashSet::new();
    let light = |texel: usize| {
        let e = irradiance[texel];
        if e.is_finite() { e / PI } else { Vec3::ZERO }
    };
    let error = |texel: usize| variances[texel].sqrt() / PI;
    let image = |name: String, width: u32, height: u32, texels: Vec<Vec3>| {
        Arc::new(LightmapImage { name, width, height, texels, encoding: LightmapEncoding::Rgb32Float })
    };
    let shared: Vec<(Lightmap, TexelErrors)> = (0..pages.pages.len())
        .map(|index| {
            let page = &pages.pages[index];
            let texels = pages.compose(index, layout, light, Vec3::ZERO);
            let name = file_name(&format!("atlas-{}", index + 1), &mut names);
            let errors = pages.compose(index, layout, error, f32::NAN);
            let image = image(name, page.width, page.height, texels);
            (Lightmap { image }, TexelErrors(errors.into()))
        })
        .collect();
    for (index, object) in objects.iter().enumerate() {
        let map = &layout.maps[index];
        let lightmap = match pages.places[index] {
            Some(place) => shared[place.page].clone(),
            None => {
                let own = map.first..map.first + (map.width * map.height) as usize;
                let texels = own.clone().map(light).collect();
                let name = file_name(&object.name, &mut names);
                let image = image(name, map.width, map.height, texels);
                (Lightmap { image }, TexelErrors(own.map(error).collect()))
            }
        };
        for ((part, mesh), &moved) in object.primitives.iter().zip(&map.meshes).zip(&map.moved) {
            let Ok(mut entity) = world.get_entity_mut(part.entity) else { continue };
            let made = match pages.places[index] {
                Some(_) => pages.on_page(layout, index, mesh),
                None => Arc::clone(mesh),
            };
            let textures = textures_of(part, moved);
            if let Some(textures) = textures.as_ref().filter(|own| entity.get() != Some(*own)) {
                entity.insert(textures.clone());
            }
            if Arc::ptr_eq(&part.mesh, &made) {
                entity.remove::<UnwrappedFrom>();
            } else {
                let source = (Arc::clone(&part.mesh), part.textures.clone());
                entity.insert(UnwrappedFrom::new(source, (Arc::clone(&made), textures)));
            }
            if !entity.get::<Mesh>().is_some_and(|own| Arc::ptr_eq(&own.0, &made)) {
                entity.insert(Mesh(made));
            }
            entity.insert(lightmap.clone());
        }
    }
}

/// Takes away the lightmaps of an earlier bake from everything but `objects`: their light would count twice.
pub(crate) fn forget_lightmaps(world: &mut World, objects: &[Object]) {
    let kept: HashSet<_> =
        objects.iter().flat_map(|object| &object.primitives).map(|part| part.entity).collect();
    let mut mapped = world.query_filtered::<Entity, With<Lightmap>>();
    let stale: Vec<Entity> = mapped.iter(world).filter(|entity| !kept.contains(entity)).collect();
    for entity in stale {
        world.entity_mut(entity).remove::<(Lightmap, TexelErrors)>();
    }
}

/// Puts the light for what moves in its place, and takes away that of an earlier bake.
pub(crate) fn place_volume(world: &mut World, volume: Option<(Transform, IrradianceVolume)>) {
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

/// A file name that every system takes, used once.
fn file_name(object: &str, taken: &mut HashSet<String>) -> String {
    let plain: String = object
        .chars()
        .take(64)
        .map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' })
        .collect();
    let mut name = format!("{plain}.lightmap.exr");
    let mut number = 2;
    while !taken.insert(name.to_lowercase()) {
        name = format!("{plain}.{number}.lightmap.exr");
        number += 1;
    }
    name
}
