//! Irradiance probes against closed forms: closed boxes, a lit plane, solids that enclose probes. Also tests when
//! probes are baked at all.

use std::sync::Arc;

use crate::scene_parts::{matt, run};
use bevy_ecs::prelude::*;
use glam::{DVec3, UVec3, Vec3};
use lumbre_bake::{Bake, BakeOptions, BakeReport, Density, Probes, Quality};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{BakeMode, Light};
use lumbre_scene::{DynamicObject, EmissiveLight, IrradianceVolume, Mesh, Name, StaticObject, Transform};

const SIDES: [DVec3; 6] = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];

fn draft() -> BakeOptions {
    BakeOptions { density: Density::MapSize(32), quality: Quality::Draft, ..BakeOptions::default() }
}

fn room(size: Vec3) -> Mesh {
    Mesh(Arc::new(crate::common::shapes::room(size)))
}

/// Adds a small dynamic object.
fn add_dynamic(world: &mut World, place: DVec3, size: f32) {
    let mesh = Mesh(Arc::new(shapes::cuboid(Vec3::splat(size), 1)));
    world.spawn((mesh, DynamicObject, Transform::from_translation(place)));
}

/// The only volume of a World, with the centres of its cells.
fn volume(world: &mut World) -> (IrradianceVolume, Vec<DVec3>) {
    let mut query = world.query::<(&IrradianceVolume, &Transform)>();
    let (volume, transform) = query.single(world).expect("there is one volume");
    let size = volume.resolution;
    let centers = (0..size.element_product())
        .map(|at| {
            let cell = UVec3::new(at % size.x, at / size.x % size.y, at / (size.x * size.y));
            let unit = (cell.as_dvec3() + 0.5) / size.as_dvec3() - 0.5;
            transform.affine().transform_point3(unit)
        })
        .collect();
    (volume.clone(), centers)
}

#[test]
fn inside_a_shining_box_every_side_has_its_radiance() {
    // Black walls of radiance L: E/π = L for every side of every probe. Lambert's formula gives it without sampling.
    let radiance = Vec3::new(1.0, 0.5, 0.25);
    let mut world = World::new();
    world.spawn((room(Vec3::new(2.0, 1.0, 1.5)), matt(Vec3::ZERO, radiance), StaticObject));
    add_dynamic(&mut world, DVec3::ZERO, 0.1);
    let report = run(&mut world, &draft());
    let (volume, _) = volume(&mut world);
    assert_eq!(report.probes.inside, 0, "{:?}", report.probes);
    assert!(volume.cubes.len() > 2000 && volume.cubes.len() <= 4096, "{:?}", report.probes);
    assert_eq!(report.probes.resolution, volume.resolution.to_array());
    for side in volume.cubes.iter().flat_map(|cube| cube.0) {
        // The angles of twelve clipped triangles are computed in f64, followed by a dozen roundings in f32.
        assert!((side / radiance - 1.0).abs().max_element() < 3e-6, "{side}");
    }
}

#[test]
fn furnace() {
    // A closed box of reflectance ρ: E/π = L / (1 - ρ), of which L is the walls' emission.
    for (real_time, reflectance) in [(false, 0.5f32), (true, 0.8)] {
        let mut world = World::new();
        let walls = matt(Vec3::splat(reflectance), Vec3::new(1.0, 0.5, 0.25));
        let walls = world.spawn((room(Vec3::new(2.0, 1.0, 1.5)), walls, StaticObject)).id();
        if real_time {
            // The walls are lights in real time: their direct light must not count twice.
            world.entity_mut(walls).insert(EmissiveLight);
        }
        add_dynamic(&mut world, DVec3::ZERO, 0.1);
        let report = run(&mut world, &BakeOptions { probe_spacing: Some(0.25), ..draft() });
        let (volume, _) = volume(&mut world);
        assert_eq!(volume.resolution, UVec3::new(8, 4, 6));
        assert_eq!(report.probes.spacing, [0.25; 3]);
        let expected = 1.0 / (1.0 - reflectance) - if real_time { 1.0 } else { 0.0 };
        let sides: Vec<f32> = volume.cubes.iter().flat_map(|cube| cube.0).map(|side| side.x).collect();
        let mean = sides.iter().sum::<f32>() / sides.len() as f32;
        // As in the lightmap, uniform light is exact; what remains is the error of the form factors.
        assert!((mean / expected - 1.0).abs() < 5e-3, "{mean} instead of {expected}");
        let worst = sides.iter().map(|side| (side / expected - 1.0).abs()).fold(0.0, f32::max);
        assert!(worst < 0.03, "{worst}");
        let side = volume.cubes[0].0[2];
        assert!((side.y / side.x - 0.5).abs() < 1e-4 && (side.z / side.x - 0.25).abs() < 1e-4);
    }
}

