//! An object like those that scanners produce: round with bumps of all sizes, and with triangles of one size
//! all over, far more than its shape requires.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::TriangleMesh;
use lumbre_mesh::normals::{NormalWeight, compute_smooth_normals};
use lumbre_mesh::shapes::tetrahedral_sphere;
use lumbre_optics::{Light, Material, Surface};
use lumbre_scene::{Camera, Mesh, Name, Projection, SceneSettings, Transform};

/// Subdivision depth at full resolution: 65,536 triangles.
const DEPTH: u32 = 7;
/// Number of waves per octave, enough to hide their directions.
const WAVES: u32 = 12;
/// Number of octaves; each has twice as many bumps of half the height.
const OCTAVES: u32 = 5;

/// Creates the scan under two lamps in front of black.
pub fn scan() -> World {
    let mut world = World::new();
    world.insert_resource(SceneSettings { ambient: Vec3::splat(0.1), ..SceneSettings::default() });
    let color = Vec3::new(0.6, 0.5, 0.4);
    let front = Surface {
        ambient: color,
        diffuse: color,
        specular: Vec3::splat(0.3),
        shininess: 30.0,
        ..Surface::default()
    };
    let material = Material { front, ..Material::default() };
    world.spawn((Name::new("scan"), Mesh(Arc::new(stone())), material));
    for (name, color, place) in [
        ("key light", Vec3::new(0.9, 0.85, 0.8), (2.0, 2.5, 2.0)),
        ("fill light", Vec3::new(0.2, 0.25, 0.3), (-3.0, 0.5, 1.0)),
    ] {
        let aimed = Transform::from_xyz(place.0, place.1, place.2).looking_at(DVec3::ZERO, DVec3::Y);
        world.spawn((Name::new(name), Light::directional(color), aimed));
    }
    let eye = Transform::from_xyz(0.0, 0.6, 4.2).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((
        Name::new("camera"),
        Camera { projection: Projection::perspective(0.6), exposure: 1.0 },
        eye,
    ));
    world
}

/// Returns a sphere whose vertices are displaced along their normals by waves in random directions.
fn stone() -> TriangleMesh {
    let sphere = tetrahedral_sphere(1.0, DEPTH, false);
    let waves = waves();
    let moved = |point: &Vec3| {
        let point = point.as_dvec3();
        let height: f64 =
            waves.iter().map(|(along, phase, height)| height * (along.dot(point) + phase).sin()).sum();
        (point * (1.0 + height)).as_vec3()
    };
    let positions = sphere.positions.iter().map(moved).collect();
    let bumpy = TriangleMesh { positions, uv0: Vec::new(), ..sphere };
    // The displaced sphere is a valid mesh.
    compute_smooth_normals(&bumpy, NormalWeight::Area).map_or(bumpy, |found| found.mesh)
}

/// Returns wave vector, phase and height of each wave, always the same ones.
fn waves() -> Vec<(DVec3, f64, f64)> {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    // Marsaglia's xorshift, to [0, 1).
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut waves = Vec::new();
    for octave in 0..OCTAVES {
        let along = f64::from(1 << octave);
        for _ in 0..WAVES {
            let (z, around) = (2.0 * random() - 1.0, std::f64::consts::TAU * random());
            let flat = (1.0 - z * z).sqrt();
            let direction = DVec3::new(flat * around.cos(), flat * around.sin(), z);
            waves.push((2.5 * along * direction, std::f64::consts::TAU * random(), 0.035 / along));
        }
    }
    waves
}
