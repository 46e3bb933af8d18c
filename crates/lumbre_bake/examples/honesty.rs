//! Compares the error that a bake states for each texel with the true one: `honesty IN.glb|SCENE [--map-size
//! N|--texels-per-meter N|--automatic] [--error X[,X…]] [--draft] [--raw] [--open-seams] [--alone] [--truth FILE]
//! [--pictures FOLDER]`.
//!
//! It bakes a file (or a held-out scene by its name) with the given options and again to convergence, with the same
//! texels, and prints the true error beside the stated one and where they differ most. With `--alone` there is no
//! converged bake, and only the cost is printed. With `--truth FILE` the converged maps are read from the file, or
//! written to it if there is none. Pictures show the ratio of the true error to twice the stated one: grey up to 1, red
//! above.

#![allow(clippy::print_stdout, reason = "a program whose result is text")]

use std::error::Error;
use std::path::{Path, PathBuf};

use glam::Vec3;
use lumbre_bake::{Bake, BakeOptions, BakeReport, Density, Quality, TexelErrors};
use lumbre_scene::Lightmap;

#[path = "../tests/held_out/input.rs"]
mod input;
#[path = "../tests/held_out/random.rs"]
mod random;
#[path = "../tests/held_out/scenes/mod.rs"]
mod scenes;

fn main() -> Result<(), Box<dyn Error>> {
    let mut options = BakeOptions { density: Density::MapSize(64), ..BakeOptions::default() };
    let (mut paths, mut pictures_folder, mut errors) = (Vec::new(), None, vec![options.error]);
    let (mut truth_file, mut alone) = (None, false);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or_else(|| format!("{argument} needs a value"));
        match argument.as_str() {
            "--map-size" => options.density = Density::MapSize(value()?.parse()?),
            "--texels-per-meter" => options.density = Density::TexelsPerMeter(value()?.parse()?),
            "--automatic" => options.density = Density::Automatic,
            "--error" => errors = value()?.split(',').map(str::parse).collect::<Result<_, _>>()?,
            "--seed" => options.seed = value()?.parse()?,
            "--draft" => options.quality = Quality::Draft,
            "--alone" => alone = true,
            "--raw" => options.denoise = false,
            "--open-seams" => options.seams = false,
            "--truth" => truth_file = Some(PathBuf::from(value()?)),
            "--pictures" => pictures_folder = Some(PathBuf::from(value()?)),
            _ => paths.push(PathBuf::from(&argument)),
        }
    }
    let [input] = &paths[..] else { return Err("give an input file".into()) };
    let converged =
        BakeOptions { quality: Quality::Reference, error: 2e-3, seed: 99, denoise: false, ..options };
    if alone {
        for error in errors {
            let (report, _) = baked(input, &BakeOptions { error, ..options })?;
            println!(
                "{error}: {:.2} s, {} rays, {:.0} per texel, states {:.3} %",
                report.seconds,
                report.rays,
                report.gather_rays,
                100.0 * report.estimated_error
            );
        }
        return Ok(());
    }
    let truth = match &truth_file {
        Some(path) if path.exists() => read_truth(path)?,
        _ => {
            let (reference, truth) = baked(input, &converged)?;
            println!(
                "reference: {:.1} s, states {:.3} %",
                reference.seconds,
                100.0 * reference.estimated_error
            );
            if let Some(path) = &truth_file {
                write_truth(path, &truth)?;
            }
            truth
        }
    };
    for error in errors {
        let (report, maps) = baked(input, &BakeOptions { error, ..options })?;
        print!("{error}: ");
        compare(&report, &maps, &truth);
        if let Some(folder) = &pictures_folder {
            write_pictures(&folder.join(error.to_string()), &maps, &truth)?;
        }
    }
    Ok(())
}

