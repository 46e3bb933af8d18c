//! The demo level: the light of all its lamps compared with the twin, and the whole picture including textures
//! compared with a golden image.

use bevy_ecs::prelude::*;
use glam::DVec3;
use lumbre_optics::{AlphaMode, Light, Material};
use lumbre_render::{Display, FrameOptions, LightLists};
use lumbre_scene::{Camera, MaterialTextures, Name};
use lumbre_tests::compare::{Difference, compare};
use lumbre_tests::twin::{self, TwinOptions};

use crate::adapter::{draw, linear};

const SIZE: (usize, usize) = (160, 90);

/// Loads the level and keeps one camera.
fn level(camera: &str) -> World {
    let mut world = World::new();
    let path = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/demo.glb"));
    lumbre_scene::load(&mut world, path).unwrap();
    let mut cameras = world.query_filtered::<(Entity, &Name), With<Camera>>();
    let others: Vec<Entity> =
        cameras.iter(&world).filter(|(_, name)| name.as_str() != camera).map(|(entity, _)| entity).collect();
    others.into_iter().for_each(|entity| {
        world.entity_mut(entity).remove::<Camera>();
    });
    world
}

/// Removes what the twin does not support: textures, and blended objects. Mirrors and glass are opaque in both.
fn plain(world: &mut World) {
    let mut seen_through = world.query::<(Entity, &Material)>();
    let gone: Vec<Entity> = seen_through
        .iter(world)
        .filter(|(_, material)| material.alpha_mode == AlphaMode::Blend)
        .map(|(entity, _)| entity)
        .collect();
    gone.into_iter().for_each(|entity| {
        world.despawn(entity);
    });
    let mut textured = world.query_filtered::<Entity, With<MaterialTextures>>();
    let textured: Vec<Entity> = textured.iter(world).collect();
    textured.into_iter().for_each(|entity| {
        world.entity_mut(entity).remove::<MaterialTextures>();
    });
}

fn against_twin(world: &mut World, drawn: &mut World) -> Difference {
    let frame = twin::draw(world, SIZE.0, SIZE.1, TwinOptions::default());
    let options = FrameOptions { mirror_depth: 0, refraction: false, ..linear() };
    let (got, _) = draw(drawn, SIZE.0 as u32, SIZE.1 as u32, &options);
    // Compared inside one object, away from its own edges, and without the lamps, which are far brighter than what
    // they light and would dominate the norm.
    let smooth = |at: usize, center: DVec3| {
        let rows = [at - SIZE.0, at, at + SIZE.0];
        let near = rows.into_iter().flat_map(|row| [row - 1, row, row + 1]);
        near.map(|near| frame.color[near] - center).all(|step| step.abs().max_element() < 0.05)
    };
    let lit: Vec<_> = frame
        .interior(false)
        .into_iter()
        .enumerate()
        .map(|(at, p)| p.filter(|p| p.max_element() < 2.0 && smooth(at, *p)))
        .collect();
    compare(&got.into_iter().map(Some).collect::<Vec<_>>(), &lit)
}

#[test]
fn the_level_agrees_with_the_twin() {
    for camera in ["tour 01", "tour 04", "tour 06"] {
        let (mut world, mut drawn) = (level(camera), level(camera));
        plain(&mut world);
        plain(&mut drawn);
        let difference = against_twin(&mut world, &mut drawn);
        println!("{camera}: {difference:?}");
        assert!(difference.pixels > SIZE.0 * SIZE.1 / 4, "{camera}: {difference:?}");
        // The ball's bound (balls.rs) for sums over 35 lights of radiance up to 2, and positions up to 40 m from
        // the origin, whose f32 rounding (2 um) moves a highlight of n = 500 by that over its width of 1 /
        // sqrt(500) times a metre.
        assert!(difference.largest < 1e-3, "{camera}: {difference:?}");
        assert!(difference.relative_l2 < 1e-4, "{camera}: {difference:?}");
    }
    // Negative control: one of the 35 lights switched off.
    let (mut world, mut drawn) = (level("tour 06"), level("tour 06"));
    plain(&mut world);
    plain(&mut drawn);
    let mut lights = drawn.query::<(&mut Light, &Name)>();
    let (mut light, _) = lights
        .iter_mut(&mut drawn)
        .find(|(_, name)| name.as_str().starts_with("gallery wisp"))
        .expect("the gallery has wisps");
    light.enabled = false;
    assert!(against_twin(&mut world, &mut drawn).relative_l2 > 1e-3);
}

#[test]
fn the_level_looks_as_it_did() {
    let mut world = level("tour 06");
    let options = FrameOptions { display: Display::Srgb, ..linear() };
    let (pixels, _) = draw(&mut world, SIZE.0 as u32, SIZE.1 as u32, &options);
    let golden = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/goldens/level.png"));
    let bytes: Vec<u8> =
        pixels.iter().flat_map(|p| p.to_array()).map(|v| (v * 255.0).round() as u8).collect();
    if std::env::var_os("LUMBRE_WRITE_GOLDENS").is_some() {
        image::save_buffer(golden, &bytes, SIZE.0 as u32, SIZE.1 as u32, image::ColorType::Rgb8).unwrap();
    }
    let expected = image::open(golden).expect("a missing golden is a failure, not a pass").to_rgb8();
    assert_eq!(expected.dimensions(), (SIZE.0 as u32, SIZE.1 as u32));
    // Software rasterizers differ between processors by up to 3 codes, and in pixels on edges by more: at most 1 %
    // of them.
    let beyond = |bytes: &[u8]| {
        let apart = bytes.chunks(3).zip(expected.chunks(3));
        apart.filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 3)).count()
    };
    let count = beyond(&bytes);
    assert!(count <= SIZE.0 * SIZE.1 / 100, "{count} pixels differ from {}", golden.display());
    // Negative control: the picture shifted by one pixel.
    let mut shifted = bytes;
    shifted.rotate_right(3);
    assert!(beyond(&shifted) > SIZE.0 * SIZE.1 / 50);
}

#[test]
fn the_level_calls_for_what_it_has_and_nothing_else() {
    let mut world = level("tour 06");
    let by_objects = FrameOptions { light_lists: LightLists::Objects, ..linear() };
    let (pixels, report) = draw(&mut world, 64, 36, &by_objects);
    assert!(pixels.iter().any(|pixel| *pixel != DVec3::ZERO));
    assert!(report.plan.status("forward").unwrap().runs());
    assert!(report.plan.status("transparent").unwrap().runs(), "there is a pane");
    assert!(!report.plan.status("lightmap").unwrap().runs(), "it is not baked");
    assert!(report.plan.status("mirrors").unwrap().runs(), "there is a mirror on the wall");
    assert!(report.plan.status("refractive surfaces").unwrap().runs(), "there is a ball of crystal");
    assert!(report.statistics.lights >= 24 + 8);
    assert!(report.statistics.lights_per_object < 0.6 * report.statistics.lights as f32);
}
