//! The mean of something that varies over a triangle, like a texture: of many small triangles, each by its middle.

use glam::Vec3;

/// Corners by weights of the second and third vertex.
pub(crate) type Corners = [(f32, f32); 3];

/// Mean over the middles of n² pieces of a triangle, by weights of its second and third corner.
pub(crate) fn mean_of_points(n: u32, mut value: impl FnMut((f32, f32)) -> Vec3) -> Vec3 {
    if n <= 1 {
        return value((1.0 / 3.0, 1.0 / 3.0));
    }
    let mut sum = Vec3::ZERO;
    pieces(n, |[p, q, r]| sum += value(((p.0 + q.0 + r.0) / 3.0, (p.1 + q.1 + r.1) / 3.0)));
    sum / (n * n) as f32
}

/// Calls `visit` with the corners of n² equal pieces of a triangle.
pub(crate) fn pieces(n: u32, mut visit: impl FnMut(Corners)) {
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
