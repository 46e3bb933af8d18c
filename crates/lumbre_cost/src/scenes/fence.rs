//! A fence, a table and a ball under three lamps with shadows: a spotlight and a sun that have a size, and a
//! point light that has none, so that there is a shadow map of each kind. Thin objects near the floor and far
//! from it show the differences between maps and filters.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{Light, Material, SpotCone};
use lumbre_scene::{Camera, Mesh, Name, Projection, SceneSettings, Transform};

/// Creates the yard, seen from above the fence.
pub fn fence() -> World {
    let mut world = World::new();
    world.insert_resource(SceneSettings { ambient: Vec3::splat(0.04), ..SceneSettings::default() });
    let mut place = |name: &str, mesh, color: Vec3, at: Transform| {
        world.spawn((Name::new(name.to_owned()), Mesh(Arc::new(mesh)), Material::matt(color), at));
    };
    place("floor", shapes::plane(14.0, 14.0, 2, 2), Vec3::splat(0.7), Transform::IDENTITY);
    let upright = Transform::from_xyz(0.0, 1.5, -3.0)
        .with_rotation(DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2));
    place("wall", shapes::plane(14.0, 3.0, 1, 1), Vec3::new(0.6, 0.5, 0.45), upright);
    let wood = Vec3::new(0.5, 0.32, 0.18);
    for number in 0..9 {
        let at = Transform::from_xyz(f64::from(number) * 0.3 - 2.6, 0.6, -0.6);
        place(&format!("slat {number}"), shapes::cuboid(Vec3::new(0.08, 1.2, 0.03), 1), wood, at);
    }
    for number in 0..4_i32 {
        let (x, z) = (f64::from(number % 2) - 0.5, f64::from(number / 2) - 0.5);
        let at = Transform::from_xyz(1.4 + 0.9 * x, 0.4, 0.2 + 0.6 * z);
        place(&format!("leg {number}"), shapes::cuboid(Vec3::new(0.05, 0.8, 0.05), 1), wood, at);
    }
    let top = Transform::from_xyz(1.4, 0.82, 0.2);
    place("table", shapes::cuboid(Vec3::new(1.1, 0.04, 0.8), 1), wood, top);
    let ball = Transform::from_xyz(-0.3, 0.35, 0.7);
    place("ball", shapes::uv_sphere(0.35, 48, 25), Vec3::new(0.25, 0.35, 0.7), ball);
    let spot = Light {
        shadow: true,
        radius: 0.25,
        ..Light::spot(Vec3::splat(9.0), SpotCone::Smooth { inner: 0.5, outer: 0.7 })
    };
    let aimed = Transform::from_xyz(-1.5, 3.6, 2.4).looking_at(DVec3::new(-0.5, 0.0, -0.6), DVec3::Y);
    world.spawn((Name::new("spotlight"), spot, aimed));
    let sun = Light { shadow: true, angle: 0.05, ..Light::directional(Vec3::new(0.5, 0.48, 0.42)) };
    let high = Transform::from_xyz(3.0, 5.0, 4.0).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Name::new("sun"), sun, high));
    let lamp = Light { shadow: true, ..Light::point(Vec3::new(0.5, 0.3, 0.15)).with_range(6.0) };
    world.spawn((Name::new("lamp"), lamp, Transform::from_xyz(2.4, 1.6, 1.0)));
    let eye = Transform::from_xyz(0.0, 2.0, 3.4).looking_at(DVec3::new(0.0, 0.3, -0.2), DVec3::Y);
    let projection = Projection::perspective(0.85);
    world.spawn((Name::new("camera"), Camera { projection, exposure: 1.0 }, eye));
    world
}
