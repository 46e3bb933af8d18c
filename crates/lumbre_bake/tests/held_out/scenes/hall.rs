//! A hall with columns under point lights.

use std::f64::consts::TAU;

use bevy_ecs::world::World;
use glam::DVec3;
use lumbre_mesh::TriangleMesh;

use super::super::random::Random;
use super::builder::{Builder, CLAY, GREEN, NONE, WHITE, WOOD, matt};

/// A prism with flat sides and regular polygons as its ends, about the y axis.
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

/// A hall of 12 by 8 by 4 m with columns on square feet (of 8 sides in even layouts, of 20 in odd ones). It is lit by
/// point lights only, which are entirely baked.
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
