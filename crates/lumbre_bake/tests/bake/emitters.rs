//! Emissive surfaces and lights that are hard to sample: tiny, far brighter than others, of many triangles, textured.
//! Each is compared with a closed form or an independent sum.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::common;
use crate::common::shapes::room;
use crate::scene_parts::grey;
use bevy_ecs::world::World;
use glam::{DVec3, Vec2, Vec3};
use lumbre_bake::{Bake, BakeOptions, BakeReport, Density, Quality};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{BakeMode, Light, Material};
use lumbre_scene::{
    Image, MaterialTextures, Mesh, Name, Sampler, StaticObject, TextureReference, Transform, Wrap,
};

fn run(world: &mut World, side: u32) -> BakeReport {
    let options =
        BakeOptions { density: Density::MapSize(side), quality: Quality::Final, ..BakeOptions::default() };
    Bake::new(&options).run(world).expect("the scene bakes")
}

/// A horizontal square with texture coordinates about a given centre, looking up or down.
fn square(middle: Vec3, side: f32, up: bool) -> TriangleMesh {
    let h = 0.5 * side;
    let corners = [[-h, -h], [-h, h], [h, h], [h, -h]];
    TriangleMesh {
        positions: corners.map(|[x, z]| middle + Vec3::new(x, 0.0, z)).to_vec(),
        uv0: [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]].map(Vec2::from).to_vec(),
        indices: if up { vec![0, 1, 2, 0, 2, 3] } else { vec![0, 2, 1, 0, 3, 2] },
        ..TriangleMesh::default()
    }
}

fn spawn(world: &mut World, mesh: TriangleMesh, material: Material) {
    world.spawn((Mesh(Arc::new(mesh)), material, StaticObject));
}

/// Points of the floor y = 0 about x = `middle` with their expected irradiance.
fn points(middle: f64, value: impl Fn(DVec3) -> f64) -> Vec<common::ReferencePoint> {
    let point = |i: i32| {
        let position = DVec3::new(
            middle + 0.1 * f64::from(i % 13 - 6) + 0.013,
            0.0,
            0.1 * f64::from(i / 13 - 6) + 0.021,
        );
        common::ReferencePoint { position, normal: DVec3::Y, irradiance: DVec3::splat(value(position)) }
    };
    (0..169).map(point).collect()
}

#[test]
fn a_tiny_bright_emitter() {
    // A lamp of a millimetre that is a million times as bright as one of a metre with the same power: E = L A cos⁴ θ /
    // h²; the effect of its size is of the order of 10⁻⁶.
    let (side, radiance, height) = (1e-3f32, 1e6f32, 1.0f32);
    let mut world = World::new();
    spawn(&mut world, square(Vec3::ZERO, 1.6, true), grey(0.5, 0.0));
    spawn(&mut world, square(Vec3::new(0.0, height, 0.0), side, false), grey(0.0, radiance));
    run(&mut world, 64);
    let power = f64::from(radiance) * f64::from(side).powi(2);
    let found = common::compare(&mut world, &points(0.0, |p| power / (1.0 + p.x * p.x + p.z * p.z).powi(2)));
    println!("{found}");
    // The error of interpolation between texels of h = 1/40 m, h²/8 |E''|, is 0.03 %.
    assert!(found.missed == 0 && found.rmse < 0.002, "{found}");
}

#[test]
fn no_fireflies_of_a_tiny_emitter() {
    // The same power from a lamp of a millimetre and from one of two centimetres, in a room with bounces: all texels
    // must agree within the stated errors of both bakes.
    let [mut tiny, mut small] = [1e-3f32, 2e-2].map(|side| {
        let mut world = World::new();
        spawn(&mut world, room(Vec3::new(3.0, 2.0, 2.0)), grey(0.7, 0.0));
        spawn(&mut world, square(Vec3::new(0.4, 0.5, 0.1), side, false), grey(0.0, 1.0 / (side * side)));
        world
    });
    let [a, b] = [&mut tiny, &mut small].map(|world| run(world, 48));
    let texels = |world: &mut World| -> Vec<f64> {
        let maps = common::maps(world);
        let room = maps.iter().max_by_key(|(_, map)| map.texels.len()).map(|(_, map)| map.clone()).unwrap();
        room.texels.iter().map(|texel| f64::from(texel.x) * PI).collect()
    };
    let (tiny, small) = (texels(&mut tiny), texels(&mut small));
    let lit = small.iter().filter(|e| **e > 0.0).count() as f64;
    let mean = small.iter().sum::<f64>() / lit;
    let squares = tiny.iter().zip(&small).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    let rmse = (squares / lit).sqrt() / mean;
    let worst = tiny.iter().zip(&small).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / mean;
    println!("RMSE {rmse:.4}, worst {worst:.4}, stated {:.4} {:.4}", a.estimated_error, b.estimated_error);
    assert!(rmse < 2.0 * a.estimated_error.hypot(b.estimated_error), "{rmse}");
    // No texel deviates by more than twelve times the combined stated error.
    assert!(worst < 12.0 * a.estimated_error.hypot(b.estimated_error), "{worst}");
}

