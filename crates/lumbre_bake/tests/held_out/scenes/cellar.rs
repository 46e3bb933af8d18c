//! A cellar that is lit only through its stairs, and a corridor behind it from which no lit surface is visible
//! directly.

use bevy_ecs::world::World;
use glam::DVec3;

use super::super::random::Random;
use super::builder::{Builder, CLAY, WHITE, WOOD};
use super::carved::carve;
use super::furniture::{paint, shelf};

/// A door and six steps lead down from a bright room (even layouts) or from a yard under the sky (odd ones). The
/// corridor behind the cellar turns twice.
pub fn cellar(layout: u64, scale: f64) -> World {
    let mut random = Random::new(3000 + layout);
    let mut b = Builder::new(scale);
    let (deep, low) = (-1.2, 0.95);
    let side = random.between(0.4, 1.6);
    let door = random.between(1.0, 2.4);
    let yard = !layout.is_multiple_of(2);
    let voids = [
        [[-4.2, 0.0, 0.0], [-0.2, 2.7, 4.0]],
        // The door, the stairs and the cellar.
        [[-0.2, 0.0, door], [0.0, 2.05, door + 0.95]],
        [[0.0, deep, 0.0], [2.2, 2.4, 4.0]],
        [[2.2, deep, 0.0], [6.0, low, 4.0]],
        // The corridor.
        [[4.2, deep, 4.0], [5.2, deep + 2.0, 4.2]],
        [[4.0, deep, 4.2], [5.4, low, 7.0]],
        [[4.0 - 2.2, deep, 7.0 - 1.4], [4.0, low, 7.0]],
        [[4.0 - 2.2, deep, 7.0], [4.0 - 2.2 + 1.3, low, 9.0]],
    ];
    carve(&mut b, &voids, [[0.42, 0.4, 0.37], WHITE, WHITE], yard.then_some(2.7));
    for step in 0..6 {
        let x = 0.3 * f64::from(step);
        let top = -0.2 * f64::from(step);
        let end = [x + 0.3, top.min(-0.01), door + 1.05];
        b.block("step", [x, deep, door - 0.1], end, [0.5, 0.48, 0.45], 0.0);
    }
    let turn = random.between(0.2, 1.2);
    b.block("barrel", [3.0, deep, side], [3.6, deep + 0.9, side + 0.6], WOOD, turn);
    b.block("crate", [4.6, deep, 0.5], [5.3, deep + 0.6, 1.1], CLAY, random.between(0.0, 1.5));
    b.block("small crate", [4.7, deep + 0.6, 0.6], [5.1, deep + 0.9, 0.95], paint(&mut random), 0.3);
    b.block("chest", [4.1, deep, 5.9], [4.5, deep + 0.5, 6.7], WOOD, 0.0);
    shelf(&mut b, -3.9, 0.0, 1.0, 4);
    if yard {
        b.sky([0.55, 0.8, 1.25]);
        // The sun shines over the yard's edge into the door.
        b.sun(DVec3::new(1.0, -1.0, random.between(-0.2, 0.2)), [23.0, 20.0, 16.0]);
    } else {
        b.lamp("lamp", [-2.6, 2.64, 1.6], [-1.8, 2.7, 2.4], [40.0, 36.0, 28.0]);
    }
    b.camera([5.6, 0.4, 3.7], [0.5, -0.3, door]);
    let way = [[0.0, 0.0, door], [0.0, 0.0, 0.95], [0.0, 2.05, 0.0]];
    let behind = [[4.2, deep, 4.1], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
    b.region([0.0, deep, 0.0], [6.0, 2.4, 9.0], &[way, behind]);
    b.world
}
