//! The side of a cylinder about the y axis, in implicit and parametric form, without its caps.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::{ImplicitSurface, ParametricSurface, SurfaceError, around};

/// f(p) = x² + z² - r², which is infinitely long; p(u, v) with u the angle from +x towards -z and v the
/// height, from -h/2 to h/2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// Radius r in metres, greater than 0.
    pub radius: f64,
    /// Height h in metres, greater than 0.
    pub height: f64,
}

impl ImplicitSurface for Cylinder {
    fn value(&self, point: DVec3) -> f64 {
        point.x * point.x + point.z * point.z - self.radius * self.radius
    }

    fn scale(&self) -> f64 {
        self.radius
    }

    fn gradient(&self, point: DVec3) -> DVec3 {
        DVec3::new(2.0 * point.x, 0.0, 2.0 * point.z)
    }
}

impl ParametricSurface for Cylinder {
    fn domain(&self) -> [DVec2; 2] {
        let half = 0.5 * self.height;
        [DVec2::new(0.0, -half), DVec2::new(TAU, half)]
    }

    fn closed(&self) -> [bool; 2] {
        [true, false]
    }

    fn point(&self, u: f64, v: f64) -> DVec3 {
        around(u)[0] * self.radius + DVec3::Y * v
    }

    fn partials(&self, u: f64, _v: f64) -> [DVec3; 2] {
        [around(u)[1] * self.radius, DVec3::Y]
    }

    fn normal(&self, u: f64, _v: f64) -> Result<DVec3, SurfaceError> {
        Ok(around(u)[0])
    }
}
