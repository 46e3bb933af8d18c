//! Adds lightmap coordinates to a primitive of the artist's file: the triangles stay the same, vertices are
//! split where charts meet, and every attribute is carried along. The coordinates are computed elsewhere.

use std::collections::HashMap;

use glam::{Vec2, Vec3};
use lumbre_mesh::TriangleMesh;
use serde_json::{Map, Value};

use super::accessor::Buffers;
use super::compressed_primitives::EXTENSION as COMPRESSED;
use super::error::{LoadProblem, Notes};
use super::export::SaveError;
use super::import_mesh::corners;
use super::limits::Budget;
use super::patch::{Patch, place};
use super::texture_sets::{LIGHTMAP_COORDINATES, with_sets_moved};
use super::vertex_data::{NewData, Normals, Vertices};

/// If fewer than one in this many vertices is used, the unused ones are dropped: primitives may share one
/// large list.
const MIN_USED: usize = 4;

/// Primitives being changed, and what was written for them already.
pub(crate) struct Primitives<'a> {
    pub buffers: &'a Buffers<'a>,
    pub data: NewData,
    pub notes: Notes,
    /// Written attributes, targets and indices, by primitive, vertices and triangles.
    known: HashMap<Chosen, Map<String, Value>>,
    /// Copies of materials that read other texture coordinates, by material and moved sets.
    materials: HashMap<(usize, Moves), usize>,
}

/// A primitive (mesh and index), its vertices and its triangles.
type Chosen = (usize, usize, Vertices, Vec<u32>);

/// How texture coordinate sets were renumbered, as pairs of the old and the new set.
type Moves = Vec<(u64, u64)>;

/// The vertices of a primitive, split so that each has one lightmap coordinate.
struct Split {
    vertices: Vertices,
    coordinates: Vec<Vec2>,
    /// The new vertex at each corner of each triangle.
    corners: Vec<u32>,
}

impl Split {
    /// The normal of `made` at each vertex; zero for vertices that no triangle uses.
    fn directions(&self, made: &TriangleMesh) -> Vec<Vec3> {
        let mut directions = vec![Vec3::ZERO; self.vertices.sources.len()];
        for (&vertex, &of) in self.corners.iter().zip(&made.indices) {
            if let (Some(direction), Some(normal)) =
                (directions.get_mut(vertex as usize), made.normals.get(of as usize))
            {
                *direction = *normal;
            }
        }
        directions
    }
}

impl<'a> Primitives<'a> {
    pub(crate) fn new(buffers: &'a Buffers<'a>, data: NewData) -> Self {
        let (known, materials) = Default::default();
        Self { buffers, data, notes: Notes::default(), known, materials }
    }