fn write_truth(path: &Path, truth: &[(String, Map)]) -> Result<(), Box<dyn Error>> {
    let rows = truth.iter().map(|(name, map)| {
        let texels: Vec<[f32; 3]> = map.texels.iter().map(|texel| texel.to_array()).collect();
        // JSON has no NaN: -1 stands for it.
        let errors: Vec<f32> =
            map.errors.iter().map(|&error| if error.is_nan() { -1.0 } else { error }).collect();
        (name, map.width, texels, errors)
    });
    Ok(std::fs::write(path, serde_json::to_vec(&rows.collect::<Vec<_>>())?)?)
}

fn read_truth(path: &Path) -> Result<Vec<(String, Map)>, Box<dyn Error>> {
    type Row = (String, u32, Vec<[f32; 3]>, Vec<f32>);
    let rows: Vec<Row> = serde_json::from_slice(&std::fs::read(path)?)?;
    let map = |(name, width, texels, errors): Row| {
        let errors = errors.into_iter().map(|error| if error < 0.0 { f32::NAN } else { error }).collect();
        (name, Map { width, texels: texels.into_iter().map(Vec3::from).collect(), errors })
    };
    Ok(rows.into_iter().map(map).collect())
}

/// The root mean square of the differences of the channels.
fn rms_difference(a: Vec3, b: Vec3) -> f64 {
    f64::from((a - b).length()) / 3f64.sqrt()
}

fn write_pictures(
    folder: &Path,
    maps: &[(String, Map)],
    truth: &[(String, Map)],
) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(folder)?;
    for ((name, map), (_, truth)) in maps.iter().zip(truth) {
        let shade = |index: usize| {
            let stated = f64::from(map.errors[index]).hypot(f64::from(truth.errors[index]));
            let ratio = rms_difference(map.texels[index], truth.texels[index]) / (2.0 * stated);
            let grey = (160.0 * ratio.min(1.0)) as u8;
            match ratio {
                ratio if ratio.is_nan() => [0, 0, 60],
                ratio if ratio > 1.0 => [255, (255.0 * (ratio - 1.0).min(1.0)) as u8, 0],
                _ => [grey; 3],
            }
        };
        let bytes = (0..map.texels.len()).flat_map(shade).collect();
        let height = map.texels.len() as u32 / map.width;
        let picture = image::RgbImage::from_raw(map.width, height, bytes).ok_or("a map without texels")?;
        picture.save(folder.join(name).with_extension("png"))?;
    }
    Ok(())
}

