//! Intersection of rays with surfaces: triangles by `lumbre_rays`, quadrics by their equations. Nothing here
//! knows materials or light.

mod bounding_ball;
mod hierarchy;
mod occluders;
mod owners;
mod quadric;
mod ray;

pub(crate) use hierarchy::{Candidate, Geometry, Hit, Place};
pub(crate) use ray::{RayOrigin, SpaceRay};
