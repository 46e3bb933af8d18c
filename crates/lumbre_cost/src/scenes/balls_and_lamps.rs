//! Balls on a floor under many point lamps.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{Light, Material};
use lumbre_scene::{Camera, Mesh, Name, Projection, Transform};

/// The parameters of the scene.
#[derive(Clone, Copy, Debug)]
pub struct BallsAndLamps {
    /// Number of lamps.
    pub lamps: u32,
    /// A lamp ends where it gives a white surface that faces it this radiance. 0 for lamps that do not end.
    pub threshold: f32,
    /// Seed of the lamps' positions and colours.
    pub seed: u32,
}

/// Half the side of the floor, in metres.
const HALF_SIDE: f64 = 18.0;
/// Radiance in its strongest channel that a lamp gives a white surface facing it at a distance of one metre.
const STRENGTH: f32 = 1.0;

/// Creates a floor, 64 balls, lamps at random positions just above the floor, and a camera that sees most of
/// them.
pub fn balls_and_lamps(asked: BallsAndLamps) -> World {
    let mut world = World::new();
    let side = 2.0 * HALF_SIDE as f32;
    let floor = Mesh(Arc::new(shapes::plane(side, side, 16, 16)));
    world.spawn((Name::new("floor"), floor, Material::from_metallic_roughness(Vec3::splat(0.6), 0.0, 0.8)));
    let ball = Arc::new(shapes::uv_sphere(1.0, 24, 13));
    for number in 0..64 {
        let at = DVec3::new(f64::from(number % 8) * 4.0 - 14.0, 1.0, f64::from(number / 8) * 4.0 - 14.0);
        let material = Material::from_metallic_roughness(Vec3::splat(0.8), 0.0, 0.3);
        let name = Name::new(format!("ball {number}"));
        world.spawn((name, Mesh(ball.clone()), material, Transform::from_translation(at)));
    }
    let mut random = Random(u64::from(asked.seed) + 1);
    for number in 0..asked.lamps {
        let place = DVec3::new(
            random.within(-HALF_SIDE, HALF_SIDE),
            random.within(0.2, 2.5),
            random.within(-HALF_SIDE, HALF_SIDE),
        );
        let color = Vec3::from([0, 1, 2].map(|_| random.within(0.2, 1.0) as f32));
        let lamp = Light::point(color / color.max_element() * STRENGTH);
        let lamp = match asked.threshold > 0.0 {
            true => lamp.with_range((STRENGTH / asked.threshold).sqrt()),
            false => lamp,
        };
        world.spawn((Name::new(format!("lamp {number}")), lamp, Transform::from_translation(place)));
    }
    let projection = Projection::perspective(std::f64::consts::FRAC_PI_4);
    let eye = Transform::from_xyz(0.0, 12.0, 24.0).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Name::new("camera"), Camera { projection, exposure: 1.0 }, eye));
    world
}

/// A random number generator with the same numbers on every machine.
struct Random(u64);

impl Random {
    fn within(&mut self, least: f64, most: f64) -> f64 {
        // Knuth's MMIX generator, whose upper bits are the most random.
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        least + (most - least) * ((self.0 >> 11) as f64 / (1_u64 << 53) as f64)
    }
}
