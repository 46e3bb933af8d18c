//! Changes that must leave a bake as it is, or change it by no more than its stated error: the number of threads,
//! scale, rotation, finer triangles, objects that no light reaches.

use std::f64::consts::PI;
use std::sync::Arc;

use bevy_ecs::world::World;
use glam::{DAffine3, DQuat, DVec3, Vec3};
use lumbre_bake::{BakeOptions, Density, Quality};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::Material;
use lumbre_scene::{Mesh, StaticObject, Transform};

use crate::common::shapes::inside_out;
use crate::held_out::scenes;
use crate::scene_parts::{matt, run};
use crate::{common, held_out};

fn draft() -> BakeOptions {
    BakeOptions { density: Density::MapSize(16), quality: Quality::Draft, ..BakeOptions::default() }
}

#[test]
fn rooms_and_hall_have_the_same_bits_at_every_scale_of_two_and_on_1_2_and_8_threads() {
    for (name, scene) in [("rooms", scenes::rooms as fn(u64, f64) -> World), ("hall", scenes::hall)] {
        let baked = |scale: f64, threads: usize| {
            let mut world = scene(1, scale);
            run(&mut world, &BakeOptions { threads: Some(threads), ..draft() });
            common::bits(&mut world)
        };
        let plain = baked(1.0, 1);
        assert!(plain.iter().any(|&bits| bits != 0));
        for (scale, threads) in [(1.0, 2), (1.0, 8), (1.0 / 128.0, 2), (1024.0, 8)] {
            assert!(plain == baked(scale, threads), "{name}, scale {scale}, {threads} threads");
        }
    }
}

fn painted(reflectance: [f32; 3], emission: f32) -> Material {
    matt(Vec3::from(reflectance), Vec3::splat(emission))
}

/// A rotated room with a lamp and a crate; each of its walls consists of `divisions`² quads.
fn furnished(turn: DQuat, divisions: u32) -> World {
    let mut world = World::new();
    let mut place = |mesh: TriangleMesh, material: Material, at: DVec3| {
        let transform = Transform::from_translation(turn * at).with_rotation(turn);
        world.spawn((Mesh(Arc::new(mesh)), material, StaticObject, transform));
    };
    let walls = inside_out(shapes::cuboid(Vec3::new(4.0, 2.5, 3.0), divisions));
    place(walls, painted([0.7, 0.5, 0.3], 0.0), DVec3::ZERO);
    place(shapes::cuboid(Vec3::splat(0.75), 1), painted([0.5; 3], 0.0), DVec3::new(0.5, -0.875, 0.25));
    place(shapes::cuboid(Vec3::new(0.6, 0.1, 0.6), 1), painted([0.25; 3], 8.0), DVec3::new(-0.5, 0.9, 0.0));
    world
}

/// The irradiance at points of walls, floor, ceiling and crate that are the same in the room's own frame. They keep
/// away from edges, where the charts of two layouts differ.
fn probe(world: &mut World, turn: DQuat) -> Vec<DVec3> {
    let surfaces = common::lightmapped(world);
    let mut random = held_out::random::Random::new(3);
    let mut found = Vec::new();
    for (center, half, out) in [
        (DVec3::ZERO, DVec3::new(2.0, 1.25, 1.5), -1.0),
        (DVec3::new(0.5, -0.875, 0.25), DVec3::splat(0.375), 1.0),
    ] {
        for i in 0..300usize {
            let axis = i % 3;
            let side = if i % 2 == 0 { 1.0 } else { -1.0 };
            let mut local = DVec3::from_array([0; 3].map(|_| random.between(-0.8, 0.8)));
            local[axis] = side;
            let mut normal = DVec3::ZERO;
            normal[axis] = side * out;
            let position = center + local * half;
            // Skip points below or near the crate.
            let under =
                position.y < -1.2 && (position - DVec3::new(0.5, -1.25, 0.25)).abs().max_element() < 0.45;
            if under {
                continue;
            }
            let point = common::ReferencePoint {
                position: turn * position,
                normal: turn * normal,
                irradiance: DVec3::ZERO,
            };
            found.push(common::look_up(&surfaces, &point).expect("the surface has a map"));
        }
    }
    found
}

