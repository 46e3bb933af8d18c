//! Light of the sky in scenes whose irradiance is known in closed form.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::common;
use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_bake::{Bake, BakeOptions, BakeReport, Density, Quality};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::Material;
use lumbre_scene::{Mesh, Name, SceneSettings, StaticObject, Transform};

const SKY: Vec3 = Vec3::new(0.5, 1.0, 2.0);

fn options(side: u32, quality: Quality) -> BakeOptions {
    BakeOptions { density: Density::MapSize(side), quality, ..BakeOptions::default() }
}

fn run(world: &mut World, options: &BakeOptions) -> BakeReport {
    world.insert_resource(SceneSettings { sky: SKY, ..SceneSettings::default() });
    Bake::new(options).run(world).expect("the scene bakes")
}

fn matt(reflectance: f32, emission: Vec3) -> Material {
    crate::scene_parts::matt(Vec3::splat(reflectance), emission)
}

/// A flat quadrilateral; its front is the side from which its corners run counter-clockwise.
fn quad(corners: [[f32; 3]; 4]) -> Mesh {
    Mesh(Arc::new(TriangleMesh {
        positions: corners.map(Vec3::from).to_vec(),
        indices: vec![0, 1, 2, 0, 2, 3],
        ..TriangleMesh::default()
    }))
}

fn floor(half: f32) -> Mesh {
    quad([[-half, 0.0, -half], [-half, 0.0, half], [half, 0.0, half], [half, 0.0, -half]])
}

/// The irradiance of all texels that are not black.
fn irradiances(world: &mut World) -> Vec<DVec3> {
    let maps = common::maps(world);
    let all = maps.iter().flat_map(|(_, map)| map.texels.iter().map(|texel| texel.as_dvec3() * PI));
    all.filter(|e| e.element_sum() > 0.0).collect()
}

#[test]
fn surfaces_that_see_only_the_sky_have_pi_times_its_radiance() {
    for reflectance in [0.0, 0.8] {
        for mesh in [floor(1.0), Mesh(Arc::new(shapes::cuboid(Vec3::new(1.0, 2.0, 3.0), 1)))] {
            let mut world = World::new();
            world.spawn((mesh, matt(reflectance, Vec3::ZERO), StaticObject));
            let report = run(&mut world, &options(24, Quality::Draft));
            assert!(report.error_reached && report.estimated_error < 1e-6, "{report}");
            assert_eq!(report.skipped.iter().any(|line| line.contains("finds the sky")), reflectance == 0.0);
            let found = irradiances(&mut world);
            assert!(found.len() > 100);
            for e in found {
                // The sampled radiance is constant: what remains is the rounding of sums in f32.
                assert!((e / (PI * SKY.as_dvec3()) - 1.0).abs().max_element() < 1e-5, "{e}");
            }
        }
    }
}

#[test]
fn a_floor_before_a_wall() {
    // A black wall of height h and half length a, at distance c from an element of the floor, hides the share F = 1/π
    // (atan(a/c) - c/√(c²+h²) atan(a/√(c²+h²))) of the sky (form factor from an element to a perpendicular rectangle).
    let (height, half) = (1.5, 2.0);
    let wall = quad([[0.0, 0.0, 2.0], [0.0, 0.0, -2.0], [0.0, 1.5, -2.0], [0.0, 1.5, 2.0]]);
    let mut world = World::new();
    world.spawn((
        quad([[0.0, 0.0, -2.0], [0.0, 0.0, 2.0], [2.0, 0.0, 2.0], [2.0, 0.0, -2.0]]),
        matt(0.5, Vec3::ZERO),
        StaticObject,
    ));
    let mut back = matt(0.0, Vec3::ZERO);
    back.double_sided = true;
    world.spawn((wall, back, StaticObject));
    let report = run(&mut world, &options(64, Quality::Final));
    let points: Vec<_> = (1..18)
        .map(|i| {
            let c = 0.1 * f64::from(i);
            let far = c.hypot(height);
            let hidden = ((half / c).atan() - c / far * (half / far).atan()) / PI;
            let irradiance = PI * SKY.as_dvec3() * (1.0 - hidden);
            common::ReferencePoint { position: DVec3::new(c, 0.0, 0.0), normal: DVec3::Y, irradiance }
        })
        .collect();
    let found = common::compare(&mut world, &points);
    println!("{found}; stated {:.3} %", 100.0 * report.estimated_error);
    // The target error is 1 %.
    assert!(found.missed == 0 && found.rmse < 0.01 && found.rmse < 2.0 * report.estimated_error, "{found}");
    assert!(found.bias.abs() < 0.005, "{found}");
}

