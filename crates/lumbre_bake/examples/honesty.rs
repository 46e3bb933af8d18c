//! How honest the stated error is: `honesty IN.glb [--map-size N] [--error X] [--quality draft|final]` bakes a file as asked and to
//! convergence, texel by texel the same maps, and prints the true error beside the stated one, with where they differ most.

use std::error::Error;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use bevy_ecs::world::World;
use glam::Vec3;
use lumbre_bake::{BakeOptions, BakeReport, Density, LightmapError, Quality, bake};
use lumbre_scene::{Lightmap, Name};

fn main() -> Result<(), Box<dyn Error>> {
    let mut options = BakeOptions { density: Density::MapSize(64), ..BakeOptions::default() };
    let mut paths = Vec::new();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or_else(|| format!("{argument} needs a value"));
        match argument.as_str() {
            "--map-size" => options.density = Density::MapSize(value()?.parse()?),
            "--texels-per-meter" => options.density = Density::TexelsPerMeter(value()?.parse()?),
            "--error" => options.error = value()?.parse()?,
            "--seed" => options.seed = value()?.parse()?,
            "--draft" => options.quality = Quality::Draft,
            _ => paths.push(PathBuf::from(&argument)),
        }
    }
    let [input] = &paths[..] else { return Err("give an input file".into()) };
    let converged =
        BakeOptions { quality: Quality::Reference, error: 2e-3, seed: 99, denoise: false, ..options };
    let (reference, truth) = baked(input, &converged)?;
    println!("reference: {:.1} s, states {:.3} %", reference.seconds, 100.0 * reference.estimated_error);
    let (report, found) = baked(input, &options)?;
    let (mut squares, mut stated_squares, mut mean, mut count, mut within) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let mut texels = Vec::new();
    for ((name, found), (_, truth)) in found.iter().zip(&truth) {
        for (at, (texel, expected)) in found.texels.iter().zip(&truth.texels).enumerate() {
            let (stated, also) = (f64::from(found.errors[at]), f64::from(truth.errors[at]));
            if !(stated.is_finite() && also.is_finite()) {
                continue;
            }
            let apart = f64::from((*texel - *expected).length()) / 3f64.sqrt();
            squares += apart * apart;
            stated_squares += stated * stated;
            mean += f64::from(expected.element_sum()) / 3.0;
            count += 1.0;
            within += f64::from(u8::from(apart <= 2.0 * stated.hypot(also)));
            texels.push((
                apart,
                stated,
                also,
                name,
                at as u32 % found.width,
                at as u32 / found.width,
                *texel,
                *expected,
            ));
        }
    }
    mean /= count;
    println!(
        "{:.2} s, {:.0} rays per texel: stated {:.3} %, true {:.3} %, {:.2} % of {count} texels within twice theirs",
        report.seconds,
        report.gather_rays,
        100.0 * (stated_squares / count).sqrt() / mean,
        100.0 * (squares / count).sqrt() / mean,
        100.0 * within / count
    );
    type Worst<'a> = (f64, f64, f64, &'a String, u32, u32, Vec3, Vec3);
    let mut list = |title: &str, key: &dyn Fn(&Worst<'_>) -> f64| {
        texels.sort_by(|a, b| key(b).total_cmp(&key(a)));
        println!("{title}");
        for (apart, stated, also, name, x, y, texel, expected) in texels.iter().take(12) {
            let percent = |value: f64| 100.0 * value / mean;
            println!(
                "  {name} ({x}, {y}): {:.2} % stated {:.2} % (reference {:.2} %), {texel:.3} instead of {expected:.3}",
                percent(*apart),
                percent(*stated),
                percent(*also)
            );
        }
    };
    list("worst", &|texel| texel.0);
    list("stated worst", &|texel| texel.1);
    list("least honest", &|texel| texel.0 / texel.1.hypot(texel.2).max(1e-4 * mean));
    Ok(())
}

struct Map {
    width: u32,
    texels: Vec<Vec3>,
    errors: Vec<f32>,
}

fn baked(input: &Path, options: &BakeOptions) -> Result<(BakeReport, Vec<(String, Map)>), Box<dyn Error>> {
    let mut world = World::new();
    lumbre_scene::load(&mut world, input)?;
    let report = bake(&mut world, options, &mut |_| ControlFlow::Continue(()))?;
    let mut query = world.query::<(&Lightmap, &LightmapError, Option<&Name>)>();
    let mut maps: Vec<(String, Map)> = query
        .iter(&world)
        .map(|(map, errors, _)| {
            let image = &map.image;
            let texels = image.texels.clone();
            (image.name.clone(), Map { width: image.width, texels, errors: errors.0.to_vec() })
        })
        .collect();
    maps.sort_by(|a, b| a.0.cmp(&b.0));
    maps.dedup_by(|a, b| a.0 == b.0);
    Ok((report, maps))
}
