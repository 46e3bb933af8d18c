//! GPU copies of meshes: one buffer per attribute, created when a variant first needs it. Which draw uses
//! which is decided in `draws`.

use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

use glam::{DVec3, Vec3, Vec4};
use lumbre_mesh::{MeshError, SurfaceSpread, TextureCoordinateSet, TriangleMesh};
use lumbre_optics::FlatRule;
use wgpu::util::DeviceExt;

use crate::Gpu;
use crate::layout::coefficient;

/// Vertex attributes in the order of their shader locations.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Attribute {
    Position,
    Normal,
    Uv0,
    Uv1,
    Color,
    Centroid,
    Tangent,
}

impl Attribute {
    pub const ALL: [Self; 7] =
        [Self::Position, Self::Normal, Self::Uv0, Self::Uv1, Self::Color, Self::Centroid, Self::Tangent];

    pub fn format(self) -> wgpu::VertexFormat {
        match self {
            Self::Position | Self::Normal | Self::Centroid => wgpu::VertexFormat::Float32x3,
            Self::Uv0 | Self::Uv1 => wgpu::VertexFormat::Float32x2,
            Self::Color | Self::Tangent => wgpu::VertexFormat::Float32x4,
        }
    }
}

/// The attribute buffers of a mesh, with shared or with expanded vertices.
#[derive(Debug, Default)]
struct VertexBuffers {
    attributes: [Option<wgpu::Buffer>; Attribute::ALL.len()],
}

/// The GPU's copy of one mesh.
#[derive(Debug)]
pub(crate) struct GpuMesh {
    /// The mesh as the entities have it.
    shared: Arc<TriangleMesh>,
    /// The same mesh, with tangents once they were needed.
    source: Arc<TriangleMesh>,
    /// The texture coordinates of its normal map, if the mesh needs tangents for one.
    tangents: Option<TextureCoordinateSet>,
    indexed: VertexBuffers,
    indices: Option<wgpu::Buffer>,
    /// Three vertices per triangle, for flat shading by each rule.
    expanded: [VertexBuffers; FlatRule::ALL.len()],
    /// Centre of the bounding box in mesh space.
    pub center: DVec3,
    /// Half the sides of that box.
    pub half_size: DVec3,
    /// Set if an index is out of range, so that the mesh cannot be drawn. Missing attributes are no fault;
    /// they read as neutral values.
    pub fault: Option<MeshError>,
    /// Size and curvature of its triangles, computed on first use.
    spread: OnceLock<SurfaceSpread>,
}

/// Returns the centre of the bounding box in mesh space and half its sides.
pub(crate) fn mesh_box(mesh: &TriangleMesh) -> (DVec3, DVec3) {
    let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for position in mesh.positions.iter().filter(|position| position.is_finite()) {
        (min, max) = (min.min(*position), max.max(*position));
    }
    if min.cmple(max).all() {
        let (min, max) = (min.as_dvec3(), max.as_dvec3());
        (0.5 * (min + max), 0.5 * (max - min))
    } else {
        (DVec3::ZERO, DVec3::ZERO)
    }
}

/// The buffers of one draw.
pub(crate) struct MeshSlices<'a> {
    pub attributes: Vec<&'a wgpu::Buffer>,
    pub indices: Option<&'a wgpu::Buffer>,
    pub count: u32,
}

impl GpuMesh {
    fn new(source: Arc<TriangleMesh>, tangents: Option<TextureCoordinateSet>) -> Self {
        let (center, half_size) = mesh_box(&source);
        let fault = source.validate().err();
        let fault = fault.filter(|fault| matches!(fault, MeshError::IndexOutOfRange { .. }));
        Self {
            fault,
            spread: OnceLock::new(),
            shared: Arc::clone(&source),
            source,
            tangents,
            indexed: VertexBuffers::default(),
            indices: None,
            expanded: Default::default(),
            center,
            half_size,
        }
    }

    /// Returns the number of triangles.
    pub fn triangles(&self) -> usize {
        self.source.triangle_count()
    }

    /// Returns the number of vertices.
    pub fn vertices(&self) -> usize {
        self.source.positions.len()
    }

    /// Returns size and curvature of its triangles. The first call looks at all of them.
    pub fn spread(&self) -> &SurfaceSpread {
        self.spread.get_or_init(|| SurfaceSpread::of(&self.shared))
    }

