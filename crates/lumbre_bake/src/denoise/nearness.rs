//! How near the surfaces are from which a texel's light comes, by direction on its surface. Light changes over
//! the distance to such surfaces (Ward, Rubinstein and Clear, "A Ray Tracing Solution for Diffuse Interreflection",
//! 1988), but hardly along a plane from which it comes: beside the joint of two walls it changes fast away from the
//! joint, and slowly along it. How far smoothing reaches by it is in `smooth`.

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::coverage::MapAxes;

/// The part of a surface's nearness that counts in every direction, even along the surface, because its own light may
/// change. With 0.03 the texels at the joints of the Cornell box keep 1.3 times the noise, and with 0 hardly less than
/// with this.
const IN_ALL_DIRECTIONS: f32 = 0.005;

/// A symmetric matrix in the directions `along` and `across` of [`MapAxes`], 1 / canonical unit: a sum or a mean over
/// samples. Its value in a unit direction of the surface, `xx x² + 2 xy x y + yy y²`, is the 1 / distance of a surface
/// that stands across that direction or faces the receiver, and almost 0 for one that stands along it.
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
        let across = Vec2::new(normal.dot(receiver.along), normal.dot(receiver.across));
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
