//! Cosine rays against global lines: `form_factor_methods IN.glb [--draft] [--converged RAYS]` prints the error of the form factors and
//! of the patches' light by bounces, by rays and by time, against converged ones.

#![allow(clippy::print_stdout, reason = "a program whose result is text")]

use std::error::Error;
use std::path::PathBuf;

use lumbre_bake::{BakeOptions, Density, Quality, form_factor_errors};

#[path = "../tests/held_out/input.rs"]
mod input;
#[path = "../tests/held_out/random.rs"]
mod random;
#[path = "../tests/held_out/scenes/mod.rs"]
mod scenes;

fn main() -> Result<(), Box<dyn Error>> {
    let mut options = BakeOptions { density: Density::MapSize(64), ..BakeOptions::default() };
    let (mut paths, mut converged) = (Vec::new(), 50_000_000);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or_else(|| format!("{argument} needs a value"));
        match argument.as_str() {
            "--draft" => options.quality = Quality::Draft,
            "--seed" => options.seed = value()?.parse()?,
            "--converged" => converged = value()?.parse()?,
            _ => paths.push(PathBuf::from(&argument)),
        }
    }
    let [input] = &paths[..] else {
        return Err("give an input file, or the name of a held-out scene".into());
    };
    let mut world = input::world_of(input)?;
    let rays = [100_000, 400_000, 1_500_000, 6_000_000];
    println!("{}", input.display());
    println!("{:>12} {:>12} {:>9} {:>10} {:>10}", "method", "rays", "seconds", "exchange", "irradiance");
    for row in form_factor_errors(&mut world, &options, &rays, converged)? {
        println!(
            "{:>12} {:>12} {:>9.3} {:>8.2} % {:>8.3} %",
            format!("{:?}", row.method),
            row.rays,
            row.seconds,
            100.0 * row.exchange,
            100.0 * row.irradiance
        );
    }
    Ok(())
}
