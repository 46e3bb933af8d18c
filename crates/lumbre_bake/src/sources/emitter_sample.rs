//! Samples a point on an emissive triangle: uniformly by area, or by solid angle where the triangle is near.
//! `emitter_tree` chooses the triangle.

use glam::{DVec3, Vec3};

use super::emitters::Emitter;
use crate::sampling::triangle_point;
use crate::scene::Receiver;

/// A sampled point on an emitter.
pub(crate) struct EmitterSample {
    pub target: Vec3,
    /// The unoccluded irradiance by this point over its probability density: an estimate for the whole emitter.
    pub light: Vec3,
    pub distance: f32,
    /// Whether it lies below the receiver's facet although above the horizon of its shading normal: then none of the
    /// light arrives.
    pub is_below_facet: bool,
}

/// Samples an emitter at (u, v) of the unit square; `None` if the point is below the horizon of the receiver's shading
/// normal, or the receiver behind the emitter.
pub(crate) fn sample_emitter(
    emitter: &Emitter,
    receiver: &Receiver,
    (u, v): (f32, f32),
) -> Option<EmitterSample> {
    let [p, q, r] = emitter.corners.map(|corner| corner - receiver.position);
    let (a, b) = triangle_point(u, v);
    let mut towards = p + (q - p) * a + (r - p) * b;
    let height = -p.dot(emitter.normal);
    if height <= 0.0 {
        return None;
    }
    // Where the emitter is near, the contribution of its points varies strongly with their distance; sampling
    // directions uniformly avoids that.
    let nearest = p.length_squared().min(q.length_squared()).min(r.length_squared());
    let by_direction = match emitter.area > WIDE * nearest.max(height * height) {
        true => spherical_triangle([p, q, r], u, v),
        false => None,
    };
    let mut per_cosine = 0.0;
    if let Some((direction, solid_angle)) = by_direction {
        let down = -direction.dot(emitter.normal);
        if down <= 0.0 {
            return None;
        }
        (towards, per_cosine) = (direction * (height / down), solid_angle);
    }
    let distance_squared = towards.length_squared();
    let direction = towards.normalize_or_zero();
    let (cosine, emitted) = (direction.dot(receiver.normal), -direction.dot(emitter.normal));
    if cosine <= 0.0 || emitted <= 0.0 {
        return None;
    }
    let is_below_facet = direction.dot(receiver.geometric_normal) <= 0.0;
    if by_direction.is_none() {
        per_cosine = emitted * emitter.area / distance_squared;
    }
    let target = receiver.position + towards;
    let light = emitter.radiance * (cosine * per_cosine);
    Some(EmitterSample { target, light, distance: distance_squared.sqrt(), is_below_facet })
}

/// Ratio of an emitter's area to its squared distance from which on it is sampled by solid angle.
const WIDE: f32 = 0.05;

/// A direction towards a triangle, distributed uniformly over its solid angle, and that angle, for (u, v) of the unit
/// square (Arvo, "Stratified Sampling of Spherical Triangles", 1995). `None` if the triangle is too narrow for single
/// precision.
fn spherical_triangle(corners: [Vec3; 3], u: f32, v: f32) -> Option<(Vec3, f32)> {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3().normalize_or_zero());
    let normal = |p: DVec3, q: DVec3| p.cross(q).try_normalize();
    let (ab, bc, ca) = (normal(a, b)?, normal(b, c)?, normal(c, a)?);
    let (alpha, beta, gamma) = (ab.angle_between(-ca), bc.angle_between(-ab), ca.angle_between(-bc));
    let solid_angle = alpha + beta + gamma - std::f64::consts::PI;
    if solid_angle.is_nan() || solid_angle <= 1e-6 {
        return None;
    }
    let part = std::f64::consts::PI + f64::from(u) * solid_angle;
    let ((sine, cosine), (sine_part, cosine_part)) = (alpha.sin_cos(), part.sin_cos());
    let (s, t) = (sine_part * cosine - cosine_part * sine, cosine_part * cosine + sine_part * sine);
    let (k, l) = (t + cosine, s - sine * a.dot(b));
    let along = (l + (l * t - k * s) * cosine) / ((l * s + k * t) * sine);
    if along.is_nan() {
        return None;
    }
    let along = along.clamp(-1.0, 1.0);
    let beside = |p: DVec3, axis: DVec3| (p - axis * p.dot(axis)).normalize_or_zero();
    let edge = a * along + beside(c, a) * (1.0 - along * along).sqrt();
    let height = 1.0 - f64::from(v) * (1.0 - edge.dot(b));
    let direction = b * height + beside(edge, b) * (1.0 - height * height).max(0.0).sqrt();
    direction.is_finite().then(|| (direction.as_vec3(), solid_angle as f32))
}
