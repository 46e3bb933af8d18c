//! Decodes and validates a whole file into plain data, so that spawning its entities cannot fail.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::PathBuf;
use std::sync::Arc;

use lumbre_mesh::TriangleMesh;
use lumbre_optics::{BakeMode, Light, Material, ReflectionModel, Shading};

use super::accessor::Buffers;
use super::document::{self, Document, element, extension};
use super::error::{LoadProblem, Notes};
use super::extensions::{
    AnimationPointer, CameraExtension, IrradianceVolumeExtension, LightReference, LightmapExtension,
    ObjectExtension, ShadingExtension,
};
use super::hierarchy::{Hierarchy, hierarchy, transform};
use super::import_image::{Images, white};
use super::import_irradiance_volume::irradiance_volume;
use super::import_lightmap::Lightmaps;
use super::limits::{Budget, LoadLimits};
use super::quadric_extension::QuadricExtension;
use super::uri::Base;
use super::value::number;
use super::{import_light, import_material, import_medium, import_mesh, import_scene};
use crate::{
    Camera, IrradianceVolume, Lightmap, LightmapScale, MaterialTextures, Medium, Primitive, Quadric,
    SceneSettings, Transform,
};

/// A decoded primitive of a mesh with its material.
pub(crate) struct PreparedPrimitive {
    pub label: Primitive,
    pub mesh: Arc<TriangleMesh>,
    pub material: Material,
    pub textures: MaterialTextures,
    pub medium: Option<Medium>,
}

/// A decoded node with everything attached to it.
pub(crate) struct PreparedNode {
    /// Index in the file.
    pub index: usize,
    pub parent: Option<usize>,
    pub name: Option<String>,
    pub transform: Transform,
    pub mesh: Option<usize>,
    pub light: Option<Light>,
    pub camera: Option<Camera>,
    pub active_camera: bool,
    pub shading: Option<Shading>,
    pub reflection: Option<ReflectionModel>,
    pub lightmap: Option<Lightmap>,
    pub irradiance_volume: Option<IrradianceVolume>,
    pub dynamic: bool,
    pub hidden: bool,
    pub emissive_light: bool,
    pub lightmap_scale: Option<LightmapScale>,
    pub quadric: Option<Quadric>,
    pub extras: Option<serde_json::Value>,
}

/// A decoded scene.
pub(crate) struct Prepared {
    /// Every parent before its children.
    pub nodes: Vec<PreparedNode>,
    /// The primitives of each mesh in use.
    pub meshes: BTreeMap<usize, Vec<PreparedPrimitive>>,
    pub settings: SceneSettings,
    /// Number of nodes in the file.
    pub node_count: usize,
    /// The external files that the file refers to.
    pub files: Vec<PathBuf>,
    /// Number of lights in the scene with an intensity in candela or lux.
    pub photometric_lights: usize,
    /// Whether a camera in the scene states its exposure.
    pub states_exposure: bool,
}

