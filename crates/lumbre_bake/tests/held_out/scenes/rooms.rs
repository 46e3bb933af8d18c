//! Two rooms joined by a doorway, one of them lit.

use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;

use super::super::random::Random;
use super::builder::{Builder, CLAY, GREEN, WHITE, WOOD, inside_out, matt};

/// Two rooms of 4 by 3.6 m, a wall of 15 cm with a doorway between them, and a lamp under the ceiling of the first.
///
/// In even layouts the rooms are the inside of a box and the lamp is a square that looks down. In odd ones walls, floor
/// and ceiling are slabs and the lamp is a box. The layout also determines the positions of doorway, lamp and
/// furniture.
pub fn rooms(layout: u64, scale: f64) -> World {
    let mut random = Random::new(layout);
    let mut b = Builder::new(scale);
    let (height, depth, wall) = (2.6, 3.6, 0.15);
    let (left, right) = (-4.0, 4.0 + wall);
    if layout.is_multiple_of(2) {
        b.shell("rooms", [left, 0.0, 0.0], [right, height, depth], WHITE);
    } else {
        b.block("floor", [left - wall, -0.2, -wall], [right + wall, 0.0, depth + wall], WOOD, 0.0);
        b.block(
            "ceiling",
            [left - wall, height, -wall],
            [right + wall, height + 0.2, depth + wall],
            WHITE,
            0.0,
        );
        b.block("west wall", [left - wall, 0.0, 0.0], [left, height, depth], CLAY, 0.0);
        b.block("east wall", [right, 0.0, 0.0], [right + wall, height, depth], GREEN, 0.0);
        b.block("north wall", [left - wall, 0.0, -wall], [right + wall, height, 0.0], WHITE, 0.0);
        b.block("south wall", [left - wall, 0.0, depth], [right + wall, height, depth + wall], WHITE, 0.0);
    }
    // The wall between the rooms, with a doorway of 90 by 205 cm.
    let door = random.between(0.5, depth - 1.4);
    b.block("wall before the door", [0.0, 0.0, 0.0], [wall, height, door], WHITE, 0.0);
    b.block("wall behind the door", [0.0, 0.0, door + 0.9], [wall, height, depth], WHITE, 0.0);
    b.block("lintel", [0.0, 2.05, door], [wall, height, door + 0.9], WHITE, 0.0);
    // The lamp.
    let (x, z) = (random.between(-2.6, -1.6), random.between(1.4, 2.2));
    let radiance = [18.0, 15.0, 11.0];
    if layout.is_multiple_of(2) {
        let size = (0.6 * scale) as f32;
        let lamp = inside_out(shapes::plane(size, size, 1, 1));
        b.mesh("lamp", lamp, matt([0.5; 3], radiance), DVec3::new(x, height - 0.01, z), 0.0);
    } else {
        let lamp = shapes::cuboid(Vec3::new(0.7, 0.06, 0.4) * scale as f32, 1);
        b.mesh("lamp", lamp, matt([0.5; 3], radiance), DVec3::new(x, height - 0.1, z), 0.0);
    }
    // The furniture of both rooms.
    b.table(random.between(-3.0, -2.2), random.between(0.8, 1.2), random.between(0.0, 1.5));
    let turn = random.between(0.2, 1.3);
    let (x, z) = (random.between(-1.2, -0.9), random.between(2.6, 2.8));
    b.block("chest", [x - 0.4, 0.0, z - 0.25], [x + 0.4, 0.5, z + 0.25], CLAY, turn);
    b.closed_cupboard([-3.9, 0.0, 2.9], [-3.0, 1.5, 3.5]);
    b.block("shelf", [1.0, 0.0, 0.0], [2.1, 1.9, 0.35], WOOD, 0.0);
    let (x, z) = (random.between(2.0, 2.8), random.between(1.6, 2.4));
    b.block("crate", [x - 0.3, 0.0, z - 0.3], [x + 0.3, 0.6, z + 0.3], GREEN, random.between(0.2, 1.3));
    b.block(
        "small crate",
        [x - 0.15, 0.6, z - 0.15],
        [x + 0.15, 0.9, z + 0.15],
        CLAY,
        random.between(0.0, 1.5),
    );
    b.block("sofa", [3.2, 0.0, 1.0], [4.0, 0.45, 2.6], GREEN, 0.0);
    b.world
}
