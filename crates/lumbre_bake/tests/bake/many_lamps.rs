//! Many sources that share samples: hundreds of emissive squares, and hundreds of point lights, against sums of closed
//! forms. The stated error must cover the random choice of sources. The example `many_lamps` measures the time.

#![allow(clippy::print_stdout, reason = "the errors are the result that a reader of the output wants")]

use std::f64::consts::PI;
use std::sync::Arc;

use crate::common;
use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_bake::{Bake, BakeOptions, BakeReport, Density};
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{BakeMode, Light, Material, Surface};
use lumbre_scene::{Mesh, StaticObject, Transform};

/// Adds a horizontal, black square that looks up or down and emits the given radiance.
fn spawn_square(world: &mut World, middle: Vec3, side: f32, up: bool, radiance: f32) {
    let h = 0.5 * side;
    let mesh = TriangleMesh {
        positions: [[-h, -h], [-h, h], [h, h], [h, -h]].map(|[x, z]| middle + Vec3::new(x, 0.0, z)).to_vec(),
        indices: if up { vec![0, 1, 2, 0, 2, 3] } else { vec![0, 2, 1, 0, 3, 2] },
        ..TriangleMesh::default()
    };
    let front = Surface { diffuse: Vec3::ZERO, emission: Vec3::splat(radiance), ..Surface::default() };
    world.spawn((Mesh(Arc::new(mesh)), Material { front, ..Material::default() }, StaticObject));
}

/// The position of source `i` above a floor of 4 x 4 m, and its brightness; the brightest is 16 times as bright as the
/// faintest.
fn source(i: u32) -> (DVec3, f64) {
    let (row, column) = (f64::from(i / 20), f64::from(i % 20));
    // All sources are at the same height, so that none hides another.
    let place = DVec3::new(0.2 * column - 1.9, 0.4, 0.2 * row - 1.9);
    (place, 2.0f64.powi((i * 13 % 5) as i32))
}

/// The number of sources.
const COUNT: u32 = 400;
/// The largest accepted mean number of rays per texel: far less than one for each source.
const MAX_RAYS: u64 = 128;

/// Adds a floor, bakes, and compares the floor's irradiance with the expected one.
fn bake_and_compare(name: &str, world: &mut World, value: impl Fn(DVec3) -> f64) -> BakeReport {
    spawn_square(world, Vec3::ZERO, 4.0, true, 0.0);
    let options =
        BakeOptions { density: Density::TexelsPerMeter(24.0), error: 0.01, ..BakeOptions::default() };
    let report = Bake::new(&options).run(world).expect("the scene bakes");
    let point = |i: i32| {
        let place = |at: i32| 0.27 * f64::from(at - 6) + 0.011;
        let position = DVec3::new(place(i % 13), 0.0, place(i / 13));
        common::ReferencePoint { position, normal: DVec3::Y, irradiance: DVec3::splat(value(position)) }
    };
    let found = common::compare(world, &(0..169).map(point).collect::<Vec<_>>());
    println!("{name}: {found}; stated {:.2} %, {} rays", 100.0 * report.estimated_error, report.rays);
    assert_eq!(found.missed, 0);
    // The target error is one per cent; interpolation between texels of 4 cm, a tenth of the height, adds to it.
    assert!(found.rmse < 0.02 && found.bias.abs() < 0.004, "{name}: {found}");
    assert!(
        found.rmse < 2.0 * report.estimated_error.max(0.005),
        "{name}: the stated error is honest: {found}"
    );
    report
}

#[test]
fn hundreds_of_emissive_squares() {
    const SIDE: f32 = 0.06;
    let mut world = World::new();
    for (place, bright) in (0..COUNT).map(source) {
        spawn_square(&mut world, place.as_vec3(), SIDE, false, bright as f32);
    }
    let report = bake_and_compare("squares", &mut world, |p| {
        let of = |(place, bright): (DVec3, f64)| {
            bright * PI * common::to_square(p.x - place.x, p.z - place.z, f64::from(SIDE), place.y)
        };
        (0..COUNT).map(source).map(of).sum()
    });
    assert!(report.rays < MAX_RAYS * report.texels as u64, "{} rays", report.rays);
}

#[test]
fn hundreds_of_point_lights() {
    let mut world = World::new();
    for (place, bright) in (0..COUNT).map(source) {
        let light = Light { bake: BakeMode::Static, ..Light::point(Vec3::splat(1e-3 * bright as f32)) };
        world.spawn((light, Transform::from_translation(place)));
    }
    let report = bake_and_compare("point lights", &mut world, |p| {
        let of = |(place, bright): (DVec3, f64)| PI * 1e-3 * bright * place.y / (place - p).length().powi(3);
        (0..COUNT).map(source).map(of).sum()
    });
    assert!(report.rays < MAX_RAYS * report.texels as u64, "{} rays", report.rays);
}