    /// The JSON of `meshes[mesh].primitives[index]` with the lightmap coordinates of `made`, a mesh derived
    /// from it.
    ///
    /// # Errors
    /// [`SaveError::MeshChanged`] if `made` is not that primitive with some vertices split.
    pub(crate) fn lightmapped(
        &mut self,
        patch: &mut Patch,
        mesh: usize,
        index: usize,
        made: &TriangleMesh,
    ) -> Result<Value, SaveError> {
        let document = self.buffers.document;
        let place = format!("{}.primitives[{index}]", document.mesh_place(mesh));
        let unreadable = |problem| SaveError::Source { place: place.clone(), problem: Box::new(problem) };
        let changed = || SaveError::MeshChanged { place: place.clone() };
        let source = document.meshes.get(mesh).and_then(|mesh| mesh.primitives.get(index));
        let original = patch.get(&place!["meshes", mesh, "primitives", index]).cloned();
        let (Some(source), Some(mut primitive)) = (source, original) else { return Err(changed()) };

        let positions = self.read::<3>(&source.attributes, "POSITION", &place).map_err(unreadable)?;
        let positions = positions.ok_or_else(changed)?;
        let corners = corners(self.buffers, source, index, &place, positions.len()).map_err(unreadable)?;
        let same = corners.len() == made.indices.len()
            && corners.iter().zip(&made.indices).all(|(&source, &vertex)| {
                let at = made.positions.get(vertex as usize).map(|position| position.to_array());
                at.map(|at| at.map(f32::to_bits)) == Some(positions[source as usize].map(f32::to_bits))
            });
        if !same || made.uv1.len() != made.positions.len() {
            return Err(changed());
        }
        let first = self.read::<2>(&source.attributes, "TEXCOORD_0", &place).map_err(unreadable)?;
        let second = self.read::<2>(&source.attributes, "TEXCOORD_1", &place).map_err(unreadable)?;
        let equal = |set: &Option<Vec<[f32; 2]>>, of: &[Vec2]| {
            let values = set
                .as_ref()
                .filter(|values| values.len() == positions.len() && of.len() == made.positions.len());
            values.is_some_and(|values| {
                corners
                    .iter()
                    .zip(&made.indices)
                    .all(|(&source, &vertex)| Vec2::from(values[source as usize]) == of[vertex as usize])
            })
        };
        if equal(&second, &made.uv1) {
            return Ok(primitive);
        }
        let compressed = source.extensions.contains_key(COMPRESSED);
        if compressed {
            if let Some(Value::Object(extensions)) = primitive.get_mut("extensions") {
                extensions.shift_remove(COMPRESSED);
                if extensions.is_empty()
                    && let Some(primitive) = primitive.as_object_mut()
                {
                    primitive.shift_remove("extensions");
                }
            }
            self.notes
                .add(&place, "its lightmap coordinates are not in the Draco data; written uncompressed");
        }

        let split = split(&corners, made, positions.len());
        let directions = split.directions(made);
        let whole = split.vertices.complete && split.vertices.sources.len() == positions.len();
        if !whole || compressed {
            let of = (mesh, index);
            self.choose_vertices(patch, of, &place, &mut primitive, positions.len(), &split, &directions);
        } else if let Some(normals) = primitive["attributes"]["NORMAL"].as_u64() {
            let chosen = &split.vertices;
            if let Some(mended) =
                self.mended_normals(patch, normals as usize, &place, positions.len(), chosen, &directions)
            {
                primitive["attributes"]["NORMAL"] = mended.into();
            }
        }
        let coordinates: Vec<[f32; 2]> = split.coordinates.iter().map(Vec2::to_array).collect();
        let alone = first.is_none() && second.is_none();
        let written = self.data.coordinates(patch, &coordinates, alone.then_some(LIGHTMAP_COORDINATES));

        let moved = second.is_some() && !equal(&first, &made.uv0) && equal(&second, &made.uv0);
        let alike = first.is_some() && equal(&first, &made.uv0) && equal(&second, &made.uv0);
        let moves = move_sets(&mut primitive, moved, alike);
        primitive["attributes"]["TEXCOORD_1"] = written.into();
        if alone {
            primitive["attributes"]["TEXCOORD_0"] = written.into();
        }
        self.follow(patch, &mut primitive, &moves);
        Ok(primitive)
    }

    fn read<const N: usize>(
        &self,
        attributes: &Map<String, Value>,
        name: &str,
        place: &str,
    ) -> Result<Option<Vec<[f32; N]>>, LoadProblem> {
        let Some(accessor) = attributes.get(name).and_then(Value::as_u64) else { return Ok(None) };
        let shape = if N == 3 { "VEC3" } else { "VEC2" };
        let used_by = format!("{place}.{name}");
        let mut budget = Budget::new(u64::MAX);
        self.buffers.floats(accessor as usize, &used_by, &[shape], [0.0; N], &mut budget).map(Some)
    }

    /// A new accessor in which normals without a direction are replaced; `None` if all have one.
    fn mended_normals(
        &mut self,
        patch: &mut Patch,
        accessor: usize,
        place: &str,
        vertices: usize,
        chosen: &Vertices,
        directions: &[Vec3],
    ) -> Option<usize> {
        let used_by = format!("{place}.NORMAL");
        let normals =
            Normals { buffers: self.buffers, accessor, used_by: &used_by, vertices, chosen, directions };
        // An accessor that cannot be read is reported where the attribute is copied.
        let (mended, count) = normals.mended(&mut self.data, patch).ok().flatten()?;
        self.notes.add(
            place,
            format!("{count} normals were zero or NaN; those of the faces around them are written instead"),
        );
        Some(mended)
    }

