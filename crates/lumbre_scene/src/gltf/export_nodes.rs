//! Converts entities to nodes: the hierarchy, primitives merged into meshes again, and the extensions of each
//! node.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use bevy_ecs::prelude::*;
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{Light, Material, ReflectionModel, Shading};
use serde_json::{Map, Value, json};

use super::error::{Note, Notes};
use super::export::{LightmapFiles, SaveError};
use super::export_data::Data;
use super::extensions::{CameraExtension, ObjectExtension};
use super::quadric_extension::QuadricExtension;
use super::{export_light, export_material, export_scene};
use crate::{
    ActiveCamera, Camera, DynamicObject, EmissiveLight, Extras, Hidden, IrradianceVolume, Lightmap,
    LightmapImage, LightmapScale, MaterialTextures, Medium, Mesh, Primitive, Quadric, Transform,
};

/// The JSON lists of a file being written.
#[derive(Default)]
pub(crate) struct Nodes {
    pub nodes: Vec<Value>,
    pub roots: Vec<usize>,
    pub meshes: Vec<Value>,
    pub materials: Vec<Value>,
    pub lights: Vec<Value>,
    pub cameras: Vec<Value>,
    pub data: Data,
    pub notes: Vec<Note>,
}

/// Properties of a primitive's entity that glTF states per node. Primitives that differ in them need separate
/// nodes.
#[derive(Clone, PartialEq)]
struct Appearance {
    shading: Option<Shading>,
    reflection: Option<ReflectionModel>,
    lightmap: Option<Arc<LightmapImage>>,
    hidden: bool,
    emissive_light: bool,
    lightmap_scale: Option<LightmapScale>,
    quadric: Option<Quadric>,
    dynamic: bool,
}

/// The triangle mesh and the material index of each primitive of a glTF mesh.
type Parts = Vec<(*const TriangleMesh, usize)>;

/// Materials written so far, and meshes by their name and parts.
#[derive(Default)]
struct Known {
    materials: Vec<(Material, MaterialTextures, Option<Medium>, Arc<str>)>,
    meshes: HashMap<(Arc<str>, Parts), usize>,
}

impl Nodes {
    /// Converts all entities of a World that have a transform.
    pub(crate) fn collect(world: &mut World, lightmaps: &mut LightmapFiles) -> Result<Self, SaveError> {
        let mut entities: Vec<Entity> =
            world.query_filtered::<Entity, With<Transform>>().iter(world).collect();
        // Sorted by spawn order, which is the order of the file they came from.
        entities.sort_unstable_by_key(|entity| entity.index_u32());
        let mut notes = Notes::default();
        let has_transform: HashSet<Entity> = entities.iter().copied().collect();
        let parent = |entity: Entity| {
            world
                .get::<ChildOf>(entity)
                .map(|child| child.parent())
                .filter(|parent| has_transform.contains(parent))
        };
        let mut primitives: HashMap<Entity, Vec<Entity>> = HashMap::new();
        let mut nodes = Vec::new();
        for &entity in &entities {
            match parent(entity).filter(|_| is_primitive(world, entity)) {
                Some(parent) => primitives.entry(parent).or_default().push(entity),
                None => nodes.push(entity),
            }
        }
        let numbers: HashMap<Entity, usize> =
            nodes.iter().enumerate().map(|(number, &entity)| (entity, number)).collect();
        let mut result = Self { nodes: vec![Value::Null; nodes.len()], ..Self::default() };
        let mut known = Known::default();
        for (number, &entity) in nodes.iter().enumerate() {
            if parent(entity).is_none() {
                result.roots.push(number);
            }
            let mut children: Vec<usize> = world
                .get::<Children>(entity)
                .into_iter()
                .flat_map(|children| children.iter())
                .filter_map(|child| numbers.get(&child).copied())
                .collect();
            let mut node = result.node(world, entity, number, &mut notes)?;
            let own_dynamic = world.get::<DynamicObject>(entity).is_some();
            let inherited = ancestors(world, entity).any(|above| world.get::<DynamicObject>(above).is_some());
            let dynamic = own_dynamic || inherited;
            let mut drawn = primitives.remove(&entity).unwrap_or_default();
            drawn.sort_by_key(|&entity| world.get::<Primitive>(entity).map(|primitive| primitive.index));
            if world.get::<Mesh>(entity).is_some() {
                drawn.insert(0, entity);
            }
            let mut groups: Vec<(Appearance, Vec<Entity>)> = Vec::new();
            for entity in drawn {
                let appearance = appearance(world, entity, dynamic);
                match groups.iter_mut().find(|(known, _)| *known == appearance) {
                    Some((_, group)) => group.push(entity),
                    None => groups.push((appearance, vec![entity])),
                }
            }
            // The first group with the node's own mobility is attached to the node itself; the others get
            // child nodes.
            let own = groups.iter().position(|(appearance, _)| appearance.dynamic == dynamic);
            let own = own.map(|own| groups.remove(own));
            let name = world.get::<Name>(entity).map(|name| name.as_str().to_owned());
            if let Some(volume) = world.get::<IrradianceVolume>(entity) {
                let reference = lightmaps.volume_reference(volume, name.as_deref(), number);
                extend(&mut node, "LUMBRE_irradiance_volume", reference);
            }
            let mut object = ObjectExtension {
                dynamic: (own_dynamic && !inherited).then_some(true),
                ..Default::default()
            };
            if let Some((appearance, group)) = own {
                object.hidden = appearance.hidden;
                object.emissive_light = appearance.emissive_light;
                object.lightmap_scale = appearance.lightmap_scale.map(|scale| scale.0);
                result.show(
                    world,
                    &mut node,
                    &appearance,
                    &group,
                    name.as_deref(),
                    number,
                    &mut known,
                    lightmaps,
                )?;
            }
            object_extension(&mut node, object)?;
            for (appearance, group) in groups {
                let number = result.nodes.len();
                let mut below = Map::new();
                if let Some(name) = &name {
                    below.insert("name".to_owned(), format!("{name}.{number}").into());
                }
                result.show(
                    world,
                    &mut below,
                    &appearance,
                    &group,
                    name.as_deref(),
                    number,
                    &mut known,
                    lightmaps,
                )?;
                let object = ObjectExtension {
                    dynamic: (appearance.dynamic && !dynamic).then_some(true),
                    hidden: appearance.hidden,
                    emissive_light: appearance.emissive_light,
                    lightmap_scale: appearance.lightmap_scale.map(|scale| scale.0),
                };
                object_extension(&mut below, object)?;
                result.nodes.push(below.into());
                children.push(number);
            }
            if !children.is_empty() {
                node.insert("children".to_owned(), json!(children));
            }
            result.nodes[number] = node.into();
        }
        notes.list.append(&mut result.data.notes.list);
        result.notes = notes.list;
        Ok(result)
    }