    /// Creates the missing buffers of these attributes, and returns the uploaded bytes.
    pub fn prepare(&mut self, gpu: &Gpu, attributes: &[Attribute], flat: Option<FlatRule>) -> u64 {
        let mut uploaded = match attributes.contains(&Attribute::Tangent) {
            true => self.make_tangents(gpu),
            false => 0,
        };
        let buffers = match flat {
            Some(rule) => &mut self.expanded[rule as usize],
            None => &mut self.indexed,
        };
        for &attribute in attributes {
            let slot = &mut buffers.attributes[attribute as usize];
            if slot.is_none() {
                let bytes = match flat {
                    Some(rule) => expanded_attribute(&self.source, attribute, rule),
                    None => indexed_attribute(&self.source, attribute),
                };
                uploaded += bytes.len() as u64;
                *slot = Some(vertex_buffer(gpu, &bytes, wgpu::BufferUsages::VERTEX));
            }
        }
        if flat.is_none() && self.indices.is_none() {
            let bytes: &[u8] = bytemuck::cast_slice(&self.source.indices);
            uploaded += bytes.len() as u64;
            self.indices = Some(vertex_buffer(gpu, bytes, wgpu::BufferUsages::INDEX));
        }
        uploaded
    }

    /// Computes tangents for a mesh that has none. This may split vertices, so existing indexed buffers are
    /// created again. Returns the bytes uploaded for that.
    fn make_tangents(&mut self, gpu: &Gpu) -> u64 {
        let Some(set) = self.tangents.filter(|_| self.source.tangents.is_empty()) else { return 0 };
        // An invalid mesh shows its normal map as if it were flat.
        let Ok(source) = self.source.with_tangents(set) else { return 0 };
        self.source = Arc::new(source);
        self.indices = None;
        let made = std::mem::take(&mut self.indexed.attributes);
        let again: Vec<_> =
            Attribute::ALL.into_iter().filter(|attribute| made[*attribute as usize].is_some()).collect();
        if again.is_empty() { 0 } else { self.prepare(gpu, &again, None) }
    }

    /// Returns true if `prepare` has created indexed positions.
    pub fn has_positions(&self) -> bool {
        self.indexed.attributes[Attribute::Position as usize].is_some()
    }

    /// Returns the buffers that `prepare` created, in order.
    pub fn slices(&self, attributes: &[Attribute], flat: Option<FlatRule>) -> MeshSlices<'_> {
        let buffers = flat.map_or(&self.indexed, |rule| &self.expanded[rule as usize]);
        let found = attributes.iter().filter_map(|a| buffers.attributes[*a as usize].as_ref()).collect();
        MeshSlices {
            attributes: found,
            indices: if flat.is_some() { None } else { self.indices.as_ref() },
            count: u32::try_from(self.source.triangle_count() * 3).unwrap_or(u32::MAX),
        }
    }
}

fn vertex_buffer(gpu: &Gpu, bytes: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
    gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("mesh"),
        contents: if bytes.is_empty() { &[0; 16] } else { bytes },
        usage,
    })
}

/// Returns one attribute in vertex order; a missing one reads as its neutral value.
fn indexed_attribute(mesh: &TriangleMesh, attribute: Attribute) -> Vec<u8> {
    let count = mesh.positions.len();
    match attribute {
        Attribute::Position | Attribute::Centroid => bytemuck::cast_slice(&mesh.positions).to_vec(),
        Attribute::Normal => filled(&mesh.normals, Vec3::ZERO, count, usable_normal),
        Attribute::Uv0 => filled(&mesh.uv0, glam::Vec2::ZERO, count, |uv| uv),
        Attribute::Uv1 => filled(&mesh.uv1, glam::Vec2::ZERO, count, |uv| uv),
        Attribute::Color => filled(&mesh.colors, Vec4::ONE, count, usable_color),
        Attribute::Tangent => filled(&mesh.tangents, Vec4::ZERO, count, usable_tangent),
    }
}

/// Returns a normal whose square fits into f32. One that is not finite becomes the zero vector, which takes
/// ambient light only.
fn usable_normal(normal: Vec3) -> Vec3 {
    let largest = normal.abs().max_element();
    match (normal.is_finite(), largest > LARGEST_NORMAL) {
        (false, _) => Vec3::ZERO,
        (true, true) => normal / largest,
        (true, false) => normal,
    }
}

/// Returns a tangent whose square fits into f32. One that is not finite becomes the zero vector, on which a
/// normal map has no effect.
fn usable_tangent(tangent: Vec4) -> Vec4 {
    let side = if tangent.w < 0.0 { -1.0 } else { 1.0 };
    usable_normal(tangent.truncate()).extend(side)
}

/// Normals with a larger component than this are scaled down before they are squared.
const LARGEST_NORMAL: f32 = 1e9;

/// Returns a vertex colour that light can be multiplied by. An alpha that is not finite becomes 1.
fn usable_color(color: Vec4) -> Vec4 {
    let alpha = if color.w.is_finite() { color.w } else { 1.0 };
    coefficient(color.truncate()).extend(alpha)
}

fn filled<T: bytemuck::Pod>(values: &[T], neutral: T, count: usize, usable: impl Fn(T) -> T) -> Vec<u8> {
    if values.len() == count {
        bytemuck::cast_slice(&values.iter().map(|value| usable(*value)).collect::<Vec<T>>()).to_vec()
    } else {
        bytemuck::cast_slice(&vec![neutral; count]).to_vec()
    }
}

