//! Imports primitives as triangle meshes: converts strips and fans, and repairs missing and invalid normals
//! and tangents.

use glam::{Vec2, Vec3, Vec4};
use gltf::json::mesh::{TRIANGLE_FAN, TRIANGLE_STRIP, TRIANGLES};
use lumbre_mesh::TriangleMesh;
use serde_json::Value;

use super::accessor::Buffers;
use super::decoders;
use super::document::Primitive;
use super::error::{LoadProblem, Notes};
use super::limits::Budget;
use super::texture_sets::LIGHTMAP_COORDINATES;

/// Largest deviation of a squared length from 1 for which a vector counts as unit: what f32 and 16-bit
/// exporters leave.
const UNIT_TOLERANCE: f32 = 1e-5;

/// Reads one primitive, or returns `None` if it has no triangles. `place` names its mesh.
pub(crate) fn triangle_mesh(
    buffers: &Buffers<'_>,
    primitive: &Primitive,
    index: usize,
    place: &str,
    budget: &mut Budget,
    notes: &mut Notes,
) -> Result<Option<TriangleMesh>, LoadProblem> {
    let used_by = |attribute: &str| format!("{place}.primitives[{index}].{attribute}");
    let mode = primitive.mode.unwrap_or(TRIANGLES);
    if mode < TRIANGLES {
        notes.add(used_by("mode"), "points and lines are not drawn; left out");
        return Ok(None);
    }
    if mode > TRIANGLE_FAN {
        return Err(LoadProblem::Value {
            place: format!("{place}.primitives[{index}]"),
            field: "mode".to_owned(),
            value: mode.to_string(),
            expected: "use 0 to 6 (4 for triangles)".to_owned(),
        });
    }
    if primitive.targets.is_some() {
        notes.add(place, "morph targets are not supported; the base shape is used");
    }
    if primitive.extensions.contains_key("KHR_draco_mesh_compression")
        && let Some(decoder) = decoders::missing("KHR_draco_mesh_compression")
    {
        notes.add(
            place,
            format!(
                "its uncompressed form is used: this program was built without the Draco decoder (feature `{}`)",
                decoder.feature
            ),
        );
    }
    let mut attributes = Attributes { buffers, primitive, place, index, budget };
    let Some(positions) = attributes.read("POSITION", &["VEC3"], [0.0; 3], None)? else {
        notes.add(used_by("attributes"), "no POSITION; left out");
        return Ok(None);
    };
    let vertices = positions.len();
    let normals = attributes.read_unchecked("NORMAL", &["VEC3"], [0.0; 3], vertices)?;
    let tangents = match attributes.read_unchecked("TANGENT", &["VEC4"], [0.0; 4], vertices) {
        Ok(tangents) => tangents,
        Err(problem @ LoadProblem::TooLarge { .. }) => return Err(problem),
        Err(problem) => {
            notes.repair(&used_by("TANGENT"), problem, "tangents are made anew")?;
            None
        }
    };
    let stand_in = attributes.first_coordinates_stand_in();
    let uv0 =
        if stand_in { None } else { attributes.read("TEXCOORD_0", &["VEC2"], [0.0; 2], Some(vertices))? };
    let uv1 = attributes.read("TEXCOORD_1", &["VEC2"], [0.0; 2], Some(vertices))?;
    let colors = attributes.read("COLOR_0", &["VEC3", "VEC4"], [1.0; 4], Some(vertices))?;
    for unused in ["TEXCOORD_2", "COLOR_1", "JOINTS_0"] {
        if primitive.attributes.contains_key(unused) {
            notes.add(place, format!("the attribute {unused} is not used; ignored"));
        }
    }
    let order = order(buffers, primitive, index, place, vertices, budget)?;
    if mode == TRIANGLES && order.len() % 3 != 0 {
        notes.add(used_by("indices"), "the last triangle is incomplete; left out");
    }
    let indices = triangles(mode, order);
    if indices.is_empty() {
        notes.add(format!("{place}.primitives[{index}]"), "makes no triangles; left out");
        return Ok(None);
    }
    let mut mesh = TriangleMesh {
        positions: positions.into_iter().map(Vec3::from).collect(),
        normals: normals.unwrap_or_default().into_iter().map(Vec3::from).collect(),
        tangents: tangents.unwrap_or_default().into_iter().map(Vec4::from).collect(),
        uv0: uv0.unwrap_or_default().into_iter().map(Vec2::from).collect(),
        uv1: uv1.unwrap_or_default().into_iter().map(Vec2::from).collect(),
        colors: colors.unwrap_or_default().into_iter().map(Vec4::from).collect(),
        indices,
    };
    if mesh.normals.is_empty() {
        if u32::try_from(mesh.indices.len()).is_err() {
            let (needed, limit) = (mesh.indices.len() as u64, u64::from(u32::MAX));
            return Err(LoadProblem::TooLarge { what: used_by("NORMAL"), needed, limit });
        }
        budget.charge(mesh.indices.len() as u64, 64, || used_by("NORMAL"))?;
        // The specification requires tangents to be ignored if there are no normals (section 3.7.2.1).
        mesh.tangents = Vec::new();
        mesh = flat(&mesh);
    } else {
        repair_tangents(&mut mesh, place, notes);
        repair_normals(&mut mesh, place, notes);
    }
    Ok(Some(mesh))
}

