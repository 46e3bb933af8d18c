//! Lambert's formula: the unoccluded form factor from a point to a polygon, clipped to the point's horizon. F = Σ θ_i
//! n·Γ_i / 2π over the edges, with θ_i the angle that an edge subtends and Γ_i the normal of its plane (Lambert 1760;
//! Baum, Rushmeier, Winget 1989). It is exact, and computed in f64 since the terms of a distant polygon cancel.

use std::f64::consts::TAU;

use glam::DVec3;

use super::clipping::clip;

/// Form factor from a point with unit `normal` to the front (counter-clockwise side) of a triangle; 0 from behind.
pub(crate) fn point_to_triangle(point: DVec3, normal: DVec3, triangle: &[DVec3; 3]) -> f64 {
    let relative = triangle.map(|corner| corner - point);
    // The point is behind the triangle or in its plane.
    let facing = (relative[1] - relative[0]).cross(relative[2] - relative[0]).dot(relative[0]);
    if facing >= 0.0 {
        return 0.0;
    }
    // A triangle has at most four corners above the horizon.
    let (mut above, mut count) = ([DVec3::ZERO; 4], 0);
    clip(
        &relative,
        |corner| corner.dot(normal),
        |corner| {
            if let Some(place) = above.get_mut(count) {
                (*place, count) = (corner, count + 1);
            }
        },
    );
    lambert(normal, &above[..count]).clamp(0.0, 1.0)
}

/// Lambert's sum over the edges of a polygon that is seen from its front. The corners are relative to the point and
/// above its horizon.
pub(crate) fn lambert(normal: DVec3, corners: &[DVec3]) -> f64 {
    let count = corners.len();
    let mut sum = 0.0;
    for (i, &a) in corners.iter().enumerate() {
        let b = corners[(i + 1) % count];
        let cross = a.cross(b);
        let sine = cross.length();
        if sine > 0.0 {
            sum += sine.atan2(a.dot(b)) * normal.dot(cross) / sine;
        }
    }
    // Seen from the front, the corners run counter-clockwise about the direction to the viewer, hence clockwise about
    // ours.
    -sum / TAU
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectangle(corners: [[f64; 3]; 4]) -> [[DVec3; 3]; 2] {
        let [a, b, c, d] = corners.map(DVec3::from);
        [[a, b, c], [a, c, d]]
    }

    fn factor(normal: DVec3, triangles: &[[DVec3; 3]]) -> f64 {
        triangles.iter().map(|t| point_to_triangle(DVec3::ZERO, normal, t)).sum()
    }

    #[test]
    fn element_to_rectangle() {
        // Facing down, towards an element that looks up.
        let corner = rectangle([[0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]]);
        let centred = rectangle([[-1.0, 1.0, -1.0], [1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]]);
        assert!((factor(DVec3::Y, &corner) - 0.138531605994893).abs() < 1e-14);
        assert!((factor(DVec3::Y, &centred) - 0.554126423979572).abs() < 1e-14);
        // An element looking along -z at a wall perpendicular to it that begins at its own height.
        let wall = rectangle([[0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]]);
        assert!((factor(DVec3::Z, &wall) - 0.0557341970025535).abs() < 1e-14);
    }

    #[test]
    fn horizon_back_and_far_away() {
        // Half of a triangle pair that the horizon cuts in the middle.
        let cut = rectangle([[-1.0, 1.0, -1.0], [1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]]);
        let half = rectangle([[-1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]]);
        assert!((factor(DVec3::Z, &cut) - factor(DVec3::Z, &half)).abs() < 1e-14);
        assert_eq!(factor(DVec3::NEG_Y, &cut), 0.0);
        let turned = cut.map(|[a, b, c]| [a, c, b]);
        assert_eq!(factor(DVec3::Y, &turned), 0.0);
        // A unit square at 1e4: F = A / (π d²) to 1e-8.
        let far = cut.map(|t| t.map(|p| DVec3::new(0.5 * p.x, 1e4, 0.5 * p.z)));
        let expected = 1.0 / (std::f64::consts::PI * 1e8);
        assert!((factor(DVec3::Y, &far) / expected - 1.0).abs() < 3e-8);
    }
}
