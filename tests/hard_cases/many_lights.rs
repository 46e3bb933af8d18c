//! Cases of many lights: none, one, ten thousand; behind the camera; larger than the world; exactly at their range.

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_optics::{Attenuation, Light, Material};
use lumbre_render::{FrameOptions, LightLists};
use lumbre_scene::{Camera, Mesh, Projection, SceneSettings, Transform};
use lumbre_tests::panes::{pane, pane_of};

use crate::adapter::{draw, linear};
use crate::case::Outcome;

crate::cases! {
    "0, 1, 10 000 lights; all in one place; all behind the camera; a light larger than the world" {
        no_light, one_light, ten_thousand_lights_in_one_place, ten_thousand_lights_behind_the_camera,
        a_light_larger_than_the_world, a_light_exactly_at_its_range, ten_thousand_lights_on_a_thousand_objects,
    }
    "lists of lights: around, beside and behind the camera, at the end of a range, empty" { an_object_across_the_cameras_plane }
}

fn grey(color: DVec3) -> f64 {
    color.element_sum() / 3.0
}

fn dark_pane() -> World {
    let mut world = pane_of(Material::matt(Vec3::ONE));
    world.insert_resource(SceneSettings::default());
    world
}

fn worst(world: &mut World, expected: f64, bound: f64, because: &'static str) -> Outcome {
    let (pixels, _) = draw(world, 9, 9, &linear());
    Outcome::worst(pixels.iter().map(|pixel| (expected, grey(*pixel))).collect::<Vec<_>>(), bound, because)
}

fn above() -> Transform {
    Transform::from_xyz(0.0, 0.0, 1.0).looking_at(DVec3::ZERO, DVec3::Y)
}

fn no_light() -> Outcome {
    worst(&mut dark_pane(), 0.0, 0.0, "nothing shines")
}

fn one_light() -> Outcome {
    let mut world = dark_pane();
    world.spawn((Light::directional(Vec3::ONE), above()));
    worst(&mut world, 1.0, 3e-7, "k_d L_d n.l: a few roundings")
}

fn ten_thousand_lights_in_one_place() -> Outcome {
    let mut world = dark_pane();
    for _ in 0..10_000 {
        world.spawn((Light::directional(Vec3::splat(1e-4)), above()));
    }
    worst(&mut world, 1.0, 10_000.0 * 6e-8, "10,000 sums, half an ulp each")
}

fn ten_thousand_lights_behind_the_camera() -> Outcome {
    let mut world = dark_pane();
    let attenuation = Attenuation { range: 3.0, ..Attenuation::NONE };
    for number in 0..10_000 {
        let place = Transform::from_xyz(f64::from(number % 100) * 0.1, f64::from(number / 100) * 0.1, 9.0);
        world.spawn((Light { attenuation, ..Light::point(Vec3::ONE) }, place));
    }
    let by_objects = FrameOptions { light_lists: LightLists::Objects, ..linear() };
    let (pixels, report) = draw(&mut world, 9, 9, &by_objects);
    assert_eq!((report.statistics.lights, report.statistics.lights_per_object), (10_000, 0.0));
    Outcome::worst(
        pixels.iter().map(|pixel| (0.0, grey(*pixel))).collect::<Vec<_>>(),
        0.0,
        "none reaches the pane, and none is asked",
    )
}

fn a_light_larger_than_the_world() -> Outcome {
    let mut world = dark_pane();
    let attenuation = Attenuation { range: 1e12, ..Attenuation::NONE };
    world.spawn((Light { attenuation, ..Light::point(Vec3::ONE) }, Transform::from_xyz(0.0, 0.0, 1e9)));
    worst(&mut world, 1.0, 1e-6, "its window is 1 - 1e-12 there, n.l is 1")
}

fn a_light_exactly_at_its_range() -> Outcome {
    let mut world = dark_pane();
    let attenuation = Attenuation { range: 4.0, ..Attenuation::NONE };
    world.spawn((Light { attenuation, ..Light::point(Vec3::ONE) }, Transform::from_xyz(0.0, 0.0, 4.0)));
    let (pixels, _) = draw(&mut world, 9, 9, &linear());
    Outcome::number(0.0, grey(pixels[40]), 5e-7, "1 - (d/range)^4 at d = range: eight roundings of 1")
}

fn ten_thousand_lights_on_a_thousand_objects() -> Outcome {
    // Without sharing there would be ten million list entries; objects that the same lights reach share one list.
    let mut world = World::new();
    let mesh = std::sync::Arc::new(pane());
    for number in 0..1000 {
        let at = Transform::from_xyz(0.0, 0.0, -1e-3 * f64::from(number));
        world.spawn((Mesh(mesh.clone()), Material::matt(Vec3::ONE), at));
    }
    for _ in 0..10_000 {
        world.spawn((Light::directional(Vec3::splat(1e-4)), above()));
    }
    world.spawn(lumbre_tests::panes::orthographic());
    let (pixels, report) = draw(&mut world, 3, 3, &linear());
    assert_eq!(report.statistics.objects, 1000);
    Outcome::worst(
        pixels.iter().map(|pixel| (1.0, grey(*pixel))).collect::<Vec<_>>(),
        6e-4,
        "10,000 sums; shared lists, no overflow",
    )
}

fn an_object_across_the_cameras_plane() -> Outcome {
    // A floor that extends under the camera, lit by a lamp behind it: the visible part is lit by the lamp.
    let mut world = World::new();
    let floor = std::sync::Arc::new(lumbre_mesh::shapes::plane(40.0, 40.0, 1, 1));
    world.spawn((Mesh(floor), Material::matt(Vec3::ONE)));
    let lamp = DVec3::new(0.0, 2.0, 3.0);
    world.spawn((
        Light { attenuation: Attenuation::NONE, ..Light::point(Vec3::ONE) },
        Transform::from_translation(lamp),
    ));
    let projection = Projection::Perspective { vertical_fov: 0.02, aspect: None, near: 1e-3, far: None };
    let eye = DVec3::new(0.0, 1.0, 0.0);
    let target = DVec3::new(0.0, 0.0, -2.0);
    let place = Transform::from_translation(eye).looking_at(target, DVec3::Y);
    world.spawn((Camera { projection, exposure: 1.0 }, place));
    let expected = ((lamp - target).normalize()).y;
    let (pixels, _) = draw(&mut world, 9, 9, &linear());
    Outcome::number(expected, grey(pixels[40]), 1e-5, "n.l in closed form; exact lists know no slices")
}