    /// Replaces the vertices of a primitive: its attributes, morph targets and indices.
    #[expect(clippy::too_many_arguments, reason = "one call for all that a primitive gets")]
    fn choose_vertices(
        &mut self,
        patch: &mut Patch,
        (mesh, index): (usize, usize),
        place: &str,
        primitive: &mut Value,
        vertices: usize,
        split: &Split,
        directions: &[Vec3],
    ) {
        let key = (mesh, index, split.vertices.clone(), split.corners.clone());
        if let Some(known) = self.known.get(&key) {
            for (name, value) in known {
                primitive[name] = value.clone();
            }
        } else {
            let mut carried = HashMap::new();
            let mut attributes = primitive.get("attributes").cloned().unwrap_or_default();
            let mut targets = primitive.get("targets").cloned();
            let mended = attributes.get("NORMAL").and_then(Value::as_u64).and_then(|normals| {
                self.mended_normals(patch, normals as usize, place, vertices, &split.vertices, directions)
            });
            let morphs = targets.as_mut().and_then(Value::as_array_mut).into_iter().flatten();
            let lists = std::iter::once(&mut attributes).chain(morphs).filter_map(Value::as_object_mut);
            for (number, list) in lists.enumerate() {
                let first_list = number == 0;
                list.retain(|name, accessor| {
                    let Some(old) = accessor.as_u64().map(|old| old as usize) else { return false };
                    if mended.is_some() && name == "NORMAL" && first_list {
                        return true;
                    }
                    let new = match carried.get(&old) {
                        Some(&known) => Some(known),
                        None => {
                            let used_by = format!("{place}.{name}");
                            let chosen = &split.vertices;
                            let made =
                                self.data.attribute(patch, self.buffers, old, &used_by, vertices, chosen);
                            made.map_err(|problem| self.notes.add(place, format!("{problem}; left out"))).ok()
                        }
                    };
                    if let Some(new) = new {
                        carried.insert(old, new);
                        *accessor = new.into();
                    }
                    new.is_some()
                });
            }
            if let Some(mended) = mended {
                attributes["NORMAL"] = mended.into();
            }
            let replaced = primitive.get("indices").and_then(Value::as_u64).map(|old| old as usize);
            let count = split.vertices.sources.len();
            let indices = self.data.indices(patch, &split.corners, count, replaced);
            let mut written = Map::new();
            written.insert("attributes".to_owned(), attributes);
            written.insert("indices".to_owned(), indices.into());
            if let Some(targets) = targets {
                written.insert("targets".to_owned(), targets);
            }
            for (name, value) in &written {
                primitive[name] = value.clone();
            }
            self.known.insert(key, written);
        }
        // Strips and fans were converted to a list of triangles.
        if let Value::Object(object) = primitive {
            object.shift_remove("mode");
        }
    }

    /// Makes the materials of a primitive read its texture coordinates from their new sets.
    fn follow(&mut self, patch: &mut Patch, primitive: &mut Value, moves: &Moves) {
        if moves.is_empty() {
            return;
        }
        let mut named: Vec<&mut Value> = Vec::new();
        let object = primitive.as_object_mut();
        let mut variants = None;
        for (key, value) in object.into_iter().flatten() {
            match key.as_str() {
                "material" => named.push(value),
                "extensions" => variants = value.pointer_mut("/KHR_materials_variants/mappings"),
                _ => {}
            }
        }
        let mappings = variants.and_then(Value::as_array_mut).into_iter().flatten();
        named.extend(mappings.filter_map(|mapping| mapping.get_mut("material")));
        for material in named {
            let Some(old) = material.as_u64().map(|old| old as usize) else { continue };
            let new = match self.materials.get(&(old, moves.clone())) {
                Some(&known) => known,
                None => {
                    let to =
                        |set: u64| moves.iter().find(|(from, _)| *from == set).map_or(set, |(_, to)| *to);
                    let copy = patch.get(&place!["materials", old]).and_then(|own| with_sets_moved(own, &to));
                    let new = copy.map_or(old, |copy| patch.push("materials", copy));
                    self.materials.insert((old, moves.clone()), new);
                    new
                }
            };
            *material = new.into();
        }
    }
}

