//! The cone of a spotlight against clusters: the sphere around the light also contains clusters that its cone
//! does not touch. The clusters themselves are in `light_clusters`.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use crate::light_clusters::{Axis, BoundingSphere, ClusteredView, margin};

/// By how much a spotlight's cone is widened, in radians. The device rounds the cosine of its angle.
const ANGLE_MARGIN: f64 = 1e-3;

/// The cone of a spotlight in view space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ViewCone {
    apex: DVec3,
    axis: DVec3,
    cosine: f64,
    sine: f64,
    /// By how much spheres are enlarged that are tested, in metres, for the rounding of the light's place.
    margin: f64,
}

impl ViewCone {
    /// Returns the cone of a light; `None` if it has none.
    pub fn new(view: &ClusteredView, sphere: &BoundingSphere) -> Option<Self> {
        let cone = sphere.cone?;
        let apex = cone.apex(sphere.center, sphere.radius);
        let angle = (f64::from(cone.cosine).acos() + ANGLE_MARGIN).min(FRAC_PI_2);
        let (sine, cosine) = angle.sin_cos();
        Some(Self {
            apex: view.turned(apex - view.view.eye),
            axis: view.turned(cone.axis.as_dvec3()),
            cosine,
            sine,
            margin: margin(view, sphere),
        })
    }

    /// Returns a run of columns in a row of a slice without the clusters at its ends that the cone does not
    /// touch; `None` if it touches none. `depths` are those of the slice, as far as the light reaches. A
    /// cluster is tested by the sphere around it (Wronski, "Cull that cone!", 2017).
    pub fn narrowed(
        &self,
        [mut left, mut right]: [u32; 2],
        row: u32,
        [columns, rows]: [&Axis; 2],
        [near, far]: [f64; 2],
    ) -> Option<[u32; 2]> {
        let half_depth = 0.5 * (far - near);
        let depth = near + half_depth;
        let (y, half_height) = rows.tile(row, depth, far, half_depth);
        let touches = |column: u32| {
            let (x, half_width) = columns.tile(column, depth, far, half_depth);
            let half_size = DVec3::new(half_width, half_height, half_depth);
            let radius = half_size.length() + self.margin;
            let from_apex = DVec3::new(x, y, depth) - self.apex;
            let along = from_apex.dot(self.axis);
            let aside = (from_apex.length_squared() - along * along).max(0.0).sqrt();
            along > -radius && aside * self.cosine - along * self.sine < radius
        };
        while !touches(left) {
            left += 1;
            if left > right {
                return None;
            }
        }
        while !touches(right) {
            right -= 1;
        }
        Some([left, right])
    }
}
