//! The bake's estimate of the error due to the map's resolution, against closed forms.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::common;
use crate::common::shapes::room;
use crate::scene_parts::{black_sheet, grey, run};
use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_bake::{BakeOptions, Density, Quality};
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{BakeMode, Light};
use lumbre_scene::{Mesh, Name, StaticObject, Transform};

/// A rectangle that looks up.
fn plane(x: [f32; 2], y: f32, z: [f32; 2]) -> Mesh {
    let positions =
        [[x[0], z[0]], [x[1], z[0]], [x[1], z[1]], [x[0], z[1]]].map(|[x, z]| Vec3::new(x, y, z)).to_vec();
    Mesh(Arc::new(TriangleMesh { positions, indices: vec![0, 2, 1, 0, 3, 2], ..TriangleMesh::default() }))
}

const LIGHT: DVec3 = DVec3::new(0.3, 2.0, -0.2);
const HALF: f64 = 2.0;
/// A board at this height extends from x = -2 to this x: the edge of its shadow on the floor is a line x = constant.
const EDGE: f64 = 0.1;
const HEIGHT: f64 = 0.5;

/// A black floor under a point light, with a board above a part of it.
fn scene_with_shadow() -> World {
    let mut world = World::new();
    let half = HALF as f32;
    let name = |name: &str| Name::new(name.to_owned());
    world.spawn((name("floor"), plane([-half, half], 0.0, [-half, half]), grey(0.0, 0.0), StaticObject));
    let board = plane([-half, EDGE as f32], HEIGHT as f32, [-half, half]);
    world.spawn((name("board"), board, black_sheet(), StaticObject));
    let light = Light { bake: BakeMode::Static, ..Light::point(Vec3::ONE) };
    world.spawn((light, Transform::from_xyz(LIGHT.x, LIGHT.y, LIGHT.z)));
    world
}

/// The irradiance at points that a golden-ratio lattice distributes evenly over floor and board.
fn reference(count: u32) -> Vec<common::ReferencePoint> {
    let board = (EDGE + HALF) / (2.0 * HALF);
    let boards = (f64::from(count) * board) as u32;
    let points = |count: u32, x: [f64; 2], y: f64| {
        (0..count).map(move |i| {
            let u = (f64::from(i) + 0.5) / f64::from(count);
            let v = (f64::from(i) * 0.618_033_988_749_894_9).fract();
            DVec3::new(x[0] + (x[1] - x[0]) * u, y, HALF * (2.0 * v - 1.0))
        })
    };
    let lit = |position: DVec3| {
        let towards = LIGHT - position;
        // The point at which the segment to the light passes the board's height.
        let at = position + towards * ((HEIGHT - position.y) / towards.y);
        let hidden = position.y < HEIGHT && at.x < EDGE && at.x > -HALF && at.z.abs() < HALF;
        let light = if hidden { 0.0 } else { PI * towards.y / towards.length().powi(3) };
        common::ReferencePoint { position, normal: DVec3::Y, irradiance: DVec3::splat(light) }
    };
    points(count, [-HALF, HALF], 0.0).chain(points(boards, [-HALF, EDGE], HEIGHT)).map(lit).collect()
}

#[test]
fn the_resolution_error_of_a_sharp_shadow_is_right_and_decreases_with_density() {
    let points = reference(40_000);
    let mut found = Vec::new();
    for side in [32, 128] {
        let mut world = scene_with_shadow();
        let report =
            run(&mut world, &BakeOptions { density: Density::MapSize(side), ..BakeOptions::default() });
        let truth = common::compare(&mut world, &points);
        assert_eq!(truth.missed, 0);
        println!("{side}: {:?}, {truth}", report.resolution);
        let difference = (report.resolution.error - truth.rmse).abs();
        assert!(
            difference < 4.0 * report.resolution.standard_error,
            "{side}: {:?}, {truth}",
            report.resolution
        );
        // Of the 1638 points that are sampled, some twenty lie at the shadow's edge in the finer map.
        assert!(report.resolution.standard_error < 0.35 * truth.rmse, "{:?}", report.resolution);
        // The error of sampling is reported separately, and is small here.
        assert!(report.estimated_error < 0.5 * report.resolution.error);
        found.push((report.resolution, truth.rmse));
    }
    // The error at the edge does not shrink, but the area where it occurs does, so that the RMSE goes with the root of
    // the texel's size, apart from the edge's position within a texel.
    let (coarse, fine) = (found[0], found[1]);
    assert!((coarse.1 / fine.1 / 2.0 - 1.0).abs() < 0.25, "{found:?}");
    let ratio = coarse.0.error / fine.0.error;
    let sigma =
        ratio * (coarse.0.standard_error / coarse.0.error).hypot(fine.0.standard_error / fine.0.error);
    assert!((ratio - coarse.1 / fine.1).abs() < 4.0 * sigma, "{found:?}");
}

#[test]
fn uniform_light_has_no_resolution_error() {
    let mut world = World::new();
    let mesh = room(Vec3::new(2.0, 1.0, 1.5));
    world.spawn((Mesh(Arc::new(mesh)), grey(0.6, 1.0), StaticObject));
    let options =
        BakeOptions { density: Density::MapSize(32), quality: Quality::Draft, ..BakeOptions::default() };
    let report = run(&mut world, &options);
    assert!(report.resolution.points > 200, "{:?}", report.resolution);
    let found = report.resolution;
    assert!(found.standard_error < 5e-3 && found.error < 3.0 * found.standard_error, "{found:?}");
}

#[test]
fn the_estimate_can_be_switched_off_and_costs_little() {
    let options = BakeOptions { density: Density::MapSize(64), ..BakeOptions::default() };
    let (with, without) = (
        run(&mut scene_with_shadow(), &options),
        run(&mut scene_with_shadow(), &BakeOptions { resolution_error: false, ..options }),
    );
    assert_eq!(without.resolution.points, 0);
    assert!(
        without.skipped.iter().any(|line| line == "resolution error: switched off"),
        "{:?}",
        without.skipped
    );
    assert_ne!(with.resolution.points, 0);
    // It takes about a twentieth of the rays, or those of the smallest number of points.
    assert!(with.rays - without.rays <= (without.rays / 15).max(1 << 17), "{} {}", with.rays, without.rays);
}
