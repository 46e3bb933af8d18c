//! The spheres of document \[M\]'s two tables: 1.1, the three shadings, and 2.1, one coefficient after the other.
//!
//! The tables print coefficients and the number of polygons. Light, colours and camera are ours, with the same
//! setting for all pictures: a distant white light from the upper left, ambient light, a ball of one colour and
//! white highlights.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{Light, Material, Shading, Surface};
use lumbre_scene::{Camera, Mesh, Projection, SceneSettings, Transform};

/// I_a in each channel.
pub const AMBIENT_LIGHT: f32 = 0.5;
/// I_p in each channel. The light is distant, so there is no attenuation: f_att = 1.
pub const LIGHT: f32 = 0.625;
/// O_d, with few binary digits so that its products with the coefficients are exact. O_s is white.
pub const COLOR: Vec3 = Vec3::new(0.25, 0.5, 0.875);
/// k_a of the columns of table 2.1.
pub const AMBIENT: [f32; 3] = [0.25, 0.50, 0.75];
/// k_d from the second row on.
pub const DIFFUSE: f32 = 0.40;
/// k_s in the third row.
pub const SPECULAR: f32 = 1.0;
/// n of the columns in the third row.
pub const EXPONENTS: [f32; 3] = [3.0, 10.0, 100.0];
/// Radiance behind the balls.
pub const BACKGROUND: Vec3 = Vec3::splat(0.03125);
/// Distance of the camera from the centre of the ball of radius 1, in metres.
pub const EYE: f64 = 6.0;

/// Returns the unit vector towards the light.
pub fn toward_light() -> DVec3 {
    DVec3::new(-1.0, 1.0, 2.0).normalize()
}

/// Creates a case of table 2.1: `row` 0 has ambient, 1 also diffuse, and 2 also specular reflection; `column` is 0
/// to 2. The ball has enough polygons to look round.
pub fn table_2_1(row: usize, column: usize) -> World {
    let front = Surface {
        ambient: COLOR * AMBIENT[column],
        diffuse: if row >= 1 { COLOR * DIFFUSE } else { Vec3::ZERO },
        specular: if row >= 2 { Vec3::splat(SPECULAR) } else { Vec3::ZERO },
        emission: Vec3::ZERO,
        shininess: EXPONENTS[column],
    };
    lit_ball(shapes::uv_sphere(1.0, 128, 64), front, Shading::Phong)
}

/// Creates a case of table 1.1: the sphere of 990 polygons and 497 vertices.
pub fn table_1_1(shading: Shading) -> World {
    let front = Surface {
        ambient: COLOR * AMBIENT[0],
        diffuse: COLOR * 0.75,
        specular: Vec3::splat(0.5),
        emission: Vec3::ZERO,
        shininess: 40.0,
    };
    lit_ball(shapes::uv_sphere(1.0, 33, 16), front, shading)
}

fn lit_ball(mesh: TriangleMesh, front: Surface, shading: Shading) -> World {
    let mut world = World::new();
    world.spawn((Mesh(Arc::new(mesh)), Material { front, ..Material::default() }));
    let place = Transform::from_translation(10.0 * toward_light()).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Light::directional(Vec3::splat(LIGHT)), place));
    // The ball fills nine tenths of the height.
    let vertical_fov = 2.0 * ((1.0 / EYE).asin().tan() / 0.9).atan();
    let projection = Projection::Perspective { vertical_fov, aspect: None, near: 0.5, far: None };
    world.spawn((Camera { projection, exposure: 1.0 }, Transform::from_xyz(0.0, 0.0, EYE)));
    world.insert_resource(SceneSettings {
        ambient: Vec3::splat(AMBIENT_LIGHT),
        background: BACKGROUND,
        shading,
        ..SceneSettings::default()
    });
    world
}
