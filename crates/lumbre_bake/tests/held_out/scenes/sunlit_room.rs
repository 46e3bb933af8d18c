//! A furnished room with windows on a sunny day: the outside is ten to thirty times as bright as the inside.

use bevy_ecs::world::World;
use glam::DVec3;

use super::super::random::Random;
use super::builder::{Builder, CLAY, WHITE, WOOD};
use super::furniture::{books, chair, paint, picture, shelf, vase};
use super::wall::{Opening, Wall, ground};

const WIDTH: f64 = 5.0;
const DEPTH: f64 = 4.0;
const HEIGHT: f64 = 2.7;
const THICK: f64 = 0.25;

/// A room of 5 by 4 by 2.7 m. In even layouts the sun shines in through a window to the south. In odd ones it is behind
/// the house, there is a second window to the west, and the sun lights the wall of a neighbour's house.
pub fn sunlit_room(layout: u64, scale: f64) -> World {
    let mut random = Random::new(2000 + layout);
    let mut b = Builder::new(scale);
    let shines_in = layout.is_multiple_of(2);
    let walls = [(); 4].map(|()| paint(&mut random));
    b.standing("floor", [-THICK, -0.3, -THICK], [WIDTH + THICK, 0.0, DEPTH + THICK], WOOD);
    let above = [WIDTH + THICK, HEIGHT + 0.25, DEPTH + THICK];
    b.block("ceiling", [-THICK, HEIGHT, -THICK], above, WHITE, 0.0);
    b.block("north wall", [-THICK, 0.0, -THICK], [WIDTH + THICK, HEIGHT, 0.0], walls[0], 0.0);
    b.block("east wall", [WIDTH, 0.0, 0.0], [WIDTH + THICK, HEIGHT, DEPTH], walls[1], 0.0);
    let south = Wall {
        along_x: true,
        ends: [-THICK, WIDTH + THICK],
        across: [DEPTH, DEPTH + THICK],
        height: HEIGHT,
        color: walls[2],
    };
    let west =
        Wall { along_x: false, ends: [0.0, DEPTH], across: [-THICK, 0.0], height: HEIGHT, color: walls[3] };
    let window = |random: &mut Random, low: f64, high: f64| -> Opening {
        let width = random.between(1.8, 2.4);
        let begin = random.between(low, high - width);
        [begin, begin + width, random.between(0.4, 0.8), random.between(2.2, 2.4)]
    };
    let to_south = window(&mut random, 0.6, WIDTH - 0.6);
    south.build(&mut b, &[to_south]);
    let mut openings = vec![south.rectangle(to_south)];
    if shines_in {
        west.build(&mut b, &[]);
    } else {
        let to_west = window(&mut random, 0.6, DEPTH - 0.4);
        west.build(&mut b, &[to_west]);
        openings.push(west.rectangle(to_west));
    }
    furnish(&mut b, &mut random);
    outside(&mut b, &mut random, shines_in);
    b.camera([WIDTH - 0.4, 1.6, 0.4], [1.2, 0.8, 3.2]);
    b.region([0.0; 3], [WIDTH, HEIGHT, DEPTH], &openings);
    b.world
}

fn furnish(b: &mut Builder, random: &mut Random) {
    let (x, z) = (random.between(1.4, 2.2), random.between(1.8, 2.4));
    b.table(x, z, random.between(0.0, 1.5));
    vase(b, [x + 0.1, 0.75, z], paint(random));
    chair(b, x - random.between(0.8, 1.0), z, random.between(0.0, 6.0));
    chair(b, x + 0.2, z + random.between(0.75, 0.9), random.between(0.0, 6.0));
    let width = random.between(0.9, 1.4);
    let left = random.between(0.1, 1.0);
    shelf(b, left, 0.0, width, 5);
    books(b, [left + 0.04, 0.085, 0.03], 6, random);
    books(b, [left + 0.3, 0.513, 0.03], 9, random);
    vase(b, [left + width / 2.0, 1.8, 0.16], CLAY);
    picture(b, [random.between(2.9, 4.2), 1.6, 0.0], [0.8, 0.5], paint(random));
    let deep = random.between(0.7, 0.9);
    b.block("sofa", [WIDTH - deep, 0.0, 1.0], [WIDTH, 0.42, 2.9], paint(random), 0.0);
    b.block("cushion", [WIDTH - 0.2, 0.42, 1.0], [WIDTH, 0.8, 2.9], paint(random), 0.0);
    b.block("rug", [0.8, 0.0, 1.2], [3.0, 0.012, 3.0], paint(random), 0.0);
    let crate_at = random.between(3.0, 3.6);
    let turn = random.between(0.0, 1.5);
    b.block("crate", [crate_at, 0.0, 3.2], [crate_at + 0.5, 0.4, 3.6], CLAY, turn);
}

fn outside(b: &mut Builder, random: &mut Random, shines_in: bool) {
    ground(b, [WIDTH / 2.0, -0.3, 6.0], [22.0, 20.0], [0.32, 0.34, 0.24]);
    let (x, z) = (random.between(-2.0, 1.0), random.between(10.0, 12.0));
    let tall = if shines_in { 1.6 } else { random.between(3.0, 4.5) };
    b.standing("neighbour", [x, -0.3, z], [x + 6.0, tall, z + 2.5], [0.7, 0.66, 0.58]);
    b.sky([0.55, 0.8, 1.25]);
    let (high, turn) = (random.between(0.45, 0.8), random.between(-0.6, 0.6));
    let back = if shines_in { -1.0 } else { 1.0 };
    let along = DVec3::new(high.cos() * turn.sin(), -high.sin(), back * high.cos() * turn.cos());
    b.sun(along, [23.0, 20.0, 16.0]);
}
