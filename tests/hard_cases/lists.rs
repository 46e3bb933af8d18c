//! Cases of the lists of lights per object, used in place of clusters: objects at, around or behind the camera,
//! lights at the end of their range, empty lists, and ten thousand lights.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{Attenuation, Light, Material, evaluate_light, lambert};
use lumbre_render::{FrameOptions, FrameReport, LightLists};
use lumbre_scene::{Camera, Hidden, Mesh, Projection, SceneSettings, Transform};
use lumbre_tests::panes::{orthographic, pane, pane_of, pixel_point};

use crate::adapter::{Canvas, draw, linear};
use crate::case::Outcome;

crate::cases! {
    "lists of lights: around, beside and behind the camera, at the end of a range, empty" {
        an_object_around_the_camera, an_object_in_the_cameras_plane, an_object_behind_the_camera,
        a_list_ends_where_the_range_does, the_last_tenth_of_a_range, an_empty_list_beside_full_ones,
        lists_while_objects_come_and_go,
    }
    "0, 1, 10 000 lights; all in one place; all behind the camera; a light larger than the world" {
        ten_thousand_lights_in_a_thousand_different_lists, the_length_of_those_lists,
        ten_thousand_lights_half_of_them_too_far,
    }
}

/// One rounding of f32.
const U: f64 = 5.960_464_477_539_063e-8;

/// Options that use lists per object where the frame would use those of clusters.
fn by_objects() -> FrameOptions {
    FrameOptions { light_lists: LightLists::Objects, ..linear() }
}

fn grey(color: DVec3) -> f64 {
    color.element_sum() / 3.0
}

fn lens(vertical_fov: f64) -> Camera {
    let projection = Projection::Perspective { vertical_fov, aspect: None, near: 1e-3, far: None };
    Camera { projection, exposure: 1.0 }
}

fn white() -> Material {
    Material { double_sided: true, ..Material::matt(Vec3::ONE) }
}

fn lamp(range: f32) -> Light {
    Light { attenuation: Attenuation { range, ..Attenuation::NONE }, ..Light::point(Vec3::ONE) }
}

fn an_object_around_the_camera() -> Outcome {
    // The camera is at the centre of a box, at depth 0. The lamp is there too, so that n.l is 1 straight ahead on
    // all six sides.
    let mut world = World::new();
    world.spawn((Mesh(Arc::new(shapes::cuboid(Vec3::ONE, 1))), white()));
    world.spawn((lamp(f32::INFINITY), Transform::IDENTITY));
    let eye = world.spawn((lens(0.02), Transform::IDENTITY)).id();
    let mut canvas = Canvas::new(9, 9);
    let pairs: Vec<_> = [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z]
        .into_iter()
        .map(|ahead| {
            world.entity_mut(eye).insert(Transform::IDENTITY.looking_at(ahead, DVec3::new(0.3, 0.5, 0.7)));
            (1.0, grey(canvas.draw(&mut world, &linear()).0[40]))
        })
        .collect();
    Outcome::worst(pairs, 30.0 * U, "k_d L n.l on each of six walls, from within: 30 roundings")
}

fn an_object_in_the_cameras_plane() -> Outcome {
    // The eye is in the pane's plane, so the pane itself is not visible, and looks at a wall.
    let mut world = pane_of(Material::matt(Vec3::splat(0.25)));
    let turn = Transform::from_xyz(0.0, 0.0, 2.0).looking_at(DVec3::new(1.0, 0.0, 2.0), DVec3::Y);
    world.spawn((Mesh(Arc::new(pane())), Material { double_sided: true, ..Material::matt(Vec3::ONE) }, turn));
    let eye = world.query_filtered::<Entity, With<Camera>>().single(&world).unwrap();
    world.entity_mut(eye).insert((lens(0.4), Transform::from_xyz(0.0, 0.0, 2.0)));
    world.spawn((lamp(f32::INFINITY), Transform::from_xyz(0.0, 0.0, -1.0)));
    let (pixels, _) = draw(&mut world, 10, 10, &linear());
    Outcome::worst(
        pixels.iter().map(|pixel| (0.25, grey(*pixel))),
        0.0,
        "edge on it has no area: the wall behind, k_a I_a",
    )
}

fn behind() -> (Vec<DVec3>, FrameReport) {
    let mut world = pane_of(Material::default());
    let entity = world.query_filtered::<Entity, With<Mesh>>().single(&world).unwrap();
    world.entity_mut(entity).insert(Transform::from_xyz(0.0, 0.0, 9.0));
    world.spawn((lamp(f32::INFINITY), Transform::IDENTITY));
    let background = Vec3::splat(0.125);
    world.insert_resource(SceneSettings { background, ambient: Vec3::ONE, ..SceneSettings::default() });
    draw(&mut world, 9, 9, &linear())
}

fn an_object_behind_the_camera() -> Outcome {
    let (pixels, report) = behind();
    assert_eq!((report.statistics.objects, report.statistics.objects_outside), (0, 1));
    Outcome::worst(
        pixels.iter().map(|pixel| (0.125, grey(*pixel))),
        0.0,
        "it is left out, lists and all: the background",
    )
}

