//! Tangents for normal maps, computed from texture coordinates by MikkTSpace.
//!
//! glTF requires this algorithm for files without tangents, and the tools that bake normal maps use it too;
//! tangents of another algorithm would make their seams visible. MikkTSpace's bitangent points towards
//! increasing v. The green of glTF's normal maps points the other way, since v runs down the image, so w has
//! the opposite sign here.

use std::collections::HashMap;

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{Vec2, Vec3, Vec4};

use crate::{MeshError, TriangleMesh};

/// Most triangles that may meet at one position. The library's time grows with the square of their number,
/// and its stack with the number itself. The caps and poles of shapes have some hundred.
const MAX_AROUND: usize = 4096;

/// One of a mesh's sets of texture coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TextureCoordinateSet {
    /// `uv0`.
    #[default]
    First,
    /// `uv1`.
    Second,
}

impl TriangleMesh {
    /// Returns the mesh with tangents computed from one of its sets of texture coordinates. Triangles keep
    /// their order. A vertex at which its triangles' tangents differ, because the texture is mirrored or cut
    /// there, is split.
    ///
    /// A triangle whose coordinates or positions coincide or are not finite takes the tangents of its
    /// neighbours. Without neighbours, or for a mesh without coordinates or normals, tangents are zero, which
    /// disables normal maps. The same holds for all tangents of a mesh with more than 4,096 triangles at one
    /// position.
    ///
    /// ```
    /// use glam::{Vec3, Vec4};
    /// use lumbre_mesh::{TextureCoordinateSet, shapes};
    ///
    /// // u grows along x, and v along z.
    /// let floor = shapes::plane(1.0, 1.0, 1, 1).with_tangents(TextureCoordinateSet::First)?;
    /// assert_eq!(floor.tangents[0].truncate(), Vec3::X);
    /// # Ok::<(), lumbre_mesh::MeshError>(())
    /// ```
    ///
    /// # Errors
    /// [`MeshError`] if the mesh is not [valid](Self::validate).
    pub fn with_tangents(&self, set: TextureCoordinateSet) -> Result<Self, MeshError> {
        self.validate()?;
        let coordinates = match set {
            TextureCoordinateSet::First => &self.uv0,
            TextureCoordinateSet::Second => &self.uv1,
        };
        let tangents = if coordinates.is_empty()
            || self.normals.is_empty()
            || self.most_triangles_around_a_place() > MAX_AROUND
        {
            vec![Vec4::ZERO; self.indices.len()]
        } else {
            let mut corners =
                Corners { mesh: self, coordinates, tangents: vec![Vec4::ZERO; self.indices.len()] };
            match generate_tangents(&mut corners) {
                Ok(()) => corners.tangents,
                // The error type has no variants in this version of the library.
                Err(_) => vec![Vec4::ZERO; self.indices.len()],
            }
        };
        Ok(self.split_by(&tangents))
    }

    /// The largest number of triangle corners at one position.
    fn most_triangles_around_a_place(&self) -> usize {
        let mut around: HashMap<[u32; 3], usize> = HashMap::new();
        for &vertex in &self.indices {
            // MikkTSpace welds vertices by value, not by index. Adding 0 turns -0 into 0.
            *around
                .entry((self.positions[vertex as usize] + 0.0).to_array().map(f32::to_bits))
                .or_default() += 1;
        }
        around.into_values().max().unwrap_or(0)
    }

    /// Splits vertices whose corners have different tangents.
    fn split_by(&self, corners: &[Vec4]) -> Self {
        const NONE: u32 = u32::MAX;
        // For each vertex, its first copy; for each copy, the next copy of the same vertex.
        let mut first = vec![NONE; self.positions.len()];
        let mut next: Vec<u32> = Vec::new();
        let (mut sources, mut tangents): (Vec<u32>, Vec<Vec4>) = (Vec::new(), Vec::new());
        let mut copy_of = |vertex: u32, tangent: Vec4| {
            let mut copy = first[vertex as usize];
            while copy != NONE && tangents[copy as usize] != tangent {
                copy = next[copy as usize];
            }
            if copy == NONE {
                copy = sources.len() as u32;
                sources.push(vertex);
                tangents.push(tangent);
                next.push(first[vertex as usize]);
                first[vertex as usize] = copy;
            }
            copy
        };
        let indices = self.indices.iter().zip(corners).map(|(&vertex, &tangent)| copy_of(vertex, tangent));
        let indices = indices.collect();
        Self { tangents, ..self.with_vertices(&sources, indices) }
    }
}

