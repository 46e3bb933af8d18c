//! Where rays meet surfaces: triangles by `lumbre_rays`, quadrics by their equations. No light and no materials.

mod bounding_ball;
mod hierarchy;
mod quadric;
mod ray;

pub(crate) use hierarchy::{Crossing, Geometry, Meeting, Place};
pub(crate) use ray::SpaceRay;
