//! Finds the ground under a body's feet: the highest surface to stand on within reach of a step. Walls are
//! handled in `collide`.

use glam::{DVec2, DVec3};

use super::{Stature, TriangleTree};

/// Cosine of the steepest slope to stand on, 50 degrees.
const STEEPEST: f64 = 0.642_787_609_686_539_3;
/// Distance of the outer rays from the middle, in radii of the body.
const SPREAD: f64 = 0.65;

/// Returns the height of the highest ground between a step above the feet and `down` metres below them, if
/// there is any.
pub fn ground_below(feet: DVec3, down: f64, stature: &Stature, level: &TriangleTree) -> Option<f64> {
    let reach = SPREAD * stature.radius;
    let (lowest, highest) = (feet.y - down, feet.y + stature.step);
    // Half a millimetre of tolerance on each side, so that standing exactly on a surface counts.
    let (lowest, highest) = (lowest - 5e-4, highest + 5e-4);
    let min = DVec3::new(feet.x - reach, lowest, feet.z - reach);
    let max = DVec3::new(feet.x + reach, highest, feet.z + reach);
    let mut ground: Option<f64> = None;
    level.for_each_in_box(min, max, |triangle| {
        for ray in rays(reach) {
            let height = height_at(triangle, DVec2::new(feet.x, feet.z) + ray);
            if let Some(height) = height.filter(|height| (lowest..=highest).contains(height)) {
                ground = Some(ground.map_or(height, |best| best.max(height)));
            }
        }
    });
    ground
}

/// Returns the offsets of the rays: the middle, and eight around it.
fn rays(reach: f64) -> impl Iterator<Item = DVec2> {
    let around =
        (0..8).map(move |eighth| DVec2::from_angle(f64::from(eighth) * std::f64::consts::FRAC_PI_4) * reach);
    std::iter::once(DVec2::ZERO).chain(around)
}

/// Returns the height of a triangle at (x, z) if it is there and flat enough to stand on, from either side.
fn height_at(&[a, b, c]: &[DVec3; 3], at: DVec2) -> Option<f64> {
    let normal = (b - a).cross(c - a);
    if normal.y.abs() < STEEPEST * normal.length() {
        return None;
    }
    let side = |p: DVec3, q: DVec3| {
        (DVec2::new(q.x, q.z) - DVec2::new(p.x, p.z)).perp_dot(at - DVec2::new(p.x, p.z))
    };
    let (first, second, third) = (side(a, b), side(b, c), side(c, a));
    let inside =
        (first >= 0.0 && second >= 0.0 && third >= 0.0) || (first <= 0.0 && second <= 0.0 && third <= 0.0);
    inside.then(|| a.y - (normal.x * (at.x - a.x) + normal.z * (at.y - a.z)) / normal.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn height_of_a_slope_inside_and_outside() {
        let slope = [DVec3::ZERO, DVec3::new(0.0, 0.0, 2.0), DVec3::new(2.0, 1.0, 0.0)];
        let height = height_at(&slope, DVec2::new(0.5, 0.5)).unwrap();
        assert!((height - 0.25).abs() < 1e-15);
        assert_eq!(height_at(&slope, DVec2::new(1.5, 1.5)), None);
        let reversed = [slope[0], slope[2], slope[1]];
        assert_eq!(height_at(&reversed, DVec2::new(0.5, 0.5)), Some(height));
    }

    #[test]
    fn nobody_stands_on_a_wall() {
        let steep = [DVec3::ZERO, DVec3::new(0.0, 0.0, 2.0), DVec3::new(2.0, 3.0, 0.0)];
        assert_eq!(height_at(&steep, DVec2::new(0.5, 0.5)), None);
    }
}
