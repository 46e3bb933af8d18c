//! Measures the time of a frame against the number of lights: 64 balls (73,728 triangles with the floor)
//! under point lights of three metres.
//! `cargo run --release -p lumbre_render --example many_lights -- [--frames 30] [--size 1280x720]
//! [--shading phong|auto:0.01] [--reflection blinn] [--kind point|spot|unbounded]
//! [--lists auto|objects|clusters|everything] [--path auto|forward|deferred|deferred-compute] [--png FOLDER] [--account]
//! [LIGHTS …]`
//!
//! Times are wall-clock times from the call until the device has finished. Printed are the median and the
//! minimum for frames of an unchanged World; the median for frames before each of which the camera is marked
//! as changed, so that the World is extracted; the median for frames that the target already holds
//! (`FrameOptions::keep_unchanged`); and for all three the median of the CPU time. With `--account` also the
//! account of one more frame of the second kind, with the lights that it tested.

#![allow(clippy::print_stdout, reason = "it prints its results")]

use std::sync::Arc;
use std::time::Instant;

use bevy_ecs::change_detection::DetectChangesMut;
use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{Attenuation, Light, Material, ReflectionModel, Shading, SpotCone};
use lumbre_render::{
    FrameOptions, Gpu, LightLists, Measure, Offscreen, OffscreenFormat, RenderError, Renderer, RenderingPath,
};
use lumbre_scene::{Camera, Mesh, Projection, Transform};

/// Range of the lights in metres.
const RANGE: f32 = 3.0;
/// Half the side of the floor, in metres.
const HALF_SIDE: f64 = 18.0;

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Point,
    Spot,
    Unbounded,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mut frames, mut size, mut png, mut kind) = (30, (1280, 720), None, Kind::Point);
    let mut account = false;
    let mut options = FrameOptions {
        shading: Some(Shading::Phong),
        reflection: Some(ReflectionModel::Blinn),
        ..FrameOptions::default()
    };
    let mut numbers = Vec::new();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or("a value is missing");
        match argument.as_str() {
            "--frames" => frames = value()?.parse::<usize>()?.max(1),
            "--size" => {
                let text = value()?;
                let (width, height) = text.split_once('x').ok_or("--size takes WIDTHxHEIGHT")?;
                size = (width.parse()?, height.parse()?);
            }
            "--shading" => options.shading = Some(value()?.parse()?),
            "--reflection" => {
                options.reflection = Some(ReflectionModel::from_name(&value()?).ok_or("no such model")?);
            }
            "--kind" => {
                kind = match value()?.as_str() {
                    "point" => Kind::Point,
                    "spot" => Kind::Spot,
                    "unbounded" => Kind::Unbounded,
                    _ => return Err("--kind takes point, spot or unbounded".into()),
                }
            }
            "--lists" => {
                options.light_lists = match value()?.as_str() {
                    "auto" => LightLists::Auto,
                    "objects" => LightLists::Objects,
                    "clusters" => LightLists::Clusters,
                    "everything" => LightLists::Everything,
                    _ => return Err("--lists takes auto, objects, clusters or everything".into()),
                }
            }
            "--path" => {
                options.rendering_path = RenderingPath::from_name(&value()?)
                    .ok_or("--path takes auto, forward, deferred or deferred-compute")?;
            }
            "--png" => png = Some(value()?),
            "--account" => account = true,
            number => numbers.push(number.parse::<u32>()?),
        }
    }
    if numbers.is_empty() {
        numbers = vec![0, 16, 64, 256, 1024];
    }
    let gpu = Gpu::headless()?;
    eprintln!("{} ({})", gpu.adapter.get_info().name, gpu.adapter.get_info().driver_info);
    println!(
        "lights, still: median ms, least ms, changed: median ms, kept: median ms, CPU of these three: median ms"
    );
    for number in numbers {
        let mut world = balls(number, kind);
        let mut renderer = Renderer::new(&gpu);
        let target = Offscreen::new(&gpu, size.0, size.1, OffscreenFormat::Rgba8)?;
        let mut drawn =
            |world: &mut World, options: &FrameOptions, changed: bool| -> Result<_, RenderError> {
                let (mut times, mut on_cpu) = (Vec::new(), Vec::new());
                for _ in 0..frames {
                    if changed {
                        let mut cameras = world.query::<&mut Camera>();
                        cameras.iter_mut(world).for_each(|mut camera| camera.set_changed());
                    }
                    let start = Instant::now();
                    let report = renderer.render(world, &target.target(), options)?;
                    renderer.wait()?;
                    times.push(start.elapsed().as_secs_f64() * 1e3);
                    on_cpu.push(report.statistics.cpu.total_ms);
                }
                [&mut times, &mut on_cpu].into_iter().for_each(|times| times.sort_by(f64::total_cmp));
                Ok(([times[frames / 2], times[0]], on_cpu[frames / 2], renderer.accounting().cloned()))
            };
        // Pipelines are created in the first frames.
        drawn(&mut world, &options, true)?;
        let kept = FrameOptions { keep_unchanged: true, ..options.clone() };
        let ([still, least], still_cpu, _) = drawn(&mut world, &options, false)?;
        let ([changed, _], changed_cpu, _) = drawn(&mut world, &options, true)?;
        let ([kept, _], kept_cpu, _) = drawn(&mut world, &kept, false)?;
        println!(
            "{number}, {still:.2}, {least:.2}, {changed:.2}, {kept:.4}, {still_cpu:.3}, {changed_cpu:.3}, {kept_cpu:.4}"
        );
        if account {
            let measured = |measure| FrameOptions { measure, ..options.clone() };
            let (_, _, accounting) = drawn(&mut world, &measured(Measure::TimeAndInvocations), true)?;
            let (_, _, counted) = drawn(&mut world, &measured(Measure::Lights), true)?;
            if let (Some(mut accounting), Some(counted)) = (accounting, counted) {
                accounting.take_lights_of(&counted);
                println!("{}", accounting.to_text());
            }
        }
        if let Some(folder) = &png {
            let path = format!("{folder}/many_lights_{number}.png");
            image::save_buffer(path, &target.read_rgba8(&gpu)?, size.0, size.1, image::ColorType::Rgba8)?;
        }
    }
    Ok(())
}

