//! Indexed triangle meshes and the geometry that lighting needs: normals, adjacency, exact shapes and
//! lightmap coordinates.
//!
//! The crate knows no ECS, GPU or files; its interface uses `glam` types only.
//!
//! ```text
//!   surfaces ► shapes ┐              ┌─► normals (flat, smooth)
//!                   ├─► TriangleMesh ┼─► flat (triangle, normal, centroid)
//!                   │                ├─► tangents (MikkTSpace)
//!                   │                ├─► surface_spread (bounds on triangle size and curvature)
//!   a file's mesh ──┘                ├─► weld ─► adjacency
//!                                    └─► unwrap ─► charts ─► atlas ─► uv1 ─► uv_validation
//! ```
//!
//! ```
//! use lumbre_mesh::{UnwrapOptions, shapes, unwrap, uv_validation::validate_uv1};
//!
//! let room = shapes::cuboid(glam::Vec3::new(4.0, 2.5, 3.0), 1);
//! // 16 texels per metre; the mesh stands in the world as it is.
//! let unwrapped = unwrap(&room, &room.positions, 16.0, UnwrapOptions::default())?;
//! assert_eq!(unwrapped.charts.len(), 6);
//! let report = validate_uv1(&unwrapped.mesh, unwrapped.width, unwrapped.height)?;
//! assert!(report.is_sound());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod adjacency;
pub mod atlas;
mod bounding_rectangle;
mod box_clip;
mod chart;
pub mod flat;
mod grid;
pub mod normals;
mod planar_overlap;
mod plane;
pub mod shapes;
mod surface_spread;
pub mod surfaces;
mod tangents;
mod triangle_mesh;
mod unwrap;
pub mod uv_validation;
mod vertex_split;
mod weld;

pub use adjacency::Adjacency;
pub use plane::MeshPlane;
pub use surface_spread::{MAX_PATCHES, NormalCone, SurfacePatch, SurfaceSpread};
pub use tangents::TextureCoordinateSet;
pub use triangle_mesh::{MeshError, TriangleMesh};
pub use unwrap::{Chart, Charted, UnwrapError, UnwrapOptions, Unwrapped, unwrap};
pub use weld::weld_positions;
