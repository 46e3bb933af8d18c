//! Two rooms joined by a doorway, and a hall with columns: without lightmap coordinates, in several layouts, at any scale.
//! Irradiance is the same at every scale: radiance stays, a point light's intensity grows with the square.

use std::f64::consts::TAU;
use std::sync::Arc;

use bevy_ecs::world::World;
use glam::{DQuat, DVec3, Vec3};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{BakeMode, Light, Material, Surface};
use lumbre_scene::{Mesh, Name, StaticObject, Transform};

use super::random::Random;

struct Builder {
    world: World,
    scale: f64,
}

fn matt(reflectance: [f32; 3], emission: [f32; 3]) -> Material {
    let front = Surface { diffuse: reflectance.into(), emission: emission.into(), ..Surface::default() };
    Material { front, ..Material::default() }
}

const WHITE: [f32; 3] = [0.72, 0.7, 0.66];
const CLAY: [f32; 3] = [0.55, 0.24, 0.16];
const WOOD: [f32; 3] = [0.45, 0.33, 0.2];
const GREEN: [f32; 3] = [0.2, 0.45, 0.22];
const NONE: [f32; 3] = [0.0; 3];

impl Builder {
    fn new(scale: f64) -> Self {
        Self { world: World::new(), scale }
    }

    fn mesh(&mut self, name: &str, mesh: TriangleMesh, material: Material, at: DVec3, turn: f64) {
        let place = Transform::from_translation(at * self.scale).with_rotation(DQuat::from_rotation_y(turn));
        self.world.spawn((Name::new(name.to_owned()), Mesh(Arc::new(mesh)), material, StaticObject, place));
    }

    /// A box from its lowest to its highest corner, turned about its own vertical axis.
    fn block(&mut self, name: &str, low: [f64; 3], high: [f64; 3], color: [f32; 3], turn: f64) {
        let (low, high) = (DVec3::from(low), DVec3::from(high));
        let mesh = shapes::cuboid(((high - low) * self.scale).as_vec3(), 1);
        self.mesh(name, mesh, matt(color, NONE), (low + high) / 2.0, turn);
    }

    /// The inside of a box.
    fn shell(&mut self, name: &str, low: [f64; 3], high: [f64; 3], color: [f32; 3]) {
        let (low, high) = (DVec3::from(low), DVec3::from(high));
        let mut mesh = shapes::cuboid(((high - low) * self.scale).as_vec3(), 1);
        mesh.indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
        mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
        self.mesh(name, mesh, matt(color, NONE), (low + high) / 2.0, 0.0);
    }

    fn point_light(&mut self, at: [f64; 3], color: [f32; 3]) {
        let strength = (self.scale * self.scale) as f32;
        let light = Light { bake: BakeMode::Static, ..Light::point(Vec3::from(color) * strength) };
        self.world.spawn((light, Transform::from_translation(DVec3::from(at) * self.scale)));
    }

    /// A table: a board on four legs.
    fn table(&mut self, x: f64, z: f64, turn: f64) {
        self.mesh_at_turn("table board", [1.2, 0.04, 0.7], [x, 0.73, z], turn, [0.0; 3]);
        for (dx, dz) in [(-0.55, -0.3), (0.55, -0.3), (-0.55, 0.3), (0.55, 0.3)] {
            self.mesh_at_turn("table leg", [0.06, 0.71, 0.06], [x, 0.355, z], turn, [dx, 0.0, dz]);
        }
    }

    fn mesh_at_turn(&mut self, name: &str, size: [f64; 3], at: [f64; 3], turn: f64, off: [f64; 3]) {
        let mesh = shapes::cuboid((DVec3::from(size) * self.scale).as_vec3(), 1);
        let at = DVec3::from(at) + DQuat::from_rotation_y(turn) * DVec3::from(off);
        self.mesh(name, mesh, matt(WOOD, NONE), at, turn);
    }

    /// Six boards around a place that no light reaches.
    fn closed_cupboard(&mut self, low: [f64; 3], high: [f64; 3]) {
        const BOARD: f64 = 0.02;
        let ([x0, y0, z0], [x1, y1, z1]) = (low, high);
        self.block("cupboard floor", low, [x1, y0 + BOARD, z1], WOOD, 0.0);
        self.block("cupboard top", [x0, y1 - BOARD, z0], high, WOOD, 0.0);
        let (y0, y1) = (y0 + BOARD, y1 - BOARD);
        self.block("cupboard left", [x0, y0, z0], [x0 + BOARD, y1, z1], WOOD, 0.0);
        self.block("cupboard right", [x1 - BOARD, y0, z0], [x1, y1, z1], WOOD, 0.0);
        let (x0, x1) = (x0 + BOARD, x1 - BOARD);
        self.block("cupboard back", [x0, y0, z0], [x1, y1, z0 + BOARD], WOOD, 0.0);
        self.block("cupboard door", [x0, y0, z1 - BOARD], [x1, y1, z1], WOOD, 0.0);
    }
}