/// The RMS difference of two lists relative to the mean of the first one.
fn relative_difference(a: &[DVec3], b: &[DVec3]) -> f64 {
    let mean = a.iter().map(|v| v.element_sum()).sum::<f64>() / (3 * a.len()) as f64;
    let squares: f64 = a.iter().zip(b).map(|(a, b)| (*a - *b).length_squared()).sum();
    (squares / (3 * a.len()) as f64).sqrt() / mean
}

#[test]
fn rotation_and_finer_triangles_stay_within_the_stated_error() {
    let options =
        BakeOptions { density: Density::TexelsPerMeter(16.0), error: 0.02, ..BakeOptions::default() };
    let baked = |turn: DQuat, divisions: u32, density: f64| {
        let mut world = furnished(turn, divisions);
        let report = run(&mut world, &BakeOptions { density: Density::TexelsPerMeter(density), ..options });
        (probe(&mut world, turn), report.estimated_error)
    };
    let odd = DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.7);
    let (plain, stated) = baked(DQuat::IDENTITY, 1, 16.0);
    // For information, the effect of the map's resolution: the same scene with another lattice of texels.
    let (shifted, _) = baked(DQuat::IDENTITY, 1, 14.3);
    let lattice = relative_difference(&plain, &shifted);
    for (name, turn, divisions) in [
        ("by a quarter", DQuat::from_rotation_y(PI / 2.0), 1),
        ("by an odd angle", odd, 1),
        ("finer triangles", DQuat::IDENTITY, 5),
    ] {
        let (found, other_stated) = baked(turn, divisions, 16.0);
        let difference = relative_difference(&plain, &found);
        println!(
            "{name}: apart {:.3} %, stated {:.3} and {:.3} %, lattices {:.3} %",
            100.0 * difference,
            100.0 * stated,
            100.0 * other_stated,
            100.0 * lattice
        );
        // The two errors are independent, so that the stated errors add up by their squares; the limit is twice that.
        assert!(
            difference < 2.0 * stated.hypot(other_stated),
            "{name}: {difference}, stated {stated} and {other_stated}"
        );
        assert!(difference > 0.0);
    }
}

#[test]
fn objects_that_no_light_reaches_change_only_the_samples() {
    let options =
        BakeOptions { density: Density::TexelsPerMeter(12.0), error: 0.02, ..BakeOptions::default() };
    let baked = |outside: bool, hidden: bool| {
        let mut world = furnished(DQuat::IDENTITY, 1);
        if outside {
            // In the dark behind a wall, yet near enough that the scene's scale, a power of two, stays the same.
            let rock = Mesh(Arc::new(shapes::cuboid(Vec3::splat(0.3), 1)));
            world.spawn((rock, painted([0.5; 3], 0.0), StaticObject, Transform::from_xyz(2.6, 0.0, 0.0)));
        }
        if hidden {
            let ghost = Mesh(Arc::new(shapes::cuboid(Vec3::splat(0.9), 1)));
            world.spawn((
                ghost,
                painted([0.5; 3], 5.0),
                StaticObject,
                lumbre_scene::Hidden,
                Transform::from_affine(DAffine3::IDENTITY).0,
            ));
        }
        let report = run(&mut world, &options);
        (common::bits(&mut world), probe(&mut world, DQuat::IDENTITY), report.estimated_error)
    };
    let (bits, plain, stated) = baked(false, false);
    let (with_ghost, ..) = baked(false, true);
    assert!(bits == with_ghost, "a hidden object has no part in the bake");
    let (_, with_rock, other_stated) = baked(true, false);
    let difference = relative_difference(&plain, &with_rock);
    assert!(
        difference < 2.0 * stated.hypot(other_stated),
        "{difference}, stated {stated} and {other_stated}"
    );
}
