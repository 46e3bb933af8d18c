//! The exchange area of two unoccluded polygons by their contours: A_i F_ij = 1/2π ∮∮ ln r dx·dy (Stokes' theorem twice; Goral, Torrance,
//! Greenberg, Battaile, "Modeling the Interaction of Light Between Diffuse Surfaces", 1984, equation 17). Each polygon lies wholly before
//! the other's plane. Parallel edges, a shared one among them, have a closed form; of others the inner integral has one, and the outer rule's
//! points crowd where the edges' lines come nearest, since there its integrand is singular. Not visibility.

use std::f64::consts::TAU;

use glam::DVec3;

/// Gauss-Legendre rules on [0, 1]: (abscissa, weight).
const FEW: [(f64, f64); 4] = [
    (0.06943184420297371, 0.17392742256872692),
    (0.33000947820757187, 0.32607257743127307),
    (0.6699905217924281, 0.32607257743127307),
    (0.9305681557970263, 0.17392742256872692),
];
const MANY: [(f64, f64); 6] = [
    (0.033_765_242_898_423_99, 0.08566224618958517),
    (0.16939530676686774, 0.1803807865240693),
    (0.38069040695840155, 0.23395696728634552),
    (0.6193095930415985, 0.23395696728634552),
    (0.8306046932331323, 0.1803807865240693),
    (0.966234757101576, 0.08566224618958517),
];

/// Sine of the angle below which edges count as parallel: the rounding of f32 coordinates.
const PARALLEL: f64 = 1e-6;

/// A_i F_ij of two triangles that see each other wholly, in their square units; corners counter-clockwise seen from their fronts.
pub(crate) fn exchange_area(one: &[DVec3; 3], two: &[DVec3; 3]) -> f64 {
    let edges = |corners: &[DVec3; 3]| [0, 1, 2].map(|i| (corners[i], corners[(i + 1) % 3] - corners[i]));
    let mut sum = 0.0;
    for (p, d) in edges(one) {
        for (q, e) in edges(two) {
            let (length, other) = (d.length(), e.length());
            if length == 0.0 || other == 0.0 {
                continue;
            }
            sum += if d.cross(e).length() <= PARALLEL * length * other {
                parallel(p, d / length, length, q, e)
            } else {
                skew(p, d, q, e / other, other)
            };
        }
    }
    sum / TAU
}

/// ∫∫ ln r dx·dy over an edge from `p` along unit `u` and one of the same direction, from `q` to `q + e`.
fn parallel(p: DVec3, u: DVec3, length: f64, q: DVec3, e: DVec3) -> f64 {
    let from = (q - p).dot(u);
    let to = (q + e - p).dot(u);
    let middle = q + 0.5 * e - p;
    let apart = (middle - u * middle.dot(u)).length();
    let f = |z: f64| log_twice_integrated(z, apart);
    f(length - from) - f(-from) - f(length - to) + f(-to)
}

/// ∫∫ ln r dx·dy over an edge from `p` to `p + d` and one from `q` along unit `v`.
fn skew(p: DVec3, d: DVec3, q: DVec3, v: DVec3, other: f64) -> f64 {
    let along = d.dot(v);
    if along == 0.0 {
        return 0.0;
    }
    let inner = |s: f64| {
        let from = q - (p + d * s);
        let start = from.dot(v);
        let apart = (from - v * start).length();
        log_integrated(start + other, apart) - log_integrated(start, apart)
    };
    // Where the line of the first comes nearest to that of the second.
    let across = d - v * along;
    let nearest = (q - p).dot(across) / across.length_squared();
    let sum: f64 = if (-FAR..=1.0 + FAR).contains(&nearest) {
        let nearest = nearest.clamp(0.0, 1.0);
        let towards = |end: f64| -> f64 {
            MANY.iter()
                .map(|&(y, weight)| weight * 2.0 * y * inner(nearest + (end - nearest) * y * y))
                .sum::<f64>()
                * (end - nearest)
        };
        towards(1.0) - towards(0.0)
    } else {
        FEW.iter().map(|&(s, weight)| weight * inner(s)).sum()
    };
    along * sum
}

/// Of its length an edge's distance from where the lines come nearest, beyond which a few points are enough.
const FAR: f64 = 0.5;

/// ∫ ln sqrt(z² + h²) dz.
fn log_integrated(z: f64, h: f64) -> f64 {
    let square = z * z + h * h;
    if square == 0.0 { 0.0 } else { 0.5 * z * square.ln() - z + h * z.atan2(h) }
}

