//! A lamp behind many thin bars, whose soft shadows overlap.

use bevy_ecs::world::World;

use super::super::random::Random;
use super::builder::{Builder, CLAY, WHITE, WOOD};
use super::carved::carve;
use super::furniture::{chair, paint, picture};

/// A room of 4 by 4 by 2.6 m whose lamp is in a shaft of the ceiling (even layouts) or in a cage on the wall (odd
/// ones), behind a grille.
pub fn grille(layout: u64, scale: f64) -> World {
    let mut random = Random::new(5000 + layout);
    let mut b = Builder::new(scale);
    let height = 2.6;
    let (x, z) = (random.between(1.3, 2.1), random.between(1.3, 2.1));
    let room = [[0.0; 3], [4.0, height, 4.0]];
    let colors = [WOOD, paint(&mut random), WHITE];
    let steel = [0.35, 0.35, 0.36];
    if layout.is_multiple_of(2) {
        let shaft = [[x, height, z], [x + 0.8, height + 0.5, z + 0.6]];
        carve(&mut b, &[room, shaft], colors, None);
        let lamp = [x + 0.2, height + 0.42, z + 0.15];
        b.lamp("lamp", lamp, [x + 0.6, height + 0.5, z + 0.45], [70.0, 60.0, 45.0]);
        let bars = 20;
        for bar in 1..bars {
            let at = x + 0.8 * f64::from(bar) / f64::from(bars) - 0.006;
            b.block("bar", [at, height, z], [at + 0.012, height + 0.012, z + 0.6], steel, 0.0);
        }
        for bar in 1..4 {
            let at = z + 0.15 * f64::from(bar) - 0.006;
            b.block("cross bar", [x, height + 0.012, at], [x + 0.8, height + 0.024, at + 0.012], steel, 0.0);
        }
    } else {
        carve(&mut b, &[room], colors, None);
        b.lamp("lamp", [x, 1.5, 0.0], [x + 0.7, 1.9, 0.06], [40.0, 35.0, 26.0]);
        let bars = 24;
        for bar in 0..=bars {
            let at = x - 0.1 + 0.9 * f64::from(bar) / f64::from(bars) - 0.005;
            b.block("bar", [at, 1.4, 0.15], [at + 0.01, 2.0, 0.16], steel, 0.0);
        }
        for bar in 0..5 {
            let at = 1.4 + 0.1475 * f64::from(bar);
            b.block("cross bar", [x - 0.105, at, 0.16], [x + 0.805, at + 0.01, 0.17], steel, 0.0);
        }
        for (at, y) in [(x - 0.105, 1.4), (x + 0.795, 1.4), (x - 0.105, 1.99), (x + 0.795, 1.99)] {
            b.block("holder", [at, y, 0.0], [at + 0.01, y + 0.01, 0.15], steel, 0.0);
        }
    }
    b.table(random.between(2.4, 2.8), random.between(2.4, 2.8), random.between(0.0, 1.5));
    chair(&mut b, random.between(1.0, 1.5), random.between(2.5, 3.0), random.between(0.0, 6.0));
    b.block("crate", [0.4, 0.0, 0.4], [0.9, 0.5, 0.9], CLAY, random.between(0.0, 1.5));
    picture(&mut b, [3.2, 1.5, 0.0], [0.6, 0.8], paint(&mut random));
    b.camera([3.7, 1.6, 3.7], [1.2, 0.7, 1.0]);
    b.region(room[0], [4.0, height, 4.0], &[]);
    b.world
}
