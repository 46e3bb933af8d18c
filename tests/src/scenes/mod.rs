//! Small scenes made in code: one object, one light, one camera.

pub mod documents;

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{Light, Material, SpotCone, Surface};
use lumbre_scene::{Camera, Mesh, SceneSettings, Transform};

/// A shiny ball of table 1.1 (990 polygons, 497 vertices) in front of a camera, lit by `light` from the upper
/// right.
pub fn ball(light: Light) -> World {
    ball_of(shapes::uv_sphere(1.0, 33, 16), light)
}

/// The same as [`ball`] with another mesh.
pub fn ball_of(mesh: TriangleMesh, light: Light) -> World {
    let mut world = World::new();
    let front = Surface {
        ambient: Vec3::new(0.6, 0.3, 0.2),
        diffuse: Vec3::new(0.7, 0.35, 0.25),
        specular: Vec3::splat(0.5),
        emission: Vec3::new(0.01, 0.02, 0.03),
        shininess: 20.0,
    };
    world.spawn((Mesh(Arc::new(mesh)), Material { front, ..Material::default() }));
    let place = Transform::from_xyz(2.0, 2.5, 3.0).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((light, place));
    world.spawn((Camera::default(), Transform::from_xyz(0.0, 0.3, 3.6).looking_at(DVec3::ZERO, DVec3::Y)));
    world.insert_resource(SceneSettings { ambient: Vec3::splat(0.1), ..SceneSettings::default() });
    world
}

/// Every kind of light with its name, all about equally bright on the ball.
pub fn every_light() -> Vec<(&'static str, Light)> {
    let color = Vec3::new(0.9, 0.8, 0.7);
    let with_ambient = |light: Light| Light { ambient: Vec3::splat(0.05), ..light };
    vec![
        ("ambient", Light::ambient(color)),
        ("directional", with_ambient(Light::directional(color))),
        ("point", with_ambient(Light::point(color * 15.0))),
        ("spot (exponent)", Light::spot(color * 15.0, SpotCone::Exponent { cutoff: 0.2, exponent: 30.0 })),
        ("spot (smooth)", Light::spot(color * 15.0, SpotCone::Smooth { inner: 0.1, outer: 0.25 })),
    ]
}
