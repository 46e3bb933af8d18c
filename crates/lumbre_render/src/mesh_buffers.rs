//! GPU copies of meshes: one buffer per attribute, made when a variant first asks for it. Who uses which is decided in `draws`.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DVec3, Vec3, Vec4};
use lumbre_mesh::TriangleMesh;
use wgpu::util::DeviceExt;

use crate::Gpu;

/// Attributes in the order of their shader locations.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Attribute {
    Position,
    Normal,
    Uv0,
    Uv1,
    Color,
    Centroid,
}

impl Attribute {
    pub const ALL: [Self; 6] =
        [Self::Position, Self::Normal, Self::Uv0, Self::Uv1, Self::Color, Self::Centroid];

    pub fn format(self) -> wgpu::VertexFormat {
        match self {
            Self::Position | Self::Normal | Self::Centroid => wgpu::VertexFormat::Float32x3,
            Self::Uv0 | Self::Uv1 => wgpu::VertexFormat::Float32x2,
            Self::Color => wgpu::VertexFormat::Float32x4,
        }
    }
}

/// The vertices of a mesh for one rate of evaluation.
#[derive(Debug, Default)]
struct VertexBuffers {
    attributes: [Option<wgpu::Buffer>; 6],
}

/// The GPU's copy of one mesh.
#[derive(Debug)]
pub(crate) struct GpuMesh {
    source: Arc<TriangleMesh>,
    indexed: VertexBuffers,
    indices: Option<wgpu::Buffer>,
    /// Three vertices per triangle, for flat shading.
    expanded: VertexBuffers,
    /// Middle of the bounding box in mesh space.
    pub center: DVec3,
    /// Half its sides.
    pub half_size: DVec3,
}

/// A draw's worth of buffers.
pub(crate) struct MeshSlices<'a> {
    pub attributes: Vec<&'a wgpu::Buffer>,
    pub indices: Option<&'a wgpu::Buffer>,
    pub count: u32,
}

impl GpuMesh {
    fn new(source: Arc<TriangleMesh>) -> Self {
        let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for position in source.positions.iter().filter(|position| position.is_finite()) {
            (min, max) = (min.min(*position), max.max(*position));
        }
        let (center, half_size) = if min.cmple(max).all() {
            let (min, max) = (min.as_dvec3(), max.as_dvec3());
            (0.5 * (min + max), 0.5 * (max - min))
        } else {
            (DVec3::ZERO, DVec3::ZERO)
        };
        Self {
            source,
            indexed: VertexBuffers::default(),
            indices: None,
            expanded: VertexBuffers::default(),
            center,
            half_size,
        }
    }

    /// Number of triangles.
    pub fn triangles(&self) -> usize {
        self.source.triangle_count()
    }

    /// Makes what is missing of these attributes.
    pub fn prepare(&mut self, gpu: &Gpu, attributes: &[Attribute], flat: bool) {
        let buffers = if flat { &mut self.expanded } else { &mut self.indexed };
        for &attribute in attributes {
            let slot = &mut buffers.attributes[attribute as usize];
            if slot.is_none() {
                let bytes = if flat {
                    expanded_attribute(&self.source, attribute)
                } else {
                    indexed_attribute(&self.source, attribute)
                };
                *slot = Some(vertex_buffer(gpu, &bytes, wgpu::BufferUsages::VERTEX));
            }
        }
        if !flat && self.indices.is_none() {
            let bytes = bytemuck::cast_slice(&self.source.indices);
            self.indices = Some(vertex_buffer(gpu, bytes, wgpu::BufferUsages::INDEX));
        }
    }