/// The mesh in the form that MikkTSpace reads, corner by corner.
struct Corners<'a> {
    mesh: &'a TriangleMesh,
    coordinates: &'a [Vec2],
    tangents: Vec<Vec4>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.mesh.indices[3 * face + corner] as usize
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.mesh.triangle_count()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        let position = self.mesh.positions[self.vertex(face, corner)];
        if position.is_finite() { position.to_array() } else { [0.0; 3] }
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        let normal = self.mesh.normals[self.vertex(face, corner)];
        if normal.is_finite() { normal.to_array() } else { [0.0; 3] }
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        let uv = self.coordinates[self.vertex(face, corner)];
        if uv.is_finite() { uv.to_array() } else { [0.0; 2] }
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        let tangent = space.map_or(Vec4::ZERO, |space| Vec4::from(space.tangent_encoded()));
        let direction = tangent.truncate();
        let usable = direction.is_finite() && direction != Vec3::ZERO;
        self.tangents[3 * face + corner] = if usable { direction.extend(-tangent.w) } else { Vec4::ZERO };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square in the xy plane whose right half has the left half's texture, mirrored.
    fn folded() -> TriangleMesh {
        let columns = [0.0, 1.0, 2.0];
        let point = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        TriangleMesh {
            positions: columns.iter().flat_map(|&x| [point(x, 0.0), point(x, 1.0)]).collect(),
            normals: vec![Vec3::Z; 6],
            uv0: columns
                .iter()
                .flat_map(|&x: &f32| [0.0, 1.0].map(|y| Vec2::new(1.0 - (x - 1.0).abs(), 1.0 - y)))
                .collect(),
            indices: vec![0, 2, 1, 1, 2, 3, 2, 4, 3, 3, 4, 5],
            ..TriangleMesh::default()
        }
    }

    #[test]
    fn a_fan_of_more_triangles_than_a_stack_holds_ends() {
        let count = 200_000u32;
        let rim = (0..=count).map(|i| {
            let angle = std::f32::consts::TAU * i as f32 / count as f32;
            Vec3::new(angle.cos(), 0.0, angle.sin())
        });
        let positions: Vec<Vec3> = std::iter::once(Vec3::ZERO).chain(rim).collect();
        let fan = TriangleMesh {
            normals: vec![Vec3::Y; positions.len()],
            uv0: positions.iter().map(|p| Vec2::new(p.x, p.z)).collect(),
            indices: (1..=count).flat_map(|i| [0, i + 1, i]).collect(),
            positions,
            ..TriangleMesh::default()
        };
        let with = fan.with_tangents(TextureCoordinateSet::First).expect("it is sound");
        assert_eq!(with.triangle_count(), count as usize);
        assert!(with.tangents.iter().all(|tangent| *tangent == Vec4::ZERO));
    }

    #[test]
    fn a_mirrored_texture_splits_the_vertices_of_its_seam() {
        let mesh = folded().with_tangents(TextureCoordinateSet::First).unwrap();
        mesh.validate().unwrap();
        // The two vertices on the fold are split.
        assert_eq!(mesh.positions.len(), 8);
        for (at, triangle) in mesh.triangles().enumerate() {
            for vertex in triangle {
                let (tangent, side) = (mesh.tangents[vertex as usize], if at < 2 { 1.0 } else { -1.0 });
                assert_eq!(tangent.truncate(), side * Vec3::X);
                // Green points up the image, towards smaller v, on both sides: along y.
                assert_eq!(Vec3::Z.cross(tangent.truncate()) * tangent.w, Vec3::Y);
            }
        }
        // The triangles keep their order and positions.
        let places = |mesh: &TriangleMesh| mesh.triangle_positions().unwrap();
        assert_eq!(places(&mesh), places(&folded()));
    }

    #[test]
    fn what_has_no_direction_has_no_tangent() {
        let mut point = folded();
        point.uv0 = vec![Vec2::splat(0.5); 6];
        let mesh = point.with_tangents(TextureCoordinateSet::First).unwrap();
        assert!(mesh.tangents.iter().all(|tangent| tangent.is_finite()), "{:?}", mesh.tangents);
        let none = folded().with_tangents(TextureCoordinateSet::Second).unwrap();
        assert_eq!((none.tangents, none.positions), (vec![Vec4::ZERO; 6], none_split()));
        let broken = TriangleMesh { indices: vec![0, 1, 9], ..folded() };
        assert!(broken.with_tangents(TextureCoordinateSet::First).is_err());
    }

    /// The positions of the folded square in the order in which triangles first use them.
    fn none_split() -> Vec<Vec3> {
        [0, 2, 1, 3, 4, 5].map(|vertex: usize| folded().positions[vertex]).to_vec()
    }

    #[test]
    fn meshes_of_any_numbers_get_tangents_that_are_numbers() {
        // Few vertices, so that triangles share them, degenerate and coincide. The generator is linear
        // congruential.
        let mut state = 1u64;
        let mut next = move |below: u32| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as u32 % below
        };
        const NUMBERS: [f32; 10] =
            [0.0, -0.0, 1.0, -1.0, 0.5, 1e-38, 1e30, f32::MAX, f32::NAN, f32::INFINITY];
        for _ in 0..3000 {
            let vertices = 1 + next(7);
            let calm = next(2) == 0;
            let mut number = || if calm { next(5) as f32 } else { NUMBERS[next(10) as usize] };
            let vectors = |number: &mut dyn FnMut() -> f32| {
                (0..vertices).map(|_| Vec3::new(number(), number(), number())).collect::<Vec<_>>()
            };
            let (positions, normals) = (vectors(&mut number), vectors(&mut number));
            let uv0 = (0..vertices).map(|_| Vec2::new(number(), number())).collect();
            let triangles = next(9);
            let indices = (0..3 * triangles).map(|_| next(vertices)).collect();
            let mesh = TriangleMesh { positions, normals, uv0, indices, ..TriangleMesh::default() };
            let made = mesh.with_tangents(TextureCoordinateSet::First).unwrap();
            made.validate().unwrap();
            assert!(made.tangents.iter().all(|tangent| tangent.is_finite()), "{mesh:?}");
        }
    }
}