/// Two rooms of 4 by 3.6 metres, a wall of 15 cm with a doorway and a lintel between them, and a lamp under the first one's ceiling.
///
/// Layouts: 0 is a shell with a lamp that shines down; 1 has walls, floor and ceiling of slabs, and a lamp of six shining faces; from
/// 2 on, furniture and doorway move.
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
    // The wall between, around a doorway of 90 by 205 cm.
    let door = random.between(0.5, depth - 1.4);
    b.block("wall before the door", [0.0, 0.0, 0.0], [wall, height, door], WHITE, 0.0);
    b.block("wall behind the door", [0.0, 0.0, door + 0.9], [wall, height, depth], WHITE, 0.0);
    b.block("lintel", [0.0, 2.05, door], [wall, height, door + 0.9], WHITE, 0.0);
    // The lamp.
    let (x, z) = (random.between(-2.6, -1.6), random.between(1.4, 2.2));
    let shine = [18.0, 15.0, 11.0];
    if layout.is_multiple_of(2) {
        let size = (0.6 * scale) as f32;
        let mut lamp = shapes::plane(size, size, 1, 1);
        lamp.indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
        lamp.normals.iter_mut().for_each(|normal| *normal = -*normal);
        b.mesh("lamp", lamp, matt([0.5; 3], shine), DVec3::new(x, height - 0.01, z), 0.0);
    } else {
        let lamp = shapes::cuboid(Vec3::new(0.7, 0.06, 0.4) * scale as f32, 1);
        b.mesh("lamp", lamp, matt([0.5; 3], shine), DVec3::new(x, height - 0.1, z), 0.0);
    }
    // Furniture of both rooms.
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

/// A prism of flat sides that stands on the floor.
fn prism(radius: f64, height: f64, sides: u32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let corner = |i: u32| {
        let angle = TAU * f64::from(i % sides) / f64::from(sides);
        DVec3::new(radius * angle.cos(), 0.0, radius * angle.sin())
    };
    let up = DVec3::Y * height;
    let mut polygon = |corners: &[DVec3], normal: DVec3| {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners.iter().map(|corner| corner.as_vec3()));
        mesh.normals.extend(corners.iter().map(|_| normal.as_vec3()));
        for i in 1..corners.len() as u32 - 1 {
            mesh.indices.extend([first, first + i, first + i + 1]);
        }
    };
    for i in 0..sides {
        let (a, b) = (corner(i), corner(i + 1));
        polygon(&[a, a + up, b + up, b], (a + b).normalize());
    }
    let bottom: Vec<DVec3> = (0..sides).map(corner).collect();
    let top: Vec<DVec3> = (0..sides).rev().map(|i| corner(i) + up).collect();
    polygon(&bottom, DVec3::NEG_Y);
    polygon(&top, DVec3::Y);
    mesh
}

/// A hall of 12 by 8 by 4 metres with columns (of eight sides in even layouts, of twenty in odd ones) on square feet, and point lights
/// only, baked whole.
pub fn hall(layout: u64, scale: f64) -> World {
    let mut random = Random::new(1000 + layout);
    let mut b = Builder::new(scale);
    let (width, height, depth) = (12.0, 4.0, 8.0);
    if layout.is_multiple_of(2) {
        b.shell("hall", [0.0; 3], [width, height, depth], WHITE);
    } else {
        b.block("floor", [-0.2, -0.2, -0.2], [width + 0.2, 0.0, depth + 0.2], WOOD, 0.0);
        b.block("ceiling", [-0.2, height, -0.2], [width + 0.2, height + 0.2, depth + 0.2], WHITE, 0.0);
        b.block("west wall", [-0.2, 0.0, 0.0], [0.0, height, depth], CLAY, 0.0);
        b.block("east wall", [width, 0.0, 0.0], [width + 0.2, height, depth], GREEN, 0.0);
        b.block("north wall", [-0.2, 0.0, -0.2], [width + 0.2, height, 0.0], WHITE, 0.0);
        b.block("south wall", [-0.2, 0.0, depth], [width + 0.2, height, depth + 0.2], WHITE, 0.0);
    }
    let sides = if layout.is_multiple_of(2) { 8 } else { 20 };
    for x in [2.4, 4.8, 7.2, 9.6] {
        for z in [2.2, 5.8] {
            let radius = random.between(0.2, 0.35);
            b.block("foot", [x - 0.4, 0.0, z - 0.4], [x + 0.4, 0.3, z + 0.4], WOOD, 0.0);
            let column = prism(radius * scale, (height - 0.3) * scale, sides);
            b.mesh("column", column, matt(WHITE, NONE), DVec3::new(x, 0.3, z), random.between(0.0, 1.0));
        }
    }
    for (x, z) in [(1.2, 4.0), (6.0, 1.1), (6.0, 6.9), (10.8, 4.0), (6.0, 4.0)] {
        let at = [x + random.between(-0.4, 0.4), random.between(2.4, 3.4), z + random.between(-0.3, 0.3)];
        let warm = random.between(0.6, 1.0) as f32;
        b.point_light(at, [3.0, 3.0 * warm, 3.0 * warm * warm]);
    }
    b.world
}

/// A name, what builds it by layout and scale, and its layout.
pub type Named = (&'static str, fn(u64, f64) -> World, u64);

/// Every kind and layout.
pub fn all() -> [Named; 6] {
    [
        ("rooms_0", rooms, 0),
        ("rooms_1", rooms, 1),
        ("hall_0", hall, 0),
        ("hall_1", hall, 1),
        ("rooms_2", rooms, 2),
        ("hall_2", hall, 2),
    ]
}
