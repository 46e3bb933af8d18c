//! Whole bakes of scenes whose irradiance is known in closed form, and properties that need no expected value: the same
//! result on any number of threads and at any scale, symmetry of the channels, linearity.

use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::sync::Arc;

use crate::common;
use crate::scene_parts::{matt, run};
use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_bake::{Bake, BakeError, BakeOptions, Density, Quality};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{BakeMode, Light, Material, SurfaceSample};
use lumbre_scene::{Lightmap, Mesh, Name, StaticObject, Transform};

fn draft(side: u32) -> BakeOptions {
    BakeOptions { density: Density::MapSize(side), quality: Quality::Draft, ..BakeOptions::default() }
}

fn room(size: Vec3) -> Mesh {
    Mesh(Arc::new(common::shapes::room(size)))
}

/// The irradiance of all texels of all maps.
fn irradiances(world: &mut World) -> Vec<DVec3> {
    let maps = common::maps(world);
    maps.iter().flat_map(|(_, map)| map.texels.iter().map(|texel| texel.as_dvec3() * PI)).collect()
}

#[test]
fn furnace() {
    // A closed room of uniform emission L and reflectance ρ: every surface receives E = πL / (1 - ρ).
    let emission = Vec3::new(1.0, 0.5, 0.25);
    // A metal has no k_d: what stands for its highlight is reflected.
    let mut metal = Material::from_metallic_roughness(Vec3::splat(0.9), 1.0, 0.6);
    metal.front.emission = emission;
    let of_metal = SurfaceSample::new(&metal, true).reflectance_as_metal().x as f32;
    assert!((0.7..0.9).contains(&of_metal), "{of_metal}");
    let matt = |reflectance: f32| (matt(Vec3::splat(reflectance), emission), reflectance);
    for (material, reflectance) in [matt(0.2), matt(0.8), (metal, of_metal)] {
        let mut world = World::new();
        let entity = world.spawn((room(Vec3::new(2.0, 1.0, 1.5)), material, StaticObject)).id();
        let report = run(&mut world, &draft(48));
        assert!(report.energy_lost < 0.01 && report.warnings.is_empty(), "{report:?}");
        let lightmap = world.get::<Lightmap>(entity).unwrap();
        let expected = PI / (1.0 - f64::from(reflectance));
        let lit: Vec<f64> =
            lightmap.image.texels.iter().map(|t| f64::from(t.x) * PI).filter(|&e| e > 0.0).collect();
        assert!(lit.len() > 500);
        let mean = lit.iter().sum::<f64>() / lit.len() as f64;
        // Direct light is exact, and indirect light is a mean of equal values: what remains is the error of the row
        // sums.
        assert!((mean / expected - 1.0).abs() < 5e-3, "{reflectance}: {mean} {expected}");
        let worst = lit.iter().map(|e| (e / expected - 1.0).abs()).fold(0.0, f64::max);
        assert!(worst < 0.03, "{reflectance}: {worst}");
        let texel = lightmap.image.texels.iter().find(|t| t.x > 0.0).unwrap();
        assert!((texel.y / texel.x - 0.5).abs() < 1e-4 && (texel.z / texel.x - 0.25).abs() < 1e-4);
    }
}

