//! How far baked levels are off where one looks: `level_errors [NAME|FILE.glb …] [--error X] [--time SECONDS] [--seed N] [--texels-per-meter N] [--points N]
//! [--cache FOLDER] [--reference] [--anew|--paths] [--flip] [--pictures FOLDER] [--stages]` bakes each (all levels without a name) and prints one row: errors relative to the light
//! around a point, away from shadow edges, at reference points of the cache or the tests' folder (not with `--anew`), which are computed where there
//! are none; with `--paths` by paths to their very end, unbiased and noisy.
//!
//! With `--flip` the level's view is compared to that of a converged bake of the same texels, which the cache keeps, too; with `--pictures` the
//! views are written, the converged one only with `--flip`.

#![allow(clippy::print_stdout, reason = "a program whose result is text")]

use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Duration;

use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_bake::{Bake, BakeOptions, BakeReport, Density, Quality};

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/held_out/mod.rs"]
mod held_out;

use held_out::input::world_of;
use held_out::judgement::{Judgement, judge};
use held_out::path_tracer::{Effort, Irradiance, PathTracer};
use held_out::view::{View, write_png};
use held_out::{reference_points, scenes};
use lumbre_trace::flip::mean_flip;

/// Pixels of a view.
const WIDTH: usize = 640;
const HEIGHT: usize = 400;
/// Batches of 576 paths for a point with `--paths`, at most.
const MAX_BATCHES: usize = 1200;
/// Points that are named.
const WORST: usize = 24;
/// What a converged bake may take.
const PATIENCE: Duration = Duration::from_secs(900);

struct Request {
    options: BakeOptions,
    points: usize,
    cache: Option<PathBuf>,
    flip: bool,
    pictures: Option<PathBuf>,
    stages: bool,
    /// Whether the tests' points are left alone.
    anew: bool,
    /// Whether new reference points are unbiased paths to their end, with far more noise.
    paths: bool,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut request = Request {
        options: BakeOptions::default(),
        points: 800,
        cache: None,
        flip: false,
        pictures: None,
        stages: false,
        anew: false,
        paths: false,
    };
    let mut names = Vec::new();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or_else(|| format!("{argument} needs a value"));
        let options = &mut request.options;
        match argument.as_str() {
            "--error" => options.error = value()?.parse()?,
            "--time" => options.time = Some(Duration::try_from_secs_f64(value()?.parse()?)?),
            "--seed" => options.seed = value()?.parse()?,
            "--anew" => request.anew = true,
            "--paths" => (request.paths, request.anew) = (true, true),
            "--reference" => options.quality = Quality::Reference,
            "--threads" => options.threads = Some(value()?.parse()?),
            "--texels-per-meter" => options.density = Density::TexelsPerMeter(value()?.parse()?),
            "--points" => request.points = value()?.parse()?,
            "--cache" => request.cache = Some(value()?.into()),
            "--flip" => request.flip = true,
            "--pictures" => request.pictures = Some(value()?.into()),
            "--stages" => request.stages = true,
            _ => names.push(argument),
        }
    }
    if names.is_empty() {
        names = scenes::levels().iter().map(|(name, ..)| (*name).to_owned()).collect();
    }
    for folder in request.cache.iter().chain(&request.pictures) {
        std::fs::create_dir_all(folder)?;
    }
    println!(
        "| level | texels | seconds | stated % | region/outside | own: median % | p95 % | log-average: median % | p95 % | RMSE % | mean: RMSE % | bias % | leaks | FLIP |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for name in &names {
        row(name, &request)?;
    }
    Ok(())
}

fn row(name: &str, request: &Request) -> Result<(), Box<dyn Error>> {
    let build = || world_of(Path::new(name));
    let name = Path::new(name).file_stem().unwrap_or_default().to_string_lossy();
    let name = name.as_ref();
    let points = points(name, &mut build()?, request)?;
    let mut world = build()?;
    let report = baked(&mut world, &request.options)?;
    let found = judge(&mut world, &points);
    let flip = match request.flip || request.pictures.is_some() {
        true => compared_views(name, &mut world, build, request)?,
        false => "-".to_owned(),
    };
    let away = found.local.away;
    let percent = [
        away.own.median,
        away.own.p95,
        away.around.median,
        away.around.p95,
        away.around.rmse,
        found.own_rmse(),
        found.bias,
    ]
    .map(|x| format!("{:.2}", 100.0 * x));
    println!(
        "| {name} | {} | {:.1} | {:.2} | {:.3}/{:.3} | {} | {} ({:.1e}) | {flip} |",
        report.texels,
        report.seconds,
        100.0 * report.estimated_error,
        found.local.mean,
        found.local.outside,
        percent.join(" | "),
        found.leaks.0,
        found.leaks.1
    );
    if request.stages {
        println!("\n{found}\n{}\n{report}", found.local);
        worst(&found, &points);
    }
    Ok(())
}

