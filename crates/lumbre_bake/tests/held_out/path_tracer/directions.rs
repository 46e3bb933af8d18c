//! Samples the next direction of a path: by the cosine or, in a region with openings, half of the time towards one of
//! the openings through which light enters.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::super::scenes::region::Region;

pub struct Directions {
    region: Option<Region>,
}

impl Directions {
    pub fn new(region: Option<Region>) -> Self {
        Self { region: region.filter(|region| !region.openings.is_empty()) }
    }

    /// Samples a direction by two uniform numbers. Returns it with the ratio of the cosine density to the density that
    /// it was sampled with, or `None` if it lies below the horizon.
    pub fn choose(&self, origin: DVec3, normal: DVec3, u: f64, v: f64) -> Option<(DVec3, f64)> {
        let guided = self.region.as_ref().filter(|region| region.holds(origin));
        let Some(Region { openings, .. }) = guided else { return Some((cosine(normal, u, v), 1.0)) };
        let direction = if u < 0.5 {
            cosine(normal, 2.0 * u, v)
        } else {
            let number = (2.0 * u - 1.0) * openings.len() as f64;
            let [corner, right, up] = openings[(number as usize).min(openings.len() - 1)];
            (corner + right * number.fract() + up * v - origin).try_normalize()?
        };
        let facing = normal.dot(direction);
        if facing <= 0.0 {
            return None;
        }
        let density = |opening: &[DVec3; 3]| density(origin, direction, opening);
        let through = openings.iter().map(density).sum::<f64>() / openings.len() as f64;
        let by_cosine = facing / PI;
        Some((direction, by_cosine / (0.5 * by_cosine + 0.5 * through)))
    }
}

/// The density per solid angle of the direction to a point chosen uniformly on a rectangle.
fn density(origin: DVec3, direction: DVec3, [corner, right, up]: &[DVec3; 3]) -> f64 {
    let across = right.cross(*up);
    let ahead = direction.dot(across);
    let distance = (*corner - origin).dot(across) / ahead;
    if !(distance > 0.0 && distance.is_finite()) {
        return 0.0;
    }
    let at = origin + direction * distance - *corner;
    let inside = |edge: DVec3| (-1e-12..=1.0 + 1e-12).contains(&(at.dot(edge) / edge.length_squared()));
    // Squared distance over the projected area: |across| is the rectangle's area.
    if inside(*right) && inside(*up) { distance * distance / ahead.abs() } else { 0.0 }
}

/// A direction distributed by the cosine about a normal.
pub fn cosine(normal: DVec3, u: f64, v: f64) -> DVec3 {
    let (right, up) = normal.any_orthonormal_pair();
    let (radius, angle) = (u.sqrt(), TAU * v);
    (right * (radius * angle.cos()) + up * (radius * angle.sin()) + normal * (1.0 - u).max(0.0).sqrt())
        .normalize()
}
