//! Measured costs and contributions of effects, with known answers for how much each contributes to the
//! picture.

#![allow(clippy::unwrap_used, reason = "helpers of tests, which clippy does not count as tests")]

use std::sync::Arc;
use std::time::Duration;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_optics::{AlphaMode, Fog, FogMode, Light, Material, Surface};
use lumbre_render::{FrameOptions, Gpu, RenderError, effect_costs, removable_effects};
use lumbre_scene::{Camera, Census, Mesh, SceneSettings, Transform};

/// A wall that fills the view of the camera, half of whose light is emission and half ambient light.
fn wall(change: impl FnOnce(&mut World, &mut Material)) -> World {
    let mut world = World::new();
    world.insert_resource(SceneSettings { ambient: Vec3::splat(0.25), ..SceneSettings::default() });
    let front = Surface {
        ambient: Vec3::ONE,
        emission: Vec3::splat(0.25),
        diffuse: Vec3::ZERO,
        ..Surface::default()
    };
    let mut material = Material { front, ..Material::default() };
    change(&mut world, &mut material);
    let facing = Transform::from_rotation(glam::DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2));
    world.spawn((Mesh(Arc::new(lumbre_mesh::shapes::plane(100.0, 100.0, 1, 1))), material, facing));
    world.spawn((Camera::default(), Transform::from_xyz(0.0, 0.0, 2.0).looking_at(DVec3::ZERO, DVec3::Y)));
    world
}

#[test]
fn half_of_the_light_is_half_of_the_picture() {
    let gpu = Gpu::headless().unwrap();
    let scene = || {
        wall(|world, material| {
            material.alpha_mode = AlphaMode::Mask { cutoff: 0.5 };
            // Starts too far away to have any effect.
            let fog = Fog { mode: FogMode::Linear { start: 1e6, end: 1e7 }, color: Vec3::ONE };
            world.resource_mut::<SceneSettings>().fog = Some(fog);
            world.spawn((Light::directional(Vec3::ONE), Transform::IDENTITY));
        })
    };
    let effects = removable_effects(&Census::of(&mut scene()), &FrameOptions::default());
    let names: Vec<_> = effects.iter().map(|effect| effect.effect).collect();
    assert_eq!(
        names,
        ["Phong shading", "global ambient", "directional lights", "emission", "alpha mask", "fog"],
        "what the scene does not call for is not taken away"
    );
    let mut again = || Ok::<_, RenderError>((scene(), FrameOptions::default()));
    let cost = effect_costs(&gpu, &mut again, &effects, [32, 32], Duration::ZERO).unwrap();
    assert!(cost.rounds >= 5 && cost.milliseconds > 0.0, "{cost:?}");
    let accounting = cost.accounting.as_ref().unwrap();
    let forward = accounting.passes.iter().find(|pass| pass.pass == "forward").unwrap();
    // One light on each of the wall's pixels. The wall is masked, and nothing hides it.
    assert_eq!(forward.lights.unwrap().tested, 32 * 32);
    assert!(accounting.remainder_ms().is_some());
    for effect in &cost.effects {
        let expected = match effect.effect {
            "global ambient" | "emission" => 0.5,
            _ => 0.0,
        };
        assert!((effect.difference - expected).abs() < 1e-6, "{effect:?}");
        assert!(effect.milliseconds.is_finite() && effect.spread >= 0.0, "{effect:?}");
    }
}
