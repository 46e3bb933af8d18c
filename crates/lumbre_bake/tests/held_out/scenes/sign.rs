//! A room lit by a sign of nine emissive boxes on its wall.

use bevy_ecs::world::World;

use super::super::random::Random;
use super::builder::{Builder, CLAY, WHITE, WOOD};
use super::carved::carve;
use super::furniture::{chair, paint, shelf, vase};

/// The strokes of three letters, three each: two opposite corners in tenths of a letter's height.
const STROKES: [[[f64; 2]; 2]; 9] = [
    [[0.0, 0.0], [1.0, 10.0]],
    [[1.2, 0.0], [5.0, 1.0]],
    [[1.2, 4.5], [4.0, 5.5]],
    [[7.0, 0.0], [8.0, 10.0]],
    [[11.0, 0.0], [12.0, 10.0]],
    [[8.2, 4.5], [10.8, 5.5]],
    [[14.0, 0.0], [15.0, 10.0]],
    [[15.2, 9.0], [19.0, 10.0]],
    [[15.2, 0.0], [19.0, 1.0]],
];

/// A room of 5 by 4 by 2.8 m. The backs of the boxes lie against the wall and are hidden.
pub fn sign(layout: u64, scale: f64) -> World {
    let mut random = Random::new(6000 + layout);
    let mut b = Builder::new(scale);
    let high = [5.0, 2.8, 4.0];
    carve(&mut b, &[[[0.0; 3], high]], [WOOD, paint(&mut random), WHITE], None);
    let (x, y) = (random.between(1.0, 2.2), random.between(1.4, 1.8));
    let size = random.between(0.06, 0.08);
    let colors = [[34.0, 7.0, 5.0], [6.0, 14.0, 34.0], [30.0, 24.0, 10.0]];
    let first = random.next();
    for (stroke, [from, to]) in STROKES.iter().enumerate() {
        let color = colors[((stroke as u64 / 3 + first) % 3) as usize];
        let low = [x + size * from[0], y + size * from[1], 0.0];
        b.lamp("letter", low, [x + size * to[0], y + size * to[1], 0.05], color);
    }
    b.table(random.between(1.5, 2.5), random.between(1.6, 2.2), random.between(0.0, 1.5));
    chair(&mut b, random.between(3.2, 3.8), random.between(1.4, 2.2), random.between(0.0, 6.0));
    shelf(&mut b, 0.1, 0.0, 0.8, 5);
    vase(&mut b, [0.5, 1.8, 0.16], paint(&mut random));
    b.block("counter", [3.9, 0.0, 2.6], [4.5, 1.1, 3.8], CLAY, 0.0);
    b.camera([4.5, 1.7, 3.6], [1.4, 1.1, 0.2]);
    b.region([0.0; 3], high, &[]);
    b.world
}
