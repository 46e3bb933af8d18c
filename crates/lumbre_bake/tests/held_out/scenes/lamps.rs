//! A furnished room under any number of lamps of the same total power: emissive squares, point lights, or a bulb of
//! many triangles.

use bevy_ecs::world::World;
use glam::{DVec3, Vec2};
use lumbre_mesh::TriangleMesh;

use super::super::random::Random;
use super::builder::{Builder, CLAY, GREEN, WHITE, WOOD, matt};
use super::carved::carve;
use super::furniture::{chair, paint, picture, shelf, vase};
use super::revolution::revolution;

const SIZE: [f64; 3] = [8.0, 3.0, 6.0];
/// The total area of the emissive squares in m², and their radiance.
const AREA: f64 = 0.64;
const RADIANCE: [f32; 3] = [14.0, 12.0, 9.5];

/// The room without lamps, 8 by 6 by 3 m; all scenes of this module and the screen's share it.
pub fn furnished(scale: f64) -> Builder {
    let mut random = Random::new(7000);
    let mut b = Builder::new(scale);
    carve(&mut b, &[[[0.0; 3], SIZE]], [WOOD, [0.7, 0.66, 0.6], WHITE], None);
    for (x, z, turn) in [(2.0, 2.0, 0.3), (5.6, 2.4, 1.1), (3.6, 4.4, 0.7)] {
        b.table(x, z, turn);
        chair(&mut b, x - 0.9, z + 0.2, random.between(0.0, 6.0));
        chair(&mut b, x + 0.8, z + 0.5, random.between(0.0, 6.0));
        vase(&mut b, [x, 0.75, z], paint(&mut random));
    }
    shelf(&mut b, 0.5, 0.0, 1.2, 5);
    shelf(&mut b, 5.8, 0.0, 1.6, 5);
    picture(&mut b, [4.0, 1.4, 0.0], [1.0, 0.6], paint(&mut random));
    b.block("sofa", [7.2, 0.0, 3.0], [8.0, 0.45, 5.0], GREEN, 0.0);
    b.block("crate", [0.6, 0.0, 4.6], [1.3, 0.6, 5.3], CLAY, 0.5);
    b.camera([7.6, 1.7, 5.7], [2.5, 0.9, 1.6]);
    b.region([0.0; 3], SIZE, &[]);
    b
}

/// Two coordinates in [0, 1) that fill the square evenly (Martin Roberts' R2 sequence), and a third that is random.
fn spread(index: u64, random: &mut Random) -> [f64; 3] {
    let at = |step: f64| (0.5 + step * index as f64).fract();
    [at(0.754_877_666_246_693), at(0.569_840_290_998_053), random.uniform()]
}

/// The room with `count` emissive squares: a third each below the ceiling, on the walls, and free in the room. Each
/// third is one object.
pub fn lamps(count: u64, scale: f64) -> World {
    let mut b = furnished(scale);
    let mut random = Random::new(7100);
    let half = 0.5 * (AREA / count as f64).sqrt();
    let mut meshes: [TriangleMesh; 3] = Default::default();
    let [width, height, depth] = SIZE;
    for index in 0..count {
        let [s, t, u] = spread(index / 3, &mut random);
        let (x, z) = (0.5 + (width - 1.0) * s, 0.5 + (depth - 1.0) * t);
        let (at, normal) = match index % 3 {
            0 => (DVec3::new(x, height - 0.01, z), DVec3::NEG_Y),
            1 => {
                let y = 2.1 + 0.8 * t;
                let along = 2.0 * (width + depth) * s;
                if along < 2.0 * width {
                    let x = 0.1 + (width - 0.2) * (along % width) / width;
                    if along < width {
                        (DVec3::new(x, y.min(height - 2.0 * half), 0.01), DVec3::Z)
                    } else {
                        (DVec3::new(x, y.min(height - 2.0 * half), depth - 0.01), DVec3::NEG_Z)
                    }
                } else {
                    let along = along - 2.0 * width;
                    let z = 0.1 + (depth - 0.2) * (along % depth) / depth;
                    if along < depth {
                        (DVec3::new(0.01, y.min(height - 2.0 * half), z), DVec3::X)
                    } else {
                        (DVec3::new(width - 0.01, y.min(height - 2.0 * half), z), DVec3::NEG_X)
                    }
                }
            }
            _ => {
                let tilt = DVec3::new(random.between(-0.8, 0.8), -1.0, random.between(-0.8, 0.8));
                (DVec3::new(x, 2.0 + 0.6 * u, z), tilt.normalize())
            }
        };
        push_square(&mut meshes[(index % 3) as usize], at * scale, normal, half * scale);
    }
    for (mesh, name) in meshes.into_iter().zip(["ceiling lamps", "wall lamps", "hanging lamps"]) {
        if !mesh.indices.is_empty() {
            b.mesh(name, mesh, matt([0.3; 3], RADIANCE), DVec3::ZERO, 0.0);
        }
    }
    b.world
}

fn push_square(mesh: &mut TriangleMesh, at: DVec3, normal: DVec3, half: f64) {
    let (right, up) = normal.any_orthonormal_pair();
    let first = mesh.positions.len() as u32;
    for (s, t) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
        mesh.positions.push((at + (right * s + up * t) * half).as_vec3());
        mesh.normals.push(normal.as_vec3());
        mesh.uv0.push(Vec2::new(0.5 + 0.5 * s as f32, 0.5 - 0.5 * t as f32));
    }
    mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|vertex| first + vertex));
}

/// The room with `count` point lights in its upper half.
pub fn points(count: u64, scale: f64) -> World {
    let mut b = furnished(scale);
    let mut random = Random::new(7200);
    for index in 0..count {
        let [s, t, u] = spread(index, &mut random);
        let at = [0.4 + (SIZE[0] - 0.8) * s, 1.5 + 1.1 * u, 0.4 + (SIZE[2] - 0.8) * t];
        let strength = (AREA / (4.0 * std::f64::consts::PI)) as f32 / count as f32;
        b.point_light(at, RADIANCE.map(|radiance| radiance * strength));
    }
    b.world
}

/// The room with one smooth bulb of about this many triangles.
pub fn bulb(triangles: u64, scale: f64) -> World {
    let mut b = furnished(scale);
    let segments = ((triangles as f64 / 1.75).sqrt()).round().max(8.0) as u32;
    // The rings at both ends have only one triangle per segment.
    let rings = (triangles as f64 / (2.0 * f64::from(segments)) + 1.0).round().max(4.0) as u32;
    let size = 0.1 * b.scale;
    let profile = |t: f64| {
        let angle = std::f64::consts::PI * t;
        // A globe that narrows towards its thread.
        let narrow = 1.0 - 0.55 * ((t - 0.55) / 0.3).clamp(0.0, 1.0);
        let radius = if t > 0.0 && t < 1.0 { size * angle.sin().max(0.0) * narrow } else { 0.0 };
        [radius, -size * angle.cos() * 1.3]
    };
    let mesh = revolution(profile, segments, rings);
    let area: f32 = mesh
        .triangle_positions()
        .unwrap_or_default()
        .iter()
        .map(|[a, b, c]| 0.5 * (*b - *a).cross(*c - *a).length())
        .sum();
    let brighter = (AREA * scale * scale) as f32 / area;
    let at = DVec3::new(4.0, 2.3, 3.2);
    b.mesh("bulb", mesh, matt([0.3; 3], RADIANCE.map(|radiance| radiance * brighter)), at, 0.0);
    b.world
}