/// The points in the region, away from shadow edges, that are farthest off, relative to their own light.
fn worst(found: &Judgement, points: &[Irradiance]) {
    let counts = |position: DVec3| points.iter().any(|p| p.position == position && p.inside && !p.edge);
    let grey = |light: DVec3| light.element_sum() / 3.0;
    let mut rows: Vec<(f64, &[DVec3; 5])> = found
        .rows
        .iter()
        .filter(|row| counts(row[0]) && grey(row[3]) > 0.0)
        .map(|row| ((grey(row[2]) - grey(row[3])) / grey(row[3]), row))
        .collect();
    if rows.is_empty() {
        return;
    }
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let at = |share: f64| 100.0 * rows[((rows.len() - 1) as f64 * share) as usize].0;
    println!(
        "signed errors of {} points, relative to their own light: {:+.2}, {:+.2}, {:+.2}, {:+.2}, {:+.2} % at the 5th, 25th, 50th, 75th and 95th percentile",
        rows.len(),
        at(0.05),
        at(0.25),
        at(0.5),
        at(0.75),
        at(0.95)
    );
    rows.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
    for (off, [position, normal, value, expected, error]) in rows.into_iter().take(WORST) {
        println!(
            "  {:+7.2} % at {position:.3}, normal {normal:.1}: {:.4}, expected {:.4} ± {:.4}",
            100.0 * off,
            grey(*value),
            grey(*expected),
            grey(*error)
        );
    }
}

fn baked(world: &mut World, options: &BakeOptions) -> Result<BakeReport, Box<dyn Error>> {
    Ok(Bake::new(options).run(world)?)
}

/// Those that the tests keep or the cache, or new ones.
fn points(name: &str, world: &mut World, request: &Request) -> Result<Vec<Irradiance>, Box<dyn Error>> {
    let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference");
    let file = |folder: &Path| folder.join(name).with_extension("csv");
    let kept = if request.anew { None } else { Some(&kept) };
    for folder in request.cache.iter().chain(kept) {
        if file(folder).exists() {
            return Ok(reference_points::read(&file(folder)));
        }
    }
    let tracer = PathTracer::new(world);
    let (tracer, effort) = match request.paths {
        true => (tracer, Effort { batches: [16, MAX_BATCHES], ..Effort::reference() }),
        false => (tracer.with_bounced(7), Effort::reference()),
    };
    let found = tracer.points(request.points, effort, 7);
    if let Some(folder) = &request.cache {
        reference_points::write(&file(folder), &found)?;
    }
    Ok(found)
}

/// FLIP between the views of a bake and of a converged one, both exposed for the latter; without the flag only the picture.
fn compared_views(
    name: &str,
    world: &mut World,
    scene: impl Fn() -> Result<World, lumbre_scene::LoadError>,
    request: &Request,
) -> Result<String, Box<dyn Error>> {
    let own = View::of(world, WIDTH, HEIGHT).ok_or("a level without a camera")?;
    if let (Some(folder), false) = (&request.pictures, request.flip) {
        write_png(&own.exposed(own.exposure()), &folder.join(format!("{name}.png")))?;
        return Ok("-".to_owned());
    }
    let density = match request.options.density {
        Density::TexelsPerMeter(density) => format!("_{density}"),
        _ => String::new(),
    };
    let file = request.cache.as_ref().map(|folder| folder.join(format!("{name}{density}.exr")));
    let converged = match &file {
        Some(file) if file.exists() => read_view(file)?,
        _ => {
            let mut world = scene()?;
            let options = BakeOptions {
                quality: Quality::Reference,
                error: 2e-3,
                time: Some(PATIENCE),
                seed: 99,
                ..request.options
            };
            let report = baked(&mut world, &options)?;
            eprintln!("{name} converged: {report}");
            let view = View::of(&mut world, WIDTH, HEIGHT).ok_or("a level without a camera")?;
            if let Some(file) = &file {
                write_view(&view, file)?;
            }
            view
        }
    };
    let exposure = converged.exposure();
    let [own, converged] = [own, converged].map(|view| view.exposed(exposure));
    if let Some(folder) = &request.pictures {
        write_png(&own, &folder.join(format!("{name}.png")))?;
        write_png(&converged, &folder.join(format!("{name}_converged.png")))?;
    }
    Ok(format!("{:.4}", mean_flip(&converged, &own)))
}

fn write_view(view: &View, file: &Path) -> Result<(), Box<dyn Error>> {
    let numbers = view.radiance.iter().flat_map(|color| color.as_vec3().to_array()).collect();
    let height = view.radiance.len() / view.width;
    let image = image::Rgb32FImage::from_raw(view.width as u32, height as u32, numbers);
    Ok(image.ok_or("a view without pixels")?.save(file)?)
}

fn read_view(file: &Path) -> Result<View, Box<dyn Error>> {
    let image = image::open(file)?.into_rgb32f();
    let radiance: Vec<DVec3> = image.pixels().map(|pixel| Vec3::from(pixel.0).as_dvec3()).collect();
    Ok(View { width: image.width() as usize, radiance })
}
