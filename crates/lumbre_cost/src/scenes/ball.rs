//! A ball in front of black under one distant light: the documents' example of what flat and Gouraud shading
//! lose.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes::{tetrahedral_sphere, uv_sphere};
use lumbre_optics::{Light, Lobe, Material, ReflectionModel, Surface};
use lumbre_scene::{Camera, Mesh, Name, Projection, Quadric, SceneSettings, Transform};

/// The parameters of the ball.
#[derive(Clone, Copy, Debug)]
pub struct Ball {
    /// Number of subdivisions of the initial tetrahedron; the ball has 4^(depth + 1) triangles.
    pub depth: u32,
    /// Exponent of its highlight.
    pub shininess: f32,
    /// Reflection model of its highlight.
    pub reflection: ReflectionModel,
    /// How its specular coefficient is interpreted.
    pub lobe: Lobe,
}

/// Field of view in radians with which the ball of radius 1 fills the frame except for a rim.
const VERTICAL_FOV: f64 = 0.56;

/// Creates the ball as triangles with the normals of the sphere.
pub fn ball(ball: Ball) -> World {
    let mut world = surroundings(ball);
    let mesh = Mesh(Arc::new(tetrahedral_sphere(1.0, ball.depth, false)));
    world.spawn((Name::new("ball"), mesh, material(ball)));
    world
}

/// Creates the ball as the sphere of document \[M\]'s table 1.1: 33 meridians and 16 rings, 990 triangles.
pub fn ball_of_table(ball: Ball) -> World {
    let mut world = surroundings(ball);
    world.spawn((Name::new("ball"), Mesh(Arc::new(uv_sphere(1.0, 33, 16))), material(ball)));
    world
}

/// Creates the ball as an exact sphere for rays. A rasterizer draws a coarse mesh instead.
pub fn exact_ball(ball: Ball) -> World {
    let mut world = surroundings(ball);
    let mesh = Mesh(Arc::new(tetrahedral_sphere(1.0, 2, false)));
    world.spawn((Name::new("ball"), mesh, material(ball), Quadric::sphere(1.0)));
    world
}

fn material(ball: Ball) -> Material {
    let color = Vec3::new(0.25, 0.4, 0.8);
    let front = Surface {
        ambient: color,
        diffuse: color,
        specular: Vec3::splat(0.6),
        shininess: ball.shininess,
        ..Surface::default()
    };
    Material { front, lobe: ball.lobe, ..Material::default() }
}

fn surroundings(ball: Ball) -> World {
    let mut world = World::new();
    // All of the ball is lit, so that it can be distinguished from the background.
    world.insert_resource(SceneSettings {
        ambient: Vec3::splat(0.15),
        reflection: ball.reflection,
        ..SceneSettings::default()
    });
    let above = Transform::from_xyz(1.2, 1.6, 2.0).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Name::new("light"), Light::directional(Vec3::splat(0.8)), above));
    let eye = Transform::from_xyz(0.0, 0.0, 4.0);
    let projection = Projection::perspective(VERTICAL_FOV);
    world.spawn((Name::new("camera"), Camera { projection, exposure: 1.0 }, eye));
    world
}
