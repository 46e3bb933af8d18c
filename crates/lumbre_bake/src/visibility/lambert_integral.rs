//! The form factor between two unoccluded triangles, as a reference for tests of the Monte Carlo form factors: A_i F_ij
//! = ∬ F(point → triangle j), with Lambert's exact inner formula and Gauss-Legendre points on the outer triangle. Where
//! two triangles share an edge, the inner form factor jumps there, so the outer points are clustered towards every
//! edge.

use glam::DVec3;

use super::polygon::point_to_triangle;

/// Eight-point Gauss-Legendre rule on [0, 1]: (abscissa, weight).
const GAUSS: [(f64, f64); 8] = [
    (0.019855071751231885, 0.050614268145188),
    (0.10166676129318664, 0.111190517226687),
    (0.2372337950418355, 0.156853322938944),
    (0.4082826787521751, 0.181341891689181),
    (0.591717321247825, 0.181341891689181),
    (0.7627662049581645, 0.156853322938944),
    (0.8983332387068134, 0.111190517226687),
    (0.9801449282487682, 0.050614268145188),
];

/// Form factor from the front of one triangle to the front of another, without occlusion.
pub(crate) fn triangle_to_triangle(from: &[DVec3; 3], to: &[DVec3; 3]) -> f64 {
    let [a, b, c] = *from;
    let normal = (b - a).cross(c - a);
    let Some(unit) = normal.try_normalize() else { return 0.0 };
    // The centroid divides the triangle in three, one for each edge. In each of them, u runs along the edge, with
    // points clustered at both ends, and t runs from the centroid to the edge, with points clustered at the edge (1 -
    // y³).
    let center = (a + b + c) / 3.0;
    let mut sum = 0.0;
    for (p, q) in [(a, b), (b, c), (c, a)] {
        for (x, wx) in composite() {
            let (u, du) = both_ends(x);
            let edge = p.lerp(q, u);
            for (y, wy) in composite() {
                let (t, dt) = (1.0 - y * y * y, 3.0 * y * y);
                // The area element in these coordinates is 2 t du dt, as a fraction of a triangle about the centroid.
                let weight = wx * du * wy * dt * 2.0 * t / 3.0;
                sum += weight * point_to_triangle(center.lerp(edge, t), unit, to);
            }
        }
    }
    sum
}

/// The Gauss-Legendre rule applied to both halves of [0, 1].
fn composite() -> impl Iterator<Item = (f64, f64)> {
    [0.0, 0.5].into_iter().flat_map(|start| GAUSS.iter().map(move |&(x, w)| (start + 0.5 * x, 0.5 * w)))
}

/// Smoothstep, which clusters points at both ends of [0, 1], and its derivative.
fn both_ends(x: f64) -> (f64, f64) {
    (x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(origin: DVec3, u: DVec3, v: DVec3) -> [[DVec3; 3]; 2] {
        [[origin, origin + u, origin + u + v], [origin, origin + u + v, origin + v]]
    }

    fn factor(from: &[[DVec3; 3]; 2], to: &[[DVec3; 3]; 2]) -> f64 {
        // The halves have equal areas: the form factor is the mean over the source's halves of the sum over the
        // target's.
        from.iter().map(|f| to.iter().map(|t| triangle_to_triangle(f, t)).sum::<f64>()).sum::<f64>() / 2.0
    }

    fn parallel(distance: f64, shift: f64) -> f64 {
        let lower = square(DVec3::ZERO, DVec3::Z, DVec3::X);
        let upper = square(DVec3::new(shift, distance, 0.0), DVec3::X, DVec3::Z);
        factor(&lower, &upper)
    }

    #[test]
    fn parallel_squares() {
        for (distance, expected, bound) in [
            (0.1, 0.826994522397257, 2e-4),
            (0.5, 0.415253283577147, 1e-6),
            (1.0, 0.199824895698387, 1e-8),
            (2.0, 0.0685895888185524, 1e-9),
            (5.0, 0.0124039773132451, 1e-10),
            (100.0, 3.18288667328292e-5, 1e-10),
        ] {
            // The bounds are about ten times the measured error of the quadrature rule.
            let found = parallel(distance, 0.0);
            assert!((found - expected).abs() < bound, "{distance}: {found:e} {:e}", found - expected);
        }
        assert!((parallel(1.0, 1.0) - 0.0860504891523273).abs() < 1e-8);
    }

    #[test]
    fn perpendicular_squares_down_to_a_shared_edge() {
        let floor = square(DVec3::ZERO, DVec3::Z, DVec3::X);
        let wall = |gap: f64| square(DVec3::new(-gap, 0.0, 0.0), DVec3::Y, DVec3::Z);
        for (gap, expected) in [(0.0, 0.200043776075403), (1e-3, 0.19961080893592)] {
            let found = factor(&floor, &wall(gap));
            assert!((found - expected).abs() < 1e-5, "{gap}: {found} {:e}", found - expected);
        }
    }
}
