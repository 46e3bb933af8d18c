//! Bounds of polygon lights.

use std::f64::consts::PI;

use glam::DVec3;

use super::{Allowed, FLUSHED, Numbers, U, vectors};

/// arc_excess: the polynomial's 1.5·10⁻⁷ and 6 u: its alternating terms are off by 2 u each, and their magnitudes
/// add up to three times the sum.
pub fn arc_excess(excess: f64) -> f64 {
    excess * (1.5e-7 + 6.0 * U) + FLUSHED
}

/// polygon_form_factor: farther away than the polygon's size, a few u times the aspect ratio, relative to the form
/// factor for a surface that faces it; nearer, 2·10⁻⁵ and 8 u of its size over the distance to its nearest edge,
/// the horizon included. On the polygon itself, where rounding decides on which side of its plane the point is, any
/// value.
pub fn polygon_form_factor(
    corner: DVec3,
    u: DVec3,
    v: DVec3,
    triangle: bool,
    point: DVec3,
    normal: DVec3,
) -> Allowed {
    let area_vector = u.cross(v);
    let middle = (u + v) * if triangle { 1.0 / 3.0 } else { 0.5 };
    let center = corner - point + middle;
    let longest = u.length().max(v.length()).max((u - v).length());
    let area = area_vector.length();
    let aspect = longest * longest / area.max(1e-30);
    let distance = center.length();
    let face_on = area / (PI * distance * distance).max(1e-30);
    let error = match distance > longest {
        true => (1e-6 + 3e-7 * aspect) * face_on,
        // A corner relative to the point is off by u of the polygon's size, and an edge's direction by that over
        // its distance.
        false => {
            let mut nearest = nearest_edge(corner - point, u, v, triangle);
            let corners =
                [corner, corner + u, corner + v, corner + u + v].map(|corner| normal.dot(corner - point));
            if corners.iter().any(|height| *height < 0.0) && corners.iter().any(|height| *height >= 0.0) {
                // The horizon is an edge too, and is as near as the polygon's plane.
                nearest = nearest.min(area_vector.dot(center).abs() / area.max(1e-30)).max(1e-30);
            }
            2e-5 * (1.0 + 0.1 * aspect) + (8.0 * U * longest / nearest).min(1.0)
        }
    };
    let size = vectors::cross_size(u, v).dot(center.abs());
    let open = area_vector.dot(center).abs() <= 8.0 * U * size + 10.0 * FLUSHED;
    // There the point sees either nothing of the polygon, or what a point slightly in front of the plane sees:
    // almost nothing beside the polygon, and up to everything on it.
    let error =
        if open { error + if distance > 2.0 * longest { 1e-4 * face_on } else { 1.0 } } else { error };
    Allowed::from(error + FLUSHED).or(open, || Numbers::from_slice(&[0.0]))
}

/// Returns the distance from the point to the nearest edge; the polygon is relative to the point.
fn nearest_edge(corner: DVec3, u: DVec3, v: DVec3, triangle: bool) -> f64 {
    let corners = match triangle {
        true => vec![corner, corner + u, corner + v],
        false => vec![corner, corner + u, corner + u + v, corner + v],
    };
    let to_edge = |at: usize| {
        let (start, edge) = (corners[at], corners[(at + 1) % corners.len()] - corners[at]);
        let along = (-start.dot(edge) / edge.length_squared().max(1e-30)).clamp(0.0, 1.0);
        (start + along * edge).length()
    };
    (0..corners.len()).map(to_edge).fold(f64::INFINITY, f64::min).max(1e-30)
}
