//! Meshes of simple shapes with exact normals and texture coordinates, for scenes, tests and demonstrations.
//!
//! All shapes are centred at the origin with +y up, and closed shapes face outwards. Counts out of range are
//! clamped to the documented range; functions named `try_` return an error instead. Vertices are split where
//! normals or texture coordinates are discontinuous, so weld positions
//! ([`weld_positions`](crate::weld_positions)) before counting vertices.

mod flat_sided;
mod revolution;
mod sphere;

pub use flat_sided::{cuboid, plane};
pub use revolution::{cone, cylinder, disc, torus, uv_sphere};
pub use sphere::{MAX_DEPTH, ShapeError, tetrahedral_sphere, try_tetrahedral_sphere};

/// Largest number of segments, rings or columns.
pub use crate::grid::MAX_SEGMENTS;