/// ∫ of that again.
fn log_twice_integrated(z: f64, h: f64) -> f64 {
    let square = z * z + h * h;
    if square == 0.0 {
        return 0.0;
    }
    0.25 * (z * z - h * h) * square.ln() - 0.75 * z * z + h * z * z.atan2(h)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::lambert_integral;

    fn square(origin: DVec3, u: DVec3, v: DVec3) -> [[DVec3; 3]; 2] {
        [[origin, origin + u, origin + u + v], [origin, origin + u + v, origin + v]]
    }

    /// Of squares of area 1.
    fn factor(from: &[[DVec3; 3]; 2], to: &[[DVec3; 3]; 2]) -> f64 {
        from.iter().flat_map(|f| to.iter().map(|t| exchange_area(f, t))).sum()
    }

    #[test]
    fn parallel_squares() {
        let lower = square(DVec3::ZERO, DVec3::Z, DVec3::X);
        for (distance, expected) in [
            (0.01, 0.980416602925973),
            (0.1, 0.826994522397257),
            (0.5, 0.415253283577147),
            (1.0, 0.199824895698387),
            (2.0, 0.0685895888185524),
        ] {
            let upper = square(DVec3::new(0.0, distance, 0.0), DVec3::X, DVec3::Z);
            let found = factor(&lower, &upper);
            // What the diagonals' rule leaves.
            assert!((found - expected).abs() < 1e-5, "{distance}: {found} {:e}", found - expected);
        }
    }

    #[test]
    fn perpendicular_squares_down_to_a_shared_edge() {
        let floor = square(DVec3::ZERO, DVec3::Z, DVec3::X);
        let wall = |gap: f64| square(DVec3::new(-gap, 0.0, 0.0), DVec3::Y, DVec3::Z);
        let shared = 0.200043776075403;
        for (gap, expected) in [(0.0, shared), (1e-3, 0.19961080893592)] {
            let found = factor(&floor, &wall(gap));
            assert!((found - expected).abs() < 1e-6, "{gap}: {found} {:e}", found - expected);
        }
        // Towards the shared edge it grows steadily, by the gap's logarithm times the gap.
        let mut last = 0.0;
        for step in (1..50).rev() {
            let gap = 0.5f64.powi(50 - step);
            let found = factor(&floor, &wall(gap));
            assert!(found >= last - 1e-7, "gap {gap}: {found} after {last}");
            assert!((shared - found).abs() < 0.6 * gap * (1.0 - gap.ln()) + 1e-6, "gap {gap}: {found}");
            last = found;
        }
    }

    #[test]
    fn agrees_with_lamberts_formula_integrated_over_the_other() {
        // Sharing an edge at an angle, a corner, a part of an edge, and in general position.
        let base = [DVec3::ZERO, DVec3::new(1.0, 0.0, 0.0), DVec3::new(0.2, 0.0, -0.9)];
        let area = 0.45;
        for (name, other) in [
            ("edge", [base[1], base[0], DVec3::new(0.4, 0.8, 0.3)]),
            ("corner", [DVec3::ZERO, DVec3::new(0.3, 0.7, 0.4), DVec3::new(0.9, 0.8, 0.5)]),
            (
                "part of an edge",
                [DVec3::new(1.5, 0.0, 0.0), DVec3::new(0.25, 0.0, 0.0), DVec3::new(0.8, 0.9, 0.1)],
            ),
            ("general", [DVec3::new(0.9, 0.6, -0.5), DVec3::new(0.1, 0.5, -0.4), DVec3::new(0.5, 1.1, -0.3)]),
        ] {
            for other in [other, [other[0], other[2], other[1]]] {
                let normal = (base[1] - base[0]).cross(base[2] - base[0]);
                let back = (other[1] - other[0]).cross(other[2] - other[0]);
                let faces = other.iter().all(|&c| (c - base[0]).dot(normal) > -1e-9)
                    && base.iter().all(|&c| (c - other[0]).dot(back) > -1e-9);
                if !faces {
                    continue;
                }
                let found = exchange_area(&base, &other);
                // Two parts, so that a border of each ends where the other's edge does: there the inner factor jumps.
                let cut = DVec3::new(0.25, 0.0, 0.0);
                let parts = [(0.25, [base[0], cut, base[2]]), (0.75, [cut, base[1], base[2]])];
                let expected: f64 = parts
                    .iter()
                    .map(|(share, part)| share * area * lambert_integral::triangle_to_triangle(part, &other))
                    .sum();
                assert!((found - expected).abs() < 2e-5 * area, "{name}: {found} {expected}");
                let back = exchange_area(&other, &base);
                assert!((found - back).abs() < 1e-5 * area, "{name}: {found} and {back}, {expected}");
                assert!(found > 1e-3, "{name}");
            }
        }
    }
}
