//! Measures the CPU time, stage by stage, of a frame with many objects and many lights: boxes on a plane, and
//! as many lamps with a range of two metres just above them. Some of both move every frame.
//! `cargo run --release -p lumbre_render --example frame_cpu -- [--number 10000] [--moving 1]
//! [--shading phong|gouraud|auto:0.01] [--frames 30]`
//!
//! `--moving` is a percentage. Prints medians over the frames, in milliseconds. The frames are small, and the
//! time for drawing them is not included.

#![allow(clippy::print_stdout, reason = "it prints its results")]

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{Attenuation, Light, Material, Shading};
use lumbre_render::{CpuStages, FrameOptions, Gpu, Measure, Offscreen, OffscreenFormat, Renderer};
use lumbre_scene::{Camera, Mesh, Transform};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mut number, mut moving, mut frames, mut shading) = (10_000_u32, 1.0, 30, Shading::Phong);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let value = arguments.next().ok_or("a value is missing")?;
        match argument.as_str() {
            "--number" => number = value.parse()?,
            "--moving" => moving = value.parse()?,
            "--frames" => frames = value.parse()?,
            "--shading" => shading = value.parse()?,
            _ => return Err(format!("{argument} is unknown").into()),
        }
    }
    let mut world = World::new();
    let side = f64::from(number).sqrt().ceil();
    let cube = Arc::new(shapes::cuboid(Vec3::splat(0.4), 1));
    let at = |index: u32, height: f64| {
        let (row, column) = ((f64::from(index) / side).floor(), f64::from(index) % side);
        DVec3::new(column - 0.5 * side, height, row - 0.5 * side)
    };
    let mut all = Vec::new();
    for index in 0..number {
        let place = Transform::from_translation(at(index, 0.0));
        all.push(world.spawn((Mesh(cube.clone()), Material::matt(Vec3::ONE), place)).id());
        let attenuation = Attenuation { range: 2.0, ..Attenuation::INVERSE_SQUARE };
        let place = Transform::from_translation(at(index, 1.0));
        all.push(world.spawn((Light { attenuation, ..Light::point(Vec3::ONE) }, place)).id());
    }
    let eye = Transform::from_xyz(0.0, 0.6 * side, 0.8 * side).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Camera::default(), eye));
    let gpu = Gpu::headless()?;
    let mut renderer = Renderer::new(&gpu);
    let target = Offscreen::new(&gpu, 320, 180, OffscreenFormat::Rgba8)?;
    let options = FrameOptions { shading: Some(shading), measure: Measure::Time, ..FrameOptions::default() };
    let count = (all.len() as f64 * moving / 100.0) as usize;
    let mut stages: Vec<CpuStages> = Vec::new();
    for frame in 0..=frames {
        for offset in 0..count {
            let entity = all[(frame * count + offset) % all.len()];
            if let Some(mut transform) = world.get_mut::<Transform>(entity) {
                transform.translation.x += if frame % 2 == 0 { 0.1 } else { -0.1 };
            }
        }
        let report = renderer.render(&mut world, &target.target(), &options)?;
        renderer.wait()?;
        if frame == 0 {
            let statistics = &report.statistics;
            println!(
                "{} objects in view, {} lights, {:?}",
                statistics.objects, statistics.lights, statistics.light_lists
            );
            println!("{:.1} lights per object", statistics.lights_per_object);
            continue;
        }
        stages.push(report.statistics.cpu);
    }
    let median = |name: &str, of: &dyn Fn(&CpuStages) -> f64| {
        let mut values: Vec<f64> = stages.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        println!("{name:>32} {:8.2} ms (least {:.2})", values[values.len() / 2], values[0]);
    };
    for (index, (name, _)) in CpuStages::default().named().into_iter().enumerate() {
        median(name, &|cpu| cpu.named()[index].1);
    }
    median("encoding and submission", &|cpu| cpu.encoding_ms);
    median("of no stage", &CpuStages::remainder_ms);
    median("total", &|cpu| cpu.total_ms);
    Ok(())
}