#[test]
fn light_ratios_of_a_hundred_million() {
    // Two lamps, one 10⁸ times as bright as the other, on two sides of a wall that hides each from the other's floor.
    // Below the dim one the irradiance is that of Lambert's formula for it alone; below the bright one it is 10⁸ times
    // as much.
    let floor = |x: f32| square(Vec3::new(x, 0.0, 0.0), 1.6, true);
    let mut world = World::new();
    for (x, radiance) in [(-1.0, 1.0f32), (1.0, 1e8)] {
        spawn(&mut world, floor(x), grey(0.0, 0.0));
        spawn(&mut world, square(Vec3::new(x, 0.8, 0.0), 0.5, false), grey(0.0, radiance));
    }
    let mut wall = square(Vec3::ZERO, 4.0, true);
    wall.positions.iter_mut().for_each(|p| *p = Vec3::new(0.0, p.x, p.z));
    spawn(&mut world, wall, Material { double_sided: true, ..grey(0.0, 0.0) });
    run(&mut world, 64);
    for (x, radiance) in [(-1.0, 1.0), (1.0, 1e8)] {
        let value = |p: DVec3| PI * radiance * common::to_square(p.x - x, p.z, 0.5, 0.8);
        let found = common::compare(&mut world, &points(x, value));
        println!("{radiance:e}: {found}");
        assert!(found.missed == 0 && found.rmse < 0.002, "{found}");
    }
}

#[test]
fn bright_and_dim_lights_side_by_side() {
    // 20 point lights, each with 0.4 times the intensity of the one before: more than get samples of their own.
    let mut world = World::new();
    spawn(&mut world, square(Vec3::ZERO, 1.6, true), grey(0.0, 0.0));
    let strengths: Vec<f32> = (0..20).map(|i| 0.4f32.powi(i)).collect();
    for (i, &strength) in strengths.iter().enumerate() {
        let light = Light { bake: BakeMode::Static, ..Light::point(Vec3::splat(strength)) };
        world.spawn((light, Transform::from_xyz(0.05 * i as f64 - 0.5, 1.0, 0.0)));
    }
    run(&mut world, 64);
    let value = |p: DVec3| {
        let light = |(i, &strength): (usize, &f32)| {
            let x = 0.05 * i as f64 - 0.5 - p.x;
            PI * f64::from(strength) / (1.0 + x * x + p.z * p.z).powf(1.5)
        };
        strengths.iter().enumerate().map(light).sum()
    };
    let found = common::compare(&mut world, &points(0.0, value));
    println!("{found}");
    assert!(found.missed == 0 && found.rmse < 0.002, "{found}");
}

#[test]
fn a_lamp_of_ten_thousand_triangles() {
    // A sphere of uniform radiance gives E = π L (r/d)² cos θ wherever it is entirely above the horizon.
    let (radius, height, radiance) = (0.15f32, 1.0f32, 10.0f32);
    let mut world = World::new();
    spawn(&mut world, square(Vec3::ZERO, 1.6, true), grey(0.0, 0.0));
    let mut ball = shapes::uv_sphere(radius, 100, 51);
    ball.positions.iter_mut().for_each(|p| p.y += height);
    spawn(&mut world, ball, grey(0.0, radiance));
    let report = run(&mut world, 64);
    let value = |p: DVec3| {
        let d = p.x.hypot(p.z).hypot(f64::from(height));
        PI * f64::from(radiance) * f64::from(radius / height).powi(2) * (f64::from(height) / d).powi(3)
    };
    let found = common::compare(&mut world, &points(0.0, value));
    println!("{found}; stated {:.3} %", 100.0 * report.estimated_error);
    // Half a per cent for distant parts of the lamp that are evaluated in one term, and 0.2 % for the polyhedron's
    // silhouette.
    assert!(found.missed == 0 && found.rmse < 0.007, "{found}");
}

