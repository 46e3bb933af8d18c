//! The objects of a frame: entities with a mesh, each with a slot in the GPU's buffers. A slot is written
//! again only when a component of its entity changed.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use bevy_ecs::system::SystemState;
use bevy_ecs::world::WorldId;
use glam::{DAffine3, DVec3, DVec4};
use lumbre_mesh::TextureCoordinateSet;
use lumbre_optics::{Lobe, Material, ReflectionModel, Shading, Surface};
use lumbre_scene::{
    Children, DynamicObject, EmissiveLight, GlobalTransform, Hidden, Lightmap, LightmapEncoding,
    MaterialTextures, Medium, Mesh, Name, ObjectCensus, ObjectTraits, SceneSettings, StaticObject,
    planar_mirror, with_descendants,
};

use super::entity_slots::EntitySlots;
use super::planar_mirror::PlanarMirror;
use super::refractor::Refractor;
use crate::growable_buffer::GrowableBuffer;
use crate::layout::{MaterialData, ObjectData};
use crate::mesh_buffers::{MeshBuffers, MeshKey};
use crate::texture_sets::{TextureSet, TextureSets};
use crate::textures::Textures;
use crate::{Gpu, RenderError};

/// What drawing needs to know about one object.
#[derive(Debug)]
pub(crate) struct Object {
    pub entity: Entity,
    pub mesh: MeshKey,
    pub texture_set: Option<Arc<TextureSet>>,
    pub lightmap: Option<Arc<wgpu::BindGroup>>,
    pub traits: ObjectTraits,
    optional: Optional,
    /// Number of triangles of its mesh.
    pub triangles: usize,
    /// Whether it is counted in the census.
    counted: bool,
    /// A message with its name if it cannot be drawn.
    fault: Option<String>,
    pub mirrored: bool,
    pub world_from_mesh: DAffine3,
    /// Centre of the bounding box in the world.
    pub center: DVec3,
    /// Half the sides of that box along the world's axes.
    pub half_size: DVec3,
    /// Radius of the bounding sphere around the same centre.
    pub radius: f64,
    /// Set if its reflection can be drawn.
    pub planar_mirror: Option<PlanarMirror>,
    /// How it transmits light, from its material and medium.
    pub refractor: Option<Refractor>,
    /// The reflection coefficients of its material.
    pub reflectance: Reflectance,
    /// A number that changes whenever the object changes.
    pub changed: u64,
    seen: u64,
}

/// The reflection coefficients of both sides of a material.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Reflectance {
    pub front: Surface,
    /// The back side, if it differs from the front.
    pub back: Option<Surface>,
    pub lobe: Lobe,
}

impl Reflectance {
    pub fn of(material: &Material) -> Self {
        Self { front: material.front, back: material.back, lobe: material.lobe }
    }
}

/// The optional components of an object. They are compared because removing a component leaves no change
/// mark.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Optional {
    maps: bool,
    lightmap: bool,
    choices: (Option<Shading>, Option<ReflectionModel>, Option<Medium>),
    /// Static, dynamic, emissive.
    marks: (bool, bool, bool),
}

