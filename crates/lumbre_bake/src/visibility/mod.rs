//! Geometric visibility: clipping of polygons, shafts between a source and a receiver, and shadows cut out of lamps and
//! receivers. Visibility by rays is in `scene::occlusion`.

pub(crate) mod clipping;
pub(crate) mod contacts;
pub(crate) mod cut_out;
#[cfg(test)]
pub(crate) mod lambert_integral;
pub(crate) mod occluders;
pub(crate) mod polygon;
pub(crate) mod shadow_clipping;
pub(crate) mod shaft;
pub(crate) mod solid_angle;
pub(crate) mod visible_part;

pub(crate) use contacts::PlaneFrame;
pub(crate) use cut_out::{PolygonClipper, Shadow};
pub(crate) use occluders::{LampOccluders, Visibility};
pub(crate) use shadow_clipping::{LightVisibility, Origin, ReceiverShape};
pub(crate) use shaft::{Area, Shaft};
