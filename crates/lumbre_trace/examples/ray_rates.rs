//! Measures how fast the tracer finds the rays of a picture, compared with the bare triangle hierarchy:
//! `cargo run --release -p lumbre_trace --example ray_rates -- FILE [CAMERA]`.

#![allow(clippy::print_stdout, reason = "the rates are what it is for")]

use std::process::ExitCode;

use bevy_ecs::prelude::*;
use bevy_ecs::world::World;
use lumbre_scene::{Camera, Name, load};
use lumbre_trace::{RayRate, TraceOptions, Tracer};

/// Number of rounds; each times both.
const ROUNDS: usize = 9;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("ray_rates: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().ok_or("say which .glb or .gltf file")?;
    let mut world = World::new();
    load(&mut world, std::path::Path::new(&file))?;
    let camera = arguments.next().map(|name| camera(&mut world, &name)).transpose()?;
    let options = TraceOptions { camera, size: (640, 360), ..TraceOptions::default() };
    let rates = Tracer::new(&mut world, &options)?.ray_rates(ROUNDS);
    println!("{file}, 640 x 360, one thread: the tracer and the bare hierarchy");
    print("primary", rates.primary);
    print("shadow", rates.shadow);
    print("… in reach", rates.shadow_in_reach);
    Ok(())
}

fn camera(world: &mut World, wanted: &str) -> Result<Entity, String> {
    let mut cameras = world.query_filtered::<(Entity, &Name), With<Camera>>();
    let found = cameras.iter(world).find(|(_, name)| name.as_str() == wanted);
    found.map(|(entity, _)| entity).ok_or_else(|| format!("there is no camera `{wanted}`"))
}

fn print(kind: &str, found: RayRate) {
    let [tracer, hierarchy] = found.millions_per_second;
    let [met, met_bare] = found.met;
    println!(
        "{kind:10} {:10} rays, {met} and {met_bare} met: {tracer:.2} and {hierarchy:.2} million a second, ratio {:.2}",
        found.rays, found.ratio
    );
}
