//! Shadows of lights with a size against closed forms.

use std::f64::consts::{FRAC_1_PI, PI};
use std::sync::Arc;

use crate::common;
use crate::scene_parts::black_sheet;
use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_bake::{Bake, BakeOptions, BakeReport, Density, Quality};
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{BakeMode, Light};
use lumbre_scene::{Mesh, StaticObject, Transform};

fn run(world: &mut World, side: u32) -> BakeReport {
    let options = BakeOptions { density: Density::MapSize(side), error: 0.0005, ..BakeOptions::default() };
    let report = Bake::new(&BakeOptions { quality: Quality::Final, ..options }).run(world);
    report.expect("the scene bakes")
}

/// A horizontal rectangle that looks up.
fn horizontal([x0, x1]: [f32; 2], [z0, z1]: [f32; 2], y: f32) -> Mesh {
    Mesh(Arc::new(TriangleMesh {
        positions: [[x0, z0], [x0, z1], [x1, z1], [x1, z0]].map(|[x, z]| Vec3::new(x, y, z)).to_vec(),
        indices: vec![0, 1, 2, 0, 2, 3],
        ..TriangleMesh::default()
    }))
}

fn points(along: impl Iterator<Item = f64>, value: impl Fn(f64) -> f64) -> Vec<common::ReferencePoint> {
    let point = |x: f64| common::ReferencePoint {
        position: DVec3::new(x, 0.0, 0.0),
        normal: DVec3::Y,
        irradiance: DVec3::splat(value(x)),
    };
    along.map(point).collect()
}

/// The share of a unit disc on one side of a line at distance `h` from its centre: 1 for h = -1, 1/2 for 0, 0 for 1.
fn circular_segment(h: f64) -> f64 {
    let h = h.clamp(-1.0, 1.0);
    (h.acos() - h * (1.0 - h * h).sqrt()) / PI
}

#[test]
fn the_sun_behind_an_edge() {
    // A sun of angular diameter 2α straight above, and a half-plane over x < 0 at height 1. From a point at x, the
    // half-plane's edge appears at an angle φ from the vertical, tan φ = -x/1. Projected onto the floor, the sun's
    // directions are a disc of radius sin α, and the edge, which spans a plane with the point, is the line at -sin φ;
    // the part of the disc beyond the line is visible. The projection contains the cosine at the floor, so that E = E0
    // times the visible share.
    let alpha = 0.25f64;
    let mut world = World::new();
    world.spawn((horizontal([-0.5, 0.5], [-0.5, 0.5], 0.0), black_sheet(), StaticObject));
    world.spawn((horizontal([-30.0, 0.0], [-30.0, 30.0], 1.0), black_sheet(), StaticObject));
    let sun = Light {
        bake: BakeMode::Static,
        angle: 2.0 * alpha as f32,
        ..Light::directional(Vec3::splat(FRAC_1_PI as f32))
    };
    world.spawn((sun, Transform::from_xyz(0.0, 5.0, 0.0).looking_at(DVec3::ZERO, DVec3::X)));
    let report = run(&mut world, 64);
    let expected = |x: f64| circular_segment(-(x / x.hypot(1.0)) / alpha.sin());
    let along = (0..39).map(|i| 0.025 * f64::from(i) - 0.475);
    let found = common::compare(&mut world, &points(along, expected));
    println!("{found}; stated {:.3} %", 100.0 * report.estimated_error);
    // Interpolation of a penumbra 0.5 m wide between texels of 1/62 m has an error of h²/8 |E''| < 0.1 %. The target
    // error is below what the largest number of samples reaches: with 1024 samples, an edge through the disc leaves
    // (0.2 · 1024^-3/2)^½ = 0.25 % of E0 (0.5 % of the mean) at half of the points, and interpolation between texels
    // reduces that by a factor of 0.7: 0.25 %.
    assert!(found.missed == 0 && found.rmse < 0.004, "{found}");
    // Half of the light below the edge, within about two and a half times the 0.25 % of E0, reduced by interpolation.
    let half = common::compare(&mut world, &points(std::iter::once(0.0), |_| 0.5));
    assert!((half.worst[0].1.x - 0.5).abs() < 0.005, "{half}");
}

