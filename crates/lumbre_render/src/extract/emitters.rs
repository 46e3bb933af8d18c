//! Emissive objects that light others: their faces as polygon lights in the world. Faces are extracted again
//! only if a mesh or a texture changed; colours and transforms are read every frame. Which objects the
//! polygons reach is decided in `light_lists`.

use std::collections::HashMap;
use std::sync::Arc;

use bevy_ecs::prelude::*;
use bevy_ecs::world::WorldId;
use glam::{DVec3, Vec3};
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{Material, PolygonLight};
use lumbre_scene::{
    ChildOf, DynamicObject, EmissiveLight, GlobalTransform, MaterialTextures, Mesh, Name, Primitive,
    StaticObject, hidden_entities,
};

use super::emissive_faces::{Face, MAXIMUM_POLYGONS, faces};
use crate::RenderError;

/// A polygon light of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EmissivePolygon {
    /// In the world.
    pub light: PolygonLight,
    /// The object whose face it is.
    pub emitter: Entity,
    /// Whether its diffuse light is contained in the lightmaps.
    pub baked: bool,
}

/// The emitters of the last frame.
#[derive(Debug, Default)]
pub(crate) struct Emitters {
    world: Option<WorldId>,
    known: HashMap<Entity, Emitter>,
}

#[derive(Debug)]
struct Emitter {
    mesh: Arc<TriangleMesh>,
    textures: Option<MaterialTextures>,
    faces: Vec<Face>,
}

impl Emitters {
    /// Returns the polygons of all emitters, in the order of their entities. Global transforms must be up to
    /// date.
    ///
    /// # Errors
    /// [`RenderError::TooManyEmissiveFaces`].
    pub fn polygons(&mut self, world: &mut World) -> Result<Vec<EmissivePolygon>, RenderError> {
        if self.world != Some(world.id()) {
            *self = Self { world: Some(world.id()), ..Self::default() };
        }
        // Most Worlds have no emitters.
        if world.query_filtered::<(), With<EmissiveLight>>().iter(world).next().is_none() {
            self.known.clear();
            return Ok(Vec::new());
        }
        let hidden = hidden_entities(world);
        let mut query = world.query_filtered::<(
            (Entity, &Mesh, &Material, &GlobalTransform, Option<&MaterialTextures>),
            (Has<StaticObject>, Option<&Primitive>),
        ), With<EmissiveLight>>();
        let shown =
            |emitter: Entity, place: &GlobalTransform| place.0.is_finite() && !hidden.contains(&emitter);
        let mut found: Vec<_> =
            query.iter(world).filter(|(emitter, _)| shown(emitter.0, emitter.3)).collect();
        found.sort_by_key(|(emitter, _)| emitter.0.index_u32());
        let mut polygons = Vec::new();
        let mut known = HashMap::new();
        for ((entity, mesh, material, place, textures), (fixed, primitive)) in found {
            let radiance = EmissiveLight::radiance(material);
            if radiance == [Vec3::ZERO; 2] {
                continue;
            }
            let emitter = match self.known.remove(&entity) {
                Some(emitter) if emitter.is_of(&mesh.0, textures) => emitter,
                _ => Emitter::new(&mesh.0, textures).map_err(|faces| RenderError::TooManyEmissiveFaces {
                    object: name(world, entity, primitive),
                    faces,
                    limit: MAXIMUM_POLYGONS,
                })?,
            };
            let baked = fixed && !moves(world, entity);
            for face in &emitter.faces {
                let front = placed(face, place, radiance[0]);
                let back = PolygonLight { radiance: (radiance[1] * face.tint).as_dvec3(), ..front.turned() };
                for light in [front, back] {
                    let area_vector = light.area_vector();
                    if light.radiance != DVec3::ZERO && area_vector.is_finite() && area_vector != DVec3::ZERO
                    {
                        polygons.push(EmissivePolygon { light, emitter: entity, baked });
                    }
                }
            }
            known.insert(entity, emitter);
        }
        self.known = known;
        Ok(polygons)
    }
}

impl Emitter {
    fn new(mesh: &Arc<TriangleMesh>, textures: Option<&MaterialTextures>) -> Result<Self, usize> {
        let faces = faces(mesh, textures)?;
        Ok(Self { mesh: Arc::clone(mesh), textures: textures.cloned(), faces })
    }

    fn is_of(&self, mesh: &Arc<TriangleMesh>, textures: Option<&MaterialTextures>) -> bool {
        Arc::ptr_eq(&self.mesh, mesh) && self.textures.as_ref() == textures
    }
}

/// Places a face in the world. A mirroring transform reverses the winding, so the face is turned to keep its
/// front.
fn placed(face: &Face, place: &GlobalTransform, radiance: Vec3) -> PolygonLight {
    let light = PolygonLight {
        corner: place.0.transform_point3(face.corner),
        edge_u: place.0.transform_vector3(face.edge_u),
        edge_v: place.0.transform_vector3(face.edge_v),
        triangle: face.triangle,
        radiance: (radiance * face.tint).as_dvec3(),
    };
    if place.mirrors() { light.turned() } else { light }
}

/// Returns true if the entity or one of its ancestors is dynamic. The baker leaves it out in that case.
fn moves(world: &World, entity: Entity) -> bool {
    let above = |entity: &Entity| world.get::<ChildOf>(*entity).map(ChildOf::parent);
    std::iter::successors(Some(entity), above).any(|entity| world.get::<DynamicObject>(entity).is_some())
}

