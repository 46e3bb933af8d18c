//! Parametric surfaces p(u, v) and their normals, the cross products of the partial derivatives. Where these
//! vanish, as at poles, the normals are computed in `pole`.

use glam::{DVec2, DVec3};

use super::pole::limit_normal;
use super::{SurfaceError, direction};

/// A surface p(u, v) over a rectangle of parameters.
///
/// The front is the side to which ∂p/∂u × ∂p/∂v points.
pub trait ParametricSurface {
    /// The smallest and largest (u, v). The surface is never evaluated outside.
    fn domain(&self) -> [DVec2; 2];

    /// Whether the surface is closed along u and along v, i.e. both ends are the same and joined smoothly.
    fn closed(&self) -> [bool; 2] {
        [false; 2]
    }

    /// The point at (u, v), in metres.
    fn point(&self, u: f64, v: f64) -> DVec3;

    /// ∂p/∂u and ∂p/∂v at (u, v). Computed from differences unless overridden.
    fn partials(&self, u: f64, v: f64) -> [DVec3; 2] {
        difference_partials(self, u, v)
    }

    /// The unit normal at (u, v). Computed from the partial derivatives unless overridden.
    ///
    /// # Errors
    /// As [`parametric_normal`].
    fn normal(&self, u: f64, v: f64) -> Result<DVec3, SurfaceError> {
        parametric_normal(self, u, v)
    }
}

/// Threshold for degenerate derivatives, relative to the larger one, with both multiplied by the widths of
/// their parameters: below it, the smaller one (or the sine of the angle between the two) counts as zero. It
/// is above the error of [`difference_partials`], 10⁻¹⁰; derivatives in between use the limit, which is the
/// same normal.
const DEGENERATE: f64 = 1e-8;

/// The unit normal of a parametric surface: n = ∂p/∂u × ∂p/∂v / |…|.
///
/// Where the product vanishes only because of the parametrization (at the poles of a sphere), the normal is
/// the limit of those nearby, extrapolated from distances of 1/1000 and 1/2000 of the parameters' widths; its
/// error is of the order of 10⁻⁸. The normals nearby must agree to 10⁻³ radians, including those around other
/// parameters of the same point (every longitude, at a pole).
///
/// Source: document \[I\], Vectores normales. (There the third component of the sphere's product is printed
/// cos u sin v; it is cos u sin u.)
///
/// # Errors
/// [`SurfaceError::NotFinite`] if a derivative is not finite; [`SurfaceError::NoTangentPlane`] where the
/// surface itself has no normal, such as at a cone's apex.
pub fn parametric_normal<S>(surface: &S, u: f64, v: f64) -> Result<DVec3, SurfaceError>
where
    S: ParametricSurface + ?Sized,
{
    match regular_normal(surface, u, v)? {
        Some(normal) => Ok(normal),
        None => limit_normal(surface, u, v),
    }
}

/// The direction of the cross product, or `None` where it vanishes.
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

/// ∂p/∂u and ∂p/∂v from second-order differences that stay within the domain: central differences inside, (-3
/// p0 + 4 p1 - p2) / 2h towards the inside at an end, and central differences across the seam of a closed
/// parameter.
///
/// The step is (2^-52)^(1/3) = 6·10⁻⁶ of the parameter's width, which balances truncation (h² p'''/6) and
/// rounding (2^-53 |p| / h): an error of about 10⁻¹⁰ of p per width.
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