    /// The buffers that `prepare` made, in order.
    pub fn slices(&self, attributes: &[Attribute], flat: bool) -> MeshSlices<'_> {
        let buffers = if flat { &self.expanded } else { &self.indexed };
        let found = attributes.iter().filter_map(|a| buffers.attributes[*a as usize].as_ref()).collect();
        MeshSlices {
            attributes: found,
            indices: if flat { None } else { self.indices.as_ref() },
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

/// One attribute in vertex order; an absent one reads as its neutral value.
fn indexed_attribute(mesh: &TriangleMesh, attribute: Attribute) -> Vec<u8> {
    let count = mesh.positions.len();
    match attribute {
        Attribute::Position | Attribute::Centroid => bytemuck::cast_slice(&mesh.positions).to_vec(),
        Attribute::Normal => filled(&mesh.normals, Vec3::ZERO, count),
        Attribute::Uv0 => filled(&mesh.uv0, glam::Vec2::ZERO, count),
        Attribute::Uv1 => filled(&mesh.uv1, glam::Vec2::ZERO, count),
        Attribute::Color => filled(&mesh.colors, Vec4::ONE, count),
    }
}

fn filled<T: bytemuck::Pod>(values: &[T], neutral: T, count: usize) -> Vec<u8> {
    if values.len() == count {
        bytemuck::cast_slice(values).to_vec()
    } else {
        bytemuck::cast_slice(&vec![neutral; count]).to_vec()
    }
}

/// One attribute with three vertices per triangle: the normal is the face's, the centroid the triangle's, both computed in f64.
fn expanded_attribute(mesh: &TriangleMesh, attribute: Attribute) -> Vec<u8> {
    fn spread<T: bytemuck::Pod>(mesh: &TriangleMesh, values: &[T], neutral: T) -> Vec<u8> {
        let at = |index: u32| values.get(index as usize).copied().unwrap_or(neutral);
        bytemuck::cast_slice(&mesh.indices.iter().map(|&index| at(index)).collect::<Vec<T>>()).to_vec()
    }
    let per_face = |value: &dyn Fn([DVec3; 3]) -> DVec3| -> Vec<u8> {
        let corner = |index: u32| mesh.positions.get(index as usize).copied().unwrap_or_default().as_dvec3();
        let faces = mesh.triangles().flat_map(|triangle| [value(triangle.map(corner)).as_vec3(); 3]);
        bytemuck::cast_slice(&faces.collect::<Vec<Vec3>>()).to_vec()
    };
    match attribute {
        Attribute::Position => spread(mesh, &mesh.positions, Vec3::ZERO),
        Attribute::Normal => {
            per_face(&|[a, b, c]| (b - a).cross(c - a).try_normalize().unwrap_or(DVec3::ZERO))
        }
        Attribute::Centroid => per_face(&|[a, b, c]| (a + b + c) / 3.0),
        Attribute::Uv0 => spread(mesh, &mesh.uv0, glam::Vec2::ZERO),
        Attribute::Uv1 => spread(mesh, &mesh.uv1, glam::Vec2::ZERO),
        Attribute::Color => spread(mesh, &mesh.colors, Vec4::ONE),
    }
}

/// Address of a shared mesh: what entities share, the GPU shares.
pub(crate) type MeshKey = usize;

/// Every mesh in use.
#[derive(Debug, Default)]
pub(crate) struct MeshBuffers {
    meshes: HashMap<MeshKey, GpuMesh>,
}

impl MeshBuffers {
    /// The key of a mesh, known from now on.
    pub fn insert(&mut self, mesh: &Arc<TriangleMesh>) -> MeshKey {
        let key = Arc::as_ptr(mesh) as usize;
        // The copy keeps the Arc alive, so that an address never names another mesh.
        self.meshes.entry(key).or_insert_with(|| GpuMesh::new(Arc::clone(mesh)));
        key
    }

    pub fn get(&self, key: MeshKey) -> Option<&GpuMesh> {
        self.meshes.get(&key)
    }

    pub fn get_mut(&mut self, key: MeshKey) -> Option<&mut GpuMesh> {
        self.meshes.get_mut(&key)
    }

    /// Forgets meshes that no entity holds any more.
    pub fn sweep(&mut self) {
        self.meshes.retain(|_, mesh| Arc::strong_count(&mesh.source) > 1);
    }
}