/// A floor, 64 balls, this many lights at random positions just above the floor, and a camera that sees most
/// of them.
fn balls(lights: u32, kind: Kind) -> World {
    let mut world = World::new();
    let floor = shapes::plane(2.0 * HALF_SIDE as f32, 2.0 * HALF_SIDE as f32, 64, 64);
    world.spawn((Mesh(Arc::new(floor)), Material::from_metallic_roughness(Vec3::splat(0.6), 0.0, 0.8)));
    let ball = Arc::new(shapes::uv_sphere(1.0, 32, 17));
    for number in 0..64 {
        let at = DVec3::new(f64::from(number % 8) * 4.0 - 14.0, 1.0, f64::from(number / 8) * 4.0 - 14.0);
        let material = Material::from_metallic_roughness(Vec3::splat(0.8), 0.0, 0.3);
        world.spawn((Mesh(ball.clone()), material, Transform::from_translation(at)));
    }
    let mut random = Random(1);
    for _ in 0..lights {
        let place = DVec3::new(
            random.within(-HALF_SIDE, HALF_SIDE),
            random.within(0.2, 2.5),
            random.within(-HALF_SIDE, HALF_SIDE),
        );
        let color = Vec3::from([0, 1, 2].map(|_| random.within(0.2, 1.0) as f32));
        let strength = color / color.max_element() * (40.0 / std::f32::consts::PI / 12.0);
        let range = if kind == Kind::Unbounded { f32::INFINITY } else { RANGE };
        let attenuation = Attenuation { range, ..Attenuation::INVERSE_SQUARE };
        let light = match kind {
            Kind::Spot => Light::spot(strength, SpotCone::Smooth { inner: 0.3, outer: 0.6 }),
            Kind::Point | Kind::Unbounded => Light::point(strength),
        };
        let aim = place + DVec3::new(random.within(-1.0, 1.0), -1.0, random.within(-1.0, 1.0));
        let transform = Transform::from_translation(place).looking_at(aim, DVec3::Z);
        world.spawn((Light { attenuation, ..light }, transform));
    }
    let projection = Projection::Perspective {
        vertical_fov: std::f64::consts::FRAC_PI_4,
        aspect: None,
        near: 0.1,
        far: Some(200.0),
    };
    let eye = Transform::from_xyz(0.0, 12.0, 24.0).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Camera { projection, exposure: 1.0 }, eye));
    world
}

/// A generator that gives the same numbers on every machine.
struct Random(u64);

impl Random {
    fn within(&mut self, least: f64, most: f64) -> f64 {
        // Knuth's MMIX generator; the upper bits are the random ones.
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        least + (most - least) * ((self.0 >> 11) as f64 / (1_u64 << 53) as f64)
    }
}