/// Decodes and validates a document.
pub(crate) fn prepare(
    document: &Document,
    buffers: &Buffers<'_>,
    base: Base<'_>,
    limits: LoadLimits,
    mut budget: Budget,
    notes: &mut Notes,
) -> Result<Prepared, LoadProblem> {
    note_extensions(document, notes);
    let Hierarchy { order, parents, scene } = hierarchy(document, notes)?;
    let settings = import_scene::settings(document, scene.unwrap_or(0))?;
    let dynamic = dynamic_nodes(document, &order, &parents, notes)?;

    let decoded = vec![None; document.images.len()];
    let image_budget = Budget::new(limits.image_bytes);
    let mut images =
        Images { buffers, base, limits, budget: image_budget, decoded, stand_in: Arc::new(white()) };
    // Materials are decoded even if nothing uses them, so that their faults are reported early.
    let (mut materials, mut media) = (Vec::new(), Vec::new());
    for (index, source) in document.materials.iter().enumerate() {
        media.push(import_medium::medium(source, &document.material_place(index), notes)?);
        materials.push(import_material::material(
            source,
            &document.material_place(index),
            &mut images,
            notes,
        )?);
    }
    let mut lights = Vec::new();
    let animated_lights = animated_lights(document)?;
    for (index, source) in document.lights.iter().enumerate() {
        let place = match &source.name {
            Some(name) => format!("lights[{index}] ({})", document::shortened(name)),
            None => format!("lights[{index}]"),
        };
        let mut light = import_light::light(source, &place)?;
        if animated_lights.contains(&index) && light.bake != BakeMode::Dynamic {
            notes.add(&place, "an animation changes it, so that it is not baked");
            light.bake = BakeMode::Dynamic;
        }
        lights.push(light);
    }

    let mut meshes = BTreeMap::new();
    let mut geometries = Geometries::new();
    let mut lightmaps = Lightmaps::default();
    let mut nodes = Vec::new();
    let (mut photometric_lights, mut states_exposure) = (0, false);
    for index in order {
        let node = &document.nodes[index];
        let place = document.node_place(index);
        if let Some(mesh) = node.mesh {
            element(&document.meshes, "meshes", mesh, || format!("{place}.mesh"))?;
            if let Entry::Vacant(entry) = meshes.entry(mesh) {
                let mut source = Source {
                    document,
                    buffers,
                    materials: &materials,
                    media: &media,
                    budget: &mut budget,
                    notes,
                };
                entry.insert(source.primitives(mesh, node.name.as_deref(), &mut geometries)?);
            }
        }
        let light = match extension::<LightReference>(&node.extensions, "KHR_lights_punctual", &place)? {
            Some(LightReference { light }) => {
                let field = || format!("{place}.extensions.KHR_lights_punctual.light");
                match element(&lights, "lights", light, field) {
                    Ok(found) => {
                        photometric_lights += usize::from(document.photometric.get(light) == Some(&true));
                        Some(found.clone())
                    }
                    Err(problem) => {
                        notes.repair(&place, problem, "it has no light")?;
                        None
                    }
                }
            }
            None => None,
        };
        let lens =
            extension::<CameraExtension>(&node.extensions, "LUMBRE_camera", &place)?.unwrap_or_default();
        let camera = match node.camera {
            Some(camera) if camera >= document.cameras.len() => {
                let found = element(&document.cameras, "cameras", camera, || format!("{place}.camera"));
                found.map_or_else(|problem| notes.repair(&place, problem, "it has no camera"), |_| Ok(()))?;
                None
            }
            Some(camera) => {
                states_exposure |= lens.exposure.is_some();
                let exposure = number(lens.exposure, 1.0);
                if !(exposure.is_finite() && exposure > 0.0) {
                    return Err(LoadProblem::Value {
                        place,
                        field: "LUMBRE_camera.exposure".to_owned(),
                        value: exposure.to_string(),
                        expected: "use a factor above 0".to_owned(),
                    });
                }
                Some(Camera { projection: import_scene::projection(document, camera)?, exposure })
            }
            None => None,
        };
        let choices = extension::<ShadingExtension>(&node.extensions, "LUMBRE_shading", &place)?;
        let (technique, model) = choices.map_or((None, None), |own| (own.technique, own.reflection));
        let shading = technique
            .map(|name| import_scene::shading(&name, &place, "LUMBRE_shading.technique"))
            .transpose()?;
        let reflection = model
            .map(|name| import_scene::reflection(&name, &place, "LUMBRE_shading.reflection"))
            .transpose()?;
        let lightmap = match extension::<LightmapExtension>(&node.extensions, "LUMBRE_lightmap", &place)? {
            Some(source) => Some(lightmaps.lightmap(&source, &place, base, &limits, &mut images.budget)?),
            None => None,
        };
        let volume =
            extension::<IrradianceVolumeExtension>(&node.extensions, "LUMBRE_irradiance_volume", &place)?
                .map(|source| irradiance_volume(&source, &place, base, &limits, &mut images.budget))
                .transpose()?;
        if let Some(primitives) = lightmap.as_ref().and(node.mesh).and_then(|mesh| meshes.get(&mesh))
            && primitives.iter().any(|primitive| primitive.mesh.uv1.is_empty() && !primitive.material.unlit)
        {
            notes.add(
                &place,
                "has a lightmap, but its mesh has no TEXCOORD_1; the lightmap is not shown there",
            );
        }
        if node.skin.is_some() {
            notes.add(&place, "skins are not supported; the mesh is shown as it was modelled");
        }
        let object =
            extension::<ObjectExtension>(&node.extensions, "LUMBRE_object", &place)?.unwrap_or_default();
        let exact = extension::<QuadricExtension>(&node.extensions, "LUMBRE_quadric", &place)?;
        let mut quadric = exact.map(|exact| exact.surface(&place)).transpose()?;
        let primitives = node.mesh.and_then(|mesh| meshes.get(&mesh)).map_or(0, Vec::len);
        if quadric.is_some() && primitives != 1 {
            notes.add(
                &place,
                format!("has LUMBRE_quadric and {primitives} primitives: it needs a mesh of one, whose material it takes; the exact surface is left out"),
            );
            quadric = None;
        }
        nodes.push(PreparedNode {
            index,
            parent: parents[index],
            name: node.name.clone(),
            transform: transform(node, &place, notes)?,
            mesh: node.mesh,
            light,
            camera,
            active_camera: camera.is_some() && lens.active,
            shading,
            reflection,
            lightmap,
            irradiance_volume: volume,
            dynamic: dynamic.contains(&index),
            hidden: object.hidden,
            emissive_light: object.emissive_light,
            lightmap_scale: lightmap_scale(object.lightmap_scale, &place)?,
            quadric,
            extras: node.extras.clone(),
        });
    }
    let (node_count, files) = (document.nodes.len(), Vec::new());
    Ok(Prepared { nodes, meshes, settings, node_count, files, photometric_lights, states_exposure })
}

