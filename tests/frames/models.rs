//! Real models, where they lie beside the checkout: they load, shade in every technique, and nothing in the frame is NaN.

use bevy_ecs::world::World;
use lumbre_optics::Shading;
use lumbre_render::FrameOptions;
use lumbre_scene::default_camera;
use lumbre_tests::shared_files::shared_file;
use lumbre_tests::twin::{self, TwinOptions};

use crate::adapter::{draw, linear};

fn load(name: &str) -> Option<World> {
    let mut world = World::new();
    lumbre_scene::load(&mut world, &shared_file(name)?).unwrap();
    if world.query::<&lumbre_scene::Camera>().iter(&world).next().is_none() {
        let camera = default_camera(&mut world, 1.0);
        world.spawn(camera);
    }
    Some(world)
}

#[test]
fn the_bunny_in_three_shadings_agrees_with_the_twin() {
    let Some(mut world) = load("models/stanford-bunny.glb") else { return };
    let size = 128;
    let mut frames = Vec::new();
    for shading in Shading::ALL {
        let options = FrameOptions { shading: Some(*shading), ..linear() };
        let (got, _) = draw(&mut world, size as u32, size as u32, &options);
        let expected = twin::draw(
            &mut world,
            size,
            size,
            TwinOptions { shading: Some(*shading), ..TwinOptions::default() },
        );
        // Its triangles are smaller than a pixel: which of two a centre falls into is a matter of f32's rounding, and neighbouring
        // triangles differ in colour. So the bound is on the share of pixels, and the level is one eight-bit code.
        let apart = |i: usize| (got[i] - expected.color[i]).abs().max_element() > 1.0 / 255.0;
        let beyond = (0..size * size).filter(|&i| expected.surface[i].is_some() && apart(i)).count();
        println!("{}: {beyond} of {} pixels differ", shading.name(), size * size);
        assert!(beyond < size * size / 200, "{}: {beyond} pixels differ", shading.name());
        frames.push(got);
    }
    let distance = |a: usize, b: usize| {
        let sum: f64 = frames[a].iter().zip(&frames[b]).map(|(a, b)| (*a - *b).length()).sum();
        sum / (size * size) as f64
    };
    assert!(distance(0, 1) > 1e-3 && distance(1, 2) > 1e-4, "the three shadings show different pictures");
}

#[test]
fn many_lights_draw_and_stay_finite() {
    for (name, lights) in [("models/many_lights_64.glb", 64), ("models/many_lights_1024.glb", 1024)] {
        let Some(mut world) = load(name) else { continue };
        let (pixels, report) = draw(&mut world, 64, 48, &linear());
        assert_eq!(report.statistics.lights, lights, "{name}");
        let lit = pixels.iter().filter(|pixel| pixel.max_element() > 1e-3).count();
        assert!(lit > pixels.len() / 4, "{name}: only {lit} pixels are lit");
    }
}
