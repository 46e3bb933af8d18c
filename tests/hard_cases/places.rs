//! Cases of positions and transforms: far away, mirrored, flattened, turned inside out.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{Light, Material};
use lumbre_scene::{Camera, Mesh, Projection, SceneSettings, Transform};
use lumbre_tests::panes::pane;

use crate::adapter::{draw, linear};
use crate::case::Outcome;

crate::cases! {
    "world at 10^5 to 10^7 m from the origin" { a_hundred_kilometres_away, ten_thousand_kilometres_away }
    "singular or mirroring transform, scale 0 or negative, non-uniform scale" {
        a_mirrored_pane_keeps_its_light, a_scale_of_zero_is_not_seen, the_normal_of_an_ellipsoid,
        the_normal_of_a_mirrored_ellipsoid,
    }
}

fn grey(color: DVec3) -> f64 {
    color.element_sum() / 3.0
}

/// A pane at `at` under a point light, seen from 2 m.
fn lit_pane(at: DVec3) -> Vec<f64> {
    let mut world = World::new();
    world.spawn((Mesh(Arc::new(pane())), Material::matt(Vec3::ONE), Transform::from_translation(at)));
    let light = Transform::from_translation(at + DVec3::new(0.5, 0.25, 1.0));
    world.spawn((Light::point(Vec3::ONE), light));
    let projection = Projection::Perspective { vertical_fov: 0.6, aspect: None, near: 0.05, far: None };
    let eye = Transform::from_translation(at + DVec3::new(0.0, 0.0, 2.0));
    world.spawn((Camera { projection, exposure: 1.0 }, eye));
    draw(&mut world, 16, 16, &linear()).0.into_iter().map(grey).collect()
}

fn moved(at: DVec3) -> Outcome {
    let near = lit_pane(DVec3::ZERO);
    let far = lit_pane(at);
    // Positions are f64 until the camera is subtracted. What remains is their rounding at 10^7 m, 2e-9 m, and that
    // of camera-relative space, 1e-7 of a metre or two, in a light that changes by about 2 per metre.
    Outcome::worst(near.into_iter().zip(far), 1e-6, "camera-relative in f64: 2 per metre times 2e-7 m")
}

fn a_hundred_kilometres_away() -> Outcome {
    moved(DVec3::new(1e5, 1e5, -1e5))
}

fn ten_thousand_kilometres_away() -> Outcome {
    moved(DVec3::new(-1e7, 3e6, 1e7))
}

/// Returns the middle pixel of a shape under a light from the upper right, seen along -z by an orthographic camera.
fn parallel(mesh: lumbre_mesh::TriangleMesh, scale: DVec3, at: DVec3) -> f64 {
    let mut world = World::new();
    let place = Transform { scale, ..Transform::IDENTITY };
    world.spawn((Mesh(Arc::new(mesh)), Material::matt(Vec3::ONE), place));
    let sun = Transform::from_xyz(1.0, 1.0, 1.0).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Light::directional(Vec3::ONE), sun));
    let projection = Projection::Orthographic { half_width: 1e-3, half_height: 1e-3, near: 0.5, far: 16.0 };
    world.spawn((Camera { projection, exposure: 1.0 }, Transform::from_xyz(at.x, at.y, 8.0)));
    world.insert_resource(SceneSettings::default());
    grey(draw(&mut world, 9, 9, &linear()).0[40])
}

fn a_mirrored_pane_keeps_its_light() -> Outcome {
    let got = parallel(pane(), DVec3::new(-1.0, 1.0, 1.0), DVec3::ZERO);
    Outcome::number(3f64.sqrt().recip(), got, 1e-6, "n.l = 1/sqrt 3: a mirror does not turn the face away")
}

fn a_scale_of_zero_is_not_seen() -> Outcome {
    let got = parallel(shapes::uv_sphere(1.0, 32, 16), DVec3::new(0.0, 0.0, 0.0), DVec3::ZERO);
    Outcome::number(0.0, got, 0.0, "no area: the background")
}

/// At x = y = 0.4 on the ellipsoid with half axes (2, 1, 0.5), the normal is the gradient (x/4, y, 4 z).
fn ellipsoid(sign: f64) -> Outcome {
    let (x, y) = (0.4f64, 0.4f64);
    let z = 0.5 * (1.0 - x * x / 4.0 - y * y).sqrt();
    let normal = DVec3::new(x / 4.0, y, 4.0 * z).normalize();
    let expected = normal.dot(DVec3::ONE.normalize());
    let got =
        parallel(shapes::uv_sphere(1.0, 512, 256), DVec3::new(sign * 2.0, 1.0, 0.5), DVec3::new(x, y, 0.0));
    // Normals are interpolated between vertices 0.012 apart: second order, 0.012^2 / 8 times the axes' ratio of 4.
    Outcome::number(expected, got, 2e-4, "the cofactor matrix; normals interpolated over 0.7 degrees")
}

fn the_normal_of_an_ellipsoid() -> Outcome {
    ellipsoid(1.0)
}

fn the_normal_of_a_mirrored_ellipsoid() -> Outcome {
    ellipsoid(-1.0)
}
