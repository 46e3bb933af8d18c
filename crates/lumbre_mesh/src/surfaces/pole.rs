//! The normal of a parametric surface where its partial derivatives span no plane: the limit of the normals
//! nearby.

use glam::{DVec2, DVec3};

use super::parametric::regular_normal;
use super::{ParametricSurface, SurfaceError, direction};

/// Distance from the pole at which normals are taken, as a fraction of the parameters' widths. The error of
/// the extrapolation is of the order of its square times the curvature; difference quotients still have five
/// correct digits there.
const DISTANCE: f64 = 1e-3;
/// Cosine of the largest angle between extrapolated normals that counts as agreement: 10⁻³ radians.
const AGREEMENT: f64 = 1.0 - 0.5e-6;
/// Number of other values per parameter that are tried to find the same point.
const PLACES: u32 = 8;
/// Number of directions in which normals are extrapolated.
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

/// Parameters of the same point: the given ones, and others that differ in u or v only.
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

/// The limit of the normal along one direction, by linear extrapolation from two distances. `None` if the
/// direction leads out of the domain or along a line of points without normals.
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
