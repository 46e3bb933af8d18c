//! Rays that start on a surface: shadow, mirrored and transmitted rays at sizes from a millimetre to a
//! hundred kilometres, near the origin and far from it.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{Light, Material};
use lumbre_scene::{Mesh, Quadric, QuadricShape, Transform};
use lumbre_trace::TraceOptions;

use crate::case::Outcome;
use crate::support::*;

crate::cases! {
    "rays that start on a surface" {
        a_floor_lit_at_every_size, a_mirror_of_triangles_does_not_see_itself, an_exact_mirror_does_not_see_itself,
        glass_of_triangles_is_entered_and_left_once, exact_glass_is_entered_and_left_once,
        a_path_does_not_shade_the_face_it_left,
    }
}

const SIZES: [f64; 5] = [1e-3, 1.0, 1e2, 1e4, 1e5];
const PLACES: [DVec3; 2] = [DVec3::ZERO, DVec3::new(1e6, -2e5, 3e6)];

/// Draws a world of each size at each place and pairs every pixel with the value that all of them must have.
fn pixels(make: impl Fn(&mut World, f64, DVec3), expected: f64, options: &TraceOptions) -> Vec<(f64, f64)> {
    let mut found = Vec::new();
    for (size, place) in SIZES.into_iter().flat_map(|size| PLACES.map(|place| (size, place))) {
        // Far from the origin, f32 cannot represent an object of a millimetre.
        if size < 1.0 && place != DVec3::ZERO {
            continue;
        }
        let mut world = World::new();
        make(&mut world, size, place);
        let (picture, _) = draw(&mut world, options);
        found.extend(picture.radiance.iter().map(|pixel| (expected, pixel.x)));
    }
    found
}

fn a_floor_lit_at_every_size() -> Outcome {
    // Seen from the lamp: k_d L (n.l) / d² at every point, up to grazing angles at the picture's edge.
    let mut pairs = Vec::new();
    for (size, place) in SIZES.into_iter().flat_map(|size| PLACES.map(|place| (size, place))) {
        if size < 1.0 && place != DVec3::ZERO {
            continue;
        }
        let mut world = World::new();
        let side = 40.0 * size as f32;
        let floor = Mesh(Arc::new(shapes::plane(side, side, 8, 8)));
        world.spawn((floor, Material::matt(Vec3::ONE), Transform::from_translation(place)));
        let strength = Vec3::splat((size * size) as f32);
        let lamp = place + DVec3::Y * size;
        world.spawn((Light::point(strength), Transform::from_translation(lamp)));
        camera(&mut world, lamp, place + DVec3::new(3.0 * size, 0.0, 0.0), 0.4);
        let asked = |shadows| TraceOptions { shadows, ..options(48) };
        let (lit, _) = draw(&mut world, &asked(true));
        let (open, _) = draw(&mut world, &asked(false));
        pairs.extend(open.radiance.iter().zip(&lit.radiance).map(|(open, lit)| (1.0, lit.x / open.x)));
    }
    Outcome::worst(
        pairs,
        0.0,
        "share of the light that arrives: nothing stands between, so that any other is a shadow of the floor's own",
    )
}

fn half_mirror() -> Material {
    mirror(0.5)
}

fn tilted(size: f64, place: DVec3) -> Transform {
    Transform::from_translation(place)
        .with_rotation(DQuat::from_rotation_z(0.3) * DQuat::from_rotation_x(0.2))
        .with_scale(DVec3::splat(size))
}

/// Draws something under a sky of 1, from an `eye` in its own frame; it must show one value everywhere.
fn in_a_furnace(
    add: impl Fn(&mut World, Transform),
    (eye, angle): (DVec3, f64),
    expected: f64,
    tells: &'static str,
) -> Outcome {
    let make = |world: &mut World, size: f64, place: DVec3| {
        add(world, tilted(size, place));
        furnace(world, 1.0);
        camera(world, place + eye * size, place, angle);
    };
    Outcome::worst(pixels(make, expected, &options(48)), 0.0, tells)
}

/// Eye and field of view in front of a ball of radius 1.
const BEFORE: (DVec3, f64) = (DVec3::new(0.0, 0.0, 3.0), 0.35);

fn a_mirror_of_triangles_does_not_see_itself() -> Outcome {
    let ball = |world: &mut World, place: Transform| {
        world.spawn((Mesh(Arc::new(shapes::uv_sphere(1.0, 48, 24))), half_mirror(), place));
    };
    in_a_furnace(ball, BEFORE, 0.5, "k_r of a sky of 1: who meets the ball again has 1/4")
}

fn an_exact_mirror_does_not_see_itself() -> Outcome {
    let ball = |world: &mut World, place: Transform| {
        exact(world, Quadric::sphere(1.0), half_mirror(), place);
    };
    in_a_furnace(ball, BEFORE, 0.5, "k_r of a sky of 1: who meets the ball again has 1/4")
}

fn half_glass() -> Material {
    Material { transmission: Vec3::splat(0.5), ior: 1.2, ..black() }
}

fn glass_of_triangles_is_entered_and_left_once() -> Outcome {
    let slab = |world: &mut World, place: Transform| {
        let mesh = Mesh(Arc::new(shapes::cuboid(Vec3::new(8.0, 1.0, 8.0), 1)));
        world.spawn((mesh, half_glass(), place));
    };
    let above = (DVec3::new(0.5, 2.0, 0.0), 0.9);
    in_a_furnace(slab, above, 0.25, "k_t² of a sky of 1: who meets a face twice has 1/8 or less")
}

fn exact_glass_is_entered_and_left_once() -> Outcome {
    let ball = |world: &mut World, place: Transform| {
        exact(world, Quadric::sphere(1.0), half_glass(), place);
    };
    in_a_furnace(ball, BEFORE, 0.25, "k_t² of a sky of 1: who meets the ball's face twice has 1/8 or less")
}

fn a_path_does_not_shade_the_face_it_left() -> Outcome {
    // A plane under a sky sees nothing but sky, whichever direction a path takes.
    let mut pairs = Vec::new();
    for size in SIZES {
        let mut world = World::new();
        exact(
            &mut world,
            Quadric::new(QuadricShape::Plane),
            Material::matt(Vec3::splat(0.5)),
            Transform::IDENTITY,
        );
        furnace(&mut world, 1.0);
        camera(&mut world, DVec3::new(0.3, 1.0, 0.1) * size, DVec3::new(0.0, 0.0, -3.0 * size), 0.3);
        let (picture, _) = draw(&mut world, &paths(12, 16));
        pairs.extend(picture.radiance.iter().map(|pixel| (0.5, pixel.x)));
    }
    Outcome::worst(pairs, 1e-12, "k_d of a sky of 1: a path that met its own plane would bring k_d²")
}
