//! The torus about the y axis, in implicit form and parametrized by two angles.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::{ImplicitSurface, ParametricSurface, SurfaceError, around, from_axis};

/// f(p) = (√(x² + z²) - R)² + y² - r², which has no gradient on the axis; p(u, v) with u the angle around the
/// axis from +x towards -z and v the angle around the tube from the outside upwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Torus {
    /// R: the distance from the axis to the centre of the tube in metres, greater than `minor_radius`.
    pub major_radius: f64,
    /// r: the radius of the tube in metres, greater than 0.
    pub minor_radius: f64,
}

impl ImplicitSurface for Torus {
    fn value(&self, point: DVec3) -> f64 {
        let across = from_axis(point).0 - self.major_radius;
        across * across + point.y * point.y - self.minor_radius * self.minor_radius
    }

    fn scale(&self) -> f64 {
        self.minor_radius
    }

    fn gradient(&self, point: DVec3) -> DVec3 {
        let (distance, out) = from_axis(point);
        if distance == 0.0 {
            return DVec3::ZERO;
        }
        2.0 * (out * (distance - self.major_radius) + DVec3::Y * point.y)
    }
}

impl ParametricSurface for Torus {
    fn domain(&self) -> [DVec2; 2] {
        [DVec2::ZERO, DVec2::splat(TAU)]
    }

    fn closed(&self) -> [bool; 2] {
        [true; 2]
    }

    fn point(&self, u: f64, v: f64) -> DVec3 {
        let (out, normal) = directions(u, v);
        out * self.major_radius + normal * self.minor_radius
    }

    fn partials(&self, u: f64, v: f64) -> [DVec3; 2] {
        let ([out, turn], (sin, cos)) = (around(u), v.sin_cos());
        [
            turn * (self.major_radius + self.minor_radius * cos),
            (DVec3::Y * cos - out * sin) * self.minor_radius,
        ]
    }

    fn normal(&self, u: f64, v: f64) -> Result<DVec3, SurfaceError> {
        Ok(directions(u, v).1)
    }
}

/// The unit directions away from the axis and away from the centre of the tube.
fn directions(u: f64, v: f64) -> (DVec3, DVec3) {
    let (out, (sin, cos)) = (around(u)[0], v.sin_cos());
    (out, out * cos + DVec3::Y * sin)
}
