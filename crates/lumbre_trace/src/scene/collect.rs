//! Reads the components of a World that a frame is drawn from, and places them in the tracer's space.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DAffine3, DVec3};
use lumbre_mesh::{TextureCoordinateSet, TriangleMesh};
use lumbre_optics::{Light, LightKind, Material, ReflectionModel};
use lumbre_scene::{
    ChildOf, DynamicObject, EmissiveLight, GlobalTransform, IrradianceVolume, Lightmap, MaterialTextures,
    Medium, Mesh, Name, Primitive, Quadric, SceneSettings, StaticObject, VolumePlace, hidden_entities,
    nearest_volume,
};

use super::emissive_polygons::{EmissivePolygon, emissive_polygons};
use super::object::Object;
use crate::TraceError;

/// A light and its position in the tracer's space.
#[derive(Clone, Debug)]
pub(crate) struct PlacedLight {
    pub light: Light,
    pub position: DVec3,
    /// Unit vector in which it shines.
    pub axis: DVec3,
    pub name: String,
    /// Objects that do not block it: an emissive object whose box contains the light is the lamp's bulb.
    pub bulbs: Vec<usize>,
}

impl PlacedLight {
    fn find_bulbs(&mut self, objects: &[Object]) {
        if self.light.kind == LightKind::Point {
            let is_bulb = |object: &Object| object.glows() && object.box_holds(self.position);
            let found = objects.iter().enumerate().filter(|(_, object)| is_bulb(object));
            self.bulbs = found.map(|(index, _)| index).collect();
        }
    }
}

/// Everything that was read from a World.
#[derive(Debug)]
pub(crate) struct Collected {
    pub settings: SceneSettings,
    pub objects: Vec<Object>,
    /// Exact surfaces, each with the index of its object, in the object's own space.
    pub quadrics: Vec<(usize, Quadric)>,
    pub lights: Vec<PlacedLight>,
    pub polygons: Vec<EmissivePolygon>,
    pub notes: Vec<String>,
}