/// The vertex indices of a primitive in drawing order, to be interpreted by its mode.
fn order(
    buffers: &Buffers<'_>,
    primitive: &Primitive,
    index: usize,
    place: &str,
    vertices: usize,
    budget: &mut Budget,
) -> Result<Vec<u32>, LoadProblem> {
    let used_by = |attribute: &str| format!("{place}.primitives[{index}].{attribute}");
    let order = match primitive.indices {
        Some(accessor) => buffers.indices(accessor, &used_by("indices"), vertices, budget)?,
        None => {
            let count = u32::try_from(vertices).map_err(|_| LoadProblem::TooLarge {
                what: used_by("POSITION"),
                needed: vertices as u64,
                limit: u64::from(u32::MAX),
            })?;
            budget.charge(u64::from(count), 4, || used_by("indices"))?;
            (0..count).collect()
        }
    };
    if primitive.mode.unwrap_or(TRIANGLES) != TRIANGLES {
        budget.charge(order.len() as u64, 12, || used_by("indices"))?;
    }
    Ok(order)
}

/// The vertex in the file for each corner of each triangle that [`triangle_mesh`] makes of a primitive with
/// this many vertices.
pub(crate) fn corners(
    buffers: &Buffers<'_>,
    primitive: &Primitive,
    index: usize,
    place: &str,
    vertices: usize,
) -> Result<Vec<u32>, LoadProblem> {
    let order = order(buffers, primitive, index, place, vertices, &mut Budget::new(u64::MAX))?;
    Ok(triangles(primitive.mode.unwrap_or(TRIANGLES), order))
}

/// Reads the attributes of one primitive.
struct Attributes<'a> {
    buffers: &'a Buffers<'a>,
    primitive: &'a Primitive,
    place: &'a str,
    index: usize,
    budget: &'a mut Budget,
}

impl Attributes<'_> {
    /// Returns true if TEXCOORD_0 exists only because glTF does not allow the lightmap's TEXCOORD_1 without
    /// it.
    fn first_coordinates_stand_in(&self) -> bool {
        let attributes = &self.primitive.attributes;
        let Some(first) = attributes.get("TEXCOORD_0").and_then(Value::as_u64) else { return false };
        let accessor =
            usize::try_from(first).ok().and_then(|first| self.buffers.document.accessors.get(first));
        attributes.get("TEXCOORD_1").and_then(Value::as_u64) == Some(first)
            && accessor.and_then(|accessor| accessor.name.as_deref()) == Some(LIGHTMAP_COORDINATES)
    }

    fn read<const N: usize>(
        &mut self,
        name: &str,
        shapes: &[&str],
        fill: [f32; N],
        vertices: Option<usize>,
    ) -> Result<Option<Vec<[f32; N]>>, LoadProblem> {
        let Some((accessor, values)) = self.accessor(name, shapes, fill, vertices)? else { return Ok(None) };
        match values.iter().position(|value| !value.iter().all(|number| number.is_finite())) {
            Some(at) => Err(self.error(
                accessor,
                name,
                format!("element {at} is NaN or infinite; export the file again"),
            )),
            None => Ok(Some(values)),
        }
    }

    fn read_unchecked<const N: usize>(
        &mut self,
        name: &str,
        shapes: &[&str],
        fill: [f32; N],
        vertices: usize,
    ) -> Result<Option<Vec<[f32; N]>>, LoadProblem> {
        Ok(self.accessor(name, shapes, fill, Some(vertices))?.map(|(_, values)| values))
    }

    #[expect(
        clippy::type_complexity,
        reason = "the accessor's number beside its values, for the caller's messages"
    )]
    fn accessor<const N: usize>(
        &mut self,
        name: &str,
        shapes: &[&str],
        fill: [f32; N],
        vertices: Option<usize>,
    ) -> Result<Option<(usize, Vec<[f32; N]>)>, LoadProblem> {
        let Some(value) = self.primitive.attributes.get(name) else { return Ok(None) };
        let place = self.place_of(name);
        let accessor = serde_json::from_value(value.clone())
            .map_err(|source| LoadProblem::Json { place: place.clone(), source })?;
        let values = self.buffers.floats(accessor, &place, shapes, fill, self.budget)?;
        match vertices {
            Some(vertices) if values.len() != vertices => {
                let problem = format!(
                    "has {} elements, but POSITION has {vertices}; export the file again",
                    values.len()
                );
                Err(self.error(accessor, name, problem))
            }
            _ => Ok(Some((accessor, values))),
        }
    }

    fn place_of(&self, attribute: &str) -> String {
        format!("{}.primitives[{}].{attribute}", self.place, self.index)
    }

    fn error(&self, accessor: usize, attribute: &str, problem: String) -> LoadProblem {
        LoadProblem::Accessor { accessor, used_by: self.place_of(attribute), problem }
    }
}

