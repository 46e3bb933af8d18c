//! A shiny sheet under one distant light, seen from where a mirror would show the light: the highlight lies in
//! the middle of the frame at every angle of incidence.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{Light, Lobe, Material, Surface};
use lumbre_scene::{Camera, Mesh, Name, Projection, Transform};

/// The parameters of the highlight.
#[derive(Clone, Copy, Debug)]
pub struct Highlight {
    /// Angle between the light and the sheet's normal in radians.
    pub incidence: f64,
    /// Exponent of the highlight.
    pub shininess: f32,
    /// How the specular coefficient is interpreted.
    pub lobe: Lobe,
}

/// Field of view in radians.
const VERTICAL_FOV: f64 = 0.9;
/// Distance of the eye from the middle of the sheet in metres.
const DISTANCE: f64 = 3.0;

/// Creates the sheet, which reflects nothing but the highlight.
pub fn highlight(asked: Highlight) -> World {
    let mut world = World::new();
    let surface = Surface {
        specular: Vec3::splat(0.6),
        shininess: asked.shininess,
        ..Material::matt(Vec3::ZERO).front
    };
    let material = Material { front: surface, lobe: asked.lobe, ..Material::default() };
    world.spawn((Name::new("sheet"), Mesh(Arc::new(shapes::plane(40.0, 40.0, 1, 1))), material));
    let (sine, cosine) = asked.incidence.sin_cos();
    let light = Transform::from_translation(DVec3::new(sine, cosine, 0.0)).looking_at(DVec3::ZERO, DVec3::Z);
    world.spawn((Name::new("light"), Light::directional(Vec3::ONE), light));
    let mirrored = DVec3::new(-sine, cosine, 0.0) * DISTANCE;
    let eye = Transform::from_translation(mirrored).looking_at(DVec3::ZERO, DVec3::Z);
    world.spawn((
        Name::new("camera"),
        Camera { projection: Projection::perspective(VERTICAL_FOV), exposure: 1.0 },
        eye,
    ));
    world
}
