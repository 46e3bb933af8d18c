//! The sphere about the origin, in implicit form and parametrized by longitude and latitude.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::{ImplicitSurface, ParametricSurface, SurfaceError, around};

/// f(p) = p·p - r²; p(u, v) with u the longitude from +x towards -z and v the angle from the south pole (-y).
///
/// Source: document \[I\], Vectores normales, there with radius 1 and about the z axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Radius r in metres, greater than 0.
    pub radius: f64,
}

impl ImplicitSurface for Sphere {
    fn value(&self, point: DVec3) -> f64 {
        point.length_squared() - self.radius * self.radius
    }

    fn scale(&self) -> f64 {
        self.radius
    }

    fn gradient(&self, point: DVec3) -> DVec3 {
        2.0 * point
    }
}

impl ParametricSurface for Sphere {
    fn domain(&self) -> [DVec2; 2] {
        [DVec2::ZERO, DVec2::new(TAU, PI)]
    }

    fn closed(&self) -> [bool; 2] {
        [true, false]
    }

    fn point(&self, u: f64, v: f64) -> DVec3 {
        unit_point(u, v) * self.radius
    }

    fn partials(&self, u: f64, v: f64) -> [DVec3; 2] {
        let ([out, turn], (sin, cos)) = (around(u), v.sin_cos());
        [turn * (self.radius * sin), (out * cos + DVec3::Y * sin) * self.radius]
    }

    /// Exact, including at the poles.
    fn normal(&self, u: f64, v: f64) -> Result<DVec3, SurfaceError> {
        Ok(unit_point(u, v))
    }
}

/// The point on the unit sphere. Exact at both poles, where the rounding of π would otherwise leave a circle
/// of radius 10⁻¹⁶.
fn unit_point(u: f64, v: f64) -> DVec3 {
    if v == PI {
        return DVec3::Y;
    }
    let (sin, cos) = v.sin_cos();
    around(u)[0] * sin - DVec3::Y * cos
}
