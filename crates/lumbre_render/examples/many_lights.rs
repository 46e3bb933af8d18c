//! What a frame costs against the number of lights: 64 balls (73,728 triangles with the floor) under point lights of three metres.
//! `cargo run --release -p lumbre_render --example many_lights -- [--frames 30] [--size 1280x720] [--shading phong] [--reflection blinn]
//! [--kind point|spot|unbounded] [--lists auto|objects|clusters|everything] [--png FOLDER] [LIGHTS …]`
//!
//! Wall clock from the call to the finished frame, the device waited for: the median of the frames, and the least.

#![allow(clippy::print_stdout, reason = "it prints its results")]

use std::sync::Arc;
use std::time::Instant;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{Attenuation, Light, Material, ReflectionModel, Shading, SpotCone};
use lumbre_render::{FrameOptions, Gpu, LightLists, Offscreen, OffscreenFormat, Renderer};
use lumbre_scene::{Camera, Mesh, Projection, Transform};

/// Metres.
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
            "--frames" => frames = value()?.parse()?,
            "--size" => {
                let text = value()?;
                let (width, height) = text.split_once('x').ok_or("--size takes WIDTHxHEIGHT")?;
                size = (width.parse()?, height.parse()?);
            }
            "--shading" => options.shading = Some(Shading::from_name(&value()?).ok_or("no such shading")?),
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
            "--png" => png = Some(value()?),
            number => numbers.push(number.parse::<u32>()?),
        }
    }
    if numbers.is_empty() {
        numbers = vec![0, 16, 64, 256, 1024];
    }
    let gpu = Gpu::headless()?;
    eprintln!("{} ({})", gpu.adapter.get_info().name, gpu.adapter.get_info().driver_info);
    println!("lights, median ms, least ms");
    for number in numbers {
        let mut world = balls(number, kind);
        let mut renderer = Renderer::new(&gpu);
        let target = Offscreen::new(&gpu, size.0, size.1, OffscreenFormat::Rgba8)?;
        let mut times = Vec::new();
        // The first frame compiles.
        for _ in 0..=frames {
            let start = Instant::now();
            renderer.render(&mut world, &target.target(), &options)?;
            renderer.wait()?;
            times.push(start.elapsed().as_secs_f64() * 1e3);
        }
        times.remove(0);
        times.sort_by(f64::total_cmp);
        println!("{number}, {:.1}, {:.1}", times[times.len() / 2], times[0]);
        if let Some(folder) = &png {
            let path = format!("{folder}/many_lights_{number}.png");
            image::save_buffer(path, &target.read_rgba8(&gpu)?, size.0, size.1, image::ColorType::Rgba8)?;
        }
    }
    Ok(())
}

/// A floor, 64 balls, this many lights at random places just above the floor, and a camera that sees most of them.
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

/// The same numbers on every machine.
struct Random(u64);

impl Random {
    fn within(&mut self, least: f64, most: f64) -> f64 {
        // Knuth's MMIX generator; the upper bits are the random ones.
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        least + (most - least) * ((self.0 >> 11) as f64 / (1_u64 << 53) as f64)
    }
}
