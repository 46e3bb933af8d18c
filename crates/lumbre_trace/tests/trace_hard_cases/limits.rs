//! Deep trees and small weights: what they contribute, and what is reported of what they leave out.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec2, DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{AlphaMode, Material};
use lumbre_scene::{Medium, Mesh, Transform};
use lumbre_trace::{Kind, TraceOptions, Tracer, TreeFormat};

use crate::case::Outcome;
use crate::mirrors::facing_mirrors;
use crate::support::*;

crate::cases! {
    "depth 50" {
        fifty_mirrors_are_a_series, what_lies_behind_them_is_within_the_bound, fifty_sheets_of_glass,
        fifty_faces_of_glass, one_less_does_not_arrive,
        thousands_of_sheets_that_hardly_cover,
    }
    "weight 10^-6" {
        mirrors_down_to_a_millionth, the_rays_it_takes, the_weight_it_states, a_weight_of_zero_ends_by_depth,
        trees_of_glass_that_divide, the_most_rays_of_a_tree_are_its_heaviest, a_weight_below_zero,
    }
}

/// Fraction of light that each mirror reflects.
const MIRRORED: f64 = 0.75;

fn series(terms: i32) -> f64 {
    2.0 * (1.0 - MIRRORED.powi(terms)) / (1.0 - MIRRORED)
}

fn to_depth(depth: u32) -> TraceOptions {
    TraceOptions { depth: Some(depth), weight: 0.0, ..options(4) }
}

fn fifty_mirrors_are_a_series() -> Outcome {
    let (picture, _) = draw(&mut facing_mirrors(0.75, 2.0), &to_depth(50));
    let pixels = picture.radiance.iter().map(|pixel| (series(51), pixel.x));
    Outcome::worst(pixels, 1e-13, "2 (1 - .75^51) / (1 - .75)")
}

fn what_lies_behind_them_is_within_the_bound() -> Outcome {
    let (picture, report) = draw(&mut facing_mirrors(0.75, 2.0), &to_depth(50));
    let missing = 8.0 - picture.radiance[0].x;
    let bound = report.cut.bound.unwrap_or(f64::NAN);
    Outcome::number(
        1.0,
        missing / bound,
        1e-7,
        "missing light over the stated bound: here nothing is brighter, so that it is met",
    )
}

/// Transmissive sheets or slabs behind each other, in front of a sky of 1.
fn sheets(count: u32, passing: f32, thin: bool) -> World {
    let mut world = World::new();
    let material = Material { transmission: Vec3::splat(passing), ior: 1.5, ..black() };
    for number in 0..count {
        let mesh = Mesh(Arc::new(shapes::cuboid(Vec3::new(4.0, 4.0, 0.01), 1)));
        let place = Transform::from_xyz(0.0, 0.0, -0.02 * f64::from(number));
        let sheet = Mesh(Arc::new(shapes::plane(4.0, 4.0, 1, 1)));
        let upright = place.with_rotation(glam::DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2));
        let medium = Medium { thin, ..Medium::default() };
        match thin {
            true => world.spawn((sheet, material.clone(), medium, upright)),
            false => world.spawn((mesh, material.clone(), medium, place)),
        };
    }
    furnace(&mut world, 1.0);
    camera(&mut world, DVec3::new(0.1, 0.05, 1.0), DVec3::ZERO, 0.05);
    world
}

fn fifty_sheets_of_glass() -> Outcome {
    let (picture, report) = draw(&mut sheets(50, 0.9, true), &to_depth(50));
    assert_eq!(report.cut.largest_weight, 0.0);
    let expected = f64::from(0.9_f32).powi(50);
    let pixels = picture.radiance.iter().map(|pixel| (expected, pixel.x));
    Outcome::worst(pixels, 1e-15, "k_t^50, a sheet having no inside")
}

fn fifty_faces_of_glass() -> Outcome {
    let (picture, _) = draw(&mut sheets(25, 0.9, false), &to_depth(50));
    let expected = f64::from(0.9_f32).powi(50);
    let pixels = picture.radiance.iter().map(|pixel| (expected, pixel.x));
    Outcome::worst(pixels, 1e-15, "k_t^50, two faces to each of 25 slabs")
}

fn one_less_does_not_arrive() -> Outcome {
    let (picture, report) = draw(&mut sheets(50, 0.9, true), &to_depth(49));
    assert!(picture.radiance.iter().all(|pixel| *pixel == DVec3::ZERO));
    let expected = f64::from(0.9_f32).powi(50);
    Outcome::number(
        expected,
        report.cut.largest_weight,
        1e-15,
        "stated weight of what was cut off: all that a depth of 50 brings",
    )
}

