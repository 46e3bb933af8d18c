//! Cases of spotlights in whole frames, compared with the closed form at every pixel; and the warnings about cones
//! between vertices.

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_optics::{Attenuation, Light, Material, Shading, SpotCone, evaluate_light, lambert};
use lumbre_render::{FrameOptions, explain};
use lumbre_scene::{ChildOf, SceneSettings, Transform};
use lumbre_tests::panes::{pane_of, pixel_point};

use crate::adapter::{draw, linear};
use crate::case::Outcome;

crate::cases! {
    "spot cutoff 0, 90, 180; inner = outer; exponent 0, 128; direction 0" {
        a_frame_of_cutoff_0, a_frame_of_cutoff_90, a_frame_of_cutoff_180_turned_away, a_frame_of_a_hard_edge,
        a_frame_of_exponent_128, a_light_under_a_node_of_scale_zero, a_light_under_a_flattened_parent,
    }
    "Gouraud with a spot inside one triangle" { explain_names_the_cone_between_vertices, explain_says_nothing_of_phong }
}

const SIZE: usize = 33;
/// One rounding of f32.
const U: f64 = 5.960_464_477_539_063e-8;

fn spot(cone: SpotCone) -> Light {
    Light { attenuation: Attenuation::NONE, ..Light::spot(Vec3::ONE, cone) }
}

/// Compares every pixel of the pane with f64, for a lamp that ends up at `place` and shines along `axis`. Pixels
/// within a rounding of the cone's edge, where either side is correct, are left out; a smooth edge has none of
/// them.
fn against_closed_form(
    world: &mut World,
    light: &Light,
    place: DVec3,
    axis: DVec3,
    bound: f64,
    because: &'static str,
) -> Outcome {
    let (pixels, _) = draw(world, SIZE as u32, SIZE as u32, &linear());
    let mut pairs = Vec::new();
    for (at, pixel) in pixels.iter().enumerate() {
        let point = pixel_point(at % SIZE, at / SIZE, SIZE);
        let sample = evaluate_light(light, place, axis, point);
        let edge = light.spot.map_or(2.0, |cone| cone.cosines().outer);
        let smooth = matches!(light.spot, Some(SpotCone::Smooth { .. }));
        if smooth || (-sample.direction.dot(axis) - edge).abs() > 16.0 * U {
            pairs.push((sample.spot * lambert(DVec3::Z, sample.direction), pixel.x));
        }
    }
    assert!(pairs.len() > SIZE * SIZE * 9 / 10, "{} pixels", pairs.len());
    Outcome::worst(pairs, bound, because)
}

fn dark_pane() -> World {
    let mut world = pane_of(Material::matt(Vec3::ONE));
    world.insert_resource(SceneSettings::default());
    world
}

fn frame_of(cone: SpotCone, towards: DVec3, bound: f64, because: &'static str) -> Outcome {
    let mut world = dark_pane();
    let light = spot(cone);
    let place = Transform::from_xyz(0.1, -0.2, 1.0).looking_at(towards, DVec3::Y);
    world.spawn((light.clone(), place));
    let axis = (towards - place.translation).normalize();
    against_closed_form(&mut world, &light, place.translation, axis, bound, because)
}

fn a_frame_of_cutoff_0() -> Outcome {
    let cone = SpotCone::Exponent { cutoff: 0.0, exponent: 0.0 };
    frame_of(cone, DVec3::new(0.1, -0.2, 0.0), 0.0, "a cone without an inside: black, on its axis too")
}

fn a_frame_of_cutoff_90() -> Outcome {
    let cone = SpotCone::Exponent { cutoff: std::f32::consts::FRAC_PI_2, exponent: 2.0 };
    // The light's own plane crosses the pane.
    frame_of(
        cone,
        DVec3::new(1.0, 0.0, 0.7),
        60.0 * U,
        "(cos a)^2 n.l before the light's plane, 0 behind; 60 roundings",
    )
}

