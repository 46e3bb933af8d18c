//! Measures the time of frames in which something is switched on for the first time: 64 balls under a few
//! point lights, and then the scene's first spot light, first shadow, first texture and first blended
//! surface, each while frames are drawn.
//! `cargo run --release -p lumbre_render --example switch_on -- [--frames 60] [--size 640x360] [--wait]`
//!
//! Times are wall-clock times from the call until the device has finished. Printed are the median and the
//! maximum over the frames, their ratio, and the number of frames until the change was visible.

#![allow(clippy::print_stdout, reason = "it prints its results")]

use std::sync::Arc;
use std::time::Instant;

use bevy_ecs::change_detection::DetectChangesMut;
use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{AlphaMode, Light, Material, SpotCone};
use lumbre_render::{FrameOptions, Gpu, MissingPipelines, Offscreen, OffscreenFormat, Renderer};
use lumbre_scene::{Camera, Image, MaterialTextures, Mesh, TextureReference, Transform};

/// The name of a change, and what it does.
type Change<'a> = (&'static str, &'a dyn Fn(&mut World));

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mut frames, mut size, mut wait) = (60, (640, 360), false);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or("a value is missing");
        match argument.as_str() {
            "--frames" => frames = value()?.parse()?,
            "--size" => {
                let text = value()?;
                let (width, height) = text.split_once('x').ok_or("--size takes WIDTHxHEIGHT")?;
                size = (width.parse()?, height.parse()?);
            }
            "--wait" => wait = true,
            _ => return Err(format!("{argument} is unknown").into()),
        }
    }
    let gpu = Gpu::headless()?;
    let missing_pipelines = if wait { MissingPipelines::Wait } else { MissingPipelines::Background };
    let options = FrameOptions { missing_pipelines, ..FrameOptions::default() };
    println!("change, median ms, longest ms, longest over median, frames until it was seen");
    let (mut world, lamp, ball, camera) = balls();
    let mut renderer = Renderer::new(&gpu);
    let target = Offscreen::new(&gpu, size.0, size.1, OffscreenFormat::Rgba8)?;
    let mut frame = |world: &mut World| -> Result<(f64, bool), Box<dyn std::error::Error>> {
        if let Some(mut camera) = world.get_mut::<Camera>(camera) {
            // Prevents the frame from being reused as unchanged.
            camera.set_changed();
        }
        let start = Instant::now();
        let report = renderer.render(world, &target.target(), &options)?;
        renderer.wait()?;
        Ok((start.elapsed().as_secs_f64() * 1e3, report.statistics.pipelines_awaited > 0))
    };
    for _ in 0..5 {
        frame(&mut world)?;
    }
    let changes: [Change<'_>; 5] = [
        ("nothing", &|_| {}),
        ("first spot light", &|world| {
            if let Some(mut lamp) = world.get_mut::<Light>(lamp) {
                lamp.enabled = true;
            }
        }),
        ("first shadow", &|world| {
            if let Some(mut lamp) = world.get_mut::<Light>(lamp) {
                lamp.shadow = true;
            }
        }),
        ("first texture", &|world| {
            world.entity_mut(ball).insert(checks());
        }),
        // This also needs the first display pass.
        ("first blended surface", &|world| {
            if let Some(mut material) = world.get_mut::<Material>(ball) {
                (material.alpha, material.alpha_mode) = (0.5, AlphaMode::Blend);
            }
        }),
    ];
    for (name, change) in changes {
        change(&mut world);
        let (mut times, mut former) = (Vec::new(), 0);
        for _ in 0..frames {
            let (time, is_former) = frame(&mut world)?;
            times.push(time);
            former += usize::from(is_former);
        }
        eprintln!("{name}: {times:.0?}");
        times.sort_by(f64::total_cmp);
        let (median, longest) = (times[times.len() / 2], times[times.len() - 1]);
        println!("{name}, {median:.1}, {longest:.1}, {:.2}, {former}", longest / median);
    }
    Ok(())
}

/// A floor, 64 balls, two point lights, a spot light that is off, and a camera.
fn balls() -> (World, Entity, Entity, Entity) {
    let mut world = World::new();
    let floor = Mesh(Arc::new(shapes::plane(36.0, 36.0, 64, 64)));
    world.spawn((floor, Material::from_metallic_roughness(Vec3::splat(0.6), 0.0, 0.8)));
    let shape = Arc::new(shapes::uv_sphere(1.0, 32, 17));
    let mut ball = Entity::PLACEHOLDER;
    for number in 0..64 {
        let at = DVec3::new(f64::from(number % 8) * 4.0 - 14.0, 1.0, f64::from(number / 8) * 4.0 - 14.0);
        let material = Material::from_metallic_roughness(Vec3::splat(0.8), 0.0, 0.3);
        ball = world.spawn((Mesh(shape.clone()), material, Transform::from_translation(at))).id();
    }
    for x in [-8.0, 8.0] {
        world.spawn((Light::point(Vec3::splat(60.0)), Transform::from_xyz(x, 6.0, 0.0)));
    }
    let cone = SpotCone::Smooth { inner: 0.4, outer: 0.6 };
    let place = Transform::from_xyz(0.0, 12.0, 8.0).looking_at(DVec3::ZERO, DVec3::Y);
    let lamp = world.spawn((Light { enabled: false, ..Light::spot(Vec3::splat(400.0), cone) }, place)).id();
    let eye = Transform::from_xyz(0.0, 12.0, 24.0).looking_at(DVec3::ZERO, DVec3::Y);
    let camera = world.spawn((Camera::default(), eye)).id();
    (world, lamp, ball, camera)
}

/// Black and white checks.
fn checks() -> MaterialTextures {
    let texels = (0..64 * 64).flat_map(|index| {
        let white = (index % 64 / 8 + index / 64 / 8) % 2 == 0;
        [if white { 255 } else { 20 }; 3].into_iter().chain([255])
    });
    let image = Image { name: "checks".to_owned(), width: 64, height: 64, rgba: texels.collect() };
    MaterialTextures {
        base_color: Some(TextureReference::new(Arc::new(image))),
        ..MaterialTextures::default()
    }
}
