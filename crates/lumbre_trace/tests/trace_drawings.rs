//! Drawings of ray trees: the objects behind the rays are where the projection puts them, and drawings stay small.

mod support;

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec2, DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::Material;
use lumbre_scene::{Mesh, Name, Transform};
use lumbre_trace::{TraceOptions, Tracer, TreeFormat};

use support::*;

/// Outlines of objects that rays meet, and of others.
const MET: &str = "stroke=\"#909090\"";
const OTHER: &str = "stroke=\"#d0d0d0\"";

fn cube(world: &mut World, name: &str, side: f32, middle: DVec3, material: Material) {
    let mesh = Mesh(Arc::new(shapes::cuboid(Vec3::splat(side), 1)));
    world.spawn((Name::new(name.to_owned()), mesh, material, Transform::from_translation(middle)));
}

/// A mirror cube of 1 m about the origin, which an eye at z = 4 looks at.
fn mirror_cube() -> World {
    let mut world = World::new();
    cube(&mut world, "cube", 1.0, DVec3::ZERO, mirror(0.5));
    camera(&mut world, DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, 0.5);
    world
}

fn drawing(world: &mut World) -> String {
    let tracer =
        Tracer::new(world, &TraceOptions { depth: Some(0), ..options(2) }).expect("it can be traced");
    let tree = tracer.tree(DVec2::ONE);
    tracer.draw_tree(&tree, TreeFormat::Svg)
}

#[test]
fn objects_are_drawn_behind_the_rays_in_the_same_projection() {
    let drawn = drawing(&mut mirror_cube());
    // The rays extend from z = 4 to 0.5, drawn with 15 % of room in 480 pixels about (264, 264).
    let scale = 480.0 / (1.3 * 3.5);
    let above = |x: f64, z: f64| format!("{:.1} {:.1}", 264.0 + x * scale, 264.0 + (z - 2.25) * scale);
    for x in [-0.5, 0.5] {
        assert!(drawn.contains(&above(x, 0.5)), "{} is not in {drawn}", above(x, 0.5));
    }
    assert!(drawn.contains(MET) && !drawn.contains(OTHER), "{drawn}");
    // The ray of the camera ends at the cube's face.
    let end = above(0.0, 0.5).replacen(' ', "\" cy=\"", 1);
    assert!(drawn.contains(&format!("<circle cx=\"{end}\"")), "{end} is not in {drawn}");
    // An object beside the rays is drawn in another colour, and one far from them is not drawn.
    let mut world = mirror_cube();
    cube(&mut world, "far", 1.0, DVec3::X * 10.0, black());
    assert_eq!(drawing(&mut world), drawn);
    cube(&mut world, "near", 0.2, DVec3::new(0.3, 0.0, 2.0), black());
    assert!(drawing(&mut world).contains(OTHER));
}

#[test]
fn smooth_objects_are_drawn_by_their_silhouettes() {
    let mut world = World::new();
    world.spawn((Mesh(Arc::new(shapes::uv_sphere(0.5, 64, 32))), mirror(0.5)));
    camera(&mut world, DVec3::new(0.0, 0.0, 2.0), DVec3::ZERO, 0.5);
    let drawn = drawing(&mut world);
    // Of 2,000 triangles some dozens of edges remain: the circle of each view.
    let edges = drawn.matches('M').count();
    assert!((20..200).contains(&edges), "{edges} edges");
}

#[test]
fn drawings_of_large_scenes_stay_small_and_are_always_the_same() {
    let world = || {
        let mut world = mirror_cube();
        for number in 0..2000 {
            let number = f64::from(number);
            // Beside the ray, which they must not stop.
            let aside = DVec3::new(0.3 + 0.15 * (number * 0.7).sin(), 0.3 * (number * 1.3).cos(), 0.0);
            let middle = aside + DVec3::Z * (0.6 + number * 1.5e-3);
            cube(&mut world, "crumb", 0.05, middle, black());
        }
        world
    };
    let drawn = drawing(&mut world());
    assert!(drawn.contains("shortest edges of objects"), "it says what is left out");
    assert!(drawn.len() < 150_000, "{} bytes", drawn.len());
    assert!(drawn.contains(MET), "what rays meet has precedence");
    assert_eq!(drawn, drawing(&mut world()));
}