#[test]
fn a_sphere_behind_an_edge() {
    // A spherical light of radius r at height h above x = 0, and a half-plane x < 0 at height 1. From a point at x, the
    // sphere is a cone whose half angle has the sine r/d, and the plane through the point and the half-plane's edge
    // passes the sphere's centre at a distance of |x (h - 1)| / √(x² + 1). Projected along the cone's axis, the
    // directions are a disc and that plane is a line. The cosine at the floor varies over the disc, so that the visible
    // share alone is only approximate: the integral over the visible part of the disc is computed numerically below.
    let (radius, height) = (0.2f64, 2.0f64);
    let mut world = World::new();
    world.spawn((horizontal([-0.5, 0.5], [-0.5, 0.5], 0.0), black_sheet(), StaticObject));
    world.spawn((horizontal([-30.0, 0.0], [-30.0, 30.0], 1.0), black_sheet(), StaticObject));
    let lamp = Light { bake: BakeMode::Static, radius: radius as f32, ..Light::point(Vec3::ONE) };
    world.spawn((lamp, Transform::from_xyz(0.0, height, 0.0)));
    let report = run(&mut world, 64);
    let expected = |x: f64| {
        let d = x.hypot(height);
        // The signed distance of the line from the disc's centre, in units of the radius.
        let line = -(x * (height - 1.0) / x.hypot(1.0)) / radius;
        // Integrate numerically over strips of the disc parallel to the line, independently of how the baker samples.
        let (sine, n) = (radius / d, 4000);
        let (axis, across) = ([-x / d, height / d], [height / d, x / d]);
        let (mut seen, mut all) = (0.0, 0.0);
        for i in 0..n {
            let t = -1.0 + 2.0 * (f64::from(i) + 0.5) / f64::from(n);
            let strip = 2.0 * (1.0 - t * t).sqrt() * 2.0 / f64::from(n) / PI;
            // The mean of 1/√(1 - sin² (t² + s²)) along the strip, by eight points.
            let inverse = (0..8)
                .map(|k| {
                    let s = (1.0 - t * t).sqrt() * (-1.0 + 2.0 * (f64::from(k) + 0.5) / 8.0);
                    1.0 / (1.0 - sine * sine * (t * t + s * s)).sqrt()
                })
                .sum::<f64>()
                / 8.0;
            let value = strip * (axis[1] + sine * t * across[1] * inverse);
            all += value;
            seen += if t > line { value } else { 0.0 };
        }
        assert!((all - axis[1]).abs() < 1e-3);
        PI * seen / (d * d)
    };
    let along = (0..39).map(|i| 0.025 * f64::from(i) - 0.475);
    let found = common::compare(&mut world, &points(along, expected));
    println!("{found}; stated {:.3} %", 100.0 * report.estimated_error);
    assert!(found.missed == 0 && found.rmse < 0.004, "{found}");
    let half = common::compare(&mut world, &points(std::iter::once(0.0), |_| 0.5 * PI / height.powi(2)));
    assert!((half.worst[0].1.x / (0.5 * PI / height.powi(2)) - 1.0).abs() < 0.01, "{half}");
    // The share of the area alone, without the variation of the cosine over the disc, is near it.
    let by_area = |x: f64| {
        let d = x.hypot(height);
        PI * height / d.powi(3) * circular_segment(-(x * (height - 1.0) / x.hypot(1.0)) / radius)
    };
    let found = common::compare(&mut world, &points((0..39).map(|i| 0.025 * f64::from(i) - 0.475), by_area));
    assert!(found.rmse < 0.01, "{found}");
}

