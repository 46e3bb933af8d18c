//! A corridor with two corners and one lamp at an end: behind the second corner, only light of two and more bounces
//! arrives.

use bevy_ecs::world::World;

use super::super::random::Random;
use super::builder::{Builder, CLAY, GREEN, WHITE, WOOD, matt};
use super::carved::carve;
use super::furniture::paint;
use super::revolution::revolution;

/// Three legs, 1.6 m wide and 2.4 m high, with the shape of a Z in even layouts and a U in odd ones. The lamp under the
/// ceiling is a box in the former and a bulb in the latter.
pub fn corridor(layout: u64, scale: f64) -> World {
    let mut random = Random::new(4000 + layout);
    let mut b = Builder::new(scale);
    let (width, height) = (1.6, 2.4);
    let (first, second, third) =
        (random.between(4.0, 6.0), random.between(4.5, 6.0), random.between(3.5, 5.0));
    let z_shape = layout.is_multiple_of(2);
    let last = if z_shape {
        [[first, 0.0, second - width], [first + third, height, second]]
    } else {
        [[first - width - third, 0.0, second - width], [first, height, second]]
    };
    let voids = [
        [[0.0, 0.0, 0.0], [first, height, width]],
        [[first - width, 0.0, 0.0], [first, height, second]],
        last,
    ];
    carve(&mut b, &voids, [WOOD, paint(&mut random), WHITE], None);
    if z_shape {
        b.lamp("lamp", [0.5, height - 0.06, 0.5], [1.1, height, 1.1], [20.0, 17.0, 12.0]);
    } else {
        let size = 0.09 * b.scale;
        let ball = |t: f64| {
            let angle = std::f64::consts::PI * t;
            [size * angle.sin().max(0.0) * f64::from(u8::from(t > 0.0 && t < 1.0)), -size * angle.cos()]
        };
        let bulb = revolution(ball, 16, 10);
        b.mesh("bulb", bulb, matt([0.5; 3], [70.0, 58.0, 40.0]), [0.8, height - 0.3, 0.8].into(), 0.0);
    }
    let turn = random.between(0.1, 1.4);
    b.block("crate", [first - 1.3, 0.0, 0.3], [first - 0.7, 0.5, 0.8], CLAY, turn);
    let z = second - random.between(2.2, 2.6);
    b.block("chest", [first - 0.5, 0.0, z], [first, 0.7, z + 0.7], GREEN, 0.0);
    let [low, high] = last;
    let far = if z_shape { low[0] + 1.0 } else { low[0] + third - 1.2 };
    b.block("far crate", [far, 0.0, second - 0.9], [far + 0.5, 0.45, second - 0.4], CLAY, turn / 2.0);
    b.block(
        "pillar",
        [first - width, 0.0, 0.5 * second],
        [first - 1.35, height, 0.5 * second + 0.3],
        WHITE,
        0.0,
    );
    if z_shape {
        b.camera([high[0] - 0.3, 1.6, second - 0.3], [first - 1.0, 0.9, second - 1.0]);
    } else {
        b.camera([low[0] + 0.3, 1.6, second - 0.3], [first - 0.6, 0.9, second - 1.0]);
    }
    let low = [low[0].min(0.0), 0.0, 0.0];
    b.region(low, [high[0].max(first), height, second], &[]);
    b.world
}