#[test]
fn the_floor_of_a_trench() {
    // Between two infinite black walls of height h and distance w, a point of the floor at x from the middle sees the
    // sky between two angles from the vertical: E = π L (sin β + sin γ)/2 with tan β = (w/2 - x)/h and tan γ = (w/2 +
    // x)/h. Walls that end at 100 h on either side hide less by a share of (h/100h)² at most.
    let (h, w, long) = (1.0, 2.0, 100.0);
    let mut world = World::new();
    // Only the middle of the floor is modelled; the rest would take up the map.
    world.spawn((floor(1.0), matt(0.9, Vec3::ZERO), StaticObject));
    for x in [-1.0, 1.0f32] {
        let z = 100.0 * x;
        let wall = quad([[x, 0.0, z], [x, 0.0, -z], [x, 1.0, -z], [x, 1.0, z]]);
        let mut black = matt(0.0, Vec3::ZERO);
        black.double_sided = true;
        world.spawn((wall, black, StaticObject));
    }
    // The RMSE of as few as nine points may be a third above that of all texels. The target error is half of the limit
    // of one per cent.
    let report = run(&mut world, &BakeOptions { error: 0.005, ..options(64, Quality::Final) });
    let points: Vec<_> = (0..9)
        .map(|i| {
            let x = 0.2 * f64::from(i) - 0.8;
            let sine = |opposite: f64| opposite / opposite.hypot(h);
            let seen = 0.5 * (sine(w / 2.0 - x) + sine(w / 2.0 + x));
            let irradiance = PI * SKY.as_dvec3() * seen;
            common::ReferencePoint { position: DVec3::new(x, 0.0, 0.0), normal: DVec3::Y, irradiance }
        })
        .collect();
    let found = common::compare(&mut world, &points);
    println!("{found}; stated {:.3} %; walls reach {long}", 100.0 * report.estimated_error);
    assert!(found.missed == 0 && found.rmse < 0.01 && found.rmse < 2.0 * report.estimated_error, "{found}");
    assert!(found.bias.abs() < 0.005, "{found}");
}

/// A figure of boxes in the open, most of whose rays meet nothing. Its maps in the order of their names.
fn figure(reflectance: Vec3) -> Vec<Vec<DVec3>> {
    let mut world = World::new();
    let boxes = [
        (Vec3::new(1.0, 1.0, 1.0), [0.0, 1.0, 0.0]),
        (Vec3::new(0.9, 1.0, 0.6), [0.0, 0.0, 0.0]),
        (Vec3::new(0.6, 0.7, 0.25), [0.0, 0.15, 0.43]),
        (Vec3::new(0.1, 0.15, 0.1), [-0.35, 1.575, 0.0]),
    ];
    for (number, (size, [x, y, z])) in boxes.into_iter().enumerate() {
        let mesh = Mesh(Arc::new(shapes::cuboid(size, 1)));
        let material = crate::scene_parts::matt(reflectance, Vec3::ZERO);
        let name = Name::new(format!("box {number}"));
        world.spawn((name, mesh, material, StaticObject, Transform::from_xyz(x, y, z)));
    }
    let options = BakeOptions { density: Density::TexelsPerMeter(48.0), ..BakeOptions::default() };
    let report = run(&mut world, &options);
    assert!(report.error_reached, "{report}");
    let mut maps = common::maps(&mut world);
    maps.sort_by(|a, b| a.0.cmp(&b.0));
    maps.iter()
        .map(|(_, map)| map.texels.iter().map(|texel| texel.as_dvec3() / SKY.as_dvec3()).collect())
        .collect()
}