/// Returns a name for messages: the entity's own, its node's, or its mesh's.
fn name(world: &World, entity: Entity, primitive: Option<&Primitive>) -> String {
    let parent = world.get::<ChildOf>(entity).map(ChildOf::parent);
    let named = [Some(entity), parent].into_iter().flatten().find_map(|entity| world.get::<Name>(entity));
    match (named, primitive) {
        (Some(name), _) => name.to_string(),
        (None, Some(primitive)) if !primitive.mesh.is_empty() => primitive.mesh.to_string(),
        _ => format!("entity {entity}"),
    }
}

#[cfg(test)]
mod tests {
    use lumbre_mesh::shapes;
    use lumbre_optics::Surface;
    use lumbre_scene::{Hidden, Transform, update_transforms};

    use super::*;

    fn glowing() -> Material {
        Material {
            front: Surface { emission: Vec3::new(1.0, 2.0, 3.0), ..Surface::default() },
            ..Material::default()
        }
    }

    fn lamp(world: &mut World, place: Transform) -> Entity {
        let mesh = Mesh(Arc::new(shapes::plane(2.0, 1.0, 1, 1)));
        world.spawn((mesh, glowing(), place, EmissiveLight)).id()
    }

    fn polygons(world: &mut World) -> Vec<EmissivePolygon> {
        update_transforms(world);
        Emitters::default().polygons(world).unwrap()
    }

    #[test]
    fn only_what_asks_and_shines_and_is_shown() {
        let mut world = World::new();
        let entity = lamp(&mut world, Transform::from_xyz(0.0, 3.0, 0.0));
        let found = polygons(&mut world);
        assert_eq!((found.len(), found[0].emitter, found[0].baked), (1, entity, false));
        assert_eq!(found[0].light.radiance, DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(found[0].light.area_vector(), DVec3::Y * 2.0);
        world.entity_mut(entity).insert(Hidden);
        assert_eq!(polygons(&mut world), []);
        world.entity_mut(entity).remove::<Hidden>().insert(Material { unlit: true, ..glowing() });
        assert_eq!(polygons(&mut world), []);
        world.entity_mut(entity).insert(Material::default());
        assert_eq!(polygons(&mut world), []);
        world.entity_mut(entity).insert(glowing()).remove::<EmissiveLight>();
        assert_eq!(polygons(&mut world), []);
    }

    #[test]
    fn the_front_stays_the_front_and_the_back_shines_if_it_says_so() {
        let mut world = World::new();
        let mirrored = Transform { scale: DVec3::new(-1.0, 1.0, 3.0), ..Transform::default() };
        let entity = lamp(&mut world, mirrored);
        assert_eq!(polygons(&mut world)[0].light.area_vector(), DVec3::Y * 6.0);
        // As in the baker, a double-sided material alone does not emit from its back.
        let mut material = Material { double_sided: true, ..glowing() };
        world.entity_mut(entity).insert(material.clone());
        assert_eq!(polygons(&mut world).len(), 1);
        material.back = Some(Surface { emission: Vec3::X, ..Surface::default() });
        world.entity_mut(entity).insert(material.clone());
        let found = polygons(&mut world);
        assert_eq!(found.len(), 2);
        assert_eq!((found[1].light.radiance, found[1].light.area_vector()), (DVec3::X, DVec3::Y * -6.0));
        world.entity_mut(entity).insert(Material { double_sided: false, ..material });
        assert_eq!(polygons(&mut world).len(), 1);
    }

    #[test]
    fn what_the_baker_bakes_is_baked() {
        let mut world = World::new();
        let entity = lamp(&mut world, Transform::default());
        world.entity_mut(entity).insert(StaticObject);
        assert!(polygons(&mut world)[0].baked);
        let cart = world.spawn((Transform::default(), DynamicObject)).id();
        world.entity_mut(entity).insert(ChildOf(cart));
        assert!(!polygons(&mut world)[0].baked);
    }

    #[test]
    fn flattened_infinite_and_black_faces_are_left_out() {
        let mut world = World::new();
        for scale in [DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0), DVec3::splat(f64::INFINITY)] {
            lamp(&mut world, Transform { scale, ..Transform::default() });
        }
        assert_eq!(polygons(&mut world), []);
    }

    #[test]
    fn too_many_faces_are_refused_by_name() {
        let mut world = World::new();
        let mesh = Mesh(Arc::new(shapes::uv_sphere(1.0, 64, 32)));
        let node = world.spawn((Name::new("chandelier"), Transform::default())).id();
        world.spawn((mesh, glowing(), EmissiveLight, ChildOf(node)));
        update_transforms(&mut world);
        let error = Emitters::default().polygons(&mut world).unwrap_err().to_string();
        assert!(error.contains("chandelier") && error.contains("256"), "{error}");
    }

    #[test]
    fn faces_are_found_again_only_when_the_mesh_changes() {
        let mut world = World::new();
        let entity = lamp(&mut world, Transform::default());
        update_transforms(&mut world);
        let mut emitters = Emitters::default();
        emitters.polygons(&mut world).unwrap();
        let first = emitters.known[&entity].faces.as_ptr();
        emitters.polygons(&mut world).unwrap();
        assert_eq!(first, emitters.known[&entity].faces.as_ptr());
        world.entity_mut(entity).insert(Mesh(Arc::new(shapes::cuboid(Vec3::ONE, 1))));
        assert_eq!(emitters.polygons(&mut world).unwrap().len(), 6);
        world.despawn(entity);
        assert_eq!(emitters.polygons(&mut world).unwrap(), []);
        assert!(emitters.known.is_empty());
    }
}