#[test]
fn emission_that_varies_by_texture() {
    // A texture of 24 x 24 texels with black and white stripes and spots, a fifth of its width above the floor, against
    // a sum over a fine grid with an independent bilinear look-up.
    const N: usize = 24;
    let bright =
        |x: usize, y: usize| x.is_multiple_of(5) || (x * 7 + y * 3).is_multiple_of(11) || x > 17 && y > 11;
    let rgba =
        (0..N * N).flat_map(|i| [[0, 0, 0, 255u8], [255; 4]][usize::from(bright(i % N, i / N))]).collect();
    let image = Arc::new(Image { name: "stripes".into(), width: N as u32, height: N as u32, rgba });
    let sampler = Sampler { wrap_u: Wrap::ClampToEdge, wrap_v: Wrap::ClampToEdge, ..Sampler::default() };
    let texture = TextureReference { sampler, ..TextureReference::new(image) };
    let textures = MaterialTextures { emissive: Some(texture), ..MaterialTextures::default() };
    let (side, height) = (1.0f64, 0.2f64);
    let mut world = World::new();
    spawn(&mut world, square(Vec3::ZERO, 1.6, true), grey(0.0, 0.0));
    let lamp = Mesh(Arc::new(square(Vec3::new(0.0, height as f32, 0.0), side as f32, false)));
    world.spawn((lamp, grey(0.0, 1.0), textures, StaticObject));
    let report = run(&mut world, 96);
    let look_up = |u: f64, v: f64| {
        let (x, y) = (u * N as f64 - 0.5, v * N as f64 - 0.5);
        let read = |x: f64, y: f64| {
            let index = |c: f64| c.clamp(0.0, N as f64 - 1.0) as usize;
            f64::from(u8::from(bright(index(x), index(y))))
        };
        let (i, j, f, g) = (x.floor(), y.floor(), x - x.floor(), y - y.floor());
        (read(i, j) * (1.0 - f) + read(i + 1.0, j) * f) * (1.0 - g)
            + (read(i, j + 1.0) * (1.0 - f) + read(i + 1.0, j + 1.0) * f) * g
    };
    let fine = 240;
    let value = |p: DVec3| {
        let mut sum = 0.0;
        for i in 0..fine * fine {
            let (u, v) = (
                (f64::from(i % fine) + 0.5) / f64::from(fine),
                (f64::from(i / fine) + 0.5) / f64::from(fine),
            );
            let (x, z) = ((u - 0.5) * side - p.x, (v - 0.5) * side - p.z);
            let squared = x * x + z * z + height * height;
            sum += look_up(u, v) * height * height / (squared * squared);
        }
        sum * side * side / f64::from(fine * fine)
    };
    let found = common::compare(&mut world, &points(0.0, value));
    println!("{found}; stated {:.3} %", 100.0 * report.estimated_error);
    // The baker uses pieces of two texels with one radiance each, and evaluates distant pieces in one term.
    assert!(found.missed == 0 && found.rmse < 0.006, "{found}");
}

/// Bakes a floor under a lamp of a metre whose texture has `side` texels a side, of which one is white and all others
/// black.
fn one_bright_texel(side: u32) -> (World, BakeReport) {
    let mut rgba = vec![0; 4 * (side * side) as usize];
    let (x, y) = (side / 3 + 1, side / 5 + 1);
    rgba[4 * (y * side + x) as usize..][..4].copy_from_slice(&[255; 4]);
    let texture =
        TextureReference::new(Arc::new(Image { name: "one".into(), width: side, height: side, rgba }));
    let mut world = World::new();
    spawn(&mut world, square(Vec3::ZERO, 1.6, true), grey(0.0, 0.0));
    let textures = MaterialTextures { emissive: Some(texture), ..MaterialTextures::default() };
    // The radiance makes up for the texel's small area.
    let lamp = grey(0.0, (side * side) as f32);
    let mesh = Mesh(Arc::new(square(Vec3::Y, 1.0, false)));
    world.spawn((Name::new("screen"), mesh, lamp, textures, StaticObject));
    let report = run(&mut world, 24);
    (world, report)
}

#[test]
fn a_bright_texel_is_not_missed_and_a_texture_that_is_read_more_coarsely_is_named() {
    for (side, named) in [(32, false), (512, true), (2048, true)] {
        let (mut world, report) = one_bright_texel(side);
        let words: Vec<_> =
            report.warnings.iter().filter(|warning| warning.starts_with("screen: ")).collect();
        assert_eq!(words.len(), usize::from(named), "{side}: {:?}", report.warnings);
        assert!(
            words.iter().all(|words| words.contains("48 pieces") && !words.contains("missed")),
            "{words:?}"
        );
        // The texel has the power of one square metre of radiance 1, concentrated in one place.
        let (s, d) = (side as f64, f64::from(side / 5 + 1) + 0.5);
        let (u, v) = ((f64::from(side / 3 + 1) + 0.5) / s, d / s);
        let lamp = DVec3::new(u - 0.5, 1.0, v - 0.5);
        let value = |p: DVec3| 1.0 / (lamp - p).length_squared().powi(2);
        let found = common::compare(&mut world, &points(0.0, value));
        println!("{side}: {found}");
        assert!(found.bias.abs() < 0.02, "{side}: {found}");
    }
}
