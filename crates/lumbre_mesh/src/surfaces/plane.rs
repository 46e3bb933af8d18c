//! The normal of the plane through three points. For triangles of a mesh, `normals::face_normal` accepts any
//! area above 0.

use glam::DVec3;

use super::{SurfaceError, direction};

/// Sine of the angle at a corner below which the normal would be determined by rounding: the error of the
/// cross product of two edges is at most 6 · 2^-53 of the product of their lengths (each edge rounds once,
/// each product and difference once).
const SMALLEST_SINE: f64 = 16.0 * f64::EPSILON;

/// The unit normal of the plane through three points, on the side from which they are counter-clockwise: n =
/// (p1 - p0) × (p2 - p0) / |…|.
///
/// Document \[I\] (Vectores normales) has the factors in the opposite order, which gives the opposite side.
/// The product is taken at the corner between the two shortest edges, where it is most accurate.
///
/// # Errors
/// [`SurfaceError::NotFinite`] if a coordinate is not finite; [`SurfaceError::Collinear`] if the points lie
/// on one line, or so close to one that the normal would be determined by rounding.
pub fn plane_normal(points: &[DVec3; 3]) -> Result<DVec3, SurfaceError> {
    if let Some(place) = points.iter().find(|point| !point.is_finite()) {
        return Err(SurfaceError::NotFinite { place: *place });
    }
    // Halved before the subtraction and scaled to 1 after it, so that planes of any size do not overflow.
    // Halving is exact.
    let edges = [0, 1, 2].map(|corner| points[(corner + 1) % 3] * 0.5 - points[corner] * 0.5);
    let largest = edges.iter().fold(0.0, |largest: f64, edge| largest.max(edge.abs().max_element()));
    if largest == 0.0 {
        return Err(SurfaceError::Collinear);
    }
    let edges = edges.map(|edge| edge / largest);
    let lengths = edges.map(DVec3::length);
    // Use the corner opposite the longest edge.
    let longest = (0..3).fold(0, |best, edge| if lengths[edge] > lengths[best] { edge } else { best });
    let (a, b) = ((longest + 1) % 3, (longest + 2) % 3);
    let normal = edges[a].cross(edges[b]);
    if normal.length() <= SMALLEST_SINE * lengths[a] * lengths[b] {
        return Err(SurfaceError::Collinear);
    }
    direction(normal).ok_or(SurfaceError::Collinear)
}
