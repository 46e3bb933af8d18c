//! Surfaces p(u, v) and their normals, the cross product of the partial derivatives. Not the poles, where that vanishes: those are
//! `pole`.

use glam::{DVec2, DVec3};

use super::pole::limit_normal;
use super::{SurfaceError, direction};

/// A surface p(u, v) over a rectangle of parameters.
///
/// Its front is where ∂p/∂u × ∂p/∂v points.
pub trait ParametricSurface {
    /// The least and the greatest (u, v). Nothing is ever asked outside.
    fn domain(&self) -> [DVec2; 2];

    /// Whether the surface closes along u, along v: the same place at both ends, and smooth across.
    fn closed(&self) -> [bool; 2] {
        [false; 2]
    }

    /// The point at (u, v), in metres.
    fn point(&self, u: f64, v: f64) -> DVec3;

    /// ∂p/∂u and ∂p/∂v at (u, v). From differences unless the surface knows them.
    fn partials(&self, u: f64, v: f64) -> [DVec3; 2] {
        difference_partials(self, u, v)
    }

    /// The unit normal at (u, v). From the partial derivatives unless the surface knows it.
    ///
    /// # Errors
    /// As [`parametric_normal`].
    fn normal(&self, u: f64, v: f64) -> Result<DVec3, SurfaceError> {
        parametric_normal(self, u, v)
    }
}

/// Part of the larger partial derivative, each taken over the width of its parameter, below which the smaller one (or the sine
/// between the two) counts as none. Above the error of [`difference_partials`], 10⁻¹⁰; what lies between takes the limit, which is
/// the same normal.
const DEGENERATE: f64 = 1e-8;

/// The unit normal of a parametric surface: n = ∂p/∂u × ∂p/∂v / |…|.
///
/// Where the product vanishes because of the parameters (the poles of a sphere) the normal is the limit of those around, found by
/// extrapolation from 1/1000 and 1/2000 of the parameters' widths; its error is of the order of 10⁻⁸. The normals around must agree
/// to 10⁻³ radians, also those that the parameters call by another name (every longitude, at a pole).
///
/// Source: document \[I\], Vectores normales. (There the third component of the sphere's product is printed cos u sin v; it is
/// cos u sin u.)
///
/// # Errors
/// [`SurfaceError::NotFinite`]; [`SurfaceError::NoTangentPlane`] where the surface itself has no normal, such as a cone's apex.
pub fn parametric_normal<S>(surface: &S, u: f64, v: f64) -> Result<DVec3, SurfaceError>
where
    S: ParametricSurface + ?Sized,
{
    match regular_normal(surface, u, v)? {
        Some(normal) => Ok(normal),
        None => limit_normal(surface, u, v),
    }
}

/// The cross product's direction, or `None` where it vanishes.
pub(super) fn regular_normal<S>(surface: &S, u: f64, v: f64) -> Result<Option<DVec3>, SurfaceError>
where
    S: ParametricSurface + ?Sized,
{
    let [low, high] = surface.domain();
    let [along_u, along_v] = surface.partials(u, v);
    if !(along_u.is_finite() && along_v.is_finite()) {
        return Err(SurfaceError::NotFinite { place: DVec3::new(u, v, 0.0) });
    }
    let (along_u, along_v) = (along_u * (high.x - low.x), along_v * (high.y - low.y));
    let largest = along_u.abs().max(along_v.abs()).max_element();
    if largest == 0.0 {
        return Ok(None);
    }
    let (along_u, along_v) = (along_u / largest, along_v / largest);
    let longer = along_u.length_squared().max(along_v.length_squared());
    let normal = along_u.cross(along_v);
    Ok(if normal.length() <= DEGENERATE * longer { None } else { direction(normal) })
}

/// ∂p/∂u and ∂p/∂v from differences of second order that stay within the domain: central ones inside, (-3 p0 + 4 p1 - p2) / 2h
/// towards the inside at an end, and across the seam where the surface is closed.
///
/// The step is (2^-52)^(1/3) = 6·10⁻⁶ of the parameter's width, which balances what is cut off (h² p'''/6) with the rounding
/// (2^-53 |p| / h): some 10⁻¹⁰ of p per width.
pub fn difference_partials<S>(surface: &S, u: f64, v: f64) -> [DVec3; 2]
where
    S: ParametricSurface + ?Sized,
{
    let [low, high] = surface.domain();
    let closed = surface.closed();
    let partial = |axis: usize| {
        let (low, high, at) = (low[axis], high[axis], [u, v][axis]);
        let point = |value: f64| if axis == 0 { surface.point(value, v) } else { surface.point(u, value) };
        let width = high - low;
        let step = f64::EPSILON.cbrt() * width;
        let (above, below) = (at + step, at - step);
        if closed[axis] {
            let wrap = |value: f64| {
                if value > high {
                    value - width
                } else if value < low {
                    value + width
                } else {
                    value
                }
            };
            return (point(wrap(above)) - point(wrap(below))) / (above - below);
        }
        let one_sided = |step: f64| {
            let (near, far) = (at + step, at + 2.0 * step);
            (point(near) * 4.0 - point(at) * 3.0 - point(far)) / (far - at)
        };
        if below < low {
            one_sided(step)
        } else if above > high {
            one_sided(-step)
        } else {
            (point(above) - point(below)) / (above - below)
        }
    };
    [partial(0), partial(1)]
}
