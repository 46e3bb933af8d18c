//! The side of a cone about the y axis, in implicit and parametric form, without its base.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::{ImplicitSurface, ParametricSurface, SurfaceError, around, direction};

/// A cone with its base of radius r at y = -h/2 and its apex at y = h/2.
///
/// f(p) = x² + z² - (r/h)² (h/2 - y)², which has a second half above the apex; p(u, v) with u the angle from
/// +x towards -z and v the fraction of the way from the base to the apex. The apex has no normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Radius r of the base in metres, greater than 0.
    pub radius: f64,
    /// Height h in metres, greater than 0.
    pub height: f64,
}

impl ImplicitSurface for Cone {
    fn value(&self, point: DVec3) -> f64 {
        let slope = self.radius / self.height;
        let radius = slope * (0.5 * self.height - point.y);
        point.x * point.x + point.z * point.z - radius * radius
    }

    fn scale(&self) -> f64 {
        self.radius
    }

    fn gradient(&self, point: DVec3) -> DVec3 {
        let slope = self.radius / self.height;
        let below = 0.5 * self.height - point.y;
        2.0 * DVec3::new(point.x, slope * slope * below, point.z)
    }
}

impl ParametricSurface for Cone {
    fn domain(&self) -> [DVec2; 2] {
        [DVec2::ZERO, DVec2::new(TAU, 1.0)]
    }

    fn closed(&self) -> [bool; 2] {
        [true, false]
    }

    fn point(&self, u: f64, v: f64) -> DVec3 {
        around(u)[0] * (self.radius * (1.0 - v)) + DVec3::Y * (self.height * v - 0.5 * self.height)
    }

    fn partials(&self, u: f64, v: f64) -> [DVec3; 2] {
        let [out, turn] = around(u);
        [turn * (self.radius * (1.0 - v)), DVec3::Y * self.height - out * self.radius]
    }

    fn normal(&self, u: f64, v: f64) -> Result<DVec3, SurfaceError> {
        let none = SurfaceError::NoTangentPlane { u, v };
        if v >= 1.0 {
            return Err(none);
        }
        direction(around(u)[0] * self.height + DVec3::Y * self.radius).ok_or(none)
    }
}