fn a_list_ends_where_the_range_does() -> Outcome {
    let mut world = pane_of(Material::matt(Vec3::ONE));
    // The range is the distance of 4 m to the nearest point of the pane, and the float before and after.
    let mut lists = Vec::new();
    let lamp_entity = world.spawn(Transform::from_xyz(0.0, 0.0, 4.0)).id();
    for range in [4f32.next_down(), 4.0, 4f32.next_up()] {
        world.entity_mut(lamp_entity).insert(lamp(range));
        lists.push(f64::from(draw(&mut world, 9, 9, &by_objects()).1.statistics.lights_per_object));
    }
    Outcome::worst(
        [0.0, 0.0, 1.0].into_iter().zip(lists),
        0.0,
        "lights in the list one float below, at and above its range",
    )
}

fn the_last_tenth_of_a_range() -> Outcome {
    let mut world = pane_of(Material::matt(Vec3::ONE));
    world.insert_resource(SceneSettings::default());
    let light = lamp(4.1);
    let place = DVec3::new(0.0, 0.0, 4.0);
    world.spawn((light.clone(), Transform::from_translation(place)));
    let (pixels, _) = draw(&mut world, 33, 33, &linear());
    let pairs = pixels.iter().enumerate().map(|(at, pixel)| {
        let point = pixel_point(at % 33, at / 33, 33);
        let sample = evaluate_light(&light, place, DVec3::NEG_Z, point);
        (sample.attenuation * lambert(DVec3::Z, sample.direction), grey(*pixel))
    });
    Outcome::worst(
        pairs.collect::<Vec<_>>(),
        60.0 * U,
        "f64's 1 - (d/r)^4 times n.l: 28 u, and 2 u of the point times its slope of 4",
    )
}

fn an_empty_list_beside_full_ones() -> Outcome {
    // Three panes in a row, with lamps of a short range over the outer two.
    let mut world = World::new();
    let mesh = Arc::new(pane());
    let narrow = DVec3::new(0.2, 1.0, 1.0);
    for x in [-0.8, 0.0, 0.8] {
        let place = Transform::from_xyz(x, 0.0, 0.0).with_scale(narrow);
        world.spawn((Mesh(Arc::clone(&mesh)), Material::matt(Vec3::ONE), place));
    }
    let mut lamps = Vec::new();
    for (x, count) in [(-0.8, 3), (0.8, 5)] {
        for _ in 0..count {
            let place = DVec3::new(x, 0.0, 0.25);
            world.spawn((lamp(0.5), Transform::from_translation(place)));
            lamps.push(place);
        }
    }
    world.spawn(orthographic());
    let (pixels, report) = draw(&mut world, 35, 35, &by_objects());
    assert!((report.statistics.lights_per_object - 8.0 / 3.0).abs() < 1e-6);
    let pairs = pixels.iter().enumerate().filter_map(|(at, pixel)| {
        let point = pixel_point(at % 35, at / 35, 35);
        // Inside a pane, by more than a rounding.
        let from_middle = [-0.8, 0.0, 0.8].map(|x| (point.x - x).abs()).into_iter().fold(f64::MAX, f64::min);
        (from_middle < 0.199).then(|| (lit(&lamp(0.5), &lamps, point), grey(*pixel)))
    });
    let pairs: Vec<_> = pairs.collect();
    assert!(pairs.len() > 500 && pairs.iter().any(|(expected, _)| *expected > 1.0));
    Outcome::worst(
        pairs,
        5.0 * 100.0 * U,
        "0 in the middle, the sum over 3 and 5 lamps beside it; 100 u of each (slope 16/m)",
    )
}

/// The closed form: the sum of n.l times the distance factor.
fn lit(light: &Light, places: &[DVec3], point: DVec3) -> f64 {
    let color = f64::from(light.diffuse.x);
    places
        .iter()
        .map(|place| {
            let sample = evaluate_light(light, *place, DVec3::NEG_Z, point);
            color * sample.attenuation * lambert(DVec3::Z, sample.direction)
        })
        .sum()
}

fn lists_while_objects_come_and_go() -> Outcome {
    // The frame does not depend on the lists of earlier frames: objects are hidden and shown, lights switched, and
    // the last frame equals the first.
    let mut world = World::new();
    let mesh = Arc::new(pane());
    let objects: Vec<Entity> = (0..8)
        .map(|i| {
            let place = Transform::from_xyz(0.25 * f64::from(i) - 0.875, 0.0, 0.0)
                .with_scale(DVec3::new(0.125, 1.0, 1.0));
            world.spawn((Mesh(Arc::clone(&mesh)), Material::matt(Vec3::ONE), place)).id()
        })
        .collect();
    let lights: Vec<Entity> = (0..16)
        .map(|i| world.spawn((lamp(0.4), Transform::from_xyz(0.125 * f64::from(i) - 0.94, 0.0, 0.2))).id())
        .collect();
    world.spawn(orthographic());
    let mut canvas = Canvas::new(32, 32);
    let first = canvas.draw(&mut world, &linear()).0;
    for step in 0..8 {
        world.entity_mut(objects[step]).insert(Hidden);
        world.get_mut::<Light>(lights[2 * step]).unwrap().enabled = false;
        canvas.draw(&mut world, &linear());
        if step % 2 == 0 {
            world.entity_mut(objects[step]).remove::<Hidden>();
        }
    }
    for (object, light) in objects.into_iter().zip(lights.into_iter().step_by(2)) {
        world.entity_mut(object).remove::<Hidden>();
        world.get_mut::<Light>(light).unwrap().enabled = true;
    }
    let last = canvas.draw(&mut world, &linear()).0;
    let changed = first.iter().zip(&last).filter(|(a, b)| a != b).count();
    assert!(first.iter().any(|pixel| grey(*pixel) > 0.5));
    Outcome::number(0.0, changed as f64, 0.0, "pixels that differ from the first frame, bit for bit")
}

