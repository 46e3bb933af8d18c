//! Mirrors in mirrors: corners that send light back, kaleidoscopes and long tunnels.

use std::f64::consts::FRAC_PI_3;

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec3, Vec3};
use lumbre_scene::{Quadric, QuadricShape, Transform};
use lumbre_trace::{Branch, Kind, TraceOptions};

use crate::case::Outcome;
use crate::support::*;

crate::cases! {
    "a mirror in a mirror" {
        a_corner_of_three_sends_light_back, a_corner_of_two_sends_light_back, a_kaleidoscope_of_sixty_degrees,
        a_tunnel_of_five_hundred, mirrors_of_different_colours,
    }
}

/// Two weakly emissive mirrors that face each other.
pub fn facing_mirrors(weight: f32, emission: f32) -> World {
    let mut world = World::new();
    let mut glowing = mirror(weight);
    glowing.front.emission = Vec3::splat(emission);
    for (z, toward) in [(-1.0, DVec3::Z), (1.0, DVec3::NEG_Z)] {
        let rotation = DQuat::from_rotation_arc(DVec3::Y, toward);
        let place = Transform::from_xyz(0.0, 0.0, z).with_rotation(rotation);
        exact(&mut world, Quadric::new(QuadricShape::Plane), glowing.clone(), place);
    }
    camera(&mut world, DVec3::ZERO, DVec3::new(0.01, 0.0, -1.0), 0.1);
    world
}

/// Perfect mirrors through the origin that face these directions.
fn mirrors(fronts: &[DVec3]) -> World {
    let mut world = World::new();
    for front in fronts {
        let place = Transform::IDENTITY.with_rotation(DQuat::from_rotation_arc(DVec3::Y, *front));
        exact(&mut world, Quadric::new(QuadricShape::Plane), mirror(1.0), place);
    }
    world
}

fn last(tree: &Branch) -> (&Branch, u32) {
    let (mut last, mut count) = (tree, 0);
    while let Some(branch) = next(last, Kind::Mirrored) {
        (last, count) = (branch, count + 1);
    }
    (last, count)
}

fn a_corner_of_three_sends_light_back() -> Outcome {
    let mut pairs = Vec::new();
    for aim in [DVec3::new(0.2, 0.5, 0.9), DVec3::splat(0.3), DVec3::new(0.01, 0.02, 0.03)] {
        let mut world = mirrors(&[DVec3::X, DVec3::Y, DVec3::Z]);
        camera(&mut world, DVec3::new(4.0, 5.0, 6.0), aim, 0.1);
        let tree = tree(&mut world, &options(8));
        let (back, count) = last(&tree);
        assert_eq!(count, 3);
        pairs.push((0.0, (back.direction + tree.direction).length()));
    }
    Outcome::worst(pairs, 1e-15, "a cube's corner reverses every direction: some ulps")
}

fn a_corner_of_two_sends_light_back() -> Outcome {
    let mut pairs = Vec::new();
    for angle in [0.1_f64, 0.6, 1.4] {
        let mut world = mirrors(&[DVec3::X, DVec3::Y]);
        let (sine, cosine) = angle.sin_cos();
        camera(&mut world, DVec3::new(5.0 * cosine, 5.0 * sine, 0.0), DVec3::new(1e-3, 2e-3, 0.0), 0.1);
        let tree = tree(&mut world, &options(8));
        let (back, count) = last(&tree);
        assert_eq!(count, 2);
        pairs.push((0.0, (back.direction + tree.direction).length()));
    }
    Outcome::worst(pairs, 1e-15, "a right angle reverses every direction across its edge, near it too")
}

fn a_kaleidoscope_of_sixty_degrees() -> Outcome {
    // Between mirrors at 60° a ray near their bisector is mirrored 3 times before it leaves.
    let mut world = mirrors(&[DVec3::Y, DVec3::new(FRAC_PI_3.sin(), -FRAC_PI_3.cos(), 0.0)]);
    let mut pairs = Vec::new();
    for angle in [0.2_f64, 0.5, 0.8] {
        let (sine, cosine) = angle.sin_cos();
        look_from(&mut world, DVec3::new(5.0 * cosine, 5.0 * sine, 0.0), DVec3::new(1e-4, 5e-5, 0.0), 0.1);
        let tree = tree(&mut world, &options(8));
        let (back, count) = last(&tree);
        assert_eq!(count, 3);
        // Reflections about lines at 0° and 60°, three in turn: θ becomes 240° - θ, or -120° - θ, which is
        // the same.
        let turned = back.direction.y.atan2(back.direction.x);
        let came = (-tree.direction.y).atan2(-tree.direction.x);
        pairs.push((FRAC_PI_3 - came, turned));
    }
    Outcome::worst(pairs, 1e-14, "angle of what comes back: 60° less that under which it came; some ulps")
}

fn a_tunnel_of_five_hundred() -> Outcome {
    let mut world = facing_mirrors(1.0, 0.0);
    let asked = TraceOptions { depth: Some(500), weight: 0.0, ..options(8) };
    let tree = tree(&mut world, &asked);
    let (end, count) = last(&tree);
    assert_eq!(count, 500);
    // The distance to the first mirror is 1 and to each of the others 2, and the ray moves aside by 1/100 of
    // it.
    let aside = 0.01 * (1.0 + 2.0 * 499.0);
    Outcome::number(aside, end.origin.x, 1e-11, "how far aside the 500th reflection is")
}

fn mirrors_of_different_colours() -> Outcome {
    let mut world = World::new();
    for (z, toward, tint) in
        [(-1.0, DVec3::Z, Vec3::new(0.5, 1.0, 0.0)), (1.0, DVec3::NEG_Z, Vec3::new(1.0, 0.25, 1.0))]
    {
        let mut material = mirror(1.0);
        material.mirror = tint;
        material.front.emission = Vec3::ONE;
        let place =
            Transform::from_xyz(0.0, 0.0, z).with_rotation(DQuat::from_rotation_arc(DVec3::Y, toward));
        exact(&mut world, Quadric::new(QuadricShape::Plane), material, place);
    }
    camera(&mut world, DVec3::ZERO, DVec3::NEG_Z, 0.01);
    let (picture, _) = draw(&mut world, &TraceOptions { depth: Some(200), weight: 0.0, ..options(1) });
    // 1 + a (1 + b (1 + a (…: (1 + a) / (1 - a b) in the limit.
    let limit = |a: f64, b: f64| (1.0 + a) / (1.0 - a * b);
    let expected = [limit(0.5, 1.0), limit(1.0, 0.25), 1.0];
    let found = picture.radiance[0].to_array();
    Outcome::worst(
        expected.into_iter().zip(found),
        1e-12,
        "(1 + a) / (1 - a b) of the two mirrors' k_r, channel by channel",
    )
}
