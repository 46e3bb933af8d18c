//! The cone of a spotlight against spheres: the ball around the light also holds places that its cone does not
//! touch. The clusters that such spheres enclose are in `light_clusters`.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

/// By how much a spotlight's cone is widened, in radians. The device rounds the cosine of its angle.
const ANGLE_MARGIN: f64 = 1e-3;

/// The cone of a spotlight.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightCone {
    apex: DVec3,
    axis: DVec3,
    cosine: f64,
    sine: f64,
}

impl LightCone {
    /// The cone about the unit vector `axis` whose half angle has this cosine, in any space.
    pub fn new(apex: DVec3, axis: DVec3, cosine: f64) -> Self {
        let angle = (cosine.acos() + ANGLE_MARGIN).min(FRAC_PI_2);
        let (sine, cosine) = angle.sin_cos();
        Self { apex, axis, cosine, sine }
    }

    /// Returns false only if no point of the sphere lies in the cone (Wronski, "Cull that cone!", 2017).
    pub fn touches(&self, center: DVec3, radius: f64) -> bool {
        let from_apex = center - self.apex;
        let along = from_apex.dot(self.axis);
        let aside = (from_apex.length_squared() - along * along).max(0.0).sqrt();
        along > -radius && aside * self.cosine - along * self.sine < radius
    }
}