fn a_frame_of_cutoff_180_turned_away() -> Outcome {
    let cone = SpotCone::Exponent { cutoff: std::f32::consts::PI, exponent: 7.0 };
    frame_of(cone, DVec3::new(0.0, 0.0, 9.0), 30.0 * U, "everywhere, behind it too, as without a cone: n.l")
}

fn a_frame_of_a_hard_edge() -> Outcome {
    let cone = SpotCone::Smooth { inner: 0.4, outer: 0.4 };
    // A cosine is off by 12 u, over a width of .001, and the square doubles that.
    frame_of(
        cone,
        DVec3::new(0.0, 0.1, 0.0),
        2.0 * 12.0 * U / 0.001,
        "the least width of .001: 12 u of the cosine over it, twice",
    )
}

fn a_frame_of_exponent_128() -> Outcome {
    let cone = SpotCone::Exponent { cutoff: 1.0, exponent: 128.0 };
    frame_of(
        cone,
        DVec3::new(0.0, 0.1, 0.0),
        1.6e-4,
        "safe_pow's 4.2e-5 at n = 128, and 128 times a cosine's 12 u",
    )
}

fn a_light_under_a_node_of_scale_zero() -> Outcome {
    let mut world = dark_pane();
    let light = spot(SpotCone::Exponent { cutoff: 0.5, exponent: 1.0 });
    world.spawn((light.clone(), Transform::from_xyz(0.1, 0.2, 1.0).with_scale(DVec3::ZERO)));
    let place = DVec3::new(0.1, 0.2, 1.0);
    against_closed_form(
        &mut world,
        &light,
        place,
        DVec3::NEG_Z,
        60.0 * U,
        "an axis that is scaled away is -Z, as documented",
    )
}

fn a_light_under_a_flattened_parent() -> Outcome {
    let mut world = dark_pane();
    let light = spot(SpotCone::Exponent { cutoff: 0.9, exponent: 1.0 });
    // Flattened along z, the parent keeps the part of the axis in its xy plane: along its own x, which points at
    // the pane.
    let parent = Transform::from_xyz(0.0, 0.0, 1.0)
        .with_rotation(glam::DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2))
        .with_scale(DVec3::new(1.0, 1.0, 0.0));
    let parent = world.spawn(parent).id();
    let turn = glam::DQuat::from_rotation_y(-0.9);
    let child = world.spawn((light.clone(), Transform::from_rotation(turn), ChildOf(parent))).id();
    draw(&mut world, 1, 1, &linear());
    let axis = world.get::<lumbre_scene::GlobalTransform>(child).unwrap().forward();
    // The parent's x is -z of the world, and what remains of (sin .9, 0, -cos .9) is its first component.
    assert!((axis - DVec3::NEG_Z).length() < 1e-12, "{axis}");
    against_closed_form(
        &mut world,
        &light,
        DVec3::Z,
        DVec3::NEG_Z,
        60.0 * U,
        "what is left of the axis, made unit: -Z here",
    )
}

fn explained(shading: Shading) -> String {
    let mut world = dark_pane();
    world.insert_resource(SceneSettings { shading, ..SceneSettings::default() });
    let light = spot(SpotCone::Exponent { cutoff: 0.3, exponent: 0.0 });
    world.spawn((bevy_ecs::name::Name::new("desk lamp"), light, Transform::from_xyz(0.0, 0.0, 1.0)));
    draw(&mut world, 1, 1, &linear());
    let text = explain(&mut world, &FrameOptions::default(), 64, 64).unwrap().to_text();
    text.lines().filter(|line| line.contains("cone")).collect::<Vec<_>>().join("; ")
}

fn explain_names_the_cone_between_vertices() -> Outcome {
    Outcome::text("desk lamp", explained(Shading::Gouraud))
}

fn explain_says_nothing_of_phong() -> Outcome {
    let said = explained(Shading::Phong);
    Outcome::text("no cone falls between", said)
}