/// The form factor from a point with a normal to the upper side of the square |x|, |z| <= half at y = 0, by the
/// midpoint rule.
fn form_factor(point: DVec3, normal: DVec3, half: f64) -> f64 {
    const STEPS: i32 = 600;
    let step = 2.0 * half / f64::from(STEPS);
    let at = |i: i32| -half + (f64::from(i) + 0.5) * step;
    let mut sum = 0.0;
    for i in 0..STEPS {
        for j in 0..STEPS {
            let towards = DVec3::new(at(i), 0.0, at(j)) - point;
            let squared = towards.length_squared();
            sum += towards.dot(normal).max(0.0) * -towards.y / (squared * squared);
        }
    }
    sum * step * step / std::f64::consts::PI
}

#[test]
fn above_a_lit_plane() {
    // A floor under the sun: E is the same everywhere on it, so that B = ρ E and a side of a probe has B F / π.
    let (half, reflectance, sun) = (8.0, 0.5, 3.0f32);
    let mut world = World::new();
    let corner = half as f32;
    let floor = TriangleMesh {
        positions: [[-corner, -corner], [corner, -corner], [corner, corner], [-corner, corner]]
            .map(|[x, z]| Vec3::new(x, 0.0, z))
            .to_vec(),
        indices: vec![0, 2, 1, 0, 3, 2],
        ..TriangleMesh::default()
    };
    world.spawn((Mesh(Arc::new(floor)), matt(Vec3::splat(reflectance), Vec3::ZERO), StaticObject));
    let down = Transform::default().looking_at(DVec3::NEG_Y, DVec3::X);
    world.spawn((Light { bake: BakeMode::Static, ..Light::directional(Vec3::splat(sun)) }, down));
    add_dynamic(&mut world, DVec3::new(0.0, 2.0, 0.0), 0.5);
    let options = BakeOptions { probe_spacing: Some(1.0), quality: Quality::Final, ..draft() };
    let report = run(&mut world, &options);
    let (volume, centers) = volume(&mut world);
    let (mut squares, mut errors, mut sum, mut count, mut worst) = (0.0, 0.0, 0.0, 0.0, 0.0f64);
    for (cube, center) in volume.cubes.iter().zip(&centers).filter(|(_, center)| center.y > 0.0).step_by(37) {
        for (side, normal) in cube.0.iter().zip(SIDES) {
            // E = π L_d on the floor for light from straight above.
            let expected = f64::from(reflectance * sun) * form_factor(*center, normal, half);
            let error = f64::from(side.x) - expected;
            squares += error * error;
            errors += error;
            worst = worst.max(error.abs());
            sum += expected;
            count += 1.0f64;
        }
    }
    let (mean, rmse, bias) = (sum / count, (squares / count).sqrt(), errors / count);
    let sigma = report.probes.estimated_error * mean;
    assert!(count > 50.0 && mean > 0.1, "{count} {mean}");
    // N independent rays would leave each side a variance of at most (16 / N) L² ∫ cos² / 4π = 16 L² / 6 N; 512
    // stratified ones leave less.
    let independent = f64::from(reflectance * sun) * (16.0 / (6.0 * 512.0f64)).sqrt();
    // The estimate is for all probes, the measured errors are those of every 37th.
    assert!(sigma > 0.0 && sigma < independent, "{:?}", report.probes);
    assert!(rmse < 2.0 * sigma, "{rmse}, estimated {sigma}");
    assert!(bias.abs() < 5.0 * sigma / count.sqrt(), "{bias} of {sigma}");
    assert!(worst < 10.0 * sigma, "{worst} of {sigma}");
}

/// A room with a lamp, a crate on its floor, and a dynamic object.
fn furnished(scale: f32) -> World {
    let mut world = World::new();
    let place = |x: f32, y: f32, z: f32| Transform::from_translation((Vec3::new(x, y, z) * scale).as_dvec3());
    let solid = |size: Vec3| Mesh(Arc::new(shapes::cuboid(size * scale, 1)));
    let walls = matt(Vec3::new(0.7, 0.5, 0.3), Vec3::ZERO);
    world.spawn((Name::new("room"), room(Vec3::new(4.0, 2.0, 3.0) * scale), walls, StaticObject));
    let wood = matt(Vec3::splat(0.5), Vec3::ZERO);
    world.spawn((Name::new("crate"), solid(Vec3::ONE), wood, StaticObject, place(0.5, -0.5, 0.25)));
    let lamp = matt(Vec3::splat(0.25), Vec3::new(9.0, 6.0, 3.0));
    let size = Vec3::new(0.5, 0.125, 0.5);
    world.spawn((Name::new("lamp"), solid(size), lamp, StaticObject, place(-0.5, 0.75, 0.0)));
    add_dynamic(&mut world, (Vec3::new(1.5, -0.5, 0.0) * scale).as_dvec3(), 0.25 * scale);
    world
}