/// Renumbers the texture coordinate sets to make TEXCOORD_1 free for the lightmap. The second set becomes the
/// first if the bake moved it there (`to_first`), otherwise it goes to the end, as does a displaced first
/// set. If the first two sets are equal (`alike`), materials just read the first one.
fn move_sets(primitive: &mut Value, to_first: bool, alike: bool) -> Moves {
    let Some(attributes) = primitive.get_mut("attributes").and_then(Value::as_object_mut) else {
        return Moves::new();
    };
    let Some(second) = attributes.get("TEXCOORD_1").cloned() else { return Moves::new() };
    if alike {
        return vec![(1, 0)];
    }
    let mut moves = Moves::new();
    let mut free = (2u64..).filter(|set| !attributes.contains_key(&format!("TEXCOORD_{set}")));
    let end = free.next().unwrap_or(2);
    if to_first {
        if let Some(first) = attributes.insert("TEXCOORD_0".to_owned(), second) {
            attributes.insert(format!("TEXCOORD_{end}"), first);
            moves.push((0, end));
        }
        moves.push((1, 0));
    } else {
        attributes.insert(format!("TEXCOORD_{end}"), second);
        moves.push((1, end));
    }
    moves
}

/// Makes one vertex for every pair of an old vertex and a lightmap coordinate. The old vertices keep their
/// indices, and additional ones follow.
fn split(corners: &[u32], made: &TriangleMesh, count: usize) -> Split {
    let bits = |uv: Vec2| uv.to_array().map(f32::to_bits);
    let mut first: Vec<Option<Vec2>> = vec![None; count];
    let mut further: HashMap<(u32, [u32; 2]), u32> = HashMap::new();
    let mut sources: Vec<u32> = (0u32..).take(count).collect();
    let mut coordinates = vec![Vec2::ZERO; count];
    let mut new_corners = Vec::with_capacity(corners.len());
    for (&source, &vertex) in corners.iter().zip(&made.indices) {
        let uv = made.uv1[vertex as usize];
        let own = first[source as usize].get_or_insert(uv);
        new_corners.push(if bits(*own) == bits(uv) {
            coordinates[source as usize] = uv;
            source
        } else {
            *further.entry((source, bits(uv))).or_insert_with(|| {
                sources.push(source);
                coordinates.push(uv);
                sources.len() as u32 - 1
            })
        });
    }
    let used = first.iter().flatten().count();
    let mut complete = true;
    if used.saturating_mul(MIN_USED) < count {
        complete = false;
        let is_used = |vertex: usize| vertex >= count || first[vertex].is_some();
        let mut place = vec![0; sources.len()];
        let kept: Vec<usize> = (0..sources.len()).filter(|&vertex| is_used(vertex)).collect();
        for (new, &old) in kept.iter().enumerate() {
            place[old] = new as u32;
        }
        new_corners.iter_mut().for_each(|corner| *corner = place[*corner as usize]);
        sources = kept.iter().map(|&old| sources[old]).collect();
        coordinates = kept.iter().map(|&old| coordinates[old]).collect();
    }
    Split { vertices: Vertices { sources, complete }, coordinates, corners: new_corners }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn sets_make_room() {
        let primitive = || json!({"attributes": {"TEXCOORD_0": 3, "TEXCOORD_1": 4, "TEXCOORD_2": 5}});
        let mut own = primitive();
        assert_eq!(move_sets(&mut own, false, false), [(1, 3)]);
        assert_eq!(own["attributes"]["TEXCOORD_3"], 4);
        let mut own = primitive();
        assert_eq!(move_sets(&mut own, true, false), [(0, 3), (1, 0)]);
        assert_eq!(
            (&own["attributes"]["TEXCOORD_0"], &own["attributes"]["TEXCOORD_3"]),
            (&json!(4), &json!(3))
        );
        assert_eq!(move_sets(&mut primitive(), false, true), [(1, 0)]);
        assert_eq!(move_sets(&mut json!({"attributes": {"TEXCOORD_0": 3}}), false, false), []);
    }

    #[test]
    fn a_small_part_of_a_large_list_is_taken_out_of_it() {
        let made = TriangleMesh {
            positions: vec![glam::Vec3::ZERO; 4],
            uv1: vec![Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE],
            indices: vec![0, 1, 2, 3, 2, 1],
            ..TriangleMesh::default()
        };
        let split = split(&[70, 80, 90, 70, 90, 80], &made, 100);
        assert_eq!(split.vertices, Vertices { sources: vec![70, 80, 90, 70], complete: false });
        assert_eq!(split.corners, [0, 1, 2, 3, 2, 1]);
        assert_eq!(split.coordinates, made.uv1);
    }
}
