//! Replaces lamps that have a size by many small ones without, for a reference picture: rays to the centres
//! of the small lamps add up to a soft shadow without noise.

use std::f64::consts::{FRAC_PI_2, PI};

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec3};
use lumbre_optics::{Light, LightKind};
use lumbre_scene::{GlobalTransform, Transform, update_transforms};

/// Replaces each lamp that has a size and casts a shadow by `pieces` lamps without a size that share its
/// light, and returns how many lamps were replaced. Global transforms must be up to date.
pub fn take_to_pieces(world: &mut World, pieces: u32) -> usize {
    let mut lamps = world.query::<(Entity, &Light, &GlobalTransform)>();
    let has_size = |light: &Light| match light.kind {
        LightKind::Point => light.radius > 0.0,
        LightKind::Directional => light.angle > 0.0,
        LightKind::Ambient => false,
    };
    let found: Vec<(Entity, Light, GlobalTransform)> = lamps
        .iter(world)
        .filter(|(_, light, _)| light.enabled && light.shadow && has_size(light))
        .map(|(entity, light, place)| (entity, light.clone(), *place))
        .collect();
    for (entity, light, place) in &found {
        let share = (f64::from(pieces)).recip() as f32;
        let piece = Light {
            ambient: light.ambient * share,
            diffuse: light.diffuse * share,
            specular: light.specular * share,
            radius: 0.0,
            angle: 0.0,
            ..light.clone()
        };
        let rotation = place.0.to_scale_rotation_translation().1;
        for number in 0..pieces {
            let transform = match light.kind {
                LightKind::Directional => Transform::IDENTITY
                    .with_rotation(rotation * in_disc(number, pieces, f64::from(light.angle))),
                _ => {
                    let at = place.translation() + f64::from(light.radius) * in_ball(number, pieces);
                    Transform::from_translation(at).with_rotation(rotation)
                }
            };
            world.spawn((piece.clone(), transform));
        }
        if let Some(mut light) = world.get_mut::<Light>(*entity) {
            light.enabled = false;
        }
    }
    update_transforms(world);
    found.len()
}

/// Returns the rotation from the centre of a distant disc with this angular diameter to one of `of` points of
/// Vogel's spiral, which has uniform density.
fn in_disc(number: u32, of: u32, diameter: f64) -> DQuat {
    let part = (f64::from(number) + 0.5) / f64::from(of);
    let (radius, around) = ((0.5 * diameter).tan() * part.sqrt(), f64::from(number) * GOLDEN_ANGLE);
    let direction = DVec3::new(radius * around.cos(), radius * around.sin(), -1.0).normalize();
    DQuat::from_rotation_arc(DVec3::NEG_Z, direction)
}

/// Returns a point in the unit ball. The points' density at the distance ρ from the centre is proportional to
/// 1/√(1 - ρ²), whose integral along any line through the ball is π (Abel's transform of a disc). From every
/// direction they look like a disc of uniform brightness, as a uniformly shining sphere does.
fn in_ball(number: u32, of: u32) -> DVec3 {
    let height = 1.0 - 2.0 * (f64::from(number) + 0.5) / f64::from(of);
    let (side, around) = ((1.0 - height * height).sqrt(), f64::from(number) * GOLDEN_ANGLE);
    // Van der Corput's sequence makes the radii independent of the heights.
    let part = (f64::from(number.reverse_bits()) + 0.5) / 2f64.powi(32);
    distance_within(part) * DVec3::new(side * around.cos(), side * around.sin(), height)
}

/// Returns the ρ within which a fraction of the points lies. The fraction is (2/π) (asin ρ - ρ √(1 - ρ²)),
/// inverted by bisection.
fn distance_within(part: f64) -> f64 {
    // With ρ = sin t it is (2/π) (t - sin t cos t).
    let (mut low, mut high) = (0.0, FRAC_PI_2);
    for _ in 0..60 {
        let middle: f64 = 0.5 * (low + high);
        if (middle - middle.sin() * middle.cos()) * 2.0 / PI < part {
            low = middle;
        } else {
            high = middle;
        }
    }
    (0.5 * (low + high)).sin()
}

/// The golden angle in radians.
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

#[cfg(test)]
mod tests {
    use super::*;

    /// Seen along any axis, the fraction of points within a distance r of the axis is r², as in a uniform
    /// disc.
    #[test]
    fn a_ball_of_points_looks_like_an_even_disc_from_everywhere() {
        let points: Vec<DVec3> = (0..4096).map(|number| in_ball(number, 4096)).collect();
        for axis in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(1.0, -2.0, 0.5).normalize()] {
            for radius in [0.25_f64, 0.5, 0.75, 0.95] {
                let within =
                    points.iter().filter(|point| point.reject_from_normalized(axis).length() < radius);
                let part = within.count() as f64 / 4096.0;
                assert!((part - radius * radius).abs() < 0.02, "{axis} {radius}: {part}");
            }
        }
    }

    #[test]
    fn pieces_have_the_lamps_light_between_them() {
        let mut world = World::new();
        let lamp = Light { radius: 0.2, shadow: true, ..Light::point(glam::Vec3::new(1.0, 2.0, 3.0)) };
        let at = Transform::from_xyz(1.0, 2.0, 3.0);
        world.spawn((lamp.clone(), at, GlobalTransform(at.affine())));
        world.spawn((Light { shadow: false, ..lamp.clone() }, at, GlobalTransform(at.affine())));
        let sun = Light { angle: 0.1, shadow: true, ..Light::directional(glam::Vec3::ONE) };
        world.spawn((sun, at, GlobalTransform(at.affine())));
        assert_eq!(take_to_pieces(&mut world, 32), 2, "what casts no shadow keeps its size");
        let mut lights = world.query::<(&Light, &GlobalTransform)>();
        let (mut sum, mut largest) = (glam::Vec3::ZERO, 0.0_f64);
        for (light, place) in lights.iter(&world).filter(|(light, _)| light.enabled && light.shadow) {
            match light.kind {
                LightKind::Point => {
                    sum += light.diffuse;
                    assert!(place.translation().distance(DVec3::new(1.0, 2.0, 3.0)) <= 0.2);
                }
                _ => largest = largest.max(place.forward().angle_between(DVec3::NEG_Z)),
            }
        }
        assert!((sum - lamp.diffuse).abs().max_element() < 1e-5, "{sum}");
        assert!(largest < 0.05 && largest > 0.045, "{largest}");
    }
}
