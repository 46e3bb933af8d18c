//! Shapes with exact normals and texture coordinates: for scenes, tests and demonstrations. Not a modeller.
//!
//! All are centred on the origin with +y up, closed shapes face outward, and counts out of range are clamped to
//! the range in the text (functions in `try_` refuse instead). Vertices are split where normals or texture coordinates break, so weld positions
//! ([`weld_positions`](crate::weld_positions)) before counting vertices.

mod flat_sided;
mod revolution;
mod sphere;

pub use flat_sided::{cuboid, plane};
pub use revolution::{cone, cylinder, torus, uv_sphere};
pub use sphere::{MAX_DEPTH, ShapeError, tetrahedral_sphere, try_tetrahedral_sphere};

/// Largest count of segments, rings or columns.
pub use crate::grid::MAX_SEGMENTS;