/// `LUMBRE_object.lightmapScale` of a node.
fn lightmap_scale(found: Option<f64>, place: &str) -> Result<Option<LightmapScale>, LoadProblem> {
    match found {
        Some(scale) if !(scale.is_finite() && scale > 0.0) => Err(LoadProblem::Value {
            place: place.to_owned(),
            field: "LUMBRE_object.lightmapScale".to_owned(),
            value: scale.to_string(),
            expected: "use a factor above 0, 1 for the density of the scene".to_owned(),
        }),
        scale => Ok(scale.map(LightmapScale)),
    }
}

/// Triangle meshes by the accessors they are read from, so that primitives which differ only in their
/// material share them. `None` for primitives without triangles.
type Geometries = HashMap<String, Option<Arc<TriangleMesh>>>;

/// The data from which primitives are made.
struct Source<'a> {
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    materials: &'a [(Material, MaterialTextures)],
    media: &'a [Option<Medium>],
    budget: &'a mut Budget,
    notes: &'a mut Notes,
}

impl Source<'_> {
    fn primitives(
        &mut self,
        mesh: usize,
        node_name: Option<&str>,
        geometries: &mut Geometries,
    ) -> Result<Vec<PreparedPrimitive>, LoadProblem> {
        let source = &self.document.meshes[mesh];
        let place = self.document.mesh_place(mesh);
        let name: Arc<str> = source.name.as_deref().or(node_name).unwrap_or_default().into();
        let mut prepared = Vec::new();
        for (index, primitive) in source.primitives.iter().enumerate() {
            let (material, textures, material_name) = match primitive.material {
                Some(material) => {
                    let field = || format!("{place}.primitives[{index}].material");
                    let (found, textures) = element(self.materials, "materials", material, field)?;
                    let name = self.document.materials[material].name.as_deref();
                    (found.clone(), textures.clone(), name.unwrap_or_default())
                }
                None => {
                    self.notes.add(&place, "has no material; a matt grey stands in");
                    (Material::default(), MaterialTextures::default(), "")
                }
            };
            let key =
                serde_json::json!([primitive.attributes, primitive.indices, primitive.mode]).to_string();
            let triangles = match geometries.get(&key) {
                Some(known) => known.clone(),
                None => {
                    let (budget, notes) = (&mut *self.budget, &mut *self.notes);
                    let read =
                        import_mesh::triangle_mesh(self.buffers, primitive, index, &place, budget, notes)?;
                    geometries.entry(key).or_insert(read.map(Arc::new)).clone()
                }
            };
            let Some(triangles) = triangles else { continue };
            let label = Primitive { index, mesh: name.clone(), material: material_name.into() };
            let textures = usable(textures, &triangles, &place, self.notes);
            let medium = primitive.material.and_then(|index| *self.media.get(index)?);
            prepared.push(PreparedPrimitive { label, mesh: triangles, material, textures, medium });
        }
        Ok(prepared)
    }
}

