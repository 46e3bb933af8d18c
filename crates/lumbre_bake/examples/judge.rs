//! Measures the errors of a baked file at reference points: `judge BAKED.glb POINTS.csv [--scale S] [--errors
//! OUT.csv]`. It prints statistics and the ten worst points; with `--errors` it writes all points, the worst first.

use std::error::Error;
use std::fmt::Write;
use std::path::PathBuf;

use bevy_ecs::world::World;

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/held_out/mod.rs"]
mod held_out;

use held_out::{point_errors, reference_points};

fn main() -> Result<(), Box<dyn Error>> {
    let (mut paths, mut errors_file, mut scale) = (Vec::new(), None, 1.0);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or_else(|| format!("{argument} needs a value"));
        match argument.as_str() {
            "--errors" => errors_file = Some(PathBuf::from(value()?)),
            "--scale" => scale = value()?.parse()?,
            _ => paths.push(PathBuf::from(&argument)),
        }
    }
    let [baked, points] = &paths[..] else { return Err("give a baked file and reference points".into()) };
    let mut world = World::new();
    lumbre_scene::load(&mut world, baked)?;
    lumbre_scene::update_transforms(&mut world);
    let points = point_errors::scaled(&reference_points::read(points), scale);
    let errors = point_errors::measure(&mut world, &points);
    eprintln!("{}: {errors}\n{}", baked.display(), errors.local);
    for [position, normal, value, expected, error] in errors.rows.iter().take(10) {
        eprintln!("  at {position:.3} facing {normal:.2}: {value:.4} instead of {expected:.4} ± {error:.4}");
    }
    if let Some(path) = errors_file {
        let mut text = String::from("x,y,z,nx,ny,nz,found_r,found_g,found_b,E_r,E_g,E_b,se_r,se_g,se_b\n");
        for row in &errors.rows {
            let fields: Vec<String> = row.iter().flat_map(|v| v.to_array()).map(|x| x.to_string()).collect();
            writeln!(text, "{}", fields.join(","))?;
        }
        std::fs::write(path, text)?;
    }
    Ok(())
}
