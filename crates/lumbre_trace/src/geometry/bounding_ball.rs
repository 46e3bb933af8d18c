//! Bounding spheres of exact surfaces, by which most rays are rejected early, before any division. The
//! intersection itself is in `quadric`.

use glam::{DAffine3, DVec3};
use lumbre_scene::{Quadric, QuadricShape};

/// A sphere that contains all points of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BoundingBall {
    middle: DVec3,
    squared_radius: f64,
}

/// Enlargement of the squared radius, as a fraction of it, for points that lie outside of the surface by
/// rounding.
const ROOM: f64 = 1e-6;
/// Rounding error of squared distances, relative to the squared distance of the sphere's centre, with a
/// margin.
const ROUNDING: f64 = 1e-12;

impl BoundingBall {
    /// Returns the bounding sphere of a quadric with a transform, or `None` if the quadric is infinite.
    pub fn of(quadric: &Quadric, place: &DAffine3) -> Option<Self> {
        let (middle, radius) = match (quadric.shape, quadric.trim) {
            (QuadricShape::Sphere { radius }, None) => (DVec3::ZERO, radius * largest_stretch(place)),
            _ => {
                let [low, high] = quadric.bounds();
                let half = 0.5 * (high - low);
                // Half of the corners: the others are opposite to them.
                let corners = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
                let length =
                    |(x, y): (f64, f64)| place.transform_vector3(half * DVec3::new(x, y, 1.0)).length();
                (low + half, corners.into_iter().map(length).fold(0.0, f64::max))
            }
        };
        let (middle, squared_radius) = (place.transform_point3(middle), radius * radius * (1.0 + ROOM));
        (middle.is_finite() && squared_radius.is_finite()).then_some(Self { middle, squared_radius })
    }

    /// Returns true if no point of a ray up to `farthest` is inside the sphere. `farthest` is in units of
    /// `direction`, which may have any length.
    pub fn is_missed(&self, origin: DVec3, direction: DVec3, farthest: f64) -> bool {
        let apart = self.middle - origin;
        let squared_distance = apart.length_squared();
        let room = self.squared_radius + ROUNDING * squared_distance;
        let (along, squared) = (apart.dot(direction), direction.length_squared());
        let beside = squared_distance * squared - along * along > room * squared;
        let behind = along < 0.0 && squared_distance > room;
        // From the ray's end to the projection of the centre, in metres, times the length of `direction`.
        let beyond = along - farthest * squared;
        beside || behind || (beyond > 0.0 && beyond * beyond > room * squared)
    }
}

/// Returns an upper bound of the factor by which a transform stretches vectors, exact where its axes stay
/// perpendicular: Gershgorin's circles around the eigenvalues of its squared matrix.
fn largest_stretch(place: &DAffine3) -> f64 {
    let squared = place.matrix3.transpose() * place.matrix3;
    let row = |axis: usize| squared.row(axis).abs().element_sum();
    row(0).max(row(1)).max(row(2)).sqrt()
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DQuat};

    use super::*;
    use crate::geometry::quadric::QuadricSurface;
    use crate::random::Numbers;

    /// Numbers from -1 to 1.
    fn vector(numbers: &mut Numbers) -> DVec3 {
        let mut next = || 2.0 * numbers.next() - 1.0;
        DVec3::new(next(), next(), next())
    }

    #[test]
    fn no_ray_that_meets_a_surface_misses_its_ball_and_most_others_do() {
        let shapes = [
            Quadric::sphere(0.7),
            Quadric { trim: Some([DVec3::new(0.1, -0.2, -0.9), DVec3::splat(0.6)]), ..Quadric::sphere(0.7) },
            Quadric { shape: QuadricShape::Cylinder { radius: 0.3, height: 2.0, closed: true }, trim: None },
            Quadric { shape: QuadricShape::Cone { radius: 0.9, height: 0.4, closed: false }, trim: None },
        ];
        let (mut met, mut missed, mut passing) = (0, 0, 0);
        for number in 0..40_000u32 {
            let mut numbers = Numbers::new(3, number >> 12, number & 0xfff);
            // Far from the origin, with sheared and mirrored axes.
            let size = 10f64.powf(8.0 * numbers.next() - 2.0);
            let shear =
                DMat3::from_cols(DVec3::X, DVec3::new(numbers.next(), -1.0, 0.2), DVec3::Z * numbers.next());
            let turn = DMat3::from_quat(DQuat::from_axis_angle(
                vector(&mut numbers).normalize_or(DVec3::X),
                numbers.next(),
            ));
            let place = DAffine3::from_mat3_translation(turn * shear, vector(&mut numbers) * size);
            let quadric = &shapes[number as usize % shapes.len()];
            let Some(ball) = BoundingBall::of(quadric, &place) else { panic!("{quadric:?} has an end") };
            // The rays start near or far away and point towards the surroundings of the surface.
            let origin = place.translation + vector(&mut numbers) * 10f64.powf(4.0 * numbers.next() - 0.5);
            let direction =
                (place.translation + 2.0 * vector(&mut numbers) - origin) * (0.1 + numbers.next());
            let farthest = if number % 3 == 0 { f64::INFINITY } else { 2.0 * numbers.next() };
            let to_own = place.inverse();
            let (own_origin, own_direction) =
                (to_own.transform_point3(origin), to_own.transform_vector3(direction));
            let surface = QuadricSurface::new(quadric);
            let hit = surface.closest(own_origin, own_direction, farthest, &|_| true);
            let is_missed = ball.is_missed(origin, direction, farthest);
            assert!(hit.is_none() || !is_missed, "{number}: {quadric:?}, {hit:?}");
            met += usize::from(hit.is_some());
            missed += usize::from(is_missed);
            passing += usize::from(hit.is_none() && !is_missed);
        }
        assert!(
            met > 2000 && missed > 10_000 && passing < missed,
            "{met} met, {missed} missed, {passing} more"
        );
    }

    #[test]
    fn what_has_no_end_has_no_ball() {
        let plane = Quadric { shape: QuadricShape::Plane, trim: None };
        assert_eq!(BoundingBall::of(&plane, &DAffine3::IDENTITY), None);
        let saddle =
            QuadricShape::General { coefficients: [1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0] };
        assert_eq!(BoundingBall::of(&Quadric { shape: saddle, trim: None }, &DAffine3::IDENTITY), None);
    }
}