    /// The JSON of a node, without its mesh and children.
    fn node(
        &mut self,
        world: &World,
        entity: Entity,
        number: usize,
        notes: &mut Notes,
    ) -> Result<Map<String, Value>, SaveError> {
        let mut node = Map::new();
        let name = world.get::<Name>(entity).map(|name| name.as_str());
        let place = place(name, entity);
        if let Some(name) = name {
            node.insert("name".to_owned(), name.into());
        }
        let transform = world.get::<Transform>(entity).copied().unwrap_or_default();
        if !transform.affine().is_finite() {
            return Err(SaveError::NotFinite { place, field: "Transform".to_owned() });
        }
        transform_keys(&mut node, &transform);
        if let Some(light) = world.get::<Light>(entity) {
            self.lights.push(export_light::light(light, name, &place)?);
            extend(&mut node, "KHR_lights_punctual", json!({"light": self.lights.len() - 1}));
        }
        if let Some(camera) = world.get::<Camera>(entity) {
            self.cameras.push(export_scene::camera(camera, &place)?);
            node.insert("camera".to_owned(), json!(self.cameras.len() - 1));
            let active = world.get::<ActiveCamera>(entity).is_some();
            let exposure = (camera.exposure != 1.0).then(|| f64::from(camera.exposure));
            if active || exposure.is_some() {
                let extension = serde_json::to_value(CameraExtension { exposure, active });
                extend(&mut node, "LUMBRE_camera", extension.map_err(|source| SaveError::Json { source })?);
            }
        }
        if let Some(Extras(extras)) = world.get::<Extras>(entity) {
            node.insert("extras".to_owned(), extras.clone());
        }
        if world.get::<Primitive>(entity).is_some() && world.get::<ChildOf>(entity).is_some() {
            notes.add(
                format!("{place} (nodes[{number}])"),
                "is a primitive that was moved or extended; saved as a node of its own",
            );
        }
        Ok(node)
    }

    #[expect(clippy::too_many_arguments, reason = "one call for what a node shows, from two places")]
    fn show(
        &mut self,
        world: &World,
        node: &mut Map<String, Value>,
        appearance: &Appearance,
        group: &[Entity],
        name: Option<&str>,
        number: usize,
        known: &mut Known,
        lightmaps: &mut LightmapFiles,
    ) -> Result<(), SaveError> {
        let mut parts = Parts::new();
        let mut primitives = Vec::new();
        let mut mesh_name: Option<Arc<str>> = None;
        for &entity in group {
            let Some(Mesh(mesh)) = world.get::<Mesh>(entity) else { continue };
            let place = place(name, entity);
            let label = world.get::<Primitive>(entity);
            mesh_name = mesh_name.or_else(|| label.map(|label| label.mesh.clone()));
            let material = self.material(world, entity, label, &place, known)?;
            let mut primitive = self.data.geometry(mesh, &place)?;
            if mesh.indices.is_empty() {
                continue;
            }
            primitive["material"] = material.into();
            primitives.push(primitive);
            parts.push((Arc::as_ptr(mesh), material));
        }
        if !primitives.is_empty() {
            let mesh_name = mesh_name.unwrap_or_else(|| name.unwrap_or_default().into());
            let meshes = &mut self.meshes;
            let index = *known.meshes.entry((mesh_name.clone(), parts)).or_insert_with(|| {
                let mut mesh = json!({"primitives": primitives});
                if !mesh_name.is_empty() {
                    mesh["name"] = mesh_name.as_ref().into();
                }
                meshes.push(mesh);
                meshes.len() - 1
            });
            node.insert("mesh".to_owned(), index.into());
        }
        let mut choices = Map::new();
        if let Some(shading) = appearance.shading {
            choices.insert("technique".to_owned(), shading.to_string().into());
        }
        if let Some(reflection) = appearance.reflection {
            choices.insert("reflection".to_owned(), reflection.name().into());
        }
        if !choices.is_empty() {
            extend(node, "LUMBRE_shading", choices.into());
        }
        if let Some(quadric) = appearance.quadric.as_ref().filter(|_| node.contains_key("mesh")) {
            let place = || group.first().map_or_else(String::new, |&entity| place(name, entity));
            quadric.validate().map_err(|source| SaveError::Quadric { place: place(), source })?;
            let extension = serde_json::to_value(QuadricExtension::of(quadric));
            extend(node, "LUMBRE_quadric", extension.map_err(|source| SaveError::Json { source })?);
        }
        if let Some(image) = &appearance.lightmap {
            extend(node, "LUMBRE_lightmap", lightmaps.reference(image, name, number));
        }
        Ok(())
    }

