//! The yard of the fence with a mirror on its wall, a ball of glass and two cameras. None of its lamps asks
//! for shadows. It shows what frames have of mirrors, glass and shadows, and what they lack.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{Light, Material, Surface};
use lumbre_scene::{Camera, Medium, Mesh, Name, Projection, Transform};

use super::fence;

/// Creates the yard, seen from above the fence and from beside it.
pub fn mirror_and_glass() -> World {
    let mut world = fence();
    for mut light in world.query::<&mut Light>().iter_mut(&mut world) {
        light.shadow = false;
    }
    let black = Surface { specular: Vec3::splat(0.4), shininess: 200.0, ..Material::matt(Vec3::ZERO).front };
    let mirror = Material { front: black, mirror: Vec3::splat(0.9), ..Material::default() };
    let upright = Transform::from_xyz(-0.6, 1.3, -2.95)
        .with_rotation(DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2));
    world.spawn((Name::new("mirror"), Mesh(Arc::new(shapes::plane(3.0, 1.8, 1, 1))), mirror, upright));
    let glass = Material { front: black, transmission: Vec3::ONE, ior: 1.5, ..Material::default() };
    let medium = Medium { fresnel: true, ..Medium::default() };
    let ball = Mesh(Arc::new(shapes::uv_sphere(0.3, 64, 32)));
    world.spawn((Name::new("ball of glass"), ball, glass, medium, Transform::from_xyz(0.6, 0.32, 1.1)));
    let aside = Transform::from_xyz(2.6, 1.5, 2.6).looking_at(DVec3::new(-0.3, 0.5, -1.0), DVec3::Y);
    let camera = Camera { projection: Projection::perspective(0.85), exposure: 1.0 };
    world.spawn((Name::new("camera aside"), camera, aside));
    world
}