/// Prints the stated and the true error of a bake, and the texels and maps where they differ most.
fn compare(report: &BakeReport, maps: &[(String, Map)], truth: &[(String, Map)]) {
    let (mut squares, mut stated_squares, mut mean, mut count, mut within) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let mut texels = Vec::new();
    for ((name, map), (_, truth)) in maps.iter().zip(truth) {
        for (index, (texel, expected)) in map.texels.iter().zip(&truth.texels).enumerate() {
            let (stated, truth_stated) = (f64::from(map.errors[index]), f64::from(truth.errors[index]));
            if !(stated.is_finite() && truth_stated.is_finite()) {
                continue;
            }
            let error = rms_difference(*texel, *expected);
            squares += error * error;
            stated_squares += stated * stated;
            mean += f64::from(expected.element_sum()) / 3.0;
            count += 1.0;
            within += f64::from(u8::from(error <= 2.0 * stated.hypot(truth_stated)));
            texels.push((
                error,
                stated,
                truth_stated,
                name,
                index as u32 % map.width,
                index as u32 / map.width,
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
    let pairs: Vec<(Vec3, Vec3)> = texels.iter().map(|texel| (texel.6, texel.7)).collect();
    print_errors_by_brightness(&pairs);
    // True error, stated error, stated error of the truth, map, x, y, value, expected value.
    type TexelError<'a> = (f64, f64, f64, &'a String, u32, u32, Vec3, Vec3);
    let mut list = |title: &str, key: &dyn Fn(&TexelError<'_>) -> f64| {
        texels.sort_by(|a, b| key(b).total_cmp(&key(a)));
        println!("{title}");
        for (error, stated, truth_stated, name, x, y, texel, expected) in texels.iter().take(8) {
            let percent = |value: f64| 100.0 * value / mean;
            println!(
                "  {name} ({x}, {y}): {:.2} % stated {:.2} % (reference {:.2} %), {texel:.3} instead of {expected:.3}",
                percent(*error),
                percent(*stated),
                percent(*truth_stated)
            );
        }
    };
    list("worst", &|texel| texel.0);
    list("least honest", &|texel| texel.0 / texel.1.hypot(texel.2).max(1e-4 * mean));
    let mut maps: Vec<(&String, u32, u32)> = Vec::new();
    for (error, stated, truth_stated, name, ..) in &texels {
        let failed = u32::from(*error > 2.0 * stated.hypot(*truth_stated));
        match maps.iter_mut().find(|(other, ..)| other == name) {
            Some((_, all, failures)) => (*all, *failures) = (*all + 1, *failures + failed),
            None => maps.push((name, 1, failed)),
        }
    }
    maps.sort_by_key(|(_, _, failures)| std::cmp::Reverse(*failures));
    println!("most beyond twice theirs");
    for (name, all, failures) in maps.iter().take(12) {
        let share = 100.0 * f64::from(*failures) / f64::from(*all);
        println!("  {name}: {failures} of {all} texels, {share:.1} %");
    }
}

/// Prints the errors relative to a texel's own light for bands of brightness. Relative to the mean of a sunlit level,
/// the errors of its many dim texels would vanish. The texels are pairs of the value and the expected value.
fn print_errors_by_brightness(texels: &[(Vec3, Vec3)]) {
    /// The number of bands; each is twice as bright as the one below.
    const BANDS: usize = 24;
    let channel_mean = |light: Vec3| f64::from(light.element_sum()) / 3.0;
    let brightest = texels.iter().map(|(_, expected)| channel_mean(*expected)).fold(0.0, f64::max);
    println!("by light, relative to a texel's own");
    for band in (0..BANDS).rev() {
        let low = brightest * 0.5f64.powi(band as i32 + 1);
        let in_band =
            texels.iter().filter(|(_, expected)| (low..2.0 * low).contains(&channel_mean(*expected)));
        let mut errors: Vec<(f64, f64, f64)> = in_band
            .map(|&(texel, expected)| {
                let mean = channel_mean(expected);
                (channel_mean(texel), mean, rms_difference(texel, expected) / mean)
            })
            .collect();
        if errors.len() < 100 {
            continue;
        }
        errors.sort_by(|a, b| a.2.total_cmp(&b.2));
        let (sum, expected) =
            errors.iter().fold((0.0, 0.0), |sums, texel| (sums.0 + texel.0, sums.1 + texel.1));
        let percentile = |share: f64| 100.0 * errors[(errors.len() as f64 * share) as usize].2;
        println!(
            "  {low:9.4} to {:9.4}: {:7} texels, median {:6.2} %, p95 {:6.2} %, bias {:+6.2} %",
            2.0 * low,
            errors.len(),
            percentile(0.5),
            percentile(0.95),
            100.0 * (sum / expected - 1.0)
        );
    }
}

/// A baked map with the stated errors of its texels.
struct Map {
    width: u32,
    texels: Vec<Vec3>,
    errors: Vec<f32>,
}

/// Maps with their names, sorted by name.
type Maps = Vec<(String, Map)>;

fn baked(input: &Path, options: &BakeOptions) -> Result<(BakeReport, Maps), Box<dyn Error>> {
    let mut world = input::world_of(input)?;
    let report = Bake::new(options).run(&mut world)?;
    let mut query = world.query::<(&Lightmap, &TexelErrors)>();
    let mut maps: Vec<(String, Map)> = query
        .iter(&world)
        .map(|(map, errors)| {
            let image = &map.image;
            let texels = image.texels.clone();
            (image.name.clone(), Map { width: image.width, texels, errors: errors.0.to_vec() })
        })
        .collect();
    maps.sort_by(|a, b| a.0.cmp(&b.0));
    maps.dedup_by(|a, b| a.0 == b.0);
    Ok((report, maps))
}