#[test]
fn two_squares() {
    // Two parallel unit squares of ρ = 0.8, of which the lower one emits an exitance of 1; E = (B - emitted exitance) /
    // ρ. The expected value is the solution with one constant patch per square (oracles.md); the mean irradiance of the
    // upper square differs from it only in that the second bounce is not uniform over the squares.
    let square = |y: f32, up: bool| {
        let mut mesh = TriangleMesh {
            positions: [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
                .map(|[x, z]| Vec3::new(x, y, z))
                .to_vec(),
            indices: vec![0, 1, 2, 0, 2, 3],
            ..TriangleMesh::default()
        };
        if up {
            mesh.indices = vec![0, 2, 1, 0, 3, 2];
        }
        Mesh(Arc::new(mesh))
    };
    let mut world = World::new();
    let reflectance = Vec3::splat(0.8);
    let lower = matt(reflectance, Vec3::splat(std::f32::consts::FRAC_1_PI));
    world.spawn((Name::new("a"), square(0.0, true), lower, StaticObject));
    let upper =
        world.spawn((Name::new("b"), square(1.0, false), matt(reflectance, Vec3::ZERO), StaticObject)).id();
    let options = BakeOptions { quality: Quality::Final, ..draft(32) };
    run(&mut world, &options);
    let map = world.get::<Lightmap>(upper).unwrap().image.clone();
    // The chart's border passes through the centres of its outermost texels: these have half weight, the corners a
    // quarter.
    let (mut sum, mut weights) = (0.0, 0.0);
    let covered =
        |x: i64, y: i64| x >= 0 && y >= 0 && x < 32 && y < 32 && map.texels[(y * 32 + x) as usize].x > 0.0;
    for y in 0..32i64 {
        for x in 0..32i64 {
            if covered(x, y) {
                let half = |a: bool, b: bool| if a && b { 1.0 } else { 0.5 };
                let weight =
                    half(covered(x - 1, y), covered(x + 1, y)) * half(covered(x, y - 1), covered(x, y + 1));
                sum += weight * f64::from(map.texels[(y * 32 + x) as usize].x) * PI;
                weights += weight;
            }
        }
    }
    let mean = sum / weights;
    let expected = 0.164052304858699 / 0.8;
    assert!((mean / expected - 1.0).abs() < 0.01, "{mean} instead of {expected}");
}

#[test]
fn a_point_light_over_a_floor() {
    // E = π L_d cos θ / d²; there are no bounces.
    let mut world = World::new();
    let floor = Mesh(Arc::new(TriangleMesh {
        positions: [[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]]
            .map(|[x, z]| Vec3::new(x, 0.0, z))
            .to_vec(),
        indices: vec![0, 2, 1, 0, 3, 2],
        ..TriangleMesh::default()
    }));
    world.spawn((floor, matt(Vec3::splat(0.5), Vec3::ZERO), StaticObject));
    let light = Light { bake: BakeMode::Static, ..Light::point(Vec3::new(3.0, 2.0, 1.0)) };
    world.spawn((light, Transform::from_xyz(0.5, 1.5, -0.25)));
    let report = run(&mut world, &draft(64));
    assert!(report.skipped.iter().any(|line| line.contains("no surface emits")), "{:?}", report.skipped);
    let points: Vec<_> = (0..200)
        .map(|i| {
            let at = DVec3::new(f64::from(i % 20) * 0.2 - 1.9, 0.0, f64::from(i / 20) * 0.4 - 1.8);
            let l = DVec3::new(0.5, 1.5, -0.25) - at;
            let e = PI * l.y / l.length().powi(3);
            common::ReferencePoint {
                position: at,
                normal: DVec3::Y,
                irradiance: DVec3::new(3.0, 2.0, 1.0) * e,
            }
        })
        .collect();
    let found = common::compare(&mut world, &points);
    assert_eq!(found.missed, 0);
    // The error of bilinear interpolation between texels of h = 1/16 m, h²/8 |E''|, is some tenths of a per cent.
    assert!(found.rmse < 0.005, "{found}");
}

/// A room with a lamp and a crate that stands on the floor. The colors are the walls' reflectance and the lamp's
/// radiance.
fn furnished(scale: f32, colors: [Vec3; 2]) -> World {
    let mut world = World::new();
    let place = |x: f32, y: f32, z: f32| {
        Transform::from_xyz(f64::from(x * scale), f64::from(y * scale), f64::from(z * scale))
    };
    world.spawn((
        Name::new("room"),
        room(Vec3::new(4.0, 2.0, 3.0) * scale),
        matt(colors[0], Vec3::ZERO),
        StaticObject,
    ));
    let crate_mesh = Mesh(Arc::new(shapes::cuboid(Vec3::splat(0.75) * scale, 1)));
    world.spawn((
        Name::new("crate"),
        crate_mesh,
        matt(Vec3::splat(0.5), Vec3::ZERO),
        StaticObject,
        place(0.5, -0.625, 0.25),
    ));
    let lamp = Mesh(Arc::new(shapes::cuboid(Vec3::new(0.5, 0.125, 0.5) * scale, 1)));
    world.spawn((
        Name::new("lamp"),
        lamp,
        matt(Vec3::splat(0.25), colors[1]),
        StaticObject,
        place(-0.5, 0.75, 0.0),
    ));
    world
}

const COLORS: [Vec3; 2] = [Vec3::new(0.7, 0.5, 0.3), Vec3::new(9.0, 6.0, 3.0)];

#[test]
fn the_same_bits_on_one_thread_and_on_two() {
    let baked = [1, 2].map(|threads| {
        let mut world = furnished(1.0, COLORS);
        run(&mut world, &BakeOptions { threads: Some(threads), ..draft(32) });
        common::bits(&mut world)
    });
    assert!(baked[0].iter().any(|&bits| bits != 0));
    assert_eq!(baked[0], baked[1]);
    let mut other = furnished(1.0, COLORS);
    run(&mut other, &BakeOptions { seed: 1, ..draft(32) });
    assert_ne!(baked[0], common::bits(&mut other), "another seed must give other bits");
}

#[test]
fn the_same_bits_at_every_scale_of_two() {
    let baked = [1.0, 1.0 / 128.0, 1024.0].map(|scale| {
        let mut world = furnished(scale, COLORS);
        run(&mut world, &draft(32));
        common::bits(&mut world)
    });
    assert_eq!(baked[0], baked[1]);
    assert_eq!(baked[0], baked[2]);
}

#[test]
fn swapping_channels_swaps_the_result() {
    let swap = |v: Vec3| Vec3::new(v.z, v.x, v.y);
    let [mut plain, mut swapped] = [COLORS, COLORS.map(swap)].map(|colors| furnished(1.0, colors));
    let (a, b) = (run(&mut plain, &draft(32)), run(&mut swapped, &draft(32)));
    assert_eq!(a.rays, b.rays);
    let (plain, swapped) = (irradiances(&mut plain), irradiances(&mut swapped));
    for (p, s) in plain.iter().zip(&swapped) {
        // The emitters' powers are summed in another order, and the channels are solved to a residual of 1e-5.
        assert!((DVec3::new(p.z, p.x, p.y) - *s).abs().max_element() <= 2e-3 * s.max_element(), "{p} {s}");
    }
}

#[test]
fn light_is_linear() {
    let [mut single, mut double] = [1.0, 2.0].map(|factor| furnished(1.0, [COLORS[0], COLORS[1] * factor]));
    run(&mut single, &draft(32));
    run(&mut double, &draft(32));
    for (one, two) in irradiances(&mut single).iter().zip(&irradiances(&mut double)) {
        assert_eq!(*one * 2.0, *two);
    }
}

#[test]
fn no_texel_under_the_crate_darkens_its_rim() {
    let mut world = furnished(1.0, COLORS);
    let report = run(&mut world, &draft(64));
    assert!(report.hidden_texels > 0, "{report:?}");
    assert!(irradiances(&mut world).iter().all(|e| e.is_finite() && e.min_element() >= 0.0));
    // Points of the floor just beside the side of the crate that faces the lamp.
    let maps = common::maps(&mut world);
    assert_eq!(maps.len(), 3);
    let points: Vec<_> = [0.01, 0.03, 0.05]
        .iter()
        .map(|d| common::ReferencePoint {
            position: DVec3::new(0.125 - d, -1.0, 0.25),
            normal: DVec3::Y,
            irradiance: DVec3::ONE,
        })
        .collect();
    let found = common::compare(&mut world, &points);
    let open = [common::ReferencePoint { position: DVec3::new(-0.1, -1.0, 0.25), ..points[0] }];
    let lit = common::compare(&mut world, &open).worst[0].1.x;
    for (position, value, _) in &found.worst {
        assert!(value.x > 0.5 * lit, "at {position}: {value}, in the open {lit}");
    }
}

#[test]
fn stages_without_effect_are_skipped() {
    let mut empty = World::new();
    assert!(run(&mut empty, &draft(16)).skipped[0].contains("no static mesh"));
    let mut dark = furnished(1.0, [COLORS[0], Vec3::ZERO]);
    let report = run(&mut dark, &draft(16));
    assert!(report.skipped[0].contains("no surface emits") && report.rays == 0, "{report:?}");
    let mut black = World::new();
    black.spawn((room(Vec3::ONE), matt(Vec3::ZERO, Vec3::ONE), StaticObject));
    let report = run(&mut black, &draft(16));
    assert!(report.skipped.iter().any(|line| line.contains("rho = 0")), "{report:?}");
    assert!(report.stages.iter().all(|stage| stage.stage != "final gather"));
    assert!((report.mean_irradiance[0] / PI - 1.0).abs() < 1e-3, "{report:?}");
}

#[test]
fn cancelling_leaves_the_world_alone() {
    let mut world = furnished(1.0, COLORS);
    let mut calls = 0;
    let result = Bake::new(&draft(32))
        .progress(|progress| {
            calls += 1;
            assert!((0.0..=1.0).contains(&progress.fraction));
            if progress.stage == "final gather" { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
        .run(&mut world);
    assert_eq!(result, Err(BakeError::Cancelled { stage: "final gather" }));
    assert!(calls > 3);
    assert!(common::maps(&mut world).is_empty());
    let mut meshes = world.query::<&Mesh>();
    assert!(meshes.iter(&world).all(|mesh| mesh.0.uv1.is_empty()));
}

#[test]
fn options_out_of_range_are_named() {
    for (options, name) in [
        (BakeOptions { density: Density::MapSize(0), ..draft(4) }, "map size"),
        (BakeOptions { density: Density::TexelsPerMeter(f64::NAN), ..draft(4) }, "texels per metre"),
        (BakeOptions { error: 0.0, ..draft(4) }, "error"),
        (BakeOptions { threads: Some(0), ..draft(4) }, "threads"),
    ] {
        let error = Bake::new(&options).run(&mut World::new()).unwrap_err();
        assert!(error.to_string().contains(name), "{error}");
    }
}
