//! Bakes a glTF file, or a held-out scene by its name: `bake_file IN.glb|SCENE OUT.glb [--map-size N]
//! [--draft|--reference] [--error X] [--time SECONDS] [--csv REFERENCE] [--maps FOLDER]`.
//!
//! With a reference it prints the errors at the reference points; with a folder it writes each map as a PNG to look at.

use std::error::Error;
use std::path::{Path, PathBuf};

use bevy_ecs::world::World;
use lumbre_bake::{Bake, BakeOptions, Density, FormFactorMethod, Quality};

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/held_out/mod.rs"]
mod held_out;

fn main() -> Result<(), Box<dyn Error>> {
    let mut options = BakeOptions::default();
    let (mut paths, mut csv, mut maps) = (Vec::new(), None, None);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or_else(|| format!("{argument} needs a value"));
        match argument.as_str() {
            "--map-size" => options.density = Density::MapSize(value()?.parse()?),
            "--texels-per-meter" => options.density = Density::TexelsPerMeter(value()?.parse()?),
            "--error" => options.error = value()?.parse()?,
            "--time" => options.time = Some(std::time::Duration::try_from_secs_f64(value()?.parse()?)?),
            "--seed" => options.seed = value()?.parse()?,
            "--threads" => options.threads = Some(value()?.parse()?),
            "--draft" => options.quality = Quality::Draft,
            "--reference" => options.quality = Quality::Reference,
            "--no-denoise" => options.denoise = false,
            "--no-seams" => options.seams = false,
            "--no-resolution-error" => options.resolution_error = false,
            "--global-lines" => options.form_factors = FormFactorMethod::GlobalLines,
            "--csv" => csv = Some(PathBuf::from(value()?)),
            "--maps" => maps = Some(PathBuf::from(value()?)),
            _ => paths.push(PathBuf::from(&argument)),
        }
    }
    let [input, output] = &paths[..] else { return Err("give an input and an output file".into()) };
    let mut world = held_out::input::world_of(input)?;
    let report = Bake::new(&options).run(&mut world)?;
    eprint!("{report}");
    if let Some(csv) = csv {
        let comparison = common::compare(&mut world, &common::read_reference(&csv));
        eprintln!("{comparison}");
        for (position, irradiance, expected) in &comparison.worst {
            eprintln!("  at {position:.3}: {irradiance:.4} instead of {expected:.4}");
        }
    }
    if let Some(folder) = maps {
        write_maps(&mut world, &folder)?;
    }
    lumbre_scene::save(&mut world, output)?;
    Ok(())
}

/// Writes the maps as PNG files, tone-mapped such that the mean of the lit texels is shown at half of full brightness.
fn write_maps(world: &mut World, folder: &Path) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(folder)?;
    let maps = common::maps(world);
    let lit = maps.iter().flat_map(|(_, image)| &image.texels).filter(|texel| texel.element_sum() > 0.0);
    let (sum, count) =
        lit.fold((0.0, 0.0), |(sum, count), texel| (sum + texel.element_sum() / 3.0, count + 1.0));
    let exposure = if sum > 0.0 { count / sum } else { 1.0 };
    for (name, map) in maps {
        let shade = |x: f32| (255.0 * (exposure * x / (1.0 + exposure * x)).powf(1.0 / 2.2)) as u8;
        let bytes = map.texels.iter().flat_map(|texel| texel.to_array().map(shade)).collect();
        let picture =
            image::RgbImage::from_raw(map.width, map.height, bytes).ok_or("a map without texels")?;
        picture.save(folder.join(name).with_extension("png"))?;
    }
    Ok(())
}