/// The textures for which the mesh has texture coordinates.
fn usable(
    mut textures: MaterialTextures,
    mesh: &TriangleMesh,
    place: &str,
    notes: &mut Notes,
) -> MaterialTextures {
    let missing = |tex_coord: u32| if tex_coord == 0 { mesh.uv0.is_empty() } else { mesh.uv1.is_empty() };
    let before = textures.clone();
    textures.base_color = textures.base_color.filter(|texture| !missing(texture.tex_coord));
    textures.emissive = textures.emissive.filter(|texture| !missing(texture.tex_coord));
    textures.metallic_roughness = textures.metallic_roughness.filter(|slot| !missing(slot.texture.tex_coord));
    textures.normal = textures.normal.filter(|slot| !missing(slot.texture.tex_coord));
    textures.occlusion = textures.occlusion.filter(|slot| !missing(slot.texture.tex_coord));
    if textures != before {
        notes.add(place, "has a textured material but not the texture coordinates it asks for; those textures are left out");
    }
    textures
}

/// Nodes that are animated, skinned or marked as dynamic, and all their descendants.
fn dynamic_nodes(
    document: &Document,
    order: &[usize],
    parents: &[Option<usize>],
    notes: &mut Notes,
) -> Result<HashSet<usize>, LoadProblem> {
    let mut dynamic = HashSet::new();
    for (index, animation) in document.animations.iter().enumerate() {
        notes.add(format!("animations[{index}]"), "animations are not played; their nodes count as dynamic");
        let place = format!("animations[{index}].channels");
        for channel in &animation.channels {
            let target = &channel.target;
            let pointer = extension::<AnimationPointer>(&target.extensions, "KHR_animation_pointer", &place)?;
            let Some(node) = target.node.or_else(|| pointer.and_then(|pointer| moved_node(&pointer.pointer)))
            else {
                continue;
            };
            match element(&document.nodes, "nodes", node, || place.clone()) {
                Ok(_) => {
                    dynamic.insert(node);
                }
                Err(problem) => notes.repair(&place, problem, "it moves nothing")?,
            }
        }
    }
    for &index in order {
        let node = &document.nodes[index];
        let object =
            extension::<ObjectExtension>(&node.extensions, "LUMBRE_object", &document.node_place(index))?;
        let inherited = parents[index].is_some_and(|parent| dynamic.contains(&parent));
        let own = object.and_then(|object| object.dynamic);
        if inherited || own == Some(true) {
            dynamic.insert(index);
        } else if node.skin.is_some() && node.mesh.is_some() && own.is_none() && dynamic.insert(index) {
            notes.add(
                document.node_place(index),
                "moves with its skeleton, so that it is not baked; \"LUMBRE_object\": {\"dynamic\": false} bakes it as it was modelled",
            );
        }
    }
    Ok(dynamic)
}

/// The node that moves if this JSON pointer is animated, by its transform or its morph target weights.
fn moved_node(pointer: &str) -> Option<usize> {
    let (node, property) = pointer.strip_prefix("/nodes/")?.split_once('/')?;
    let property = property.split('/').next()?;
    matches!(property, "translation" | "rotation" | "scale" | "weights").then(|| node.parse().ok())?
}

/// The lights that are animated through a JSON pointer.
fn animated_lights(document: &Document) -> Result<HashSet<usize>, LoadProblem> {
    let mut animated = HashSet::new();
    for (index, animation) in document.animations.iter().enumerate() {
        for channel in &animation.channels {
            let place = format!("animations[{index}].channels");
            let pointer =
                extension::<AnimationPointer>(&channel.target.extensions, "KHR_animation_pointer", &place)?;
            let light = pointer.and_then(|pointer| {
                let light = pointer.pointer.strip_prefix("/extensions/KHR_lights_punctual/lights/")?;
                light.split('/').next()?.parse::<usize>().ok()
            });
            animated.extend(light);
        }
    }
    Ok(animated)
}

fn note_extensions(document: &Document, notes: &mut Notes) {
    for name in &document.extensions_used {
        if !super::SUPPORTED_EXTENSIONS.contains(&name.as_str()) {
            notes.add(format!("extension {}", document::shortened(name)), "not supported; ignored");
        }
    }
    if document.skins > 0 {
        notes.add("skins", "not supported; ignored");
    }
    if document.extensions_used.iter().any(|name| name == "KHR_materials_variants") {
        notes.add("KHR_materials_variants", "the materials that stand without a variant are shown");
    }
}
