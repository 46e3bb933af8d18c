//! Samples directions uniformly over the solid angle of a triangle (Arvo, "Stratified Sampling of Spherical Triangles",
//! 1995).

use std::f64::consts::PI;

use glam::DVec3;

/// Returns a direction and the solid angle of the triangle, or `None` if that is too small (a triangle seen edge-on or
/// from far away) or not below 2π.
pub fn sample(origin: DVec3, corners: [DVec3; 3], [u, v]: [f64; 2]) -> Option<(DVec3, f64)> {
    let [a, b, c] = corners.map(|corner| (corner - origin).normalize());
    let angle = |at: DVec3, p: DVec3, q: DVec3| {
        let (p, q) = (at.cross(p), at.cross(q));
        p.cross(q).length().atan2(p.dot(q))
    };
    let (alpha, beta, gamma) = (angle(a, b, c), angle(b, c, a), angle(c, a, b));
    let area = alpha + beta + gamma - PI;
    if !(area > 1e-7 && area < 2.0 * PI) {
        return None;
    }
    let (s, t) = (u * area - alpha).sin_cos();
    let (sine, cosine) = alpha.sin_cos();
    let (p, q) = (t - cosine, s + sine * a.dot(b));
    let along = ((q * t - p * s) * cosine - q) / ((q * s + p * t) * sine);
    let along = if along.is_finite() { along.clamp(-1.0, 1.0) } else { 1.0 };
    let across = |x: DVec3, y: DVec3| (x - y * x.dot(y)).normalize_or_zero();
    let edge = a * along + across(c, a) * (1.0 - along * along).sqrt();
    let z = 1.0 - v * (1.0 - edge.dot(b));
    let direction = b * z + across(edge, b) * (1.0 - z * z).max(0.0).sqrt();
    Some((direction.normalize(), area))
}
