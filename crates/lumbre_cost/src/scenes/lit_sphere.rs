//! A sphere that fills the frame under a dome of lamps, for what the documents say of viewers, lamps and
//! highlights: each may be near, far or absent.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes::tetrahedral_sphere;
use lumbre_optics::{Light, Material, Surface};
use lumbre_scene::{Camera, Mesh, Name, Projection, SceneSettings, Transform};

/// The parameters of the scene. Distances are from the centre of the sphere, in radii.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LitSphere {
    /// Distance of the eye. The sphere fills the frame at any distance.
    pub eye: f64,
    /// Whether reflections are computed for the eye's position, or for its direction from the centre.
    pub local_viewer: bool,
    /// Distance of the lamps.
    pub lamps: f64,
    /// Whether the lamps are replaced by distant sources with the same light at the centre.
    pub distant: bool,
    /// Whether there are highlights.
    pub highlights: bool,
}

/// Number of lamps, so that evaluating their light takes most of a frame.
pub const LAMPS: u32 = 16;

/// Subdivision depth, fine enough to hide the facets.
const DEPTH: u32 = 5;

/// Creates the scene.
pub fn lit_sphere(asked: LitSphere) -> World {
    let mut world = World::new();
    let local_viewer = asked.local_viewer;
    world.insert_resource(SceneSettings { local_viewer, ..SceneSettings::default() });
    let specular = if asked.highlights { Vec3::splat(0.5) } else { Vec3::ZERO };
    let diffuse = Vec3::new(0.25, 0.4, 0.8);
    let front = Surface { ambient: diffuse, diffuse, specular, shininess: 40.0, ..Surface::default() };
    let mesh = Mesh(Arc::new(tetrahedral_sphere(1.0, DEPTH, false)));
    world.spawn((Name::new("sphere"), mesh, Material { front, ..Material::default() }));
    let each = Vec3::splat(3.0 / LAMPS as f32);
    for number in 0..LAMPS {
        let toward = on_the_dome(number);
        let place = Transform::from_translation(toward * asked.lamps);
        let light = match asked.distant {
            true => Light::directional(each),
            false => Light { radius: 0.0, ..Light::point(each * (asked.lamps * asked.lamps) as f32) },
        };
        let up = if toward.y.abs() > 0.9 { DVec3::X } else { DVec3::Y };
        world.spawn((Name::new(format!("lamp {number}")), light, place.looking_at(DVec3::ZERO, up)));
    }
    let eye = Transform::from_xyz(0.0, 0.0, asked.eye);
    let projection = Projection::perspective(2.0 * asked.eye.recip().asin());
    world.spawn((Name::new("camera"), Camera { projection, exposure: 1.0 }, eye));
    world
}

/// Returns the direction of a lamp: evenly spread over the half of the sphere that the eye sees, by the golden
/// angle.
fn on_the_dome(number: u32) -> DVec3 {
    let z = (f64::from(number) + 0.5) / f64::from(LAMPS);
    let around = f64::from(number) * std::f64::consts::PI * (3.0 - 5.0f64.sqrt());
    let side = (1.0 - z * z).sqrt();
    DVec3::new(side * around.cos(), side * around.sin(), z)
}