type ObjectQuery<'w, 's> = Query<
    'w,
    's,
    (
        Entity,
        Ref<'static, Mesh>,
        Ref<'static, Material>,
        Ref<'static, GlobalTransform>,
        Option<Ref<'static, MaterialTextures>>,
        Option<Ref<'static, Lightmap>>,
        (Option<&'static Shading>, Option<&'static ReflectionModel>, Option<&'static Medium>),
        (Has<StaticObject>, Has<DynamicObject>, Has<EmissiveLight>),
    ),
>;

/// Meshes without a material.
type Unfinished<'w, 's> = Query<'w, 's, Entity, (With<Mesh>, Without<Material>)>;
type HiddenBranches<'w, 's> = (Query<'w, 's, Entity, With<Hidden>>, Query<'w, 's, &'static Children>);
type Names<'w, 's> = Query<'w, 's, &'static Name>;
type Extraction = SystemState<(
    ObjectQuery<'static, 'static>,
    Unfinished<'static, 'static>,
    HiddenBranches<'static, 'static>,
    Names<'static, 'static>,
)>;

/// All objects and their GPU buffers.
pub(crate) struct Objects {
    state: Option<(WorldId, Extraction)>,
    slots: EntitySlots<Object>,
    /// Counts of the objects that can be drawn.
    pub census: ObjectCensus,
    pub transforms: GrowableBuffer<ObjectData>,
    pub materials: GrowableBuffer<MaterialData>,
    frame: u64,
    /// Whether something on the GPU may no longer be in use.
    stale: bool,
    /// The origin of frame space in the world.
    pub origin: DVec3,
    /// The format in which the scene asks for its lightmaps.
    lightmap_format: LightmapEncoding,
}

/// If the camera is farther from the origin of frame space than this, in metres, the origin moves to the
/// camera. Up to 512 m, f32 still resolves 0.03 mm.
const ORIGIN_REACH: f64 = 512.0;

impl Objects {
    pub fn new() -> Self {
        Self {
            state: None,
            slots: EntitySlots::default(),
            census: ObjectCensus::default(),
            transforms: GrowableBuffer::table_and_buffer("objects"),
            materials: GrowableBuffer::table("materials"),
            frame: 0,
            stale: false,
            origin: DVec3::ZERO,
            lightmap_format: LightmapEncoding::default(),
        }
    }

    /// Returns the format in which the scene asks for its lightmaps.
    pub fn lightmap_format(&self) -> LightmapEncoding {
        self.lightmap_format
    }

    /// Brings the slots up to date for a frame seen from `eye`. Objects that cannot be drawn are left out,
    /// each with a message in `left_out`.
    pub fn extract(
        &mut self,
        world: &mut World,
        gpu: &Gpu,
        resources: (&mut MeshBuffers, &mut Textures, &mut TextureSets),
        eye: DVec3,
        left_out: &mut Vec<String>,
    ) -> Result<(), RenderError> {
        let updated = self.update(world, gpu, resources, eye, left_out);
        if updated.is_err() {
            // The update is incomplete, so the next frame starts from scratch.
            *self = Self { frame: self.frame, stale: true, ..Self::new() };
        }
        updated
    }

    fn update(
        &mut self,
        world: &mut World,
        gpu: &Gpu,
        (meshes, textures, sets): (&mut MeshBuffers, &mut Textures, &mut TextureSets),
        eye: DVec3,
        left_out: &mut Vec<String>,
    ) -> Result<(), RenderError> {
        self.frame += 1;
        if self.state.as_ref().is_none_or(|(id, _)| *id != world.id()) {
            // This is another World, so drop everything of the previous one.
            *self = Self { frame: self.frame, stale: true, ..Self::new() };
            self.state = Some((world.id(), SystemState::new(world)));
        }
        let moved = (eye - self.origin).length() > ORIGIN_REACH;
        if moved {
            self.origin = eye;
        }
        let settings = world.get_resource::<SceneSettings>().copied().unwrap_or_default();
        let format = settings.frame.lightmap_format;
        let reformatted = std::mem::replace(&mut self.lightmap_format, format) != format;
        self.stale |= reformatted;
        let Some((id, mut state)) = self.state.take() else { return Ok(()) };
        if let Ok((query, unfinished, (hidden, children), names)) = state.get(world) {
            let hidden = with_descendants(hidden.iter(), &children);
            let named = |entity: Entity, fault: &str| {
                let name = names.get(entity).map_or_else(|_| entity.to_string(), ToString::to_string);
                format!("object \"{name}\": {fault}")
            };
            let unfinished = unfinished.iter().filter(|entity| !hidden.contains(entity));
            let unfinished = unfinished.map(|entity| named(entity, "it has a Mesh and no Material"));
            left_out.extend(unfinished);
            let shown = query.iter().filter(|object| !hidden.contains(&object.0));
            for (entity, mesh, material, transform, maps, lightmap, choices, marks) in shown {
                if !transform.0.is_finite() {
                    left_out.push(named(entity, "its transform is not finite"));
                    continue;
                }
                let slot = self.slots.of(entity);
                let new = self.slots.values[slot].is_none();
                let remeshed = new || mesh.is_changed();
                let transformed = new || moved || transform.is_changed();
                let maps_changed = maps.as_ref().is_some_and(Ref::is_changed);
                let map_changed = lightmap.as_ref().is_some_and(Ref::is_changed);
                let maps = maps.map(Ref::into_inner);
                let lightmap = lightmap.map(Ref::into_inner);
                let (shading, reflection, medium) = choices;
                let optional = Optional {
                    maps: maps.is_some(),
                    lightmap: lightmap.is_some(),
                    choices: (shading.copied(), reflection.copied(), medium.copied()),
                    marks,
                };
                let normal_map =
                    maps.and_then(|maps| maps.normal.as_ref()).map(|map| match map.texture.tex_coord {
                        0 => TextureCoordinateSet::First,
                        _ => TextureCoordinateSet::Second,
                    });
                let object = self.slots.values[slot].get_or_insert_with(|| {
                    Object::new(
                        entity,
                        meshes.insert(&mesh.0, normal_map),
                        ObjectTraits::new(((&*mesh, &*material, maps, lightmap), choices, marks)),
                    )
                });
                // The removal of a component leaves no change mark.
                let rematerialized =
                    new || material.is_changed() || maps_changed || object.optional.maps != optional.maps;
                let restated = remeshed || rematerialized || map_changed || object.optional != optional;
                self.stale |= !new && (remeshed || rematerialized || map_changed);
                if remeshed || rematerialized {
                    object.mesh = meshes.insert(&mesh.0, normal_map);
                }
                if transformed {
                    self.transforms.set(slot, ObjectData::new(&transform, self.origin));
                }
                if remeshed {
                    let fault = meshes.get(object.mesh).and_then(|mesh| mesh.fault.as_ref());
                    object.fault = fault.map(|fault| named(entity, &fault.to_string()));
                }
                left_out.extend(object.fault.clone());
                if transformed || remeshed {
                    object.bound(meshes, &transform);
                }
                if rematerialized {
                    self.materials.set(slot, MaterialData::new(&material, maps));
                    object.texture_set = match maps {
                        Some(maps) => sets.set(gpu, textures, maps)?,
                        None => None,
                    };
                }
                if new || map_changed || reformatted || object.lightmap.is_some() != lightmap.is_some() {
                    object.lightmap = match lightmap {
                        Some(map) => Some(sets.lightmap(gpu, textures, map, format)?),
                        None => None,
                    };
                }
                object.seen = self.frame;
                if transformed || restated {
                    object.changed = self.frame;
                    object.reflectance = Reflectance::of(&material);
                    let plane = planar_mirror(&mesh.0, &material, maps, medium);
                    object.planar_mirror =
                        plane.and_then(|plane| PlanarMirror::new(plane, &transform.0, &material, medium));
                    object.refractor = Some(Refractor::new(&material, medium));
                }
                if restated {
                    let traits = ObjectTraits::new(((&*mesh, &*material, maps, lightmap), choices, marks));
                    object.count(&mut self.census, traits, mesh.0.triangle_count());
                    object.optional = optional;
                }
            }
        }
        self.state = Some((id, state));
        self.release(gpu, meshes, textures, sets);
        Ok(())
    }

    /// Frees the slots of despawned entities, and what only they used.
    fn release(
        &mut self,
        gpu: &Gpu,
        meshes: &mut MeshBuffers,
        textures: &mut Textures,
        sets: &mut TextureSets,
    ) {
        let (frame, census) = (self.frame, &mut self.census);
        let released = self.slots.release(|object| object.seen == frame, |mut object| object.leave(census));
        if std::mem::take(&mut self.stale) || released {
            sets.sweep();
            textures.sweep(gpu, self.lightmap_format);
            meshes.sweep();
        }
    }

    /// Returns the object in a slot.
    pub fn get(&self, slot: usize) -> Option<&Object> {
        self.slots.values.get(slot)?.as_ref()
    }

    /// Returns the objects that can be drawn, with their slots.
    pub fn iter(&self) -> impl Iterator<Item = (usize, &Object)> {
        let drawn = |object: &&Object| object.fault.is_none();
        self.slots
            .values
            .iter()
            .enumerate()
            .filter_map(move |(slot, object)| Some((slot, object.as_ref().filter(drawn)?)))
    }
}

/// Transforms a bounding box from mesh space. Returns its centre in the world, half the sides of its bounding
/// box along the world's axes, and the radius of the sphere around that box.
pub(crate) fn world_box(center: DVec3, half: DVec3, transform: &GlobalTransform) -> (DVec3, DVec3, f64) {
    let matrix = transform.0.matrix3;
    let half_size =
        matrix.x_axis.abs() * half.x + matrix.y_axis.abs() * half.y + matrix.z_axis.abs() * half.z;
    (transform.0.transform_point3(center), half_size, half_size.length())
}

impl Object {
    /// Returns how far its box extends from its centre along the normal of a plane. A box that is infinite, or not a
    /// number, extends to infinity.
    pub fn reach(&self, plane: DVec4) -> f64 {
        let reach = plane.truncate().abs().dot(self.half_size);
        if reach.is_nan() { f64::INFINITY } else { reach }
    }

    fn new(entity: Entity, mesh: MeshKey, traits: ObjectTraits) -> Self {
        Self {
            entity,
            mesh,
            texture_set: None,
            lightmap: None,
            traits,
            optional: Optional::default(),
            triangles: 0,
            counted: false,
            fault: None,
            mirrored: false,
            world_from_mesh: DAffine3::IDENTITY,
            center: DVec3::ZERO,
            half_size: DVec3::ZERO,
            radius: 0.0,
            planar_mirror: None,
            refractor: None,
            reflectance: Reflectance::default(),
            changed: 0,
            seen: 0,
        }
    }

    /// Sets new traits, and updates the census.
    fn count(&mut self, census: &mut ObjectCensus, traits: ObjectTraits, triangles: usize) {
        let drawn = self.fault.is_none();
        if (self.traits, self.triangles, self.counted) != (traits, triangles, drawn) {
            self.leave(census);
            (self.traits, self.triangles, self.counted) = (traits, triangles, drawn);
            if drawn {
                census.add(&traits, triangles);
            }
        }
    }

    /// Removes the object from the census.
    fn leave(&mut self, census: &mut ObjectCensus) {
        if std::mem::take(&mut self.counted) {
            census.remove(&self.traits, self.triangles);
        }
    }

    fn bound(&mut self, meshes: &MeshBuffers, transform: &GlobalTransform) {
        self.mirrored = transform.mirrors();
        self.world_from_mesh = transform.0;
        if let Some(mesh) = meshes.get(self.mesh) {
            (self.center, self.half_size, self.radius) = world_box(mesh.center, mesh.half_size, transform);
        }
    }
}
