//! Measures what a rebake that reuses samples saves, and what it costs in error: `moved_object IN.glb|SCENE NAME X Y Z
//! [--error E] [--texels-per-meter D]` bakes a file (or a held-out scene by its name), moves the object NAME by the
//! given metres, and bakes again twice: with the samples of the first bake, and from scratch.

#![allow(clippy::print_stdout, reason = "a program whose result is text")]

use std::error::Error;
use std::path::Path;

use bevy_ecs::world::World;
use glam::DVec3;
use lumbre_bake::{Bake, BakeOptions, BakeReport, Density, Samples, TexelErrors};
use lumbre_scene::{Lightmap, Name, Transform};

#[path = "../tests/held_out/input.rs"]
mod input;
#[path = "../tests/held_out/random.rs"]
mod random;
#[path = "../tests/held_out/scenes/mod.rs"]
mod scenes;

fn main() -> Result<(), Box<dyn Error>> {
    let mut options = BakeOptions { resolution_error: false, ..BakeOptions::default() };
    let mut words = Vec::new();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or_else(|| format!("{argument} needs a value"));
        match argument.as_str() {
            "--error" => options.error = value()?.parse()?,
            "--texels-per-meter" => options.density = Density::TexelsPerMeter(value()?.parse()?),
            _ => words.push(argument),
        }
    }
    let [input, name, x, y, z] = &words[..] else {
        return Err("give an input file or scene, an object's name, and by how much it moves".into());
    };
    let by = DVec3::new(x.parse()?, y.parse()?, z.parse()?);
    let moved = || -> Result<World, Box<dyn Error>> {
        let mut world = input::world_of(Path::new(input))?;
        let mut named = world.query::<(&Name, &mut Transform)>();
        let object = named.iter_mut(&mut world).find(|(object_name, _)| object_name.as_str() == name);
        let (_, mut place) = object.ok_or_else(|| format!("{input} has no object {name}"))?;
        place.translation += by;
        Ok(world)
    };
    let (after, whole) = (moved()?, moved()?);
    let (_, first, samples) = baked(input::world_of(Path::new(input))?, None, &options)?;
    let (again, rebaked, _) = baked(after, samples.as_ref(), &options)?;
    let (whole, full, _) = baked(whole, None, &options)?;
    let (mut squares, mut light, mut count) = (0.0, 0.0, 0.0);
    for (a, b) in again.iter().zip(&whole).filter(|(a, b)| a.1.is_finite() && b.1.is_finite()) {
        squares += (a.0 - b.0).length_squared() / 3.0;
        light += b.0.element_sum() / 3.0;
        count += 1.0;
    }
    for (what, report) in [("before", &first), ("again", &rebaked), ("whole", &full)] {
        println!(
            "{what:>6}: {:7.2} s, {:6.1} million rays, states {:.3} %",
            report.seconds,
            report.rays as f64 * 1e-6,
            100.0 * report.estimated_error
        );
    }
    if let Some(rebake) = &rebaked.rebake {
        println!("{rebake}");
    }
    println!(
        "again and whole are {:.3} % of the mean apart; {:.2} of the time, {:.2} of the rays",
        100.0 * f64::sqrt(squares / count) * count / light,
        rebaked.seconds / full.seconds,
        rebaked.rays as f64 / full.rays as f64
    );
    Ok(())
}

/// The value and the stated error of every texel.
type Texels = Vec<(DVec3, f32)>;

fn baked(
    mut world: World,
    former: Option<&Samples>,
    options: &BakeOptions,
) -> Result<(Texels, BakeReport, Option<Samples>), Box<dyn Error>> {
    let mut samples = None;
    let report = Bake::new(options).former(former).keep_samples(&mut samples).run(&mut world)?;
    let mut query = world.query::<(&Lightmap, &TexelErrors)>();
    let mut maps: Vec<_> =
        query.iter(&world).map(|(map, error)| (map.image.clone(), error.0.clone())).collect();
    maps.sort_by(|a, b| a.0.name.cmp(&b.0.name));
    maps.dedup_by(|a, b| a.0.name == b.0.name);
    let texels = maps.iter().flat_map(|(map, errors)| {
        map.texels.iter().map(|texel| texel.as_dvec3()).zip(errors.iter().copied())
    });
    Ok((texels.collect(), report, samples))
}
