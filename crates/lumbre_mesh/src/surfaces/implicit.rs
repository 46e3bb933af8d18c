//! Implicit surfaces f(p) = 0 and their normals, which are the gradients of f. Parametric surfaces are in
//! `parametric`.

use glam::DVec3;

use super::{SurfaceError, direction};

/// A surface f(p) = 0, negative inside and positive outside. Implemented for every `Fn(DVec3) -> f64`.
pub trait ImplicitSurface {
    /// f at a point in metres.
    fn value(&self, point: DVec3) -> f64;

    /// The length in metres over which the surface curves: a radius or a wavelength.
    /// [`central_difference_gradient`] uses a small fraction of it as its step, so it should be right to
    /// within a factor of a hundred or so.
    fn scale(&self) -> f64 {
        1.0
    }

    /// The gradient of f, in units of f per metre; zero where f has none. Computed from central differences
    /// unless overridden.
    fn gradient(&self, point: DVec3) -> DVec3 {
        central_difference_gradient(self, point)
    }
}

impl<F: Fn(DVec3) -> f64> ImplicitSurface for F {
    fn value(&self, point: DVec3) -> f64 {
        self(point)
    }
}

/// The unit normal of an implicit surface at a point on it: n = ∇f / |∇f|, in the direction in which f
/// increases.
///
/// Source: document \[I\], Vectores normales (for the sphere f = p·p - 1, ∇f = 2p).
///
/// # Errors
/// [`SurfaceError::NotFinite`] if the point or gradient is not finite; [`SurfaceError::Singular`] if the
/// gradient is zero.
pub fn implicit_normal<S: ImplicitSurface + ?Sized>(
    surface: &S,
    point: DVec3,
) -> Result<DVec3, SurfaceError> {
    let gradient = surface.gradient(point);
    if !(point.is_finite() && gradient.is_finite()) {
        return Err(SurfaceError::NotFinite { place: point });
    }
    direction(gradient).ok_or(SurfaceError::Singular { point })
}

/// The gradient from central differences, (f(p + h e) - f(p - h e)) / 2h along each axis e.
///
/// The step balances two errors: truncating the series costs h² f'''/6, and rounding costs 2^-53 |f| / h, so
/// the best h is about (2^-52)^(1/3) = 6·10⁻⁶ times the [`scale`](ImplicitSurface::scale), and the error
/// about 10⁻¹⁰ of the gradient. The step is never less than 2^-26 of the coordinate, so that p + h and p
/// differ in half of their digits. The difference is divided by the distance between p + h and p - h as
/// rounded, so their rounding causes no error. Where f is finite on one side only (at the edge of a square
/// root's domain), the one-sided difference is used, with half the digits. The result is NaN where f is
/// finite on neither side.
pub fn central_difference_gradient<S: ImplicitSurface + ?Sized>(surface: &S, point: DVec3) -> DVec3 {
    let along = |axis: DVec3| {
        let coordinate = point.dot(axis).abs();
        let step = (f64::EPSILON.cbrt() * surface.scale().abs()).max(2f64.powi(-26) * coordinate);
        let step = if step > 0.0 { step } else { f64::MIN_POSITIVE };
        let (above, below) = (point + axis * step, point - axis * step);
        let (f_above, f_below) = (surface.value(above), surface.value(below));
        let width = |from: DVec3, to: DVec3| (to - from).dot(axis);
        match (f_above.is_finite(), f_below.is_finite()) {
            (true, true) => (f_above - f_below) / width(below, above),
            (true, false) => (f_above - surface.value(point)) / width(point, above),
            (false, true) => (surface.value(point) - f_below) / width(below, point),
            (false, false) => f64::NAN,
        }
    };
    DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z))
}