#[test]
fn probes_inside_a_crate_get_the_light_around_it() {
    let mut world = furnished(1.0);
    let report = run(&mut world, &BakeOptions { probe_spacing: Some(0.25), ..draft() });
    let (volume, centers) = volume(&mut world);
    assert_eq!(volume.resolution, UVec3::new(16, 8, 12));
    let within = |center: &DVec3| {
        let crate_half = (*center - DVec3::new(0.5, -0.5, 0.25)).abs().max_element() < 0.5;
        let lamp = (*center - DVec3::new(-0.5, 0.75, 0.0)).abs();
        crate_half || (lamp.x < 0.25 && lamp.z < 0.25 && lamp.y < 0.0625)
    };
    assert_eq!(report.probes.inside, centers.iter().filter(|center| within(center)).count());
    assert!(report.probes.inside >= 27);
    let darkest = |inside: bool| {
        let chosen = volume.cubes.iter().zip(&centers).filter(|(_, center)| within(center) == inside);
        chosen.flat_map(|(cube, _)| cube.0).map(|side| side.x).fold(f32::INFINITY, f32::min)
    };
    // Probes inside of solids get means of those around them, which cannot be darker than the darkest of these.
    assert!(darkest(true) >= darkest(false) && darkest(false) > 0.0, "{} {}", darkest(true), darkest(false));
}

#[test]
fn the_same_bits_on_any_thread_and_at_any_scale() {
    let bits = |scale: f32, threads: usize| {
        let mut world = furnished(scale);
        run(&mut world, &BakeOptions { threads: Some(threads), ..draft() });
        let (volume, _) = volume(&mut world);
        let sides = volume.cubes.iter().flat_map(|cube| cube.0);
        sides.flat_map(|side| side.to_array()).map(f32::to_bits).collect::<Vec<u32>>()
    };
    let plain = bits(1.0, 1);
    assert!(plain.iter().any(|&bits| bits != 0));
    assert_eq!(plain, bits(1.0, 2));
    assert_eq!(plain, bits(1.0 / 128.0, 2));
    assert_eq!(plain, bits(1024.0, 2));
}

#[test]
fn probes_are_baked_only_if_something_is_dynamic() {
    let skipped = |report: &BakeReport| {
        report.skipped.iter().find(|line| line.starts_with("probes: ")).cloned().unwrap_or_default()
    };
    let volumes = |world: &mut World| world.query::<&IrradianceVolume>().iter(world).count();
    let still = || {
        let mut world = World::new();
        world.spawn((room(Vec3::ONE), matt(Vec3::splat(0.5), Vec3::ONE), StaticObject));
        world
    };
    let coarse = BakeOptions { probe_spacing: Some(0.5), ..draft() };
    let mut world = still();
    assert!(skipped(&run(&mut world, &coarse)).contains("nothing moves"));
    assert_eq!(volumes(&mut world), 0);
    let report = run(&mut world, &BakeOptions { probes: Probes::Always, ..coarse });
    assert_eq!((skipped(&report), report.probes.resolution, volumes(&mut world)), (String::new(), [2; 3], 1));
    // Another bake replaces this volume by a new one or removes it.
    run(&mut world, &BakeOptions { probes: Probes::Always, probe_spacing: Some(0.25), ..coarse });
    assert_eq!(volume(&mut world).0.resolution, UVec3::splat(4));
    add_dynamic(&mut world, DVec3::ZERO, 0.1);
    let report = run(&mut world, &BakeOptions { probes: Probes::Never, ..coarse });
    assert!(skipped(&report).contains("switched off") && report.probes.resolution == [0; 3]);
    assert_eq!(volumes(&mut world), 0);
    assert!(report.stages.iter().all(|stage| stage.stage != "probes"));

    // A static point light in a black room: frames light dynamic objects with it directly, and nothing bounces.
    let mut dark = World::new();
    dark.spawn((room(Vec3::ONE), matt(Vec3::ZERO, Vec3::ZERO), StaticObject));
    dark.spawn((Light { bake: BakeMode::Static, ..Light::point(Vec3::ONE) }, Transform::default()));
    add_dynamic(&mut dark, DVec3::ZERO, 0.1);
    assert!(skipped(&run(&mut dark, &coarse)).contains("nothing bounces"));

    for spacing in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let options = BakeOptions { probe_spacing: Some(spacing), ..draft() };
        let error = Bake::new(&options).run(&mut still()).unwrap_err();
        assert!(error.to_string().contains("probe spacing"), "{error}");
    }
}
