//! The indexed triangle mesh that all other crates use. Adjacency is in `adjacency`.

use glam::{Vec2, Vec3, Vec4};

/// An indexed triangle mesh. An attribute vector is either empty (absent) or as long as `positions`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Positions in metres.
    pub positions: Vec<Vec3>,
    /// Unit normals. A zero vector marks a normal that could not be computed.
    pub normals: Vec<Vec3>,
    /// Unit tangents in the direction of increasing u, stored as in glTF's TANGENT: w is +1 or -1, and
    /// (normal x tangent) w is the direction of a normal map's green, towards decreasing v. Empty in most
    /// meshes; [`with_tangents`](Self::with_tangents) computes them.
    pub tangents: Vec<Vec4>,
    /// TEXCOORD_0: coordinates of material textures.
    pub uv0: Vec<Vec2>,
    /// TEXCOORD_1: lightmap coordinates in [0, 1].
    pub uv1: Vec<Vec2>,
    /// Linear RGBA vertex colours.
    pub colors: Vec<Vec4>,
    /// Three vertex indices per triangle, counter-clockwise seen from the front.
    pub indices: Vec<u32>,
}

impl TriangleMesh {
    /// Number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.indices.len() / 3
    }

    /// The vertex indices of every triangle.
    pub fn triangles(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]])
    }

    /// The corners of every triangle in metres, e.g. for building an acceleration structure.
    ///
    /// # Errors
    /// [`MeshError`] if the mesh is not [valid](Self::validate).
    pub fn triangle_positions(&self) -> Result<Vec<[Vec3; 3]>, MeshError> {
        self.validate()?;
        Ok(self.triangles().map(|t| t.map(|vertex| self.positions[vertex as usize])).collect())
    }

    /// Checks that the number of indices is a multiple of three, that they are in range, and that attributes
    /// are as long as the positions.
    ///
    /// Positions that are not finite and degenerate triangles are valid; each algorithm documents how it
    /// treats them.
    ///
    /// # Errors
    /// The first [`MeshError`] found.
    pub fn validate(&self) -> Result<(), MeshError> {
        if !self.indices.len().is_multiple_of(3) {
            return Err(MeshError::IncompleteTriangle { indices: self.indices.len() });
        }
        let vertices = self.positions.len();
        if let Some(at) = self.indices.iter().position(|&index| index as usize >= vertices) {
            return Err(MeshError::IndexOutOfRange { triangle: at / 3, index: self.indices[at], vertices });
        }
        for (attribute, found) in [
            ("normals", self.normals.len()),
            ("tangents", self.tangents.len()),
            ("uv0", self.uv0.len()),
            ("uv1", self.uv1.len()),
            ("colors", self.colors.len()),
        ] {
            if found != 0 && found != vertices {
                return Err(MeshError::AttributeLength { attribute, found, vertices });
            }
        }
        Ok(())
    }

    /// A mesh with the vertices `sources` of this one, including all attributes.
    ///
    /// `indices` must be valid indices into `sources`.
    ///
    /// # Panics
    /// If `sources` contains a vertex that this mesh does not have.
    pub fn with_vertices(&self, sources: &[u32], indices: Vec<u32>) -> Self {
        fn copy<T: Copy>(values: &[T], sources: &[u32]) -> Vec<T> {
            if values.is_empty() { Vec::new() } else { sources.iter().map(|&s| values[s as usize]).collect() }
        }
        Self {
            positions: copy(&self.positions, sources),
            normals: copy(&self.normals, sources),
            tangents: copy(&self.tangents, sources),
            uv0: copy(&self.uv0, sources),
            uv1: copy(&self.uv1, sources),
            colors: copy(&self.colors, sources),
            indices,
        }
    }
}

/// Why a mesh is invalid.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// The number of indices is not a multiple of 3.
    #[error("{indices} indices do not make whole triangles; give three per triangle")]
    IncompleteTriangle {
        /// Number of indices found.
        indices: usize,
    },
    /// A triangle uses a vertex that does not exist.
    #[error("triangle {triangle} uses vertex {index}, but the mesh has {vertices} vertices")]
    IndexOutOfRange {
        /// Index of the triangle.
        triangle: usize,
        /// The index out of range.
        index: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// The length of an attribute is neither 0 nor the number of vertices.
    #[error("{attribute} has {found} entries for {vertices} vertices; give one per vertex or none")]
    AttributeLength {
        /// Name of the field of [`TriangleMesh`], or `metric positions`.
        attribute: &'static str,
        /// Its length.
        found: usize,
        /// Number of vertices.
        vertices: usize,
    },
}