const STRIPS: u32 = 1000;
const LAMPS: u32 = 10_000;
const REACH: f32 = 0.25;

fn strip(number: u32) -> f64 {
    -1.0 + 2.0 * (f64::from(number) + 0.5) / f64::from(STRIPS)
}

/// A pane cut into a thousand strips, and ten thousand lamps of a short range over it, so that no two strips have
/// the same list.
fn strips() -> (World, Vec<DVec3>, Light) {
    let mut world = World::new();
    let mesh = Arc::new(pane());
    for number in 0..STRIPS {
        let place = Transform::from_xyz(strip(number), 0.0, 0.0).with_scale(DVec3::new(
            1.0 / f64::from(STRIPS),
            1.0,
            1.0,
        ));
        world.spawn((Mesh(Arc::clone(&mesh)), Material::matt(Vec3::ONE), place));
    }
    let light = Light { diffuse: Vec3::splat(1e-3), ..lamp(REACH) };
    // Points of a lattice by the golden ratio: evenly spread and unordered.
    let places: Vec<DVec3> = (0..LAMPS)
        .map(|i| {
            let turn = (f64::from(i) * 0.618_033_988_749_895).fract();
            DVec3::new(3.0 * (f64::from(i) + 0.5) / f64::from(LAMPS) - 1.5, 2.0 * turn - 1.0, 0.1)
        })
        .collect();
    for place in &places {
        world.spawn((light.clone(), Transform::from_translation(*place)));
    }
    world.spawn(orthographic());
    (world, places, light)
}

fn ten_thousand_lights_in_a_thousand_different_lists() -> Outcome {
    let (mut world, places, light) = strips();
    let (pixels, report) = draw(&mut world, 24, 24, &linear());
    assert_eq!((report.statistics.objects, report.statistics.lights), (STRIPS as usize, LAMPS));
    let pairs = pixels
        .iter()
        .enumerate()
        .map(|(at, pixel)| (lit(&light, &places, pixel_point(at % 24, at / 24, 24)), grey(*pixel)));
    // About 300 lamps of 10^-3 reach a point, each off by 60 u of its window and by 2 u of the point's position
    // times a slope of 16 per metre.
    let pairs: Vec<_> = pairs.collect();
    assert!(pairs.iter().any(|(expected, _)| *expected > 0.05), "{pairs:?}");
    Outcome::worst(
        pairs,
        300.0 * 1e-3 * 100.0 * U,
        "the closed-form sum at each pixel: 300 lamps of 1e-3, 100 u each",
    )
}

fn the_length_of_those_lists() -> Outcome {
    let (mut world, places, _) = strips();
    let (_, report) = draw(&mut world, 1, 1, &by_objects());
    let half_width = 1.0 / f64::from(STRIPS);
    let reached = |number: u32| {
        let lamps = places.iter().filter(|place| {
            let x = ((place.x - strip(number)).abs() - half_width).max(0.0);
            x.hypot(place.z) < f64::from(REACH)
        });
        lamps.count()
    };
    let expected = (0..STRIPS).map(reached).sum::<usize>() as f64 / f64::from(STRIPS);
    // The mean is reported in f32.
    Outcome::number(
        expected,
        report.statistics.lights_per_object.into(),
        expected * 4.0 * U,
        "lamps within range of each strip's box, counted; the mean in f32",
    )
}

fn ten_thousand_lights_half_of_them_too_far() -> Outcome {
    let mut world = pane_of(Material::matt(Vec3::ONE));
    world.insert_resource(SceneSettings::default());
    let light = Light { diffuse: Vec3::splat(1e-4), ..lamp(2.0) };
    for number in 0..LAMPS {
        let z = if number % 2 == 0 { 1.0 } else { 2.5 };
        world.spawn((light.clone(), Transform::from_xyz(0.0, 0.0, z)));
    }
    let (pixels, report) = draw(&mut world, 9, 9, &by_objects());
    assert_eq!(report.statistics.lights_per_object, 5000.0);
    // 1 - (1/2)^4 each, n.l = 1.
    let expected = 5000.0 * f64::from(1e-4f32) * (1.0 - 0.0625);
    Outcome::number(
        expected,
        grey(pixels[40]),
        expected * 5000.0 * U,
        "5000 (1 - 1/16) 1e-4; as many sums, half a unit each",
    )
}