/// Converts a list, strip or fan to a list of triangles (glTF 2.0 specification, section 3.7.2.1). Triangles
/// of a strip with a repeated vertex only connect its parts, and are left out.
fn triangles(mode: u32, mut order: Vec<u32>) -> Vec<u32> {
    match mode {
        TRIANGLE_STRIP => {
            let corners =
                order.windows(3).enumerate().filter(|(_, t)| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
            corners
                .flat_map(|(i, t)| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[0], t[2], t[1]] })
                .collect()
        }
        TRIANGLE_FAN => {
            let hub = order.first().copied().unwrap_or_default();
            order.get(1..).unwrap_or_default().windows(2).flat_map(|t| [t[0], t[1], hub]).collect()
        }
        _ => {
            order.truncate(order.len() - order.len() % 3);
            order
        }
    }
}

/// Gives every triangle its own vertices with the face normal, as the specification requires for meshes
/// without normals (section 3.7.2.1). Degenerate triangles get the zero vector.
fn flat(mesh: &TriangleMesh) -> TriangleMesh {
    let normals = mesh
        .triangles()
        .flat_map(|corners| [face_normal(mesh, corners).try_normalize().unwrap_or(Vec3::ZERO); 3]);
    let indices = (0u32..).take(mesh.indices.len()).collect();
    TriangleMesh { normals: normals.collect(), ..mesh.with_vertices(&mesh.indices, indices) }
}

/// The unit normal of a triangle; zero if the triangle is degenerate. Computed in f64, where products of f32
/// neither overflow nor underflow.
fn face_normal(mesh: &TriangleMesh, [a, b, c]: [u32; 3]) -> Vec3 {
    let at = |vertex: u32| mesh.positions[vertex as usize].as_dvec3();
    (at(b) - at(a)).cross(at(c) - at(a)).try_normalize().unwrap_or_default().as_vec3()
}

/// Makes every tangent a unit vector with a handedness of +1 or -1. One without a direction becomes zero,
/// which disables the normal map there.
fn repair_tangents(mesh: &mut TriangleMesh, place: &str, notes: &mut Notes) {
    let mut broken = 0usize;
    for tangent in &mut mesh.tangents {
        let direction = tangent.truncate().as_dvec3();
        let length_squared = direction.length_squared();
        let side = if tangent.w < 0.0 { -1.0 } else { 1.0 };
        if !(length_squared.is_finite() && length_squared > 0.0 && tangent.w.is_finite()) {
            *tangent = Vec4::ZERO;
            broken += 1;
        } else if (length_squared - 1.0).abs() > f64::from(UNIT_TOLERANCE) || tangent.w != side {
            *tangent = (direction / length_squared.sqrt()).as_vec3().extend(side);
        }
    }
    if broken > 0 {
        notes.add(place, format!("{broken} tangents were zero or NaN; a normal map has no effect there"));
    }
}

/// Makes every normal a unit vector. Zero and NaN normals are replaced by the average of the adjacent face
/// normals.
fn repair_normals(mesh: &mut TriangleMesh, place: &str, notes: &mut Notes) {
    let mut broken = vec![false; mesh.normals.len()];
    let mut count = 0usize;
    for (normal, broken) in mesh.normals.iter_mut().zip(&mut broken) {
        let length_squared = normal.as_dvec3().length_squared();
        if !(length_squared.is_finite() && length_squared > 0.0) {
            *normal = Vec3::ZERO;
            *broken = true;
            count += 1;
        } else if (length_squared - 1.0).abs() > f64::from(UNIT_TOLERANCE) {
            *normal = (normal.as_dvec3() / length_squared.sqrt()).as_vec3();
        }
    }
    if count == 0 {
        return;
    }
    for triangle in 0..mesh.triangle_count() {
        let corners = [0, 1, 2].map(|corner| mesh.indices[3 * triangle + corner]);
        if corners.iter().any(|&vertex| broken[vertex as usize]) {
            let face = face_normal(mesh, corners);
            for vertex in corners.into_iter().map(|vertex| vertex as usize).filter(|&vertex| broken[vertex]) {
                mesh.normals[vertex] += face;
            }
        }
    }
    for (normal, _) in mesh.normals.iter_mut().zip(&broken).filter(|(_, broken)| **broken) {
        *normal = normal.try_normalize().unwrap_or(Vec3::ZERO);
    }
    notes.add(place, format!("{count} normals were zero or NaN; replaced by those of the faces around them"));
}
