//! The error that a bake states of itself, against a converged bake of the same map: at most twice the stated one on 95 of a hundred
//! texels. The converged bakes have patches half as large, as many rays as their own estimate calls for, and no smoothing.

#![allow(clippy::print_stdout, reason = "the shares are what one wants to see of it")]

use std::sync::Arc;

use crate::scene_parts::matt;
use crate::{common, held_out};
use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_bake::{Bake, BakeOptions, BakeReport, Density, Quality, TexelErrors};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{BakeMode, Light};
use lumbre_scene::{Lightmap, Mesh, StaticObject, Transform};

/// A box seen from inside.
fn room(size: Vec3) -> Arc<TriangleMesh> {
    let mut mesh = shapes::cuboid(size, 1);
    mesh.indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
    mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
    Arc::new(mesh)
}

/// A coloured room with a lamp under its ceiling, two blocks and a small light behind one of them: penumbrae, contact shadows,
/// corners, and a part that only bounces light.
fn lit_room() -> World {
    let mut world = World::new();
    world.spawn((
        Mesh(room(Vec3::new(4.0, 3.0, 4.0))),
        matt(Vec3::new(0.7, 0.6, 0.5), Vec3::ZERO),
        StaticObject,
    ));
    let lamp = Mesh(Arc::new(shapes::cuboid(Vec3::new(1.0, 0.05, 0.6), 1)));
    world.spawn((
        lamp,
        matt(Vec3::splat(0.5), Vec3::new(10.0, 9.0, 7.0)),
        StaticObject,
        Transform::from_xyz(0.4, 1.0, -0.3),
    ));
    for (size, at) in
        [(Vec3::new(0.9, 1.6, 0.9), [-0.9, -0.7, -0.8]), (Vec3::new(1.1, 0.7, 0.8), [0.9, -1.15, 0.7])]
    {
        let block = Mesh(Arc::new(shapes::cuboid(size, 1)));
        world.spawn((
            block,
            matt(Vec3::new(0.3, 0.6, 0.4), Vec3::ZERO),
            StaticObject,
            Transform::from_xyz(at[0], at[1], at[2]),
        ));
    }
    let light = Light { bake: BakeMode::Static, ..Light::point(Vec3::splat(0.4)) };
    world.spawn((light, Transform::from_xyz(-1.6, -1.0, -1.5)));
    world
}

struct Texels {
    values: Vec<DVec3>,
    errors: Vec<f32>,
}

fn baked(mut world: World, options: &BakeOptions) -> (BakeReport, Texels) {
    let report = Bake::new(options).run(&mut world).expect("the scene bakes");
    let mut query = world.query::<(&Lightmap, &TexelErrors)>();
    let mut maps: Vec<_> =
        query.iter(&world).map(|(map, error)| (map.image.clone(), error.0.clone())).collect();
    maps.sort_by(|a, b| a.0.name.cmp(&b.0.name));
    maps.dedup_by(|a, b| a.0.name == b.0.name);
    let values = maps.iter().flat_map(|(map, _)| map.texels.iter().map(|texel| texel.as_dvec3())).collect();
    let errors = maps.iter().flat_map(|(_, errors)| errors.iter().copied()).collect();
    (report, Texels { values, errors })
}

/// What the comparison of two bakes says.
struct Honesty {
    /// Share of the texels whose true error is at most twice the stated one; and at most once: what the share would be if half as much
    /// were stated.
    within: [f64; 2],
    /// RMSE relative to the mean.
    true_error: f64,
}

fn compare(found: &Texels, expected: &Texels) -> Honesty {
    let (mut within, mut count, mut squares, mut mean) = ([0.0; 2], 0.0, 0.0, 0.0);
    let both = found.values.iter().zip(&expected.values).zip(found.errors.iter().zip(&expected.errors));
    for ((value, truth), (stated, also)) in both.filter(|(_, (a, b))| a.is_finite() && b.is_finite()) {
        let apart = (*value - *truth).length() / 3f64.sqrt();
        for (within, factor) in within.iter_mut().zip([1.0, 0.5]) {
            // The reference has an error too, and says so.
            let stated = (factor * f64::from(*stated)).hypot(f64::from(*also));
            *within += f64::from(u8::from(apart <= 2.0 * stated));
        }
        count += 1.0;
        squares += apart * apart;
        mean += truth.element_sum() / 3.0;
    }
    Honesty { within: within.map(|n| n / count), true_error: (squares / count).sqrt() * count / mean }
}

/// Bakes a scene as asked in each way, and to convergence; with each way comes the least share of texels that must be within twice what is
/// stated of them.
fn judge(name: &str, scene: impl Fn() -> World, density: Density, asked: &[(Quality, f64, f64)]) {
    let options = BakeOptions { density, resolution_error: false, ..BakeOptions::default() };
    let converged =
        BakeOptions { quality: Quality::Reference, error: 4e-3, seed: 99, denoise: false, ..options };
    let (reference, expected) = baked(scene(), &converged);
    println!(
        "{name}: reference in {:.1} s, states {:.3} %",
        reference.seconds,
        100.0 * reference.estimated_error
    );
    let mut failed_if_halved = false;
    for &(quality, error, least) in asked {
        let (report, found) = baked(scene(), &BakeOptions { quality, error, ..options });
        let Honesty { within, true_error } = compare(&found, &expected);
        println!(
            "{name} {quality:?} {error}: stated {:.3} %, true {:.3} %, {:.2} % within twice theirs ({:.2} % if halved), {:.2} s",
            100.0 * report.estimated_error,
            100.0 * true_error,
            100.0 * within[0],
            100.0 * within[1],
            report.seconds
        );
        assert!(within[0] >= least, "{name} {quality:?} {error}: {}", within[0]);
        failed_if_halved |= within[1] < 0.95;
        // Modest, too: an estimate of everything would be honest and useless.
        assert!(report.estimated_error <= 4.0 * true_error, "{name} {quality:?} {error}: too pessimistic");
    }
    assert!(failed_if_halved, "{name}: half the stated errors would have passed, so that this tells nothing");
}

const FINAL: [(Quality, f64, f64); 2] = [(Quality::Final, 0.03, 0.95), (Quality::Final, 0.01, 0.95)];

#[test]
fn a_lit_room() {
    judge("lit room", lit_room, Density::MapSize(48), &[(Quality::Draft, 0.05, 0.95), FINAL[0], FINAL[1]]);
}

fn model(path: &str, density: Density) {
    let Some(file) = common::shared(path) else { return };
    let scene = || {
        let mut world = World::new();
        lumbre_scene::load(&mut world, &file).expect("the model loads");
        world
    };
    judge(path, scene, density, &FINAL);
}

#[test]
#[ignore = "slow: scripts/test --all runs it"]
fn cornell_box() {
    model("models/cornell_box.glb", Density::MapSize(40));
}

#[test]
#[ignore = "slow: scripts/test --all runs it"]
fn alcove() {
    model("conformance/bake/alcove.glb", Density::TexelsPerMeter(10.0));
}

#[test]
#[ignore = "slow: scripts/test --all runs it"]
fn two_rooms_joined_by_a_doorway() {
    judge("rooms", || held_out::scenes::rooms(0, 1.0), Density::TexelsPerMeter(6.0), &FINAL);
}

#[test]
#[ignore = "slow: scripts/test --all runs it"]
fn a_hall_with_columns() {
    judge("hall", || held_out::scenes::hall(0, 1.0), Density::TexelsPerMeter(4.0), &FINAL);
}
