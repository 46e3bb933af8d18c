//! The mean over a triangle of something that varies on it, such as a texture: the triangle is divided evenly and each
//! piece is sampled at its centroid.

use glam::Vec3;

/// The corners of a piece, each by the barycentric weights of the triangle's second and third vertex.
pub(crate) type SubTriangle = [(f32, f32); 3];

/// Mean of `value` at the centroids of n² equal pieces of a triangle, given by the barycentric weights of its second
/// and third vertex.
pub(crate) fn mean_of_points(n: u32, mut value: impl FnMut((f32, f32)) -> Vec3) -> Vec3 {
    if n <= 1 {
        return value((1.0 / 3.0, 1.0 / 3.0));
    }
    let mut sum = Vec3::ZERO;
    pieces(n, |[p, q, r]| sum += value(((p.0 + q.0 + r.0) / 3.0, (p.1 + q.1 + r.1) / 3.0)));
    sum / (n * n) as f32
}

/// Calls `visit` with the corners of each of n² equal pieces of a triangle.
pub(crate) fn pieces(n: u32, mut visit: impl FnMut(SubTriangle)) {
    let at = |a: u32, b: u32| (a as f32 / n as f32, b as f32 / n as f32);
    for a in 0..n {
        for b in 0..n - a {
            visit([at(a, b), at(a + 1, b), at(a, b + 1)]);
            if a + b + 1 < n {
                visit([at(a + 1, b), at(a + 1, b + 1), at(a, b + 1)]);
            }
        }
    }
}