type Found<'a> = (
    Entity,
    (&'a Mesh, &'a Material, &'a GlobalTransform),
    (Option<&'a ReflectionModel>, Option<&'a Lightmap>, Option<&'a MaterialTextures>),
    (Option<&'a Medium>, Option<&'a Quadric>, Option<&'a Primitive>),
    (Has<StaticObject>, Has<EmissiveLight>),
);

type PlacedVolume = (Arc<IrradianceVolume>, VolumePlace);
type FoundLight<'a> = (Entity, &'a Light, &'a GlobalTransform, Option<&'a Name>);

/// Reads everything that is visible, with `origin` as the tracer's origin. `reflection` replaces every
/// object's reflection model if it is given; the array says whether lightmaps and irradiance volumes are
/// read.
pub(crate) fn collect(
    world: &mut World,
    origin: DVec3,
    reflection: Option<ReflectionModel>,
    [lightmaps, irradiance_volumes]: [bool; 2],
) -> Result<Collected, TraceError> {
    let settings = world.get_resource::<SceneSettings>().copied().unwrap_or_default();
    let hidden = hidden_entities(world);
    let query = world.query::<Found<'static>>();
    let lamps = world.query::<FoundLight<'static>>();
    let mut notes = Vec::new();
    let volumes = if irradiance_volumes { placed_volumes(world, origin, &mut notes) } else { Vec::new() };
    let world = &*world;
    let mut found: Vec<_> = query.iter_manual(world).filter(|object| !hidden.contains(&object.0)).collect();
    found.sort_by_key(|(entity, ..)| entity.index_u32());
    let mut collected = Collected {
        settings,
        objects: Vec::new(),
        quadrics: Vec::new(),
        lights: Vec::new(),
        polygons: Vec::new(),
        notes,
    };
    collected.lights = lights(world, &lamps, origin, &mut collected.notes);
    for (entity, (mesh, material, place), choices, exact, (fixed, shines)) in found {
        let (own_model, lightmap, textures) = choices;
        let (medium, quadric, primitive) = exact;
        let name = name(world, entity, primitive);
        let place = relative(place, origin);
        if !place.is_finite() {
            collected.notes.push(format!("\"{name}\" is left out: its transform is not finite"));
            continue;
        }
        material.validate(&name).map_err(|source| TraceError::Material { object: name.clone(), source })?;
        mesh.0.validate().map_err(|source| TraceError::Mesh { object: name.clone(), source })?;
        let textures = textures.cloned().unwrap_or_default();
        let normals = GlobalTransform(place).normal_matrix();
        let largest = normals.to_cols_array().iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        // An object with a lightmap is never lit by a volume, whether the lightmap is read or not.
        let mapped = lightmap.is_some() && !mesh.0.uv1.is_empty();
        let volume =
            nearest_volume(&volumes, |(_, place)| place, middle(&mesh.0, &place)).filter(|_| !mapped);
        let object = Object {
            shape: with_tangents(&mesh.0, &textures),
            material: material.clone(),
            textures,
            medium: medium.copied().unwrap_or_default(),
            model: reflection.or(own_model.copied()).unwrap_or(settings.reflection),
            lightmap: lightmap.filter(|_| lightmaps).map(|lightmap| Arc::clone(&lightmap.image)),
            volume: volume.cloned(),
            place,
            normals: if largest > 0.0 { normals * (1.0 / largest) } else { normals },
            mirrored: GlobalTransform(place).mirrors(),
            two_sided: settings.two_sided,
            name,
        };
        let index = collected.objects.len();
        if let Some(quadric) = quadric {
            let fault = |reason: String| TraceError::Quadric { object: object.name.clone(), reason };
            quadric.validate().map_err(|error| fault(error.to_string()))?;
            if place.matrix3.determinant() == 0.0 {
                return Err(fault("its transform flattens it; give a scale that is not 0".to_owned()));
            }
            collected.quadrics.push((index, quadric.clone()));
        }
        if shines {
            let baked = fixed && lightmaps && !moves(world, entity);
            collected.polygons.extend(emissive_polygons(index, &object, baked));
        }
        collected.objects.push(object);
    }
    let Collected { lights, objects, .. } = &mut collected;
    lights.iter_mut().for_each(|light| light.find_bulbs(objects));
    Ok(collected)
}

fn relative(place: &GlobalTransform, origin: DVec3) -> DAffine3 {
    DAffine3 { translation: place.0.translation - origin, ..place.0 }
}

/// Returns the valid irradiance volumes, placed in the tracer's space.
fn placed_volumes(world: &mut World, origin: DVec3, notes: &mut Vec<String>) -> Vec<PlacedVolume> {
    let mut query = world.query::<(Entity, &IrradianceVolume, Option<&GlobalTransform>)>();
    let mut found: Vec<_> = query.iter(world).collect();
    found.sort_by_key(|(entity, ..)| entity.index_u32());
    let mut volumes = Vec::new();
    for (_, volume, transform) in found {
        let place = volume.validate().and_then(|()| IrradianceVolume::place(volume.resolution, transform));
        match place {
            Ok(place) => volumes.push((Arc::new(volume.clone()), place.seen_from(origin))),
            Err(fault) => notes.push(format!("an irradiance volume is left out: {fault}")),
        }
    }
    volumes
}

/// Returns the centre of a mesh's bounding box in the tracer's space, by which a frame too chooses the
/// volume.
fn middle(mesh: &TriangleMesh, place: &DAffine3) -> DVec3 {
    let positions = || mesh.positions.iter().map(|position| position.as_dvec3());
    let low = positions().fold(DVec3::INFINITY, DVec3::min);
    let high = positions().fold(DVec3::NEG_INFINITY, DVec3::max);
    place.transform_point3(0.5 * (low + high))
}

/// Returns the enabled lights, in the order of their entities.
fn lights(
    world: &World,
    lamps: &QueryState<FoundLight<'static>>,
    origin: DVec3,
    notes: &mut Vec<String>,
) -> Vec<PlacedLight> {
    let mut found: Vec<_> = lamps.iter_manual(world).filter(|(_, light, ..)| light.enabled).collect();
    found.sort_by_key(|(entity, ..)| entity.index_u32());
    let mut lights = Vec::new();
    for (entity, light, place, name) in found {
        let name = name.map_or_else(|| format!("entity {entity}"), ToString::to_string);
        let (position, axis) = (place.translation() - origin, place.forward());
        let placed = light.kind != LightKind::Point || position.is_finite();
        match light.validate(&name) {
            Ok(()) if placed => {
                lights.push(PlacedLight { light: light.clone(), position, axis, name, bulbs: Vec::new() })
            }
            Ok(()) => notes.push(format!("light \"{name}\" is left out: its position is not finite")),
            Err(error) => notes.push(format!("a light is left out: {error}")),
        }
    }
    lights
}

/// Returns the mesh with the tangents that its normal map needs.
fn with_tangents(mesh: &Arc<TriangleMesh>, textures: &MaterialTextures) -> Arc<TriangleMesh> {
    let Some(map) = textures.normal.as_ref().filter(|_| mesh.tangents.is_empty()) else {
        return Arc::clone(mesh);
    };
    let set = match map.texture.tex_coord {
        0 => TextureCoordinateSet::First,
        _ => TextureCoordinateSet::Second,
    };
    mesh.with_tangents(set).map_or_else(|_| Arc::clone(mesh), Arc::new)
}

/// Returns true if the entity or one of its ancestors moves; the baker leaves such emitters out.
fn moves(world: &World, entity: Entity) -> bool {
    let above = |entity: &Entity| world.get::<ChildOf>(*entity).map(ChildOf::parent);
    std::iter::successors(Some(entity), above).any(|entity| world.get::<DynamicObject>(entity).is_some())
}

/// Returns the name shown to the user: the entity's own, its node's, or its mesh's.
fn name(world: &World, entity: Entity, primitive: Option<&Primitive>) -> String {
    let parent = world.get::<ChildOf>(entity).map(ChildOf::parent);
    let named = [Some(entity), parent].into_iter().flatten().find_map(|entity| world.get::<Name>(entity));
    match (named, primitive) {
        (Some(name), _) => name.to_string(),
        (None, Some(primitive)) if !primitive.mesh.is_empty() => primitive.mesh.to_string(),
        _ => format!("entity {entity}"),
    }
}
