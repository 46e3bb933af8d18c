//! Balls of few and many triangles, near and far, matt and glossy, on a floor. Some of them need Phong
//! shading and some do not, which is what shading by need decides.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes::{plane, tetrahedral_sphere};
use lumbre_optics::{Light, Material, Surface};
use lumbre_scene::{Camera, Mesh, Name, Projection, SceneSettings, Transform};

/// Subdivision depths of the balls in a row, from left to right: 256 to 4,096 triangles.
const DEPTHS: std::ops::RangeInclusive<u32> = 3..=5;
/// Name, height and depth of the centre of each row in metres, and the distance between its balls.
const ROWS: [(&str, f64, f64, f64); 2] = [("near", 0.5, 0.0, 1.1), ("far", 3.0, -9.0, 1.5)];
const RADIUS: f32 = 0.45;

/// Creates the balls under a sun and a weaker light from the other side.
pub fn assorted_balls() -> World {
    let mut world = World::new();
    world.insert_resource(SceneSettings { ambient: Vec3::splat(0.08), ..SceneSettings::default() });
    let floor = Mesh(Arc::new(plane(40.0, 40.0, 4, 4)));
    world.spawn((Name::new("floor"), floor, Material::matt(Vec3::splat(0.5))));
    let matt = Material::matt(Vec3::new(0.3, 0.45, 0.7));
    let shine = Surface { specular: Vec3::splat(0.4), shininess: 30.0, ..matt.front };
    let glossy = Material { front: shine, ..matt.clone() };
    for depth in DEPTHS {
        let ball = Arc::new(tetrahedral_sphere(RADIUS, depth, false));
        let middle = f64::from(*DEPTHS.start() + *DEPTHS.end()) / 2.0;
        for (row, height, z, step) in ROWS {
            for (finish, material, above) in [("matt", &matt, 0.0), ("glossy", &glossy, step)] {
                let x = (f64::from(depth) - middle) * step;
                let place = Transform::from_xyz(x, height + above, z);
                let name = Name::new(format!("{row} {finish} ball of depth {depth}"));
                world.spawn((name, Mesh(ball.clone()), material.clone(), place));
            }
        }
    }
    let sun = Transform::from_xyz(2.0, 3.0, 2.5).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Name::new("sun"), Light::directional(Vec3::splat(0.6)), sun));
    let fill = Transform::from_xyz(-3.0, 1.0, 2.0).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Name::new("fill light"), Light::directional(Vec3::new(0.12, 0.14, 0.18)), fill));
    let eye = Transform::from_xyz(0.0, 1.7, 3.6).looking_at(DVec3::new(0.0, 1.3, 0.0), DVec3::Y);
    let projection = Projection::perspective(0.75);
    world.spawn((Name::new("camera"), Camera { projection, exposure: 1.0 }, eye));
    world
}
