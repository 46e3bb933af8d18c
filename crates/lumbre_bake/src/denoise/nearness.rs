//! How near the surfaces are from which a texel's light comes, by direction over the texel's map. Light changes over
//! the distance to such surfaces (Ward, Rubinstein and Clear, "A Ray Tracing Solution for Diffuse Interreflection",
//! 1988), but hardly along a plane from which it comes: beside the joint of two walls it changes fast away from the
//! joint, and slowly along it. How far smoothing reaches by it is in `smooth`.

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::coverage::footprint::MapAxes;

/// The part of a surface's nearness that counts in every direction, even along the surface, because its own light may
/// change. With 0.03 the texels at the joints of the Cornell box keep 1.3 times the noise, and with 0 hardly less than
/// with this.
const IN_ALL_DIRECTIONS: f32 = 0.005;

/// A symmetric matrix over the columns and rows of a map, 1 / canonical unit, as a sum over samples. In a unit direction
/// (x, y), `xx x² + 2 xy x y + yy y²` is the sum of 1 / distance over the surfaces that stand across that direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Nearness {
    pub xx: f32,
    pub xy: f32,
    pub yy: f32,
}

impl Nearness {
    /// The nearness of a lamp at this inverse distance: the same in all directions, as the edges of shadows run in any.
    pub fn of_lamp(inverse_distance: f32) -> Self {
        Self { xx: inverse_distance, xy: 0.0, yy: inverse_distance }
    }

    /// The nearness of a surface with this unit normal at this inverse distance. Where it faces the receiver, its edges
    /// and its pattern count in all directions; where it stands on the receiver, only across it.
    pub fn of_surface(inverse_distance: f32, normal: Vec3, receiver: &MapAxes) -> Self {
        let across = Vec2::new(normal.dot(receiver.column), normal.dot(receiver.row));
        let facing = normal.dot(receiver.normal);
        let everywhere = facing * facing + IN_ALL_DIRECTIONS;
        Self {
            xx: inverse_distance * (across.x * across.x + everywhere),
            xy: inverse_distance * across.x * across.y,
            yy: inverse_distance * (across.y * across.y + everywhere),
        }
    }

    /// Adds the nearness of another sample.
    pub fn add(&mut self, other: Self) {
        self.xx += other.xx;
        self.xy += other.xy;
        self.yy += other.yy;
    }

    /// This matrix times a factor.
    pub fn scaled(self, factor: f32) -> Self {
        Self { xx: self.xx * factor, xy: self.xy * factor, yy: self.yy * factor }
    }

    /// Whether all its values are finite.
    pub fn is_finite(self) -> bool {
        (self.xx + self.xy + self.yy).is_finite()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A receiver in the plane of x and y, whose map is turned by some degrees and stretched.
    fn receiver(degrees: f32) -> MapAxes {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let stretch = 1.25;
        MapAxes {
            column: Vec3::new(cos, sin, 0.0) * stretch,
            row: Vec3::new(-sin, cos, 0.0) / stretch,
            normal: Vec3::Z,
        }
    }

    /// The value in the direction of the map that runs along `along` on the surface, for a step of one side.
    fn value(nearness: Nearness, receiver: &MapAxes, along: Vec3) -> f32 {
        let x = along.dot(receiver.column) / receiver.column.length_squared();
        let y = along.dot(receiver.row) / receiver.row.length_squared();
        nearness.xx * x * x + 2.0 * nearness.xy * x * y + nearness.yy * y * y
    }

    #[test]
    fn a_wall_on_the_receiver_is_near_across_it_only_however_the_map_is_turned() {
        for degrees in [0.0, 20.0, 45.0, 90.0, 200.0] {
            let receiver = receiver(degrees);
            let wall = Nearness::of_surface(4.0, Vec3::X, &receiver);
            let (across, along) = (value(wall, &receiver, Vec3::X), value(wall, &receiver, Vec3::Y));
            assert!((across - 4.0).abs() < 4.0 * 2.0 * IN_ALL_DIRECTIONS, "{degrees}: {across}");
            assert!((0.0..4.0 * 2.0 * IN_ALL_DIRECTIONS).contains(&along), "{degrees}: {along}");
            let facing = Nearness::of_surface(4.0, Vec3::NEG_Z, &receiver);
            for direction in [Vec3::X, Vec3::Y] {
                assert!(value(facing, &receiver, direction) > 4.0 / 1.25_f32.powi(2), "{degrees}");
            }
        }
    }
}