#[test]
fn nothing_in_the_open_is_brighter_than_the_sky_or_darker_than_among_black_things() {
    let (black, grey) = (figure(Vec3::ZERO), figure(Vec3::new(0.2, 0.8, 0.6)));
    let open =
        black.iter().flatten().zip(grey.iter().flatten()).filter(|(black, _)| black.min_element() > 0.05);
    let (beside, of_sky): (Vec<f64>, Vec<f64>) =
        open.map(|(black, grey)| ((*grey - *black).min_element(), grey.max_element())).unzip();
    // One texel in a thousand may lie in a corner that the maps hardly resolve.
    let all_but_a_thousandth = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        let out = values.len() / 1000;
        [values[out], values[values.len() - 1 - out]]
    };
    assert!(of_sky.len() > 10_000, "{}", of_sky.len());
    let ([lowest, _], [_, highest]) = (all_but_a_thousandth(beside), all_but_a_thousandth(of_sky));
    println!("at most {highest:.4} of the sky's light, at least {lowest:.4} more than among black things");
    // Twice the error that is reached.
    assert!(highest < 1.02 && lowest > -0.02, "{highest} {lowest}");
}

#[test]
fn furnace_under_the_sky() {
    // Surfaces of reflectance ρ that emit (1 - ρ) L under a sky of radiance L: whatever their shape, every ray finds
    // the radiance L, so that E = π L everywhere. Bounces, sky, emission and the handling of texels at edges all have
    // to agree.
    for reflectance in [0.3f32, 0.8] {
        let mut world = World::new();
        let material = matt(reflectance, (1.0 - reflectance) * SKY);
        world.spawn((floor(1.5), material.clone(), StaticObject));
        let walls = [
            [[-1.5, 0.0, -1.5], [1.5, 0.0, -1.5], [1.5, 2.0, -1.5], [-1.5, 2.0, -1.5]],
            [[-1.5, 0.0, 1.5], [-1.5, 0.0, -1.5], [-1.5, 2.0, -1.5], [-1.5, 2.0, 1.5]],
        ];
        for wall in walls {
            let material = Material { double_sided: true, back: Some(material.front), ..material.clone() };
            world.spawn((quad(wall), material, StaticObject));
        }
        let report = run(&mut world, &options(32, Quality::Final));
        let expected = PI * SKY.as_dvec3();
        let found = irradiances(&mut world);
        let mean = found.iter().sum::<DVec3>() / found.len() as f64;
        println!(
            "{reflectance}: mean {} of {expected}; stated {:.3} %",
            mean,
            100.0 * report.estimated_error
        );
        assert!((mean / expected - 1.0).abs().max_element() < 5e-3, "{reflectance}: {mean} {expected}");
        let square = |e: &DVec3| ((*e - expected).element_sum() / expected.element_sum()).powi(2);
        let rmse = (found.iter().map(square).sum::<f64>() / found.len() as f64).sqrt();
        assert!(rmse < 2.0 * report.estimated_error.max(1e-3), "{reflectance}: {rmse} {report}");
    }
}

#[test]
fn without_a_sky_the_stage_is_skipped_with_a_message() {
    let mut world = World::new();
    world.spawn((floor(1.0), matt(0.5, Vec3::ONE), StaticObject));
    let report = Bake::new(&options(16, Quality::Draft)).run(&mut world).unwrap();
    assert!(report.skipped.iter().any(|line| line == "sky light: the scene has no sky"), "{report}");
    let mut dark = World::new();
    dark.spawn((floor(1.0), matt(0.5, Vec3::ZERO), StaticObject));
    let report = Bake::new(&options(16, Quality::Draft)).run(&mut dark).unwrap();
    assert!(report.rays == 0 && report.skipped[0].contains("there is no sky"), "{report}");
}
