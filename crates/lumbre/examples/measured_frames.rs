//! What measuring costs: how much longer a frame that `lumbre render --timings` times takes than the same frame as a study of `lumbre cost` times it, which measures nothing but the wall clock.
//! Both are drawn in turns in one process, warm, so that other load on the machine affects both alike. Printed are the median of the ratios of the pairs, the interval that holds it with 95 %, and both medians.
//!
//! `cargo run --release -p lumbre --example measured_frames -- [FILE…] [--pairs 31] [--size 480x270]`, for files with a camera; without one for assets/demo.glb.

#![allow(clippy::print_stdout, reason = "a program whose result is text")]

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, bail};
use bevy_ecs::world::World;
use lumbre::cost::Spread;
use lumbre::optics::Shading;
use lumbre::render::{FrameOptions, Gpu, Measure, Offscreen, OffscreenFormat, Renderer};

/// Pairs for which pipelines are made, and which do not count.
const COLD: usize = 3;

fn main() -> anyhow::Result<()> {
    let (mut files, mut pairs, mut size) = (Vec::new(), 31_usize, (480, 270));
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().with_context(|| format!("{argument} needs a value"));
        match argument.as_str() {
            "--pairs" => pairs = value()?.parse::<usize>().context("--pairs takes a number")?.max(1),
            "--size" => {
                let text = value()?;
                let sides = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
                size = sides.context("--size takes WIDTHxHEIGHT")?;
            }
            unknown if unknown.starts_with("--") => bail!("{unknown} is unknown"),
            _ => files.push(argument),
        }
    }
    if files.is_empty() {
        files.push("assets/demo.glb".into());
    }
    let gpu = Gpu::headless()?;
    println!("{}", gpu.adapter.get_info().name);
    let phong = FrameOptions::default();
    let samples = FrameOptions { multisample: Some(true), ..phong.clone() };
    let gouraud = FrameOptions { shading: Some(Shading::Gouraud), ..phong.clone() };
    for file in &files {
        let mut world = World::new();
        lumbre::scene::load(&mut world, Path::new(file))?;
        for (name, options) in [("Phong", &phong), ("Phong, four samples", &samples), ("Gouraud", &gouraud)] {
            let [plain, measured] = times(&gpu, &mut world, options, size, pairs)?;
            let ratios: Vec<f64> = plain.iter().zip(&measured).map(|(one, other)| one / other).collect();
            let spreads = (Spread::of_median(&ratios), Spread::of(&plain), Spread::of(&measured));
            let (Some(ratio), Some(plain), Some(measured)) = spreads else { continue };
            println!(
                "{file}, {name}: {:.3} ({:.3} to {:.3}) of the time by --timings; {:.2} and {:.2} ms",
                ratio.median, ratio.lower, ratio.upper, plain.median, measured.median
            );
        }
    }
    Ok(())
}

/// Returns the milliseconds of frames that are not measured, and of those that are, in pairs.
fn times(
    gpu: &Gpu,
    world: &mut World,
    options: &FrameOptions,
    (width, height): (u32, u32),
    pairs: usize,
) -> anyhow::Result<[Vec<f64>; 2]> {
    let target = Offscreen::new(gpu, width, height, OffscreenFormat::Rgba8)?;
    let kinds = [Measure::Nothing, Measure::Time].map(|measure| FrameOptions { measure, ..options.clone() });
    let mut renderers = [Renderer::new(gpu), Renderer::new(gpu)];
    let mut times = [Vec::new(), Vec::new()];
    for number in 0..COLD + pairs {
        // Whichever is drawn first finds other caches than the second.
        for kind in if number % 2 == 0 { [0, 1] } else { [1, 0] } {
            let begun = Instant::now();
            renderers[kind].render(world, &target.target(), &kinds[kind])?;
            renderers[kind].wait()?;
            if number >= COLD {
                times[kind].push(begun.elapsed().as_secs_f64() * 1e3);
            }
        }
    }
    Ok(times)
}
