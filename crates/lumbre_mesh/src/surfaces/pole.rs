//! The normal of a parametric surface where its partial derivatives span no plane: the limit of the normals around.

use glam::{DVec2, DVec3};

use super::parametric::regular_normal;
use super::{ParametricSurface, SurfaceError, direction};

/// How far from the pole normals are taken, as a part of the parameters' widths. The extrapolation's error is of the order of its
/// square times the curvature; differences still have five digits of the derivative there.
const DISTANCE: f64 = 1e-3;
/// Cosine of the angle to which extrapolated normals must agree: 10⁻³ radians.
const AGREEMENT: f64 = 1.0 - 0.5e-6;
/// Other parameters that are tried for the same point.
const PLACES: u32 = 8;
/// Directions in which a place is left.
const DIRECTIONS: u32 = 8;

pub(super) fn limit_normal<S>(surface: &S, u: f64, v: f64) -> Result<DVec3, SurfaceError>
where
    S: ParametricSurface + ?Sized,
{
    let none = SurfaceError::NoTangentPlane { u, v };
    let mut first: Option<DVec3> = None;
    let mut sum = DVec3::ZERO;
    for place in places(surface, DVec2::new(u, v)) {
        for step in 0..DIRECTIONS {
            let turn = std::f64::consts::TAU * f64::from(step) / f64::from(DIRECTIONS);
            let Some(normal) = extrapolated(surface, place, DVec2::from_angle(turn))? else { continue };
            if normal.dot(*first.get_or_insert(normal)) < AGREEMENT {
                return Err(none);
            }
            sum += normal;
        }
    }
    direction(sum).ok_or(none)
}

/// The parameters of the same point: these, and others with the same u or the same v.
fn places<S: ParametricSurface + ?Sized>(surface: &S, place: DVec2) -> Vec<DVec2> {
    let [low, high] = surface.domain();
    let point = surface.point(place.x, place.y);
    let at = |part: u32| low + (high - low) * (f64::from(part) / f64::from(PLACES));
    let others: Vec<DVec2> = (0..PLACES)
        .flat_map(|part| [DVec2::new(at(part).x, place.y), DVec2::new(place.x, at(part).y)])
        .collect();
    let distance = |other: &DVec2| (surface.point(other.x, other.y) - point).length();
    let size = others.iter().map(&distance).fold(0.0, f64::max);
    let same = others.iter().copied().filter(|other| *other != place && distance(other) <= 1e-9 * size);
    std::iter::once(place).chain(same).collect()
}

/// The normal in the limit from one direction: linear extrapolation from two distances. `None` where that leads out of the domain or
/// along a line of points without normals.
fn extrapolated<S>(surface: &S, place: DVec2, direction_of_step: DVec2) -> Result<Option<DVec3>, SurfaceError>
where
    S: ParametricSurface + ?Sized,
{
    let [low, high] = surface.domain();
    let closed = surface.closed();
    let normal = |distance: f64| {
        let mut at = place + direction_of_step * (high - low) * distance;
        for axis in 0..2 {
            if closed[axis] {
                at[axis] = low[axis] + (at[axis] - low[axis]).rem_euclid(high[axis] - low[axis]);
            }
        }
        let inside = at.cmpge(low).all() && at.cmple(high).all();
        if inside { regular_normal(surface, at.x, at.y) } else { Ok(None) }
    };
    let (Some(near), Some(far)) = (normal(0.5 * DISTANCE)?, normal(DISTANCE)?) else { return Ok(None) };
    Ok(direction(near * 2.0 - far))
}