    fn material(
        &mut self,
        world: &World,
        entity: Entity,
        label: Option<&Primitive>,
        place: &str,
        known: &mut Known,
    ) -> Result<usize, SaveError> {
        let material = world.get::<Material>(entity).cloned().unwrap_or_default();
        let textures = world.get::<MaterialTextures>(entity).cloned().unwrap_or_default();
        let name = label.map(|label| label.material.clone()).unwrap_or_default();
        let medium = world.get::<Medium>(entity).copied();
        let key = (material, textures, medium, name);
        if let Some(known) = known.materials.iter().position(|known| *known == key) {
            return Ok(known);
        }
        self.materials.push(export_material::material(
            (&key.0, key.2),
            &key.1,
            &key.3,
            place,
            &mut self.data,
        )?);
        known.materials.push(key);
        Ok(self.materials.len() - 1)
    }
}

/// Writes translation, rotation and scale of a node, except those equal to the identity's.
pub(crate) fn transform_keys(node: &mut Map<String, Value>, transform: &Transform) {
    let identity = Transform::IDENTITY;
    if transform.translation != identity.translation {
        node.insert("translation".to_owned(), json!(transform.translation.to_array()));
    }
    if transform.rotation != identity.rotation {
        node.insert("rotation".to_owned(), json!(transform.rotation.to_array()));
    }
    if transform.scale != identity.scale {
        node.insert("scale".to_owned(), json!(transform.scale.to_array()));
    }
}

/// Returns true if an entity is nothing but a primitive of its parent's mesh.
fn is_primitive(world: &World, entity: Entity) -> bool {
    world.get::<Primitive>(entity).is_some()
        && world.get::<Mesh>(entity).is_some()
        && world.get::<Transform>(entity) == Some(&Transform::IDENTITY)
        && world.get::<Light>(entity).is_none()
        && world.get::<Camera>(entity).is_none()
        && world.get::<Name>(entity).is_none()
        && world.get::<Extras>(entity).is_none()
        && world.get::<IrradianceVolume>(entity).is_none()
        && world.get::<Children>(entity).is_none_or(|children| children.is_empty())
}

fn appearance(world: &World, entity: Entity, dynamic: bool) -> Appearance {
    Appearance {
        shading: world.get::<Shading>(entity).copied(),
        reflection: world.get::<ReflectionModel>(entity).copied(),
        lightmap: world.get::<Lightmap>(entity).map(|lightmap| lightmap.image.clone()),
        hidden: world.get::<Hidden>(entity).is_some(),
        emissive_light: world.get::<EmissiveLight>(entity).is_some(),
        lightmap_scale: world.get::<LightmapScale>(entity).copied(),
        quadric: world.get::<Quadric>(entity).cloned(),
        dynamic: dynamic || world.get::<DynamicObject>(entity).is_some(),
    }
}

fn ancestors(world: &World, entity: Entity) -> impl Iterator<Item = Entity> + '_ {
    std::iter::successors(Some(entity), |&entity| world.get::<ChildOf>(entity).map(|child| child.parent()))
        .skip(1)
}

fn object_extension(node: &mut Map<String, Value>, object: ObjectExtension) -> Result<(), SaveError> {
    if object != ObjectExtension::default() {
        let extension = serde_json::to_value(object);
        extend(node, "LUMBRE_object", extension.map_err(|source| SaveError::Json { source })?);
    }
    Ok(())
}

fn extend(object: &mut Map<String, Value>, name: &str, extension: Value) {
    let extensions = object.entry("extensions").or_insert_with(|| json!({}));
    extensions[name] = extension;
}

fn place(name: Option<&str>, entity: Entity) -> String {
    name.map_or_else(|| format!("entity {entity}"), ToOwned::to_owned)
}