/// Returns one attribute with three vertices per triangle. All three have the values that flat shading
/// evaluates once for the polygon: by the centroid rule the face's normal, the centroid and the mean colour,
/// computed in f64; otherwise those of one vertex.
fn expanded_attribute(mesh: &TriangleMesh, attribute: Attribute, rule: FlatRule) -> Vec<u8> {
    fn value<T: Copy>(values: &[T], neutral: T, index: u32) -> T {
        values.get(index as usize).copied().unwrap_or(neutral)
    }
    fn spread<T: bytemuck::Pod>(mesh: &TriangleMesh, per_corner: impl Fn([u32; 3], usize) -> T) -> Vec<u8> {
        let corners =
            mesh.triangles().flat_map(|triangle| [0, 1, 2].map(|corner| per_corner(triangle, corner)));
        bytemuck::cast_slice(&corners.collect::<Vec<T>>()).to_vec()
    }
    let place = |index| value(&mesh.positions, Vec3::ZERO, index).as_dvec3();
    // The corner that provides the polygon's values; `None` by the centroid rule.
    let provoking = match rule {
        FlatRule::Centroid => None,
        FlatRule::FirstVertex => Some(0),
        FlatRule::LastVertex => Some(2),
    };
    match (attribute, provoking) {
        (Attribute::Position, _) => {
            spread(mesh, |triangle, corner| value(&mesh.positions, Vec3::ZERO, triangle[corner]))
        }
        (Attribute::Normal, None) => spread(mesh, |triangle, _| {
            let [a, b, c] = triangle.map(place);
            (b - a).cross(c - a).try_normalize().unwrap_or(DVec3::ZERO).as_vec3()
        }),
        (Attribute::Normal, Some(first)) => {
            spread(mesh, |triangle, _| usable_normal(value(&mesh.normals, Vec3::ZERO, triangle[first])))
        }
        (Attribute::Centroid, None) => spread(mesh, |triangle, _| {
            let [a, b, c] = triangle.map(place);
            ((a + b + c) / 3.0).as_vec3()
        }),
        (Attribute::Centroid, Some(first)) => spread(mesh, |triangle, _| place(triangle[first]).as_vec3()),
        (Attribute::Uv0, _) => {
            spread(mesh, |triangle, corner| value(&mesh.uv0, glam::Vec2::ZERO, triangle[corner]))
        }
        (Attribute::Uv1, _) => {
            spread(mesh, |triangle, corner| value(&mesh.uv1, glam::Vec2::ZERO, triangle[corner]))
        }
        (Attribute::Tangent, _) => spread(mesh, |triangle, corner| {
            usable_tangent(value(&mesh.tangents, Vec4::ZERO, triangle[corner]))
        }),
        (Attribute::Color, provoking) => spread(mesh, |triangle, corner| {
            let color = |corner: usize| usable_color(value(&mesh.colors, Vec4::ONE, triangle[corner]));
            let flat = match provoking {
                Some(first) => color(first),
                None => (color(0) + color(1) + color(2)) / 3.0,
            };
            // Alpha is not lit, so each corner keeps its own.
            flat.truncate().extend(color(corner).w)
        }),
    }
}

/// Address of a shared mesh, and the texture coordinates that tangents have to be computed for, if any.
/// Meshes that entities share are also shared on the GPU.
pub(crate) type MeshKey = (usize, Option<TextureCoordinateSet>);

/// Every mesh in use.
#[derive(Debug, Default)]
pub(crate) struct MeshBuffers {
    meshes: HashMap<MeshKey, GpuMesh>,
}

impl MeshBuffers {
    /// Registers a mesh and returns its key. `normal_map` is the set of coordinates that its normal map
    /// reads, if it has one.
    pub fn insert(&mut self, mesh: &Arc<TriangleMesh>, normal_map: Option<TextureCoordinateSet>) -> MeshKey {
        let key = (Arc::as_ptr(mesh) as usize, normal_map.filter(|_| mesh.tangents.is_empty()));
        // The copy keeps the Arc alive, so the address cannot be reused by another mesh.
        self.meshes.entry(key).or_insert_with(|| GpuMesh::new(Arc::clone(mesh), key.1));
        key
    }

    pub fn get(&self, key: MeshKey) -> Option<&GpuMesh> {
        self.meshes.get(&key)
    }

    pub fn get_mut(&mut self, key: MeshKey) -> Option<&mut GpuMesh> {
        self.meshes.get_mut(&key)
    }

    /// Drops meshes that no entity uses any more.
    pub fn sweep(&mut self) {
        let mut held: HashMap<usize, usize> = HashMap::new();
        for (key, mesh) in &self.meshes {
            let own = if Arc::ptr_eq(&mesh.shared, &mesh.source) { 2 } else { 1 };
            *held.entry(key.0).or_default() += own;
        }
        self.meshes.retain(|key, mesh| Arc::strong_count(&mesh.shared) > held[&key.0]);
    }
}
