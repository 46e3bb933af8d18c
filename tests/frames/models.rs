//! Real models, if they are beside the checkout: they load, are shaded with every technique, and nothing in the
//! frame is NaN.

use bevy_ecs::world::World;
use lumbre_optics::{ReflectionModel, Shading};
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
fn the_bunny_shows_its_three_shadings() {
    let Some(mut world) = load("models/stanford-bunny.glb") else { return };
    let frames = Shading::ALL
        .iter()
        .map(|shading| draw(&mut world, 128, 128, &FrameOptions { shading: Some(*shading), ..linear() }).0)
        .collect::<Vec<_>>();
    let distance = |a: usize, b: usize| {
        let sum: f64 = frames[a].iter().zip(&frames[b]).map(|(a, b)| (*a - *b).length()).sum();
        sum / frames[a].len() as f64
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

/// Two eight-bit codes of a picture, or of one exposed so that a brighter pixel is just white. Measured at most a
/// hundredth of it, next to a light, where a radiance of a thousand falls off within a pixel.
const CODES: f64 = 2.0 / 255.0;
/// A scan's triangles are smaller than pixels. Which of two contains a pixel centre depends on f32's rounding, and
/// with flat shading they differ. Measured at most 7 of 4,000 pixels.
const SHARE: f64 = 0.005;

#[test]
fn real_scenes_agree_with_the_twin_in_every_shading_and_model() {
    for name in ["stanford-bunny.glb", "teapot.glb", "many_lights_64.glb", "many_lights_1024.glb"] {
        let Some(mut world) = load(&format!("models/{name}")) else { continue };
        let size = if name.contains("1024") { 96 } else { 192 };
        for model in ReflectionModel::ALL {
            for shading in Shading::ALL {
                let options = FrameOptions { shading: Some(*shading), reflection: Some(*model), ..linear() };
                let (got, _) = draw(&mut world, size as u32, size as u32, &options);
                let twin_options = TwinOptions {
                    shading: Some(*shading),
                    reflection: Some(*model),
                    ..TwinOptions::default()
                };
                let expected = twin::draw(&mut world, size, size, twin_options).inside_surfaces(false);
                let pairs = got.iter().zip(&expected).filter_map(|(got, expected)| Some((got, (*expected)?)));
                let apart: Vec<f64> = pairs
                    .map(|(got, expected)| {
                        (*got - expected).abs().max_element() / expected.max_element().max(1.0)
                    })
                    .collect();
                let beyond = apart.iter().filter(|apart| apart.is_nan() || **apart > CODES).count();
                let largest = apart.iter().copied().fold(0.0, f64::max);
                let (pixels, shading_name) = (apart.len(), shading.name());
                println!(
                    "{name:22} {:16} {shading_name:8} {pixels:6} pixels, {beyond:3} beyond, largest {largest:.1e}",
                    model.name()
                );
                assert!(pixels > size * size / 4, "{name}: {pixels} pixels are too few to compare");
                let allowed = if *shading == Shading::Flat { SHARE * pixels as f64 } else { 0.0 };
                assert!(
                    beyond as f64 <= allowed,
                    "{name}, {}, {shading_name}: {beyond} pixels differ, by up to {largest}",
                    model.name()
                );
            }
        }
    }
}