fn thousands_of_sheets_that_hardly_cover() -> Outcome {
    // What continues straight behind a sheet does not count as depth. A tree of all 3,000 branches would be too deep
    // to be drawn.
    let mut world = sheets(3000, 0.0, true);
    let mut sheets = world.query::<(&mut Material, &mut Transform)>();
    for (mut material, mut place) in sheets.iter_mut(&mut world) {
        (material.alpha, material.alpha_mode) = (1e-4, AlphaMode::Blend);
        // So near to each other that the view meets them all.
        place.translation.z *= 0.25;
    }
    let options = TraceOptions { size: (1, 1), ..to_depth(50) };
    let (picture, report) = draw(&mut world, &options);
    let tracer = Tracer::new(&mut world, &options).expect("the options are valid");
    let branches = tracer.draw_tree(&tracer.tree(DVec2::splat(0.5)), TreeFormat::Text);
    assert!(branches.lines().count() > 2000, "{} lines", branches.lines().count());
    assert_eq!(picture.radiance[0], DVec3::ZERO);
    let expected = (1.0 - f64::from(1e-4_f32)).powi(2001);
    let comment = "stated weight of what was cut off: all that 2,001 sheets let pass";
    Outcome::number(expected, report.cut.largest_weight, 1e-12, comment)
}

fn a_millionth() -> TraceOptions {
    TraceOptions { depth: Some(1000), weight: 1e-6, ..options(2) }
}

fn mirrors_down_to_a_millionth() -> Outcome {
    let (picture, _) = draw(&mut facing_mirrors(0.75, 2.0), &a_millionth());
    // .75^48 = 1.006e-6 is traced, .75^49 is not.
    let pixels = picture.radiance.iter().map(|pixel| (series(49), pixel.x));
    Outcome::worst(pixels, 1e-13, "2 (1 - .75^49) / (1 - .75): .75^48 is the last above 10^-6")
}

fn the_rays_it_takes() -> Outcome {
    let (picture, _) = draw(&mut facing_mirrors(0.75, 2.0), &a_millionth());
    Outcome::number(49.0, f64::from(picture.rays[0]), 0.0, "rays of a pixel: the eye's, and 48 mirrored ones")
}

fn the_weight_it_states() -> Outcome {
    let (_, report) = draw(&mut facing_mirrors(0.75, 2.0), &a_millionth());
    Outcome::number(
        MIRRORED.powi(49),
        report.cut.largest_weight,
        1e-20,
        "stated weight of what was cut off: .75^49",
    )
}

fn a_weight_of_zero_ends_by_depth() -> Outcome {
    let asked = TraceOptions { depth: Some(1000), weight: 0.0, ..options(1) };
    let (picture, _) = draw(&mut facing_mirrors(1.0, 1.0), &asked);
    Outcome::number(
        1001.0,
        picture.radiance[0].x,
        1e-9,
        "perfect mirrors that glow by 1: 1001 terms, and no more",
    )
}

fn a_weight_below_zero() -> Outcome {
    let asked = TraceOptions { weight: -1e-6, ..options(1) };
    let refused = Tracer::new(&mut facing_mirrors(0.5, 1.0), &asked).err();
    Outcome::text("weight is -0.000001", refused.map_or(String::new(), |error| error.to_string()))
}

fn the_most_rays_of_a_tree_are_its_heaviest() -> Outcome {
    // Without a least weight and 40 deep this tree would have millions of rays. Traced depth-first, 0.19 of the light
    // was cut off.
    let mut world = sheets(3, 1.0, false);
    let mut media = world.query::<&mut Medium>();
    media.iter_mut(&mut world).for_each(|mut medium| medium.fresnel = true);
    let (picture, report) = draw(&mut world, &TraceOptions { size: (1, 1), ..to_depth(40) });
    assert_eq!(picture.rays[0], 100_000);
    let missing = 1.0 - picture.radiance[0].x;
    let bound = report.cut.bound.unwrap_or(f64::NAN);
    assert!(missing <= bound + 1e-12, "{missing} of {bound}");
    Outcome::number(0.0, bound, 1e-3, "stated bound on what a limit of 100,000 rays cuts off a furnace of 1")
}

fn trees_of_glass_that_divide() -> Outcome {
    // Every face divides the light, so that the rays form a tree and not a chain. Its branches together have
    // all the light.
    let mut world = sheets(3, 1.0, false);
    let mut media = world.query::<&mut Medium>();
    media.iter_mut(&mut world).for_each(|mut medium| medium.fresnel = true);
    let (picture, report) = draw(&mut world, &TraceOptions { size: (1, 1), ..a_millionth() });
    let tree = tree(&mut world, &TraceOptions { size: (1, 1), ..a_millionth() });
    assert!(next(&tree, Kind::Mirrored).is_some() && picture.rays[0] > 500, "{} rays", picture.rays[0]);
    let missing = 1.0 - picture.radiance[0].x;
    let bound = report.cut.bound.unwrap_or(f64::NAN);
    assert!(missing <= bound + 1e-12, "{missing} of {bound}");
    Outcome::number(
        0.0,
        missing,
        1e-3,
        "a furnace of 1 less what arrives, and no more than the report's bound on what was cut off",
    )
}