/// A floor and a plate under a point light of a given radius and a sun of a given angle.
fn plate(radius: f32, angle: f32) -> World {
    let mut world = World::new();
    world.spawn((horizontal([-1.0, 1.0], [-1.0, 1.0], 0.0), black_sheet(), StaticObject));
    world.spawn((horizontal([-0.3, 0.4], [-0.5, 0.2], 0.6), black_sheet(), StaticObject));
    let lamp = Light { bake: BakeMode::Static, radius, ..Light::point(Vec3::splat(0.2)) };
    world.spawn((lamp, Transform::from_xyz(0.2, 1.5, 0.1)));
    let sun = Light { bake: BakeMode::Static, angle, ..Light::directional(Vec3::splat(0.1)) };
    world.spawn((sun, Transform::from_xyz(2.0, 5.0, 1.0).looking_at(DVec3::ZERO, DVec3::X)));
    world
}

#[test]
fn without_a_size_the_shadow_is_hard() {
    let [mut hard, mut small, mut large] = [(0.0, 0.0), (1e-6, 1e-6), (0.2, 0.2)].map(|(r, a)| plate(r, a));
    for world in [&mut hard, &mut small, &mut large] {
        run(world, 48);
    }
    let texels = |world: &mut World| -> Vec<f64> {
        let maps = common::maps(world);
        maps.iter().flat_map(|(_, map)| map.texels.iter().map(|texel| f64::from(texel.x) * PI)).collect()
    };
    let [hard, small, large] = [&mut hard, &mut small, &mut large].map(texels);
    let largest_difference =
        |other: &[f64]| hard.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    // The penumbra of a light of 10⁻⁶ is 10⁻⁴ of a texel wide: one sample in ten thousand falls into it.
    assert!(
        largest_difference(&small) < 0.02 && largest_difference(&large) > 0.1,
        "{} {}",
        largest_difference(&small),
        largest_difference(&large)
    );
}

#[test]
fn an_unoccluded_spherical_light_acts_like_a_point_light() {
    // A sphere of uniform radiance entirely above the horizon gives the same irradiance as a point light.
    for radius in [0.0f32, 0.3] {
        let mut world = World::new();
        world.spawn((horizontal([-1.0, 1.0], [-1.0, 1.0], 0.0), black_sheet(), StaticObject));
        let lamp = Light { bake: BakeMode::Static, radius, ..Light::point(Vec3::ONE) };
        world.spawn((lamp, Transform::from_xyz(0.0, 1.0, 0.0)));
        let report = run(&mut world, 48);
        let value = |x: f64| PI / x.hypot(1.0).powi(3);
        let found = common::compare(&mut world, &points((0..19).map(|i| 0.1 * f64::from(i) - 0.9), value));
        println!("{radius}: {found}; stated {:.4} %", 100.0 * report.estimated_error);
        assert!(found.missed == 0 && found.rmse < 0.002, "{found}");
    }
}

#[test]
fn a_setting_sun_is_cut_by_the_horizon() {
    // The centre of the sun is in the plane of the floor, so that the upper half of its directions is visible: E = E0 /
    // (π sin² α) · ∫ cos θ dω over that half, where E0 is the irradiance of a surface perpendicular to the sun.
    let alpha = 0.5f64;
    let mut world = World::new();
    world.spawn((horizontal([-1.0, 1.0], [-1.0, 1.0], 0.0), black_sheet(), StaticObject));
    let sun = Light { bake: BakeMode::Static, angle: 2.0 * alpha as f32, ..Light::directional(Vec3::ONE) };
    world.spawn((sun, Transform::from_xyz(4.0, 0.0, 0.0).looking_at(DVec3::ZERO, DVec3::Y)));
    run(&mut world, 32);
    // With the polar axis towards the sun, n·ω = sin θ cos φ, and the integral is ∫ sin² θ dθ ∫ cos φ dφ = α - sin α
    // cos α.
    let expected = PI * (alpha - alpha.sin() * alpha.cos()) / (PI * alpha.sin().powi(2));
    let found = common::compare(&mut world, &points((0..9).map(|i| 0.2 * f64::from(i) - 0.8), |_| expected));
    println!("{found}");
    assert!(found.missed == 0 && found.rmse < 0.01, "{found}");
}
