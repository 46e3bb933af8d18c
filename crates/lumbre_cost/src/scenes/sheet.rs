//! A sheet that fills the frame, under one lamp. Without silhouettes, every pixel compares nothing but the
//! arithmetic of lighting.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{Light, Material, SpotCone, Surface};
use lumbre_scene::{Camera, Mesh, Name, Projection, SceneSettings, Transform};

/// The parameters that make the arithmetic hard.
#[derive(Clone, Copy, Debug)]
pub struct Sheet {
    /// Distance of the whole scene from the origin along each axis, in metres.
    pub far: f64,
    /// Size of the scene relative to a sheet of two metres.
    pub scale: f64,
    /// Exponent of the highlight.
    pub shininess: f32,
    /// Height of the lamp over the sheet in metres, before scaling.
    pub height: f64,
    /// Factor on the lamp's light.
    pub brightness: f32,
    /// The lamp's cone towards the middle of the sheet; `None` if it shines everywhere.
    pub cone: Option<SpotCone>,
    /// Angle of a distant light over the horizon in radians; `None` for a lamp.
    pub grazing: Option<f64>,
}

impl Sheet {
    /// The parameters of an easy scene.
    pub const PLAIN: Self = Self {
        far: 0.0,
        scale: 1.0,
        shininess: 20.0,
        height: 0.8,
        brightness: 1.0,
        cone: None,
        grazing: None,
    };
}

/// Creates the sheet, seen obliquely from above.
pub fn sheet(asked: Sheet) -> World {
    let mut world = World::new();
    world.insert_resource(SceneSettings { ambient: Vec3::splat(0.02), ..SceneSettings::default() });
    let at = |point: DVec3| DVec3::splat(asked.far) + point * asked.scale;
    let color = Vec3::new(0.6, 0.45, 0.3);
    let front = Surface {
        ambient: color,
        diffuse: color,
        specular: Vec3::splat(0.4),
        shininess: asked.shininess,
        ..Surface::default()
    };
    let material = Material { front, ..Material::default() };
    let mesh = Mesh(Arc::new(shapes::plane(12.0, 12.0, 4, 4)));
    let place = Transform::from_translation(at(DVec3::ZERO)).with_scale(DVec3::splat(asked.scale));
    world.spawn((Name::new("sheet"), mesh, material, place));
    match asked.grazing {
        Some(angle) => {
            let from = DVec3::new(angle.cos(), angle.sin(), 0.0);
            let aimed = Transform::from_translation(at(from)).looking_at(at(DVec3::ZERO), DVec3::Z);
            let strength = 0.5 / angle.sin();
            world.spawn((Name::new("light"), Light::directional(Vec3::splat(strength as f32)), aimed));
        }
        None => {
            // The illuminance is the same at any scale and height.
            let reach = asked.height * asked.scale;
            let light = Vec3::splat((0.6 * reach * reach) as f32 * asked.brightness);
            let lamp = asked.cone.map_or_else(|| Light::point(light), |cone| Light::spot(light, cone));
            let above = Transform::from_translation(at(DVec3::Y * asked.height));
            let place = above.looking_at(at(DVec3::ZERO), DVec3::Z);
            world.spawn((Name::new("lamp"), lamp, place));
        }
    }
    let eye =
        Transform::from_translation(at(DVec3::new(0.0, 1.5, 1.2))).looking_at(at(DVec3::ZERO), DVec3::Y);
    let projection =
        Projection::Perspective { vertical_fov: 0.7, aspect: None, near: 0.01 * asked.scale, far: None };
    world.spawn((Name::new("camera"), Camera { projection, exposure: 1.0 }, eye));
    world
}
