//! Measures the errors of baked levels in the region that a player sees: `level_errors [NAME|FILE.glb …] [--error X]
//! [--time SECONDS] [--seed N] [--texels-per-meter N] [--points N] [--cache FOLDER] [--reference]
//! [--anew|--paths|--converged] [--point-error X] [--flip] [--pictures FOLDER] [--stages] [--no-denoise] [--no-seams] [--patch-texels N]`.
//!
//! It bakes each level (all of them if none is named) and prints one row for it: errors at reference points away from
//! shadow edges, relative to the light around a point. The reference points are read from the cache or from the tests'
//! folder (not from the latter with `--anew`) and computed if there are none; `--points 0` does without. With `--paths`
//! they are computed by paths that no cached light cuts short, unbiased and noisy. With `--converged` the points show
//! what a converged bake of the same texels has there: then the errors are those that more rays would remove, without
//! what the map's resolution leaves and without a reference's noise. `--point-error` is the standard error of new points
//! as a share of their light (0.004 if it is not given): where bakes are about as exact as that, it is a part of the
//! errors that are printed.
//!
//! With `--flip` the level's view is compared with that of a converged bake of the same texels, which is also stored in
//! the cache; with `--pictures` the views are written, the converged one only with `--flip`.

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

use held_out::path_tracer::{Effort, Irradiance, PathTracer};
use held_out::point_errors::{self, PointErrors};
use held_out::view::{View, write_png};
use held_out::{reference_points, scenes};
use lumbre_trace::flip::mean_flip;

/// The size of a view in pixels.
const WIDTH: usize = 640;
const HEIGHT: usize = 400;
/// The largest number of batches of 576 paths for a point with `--paths`.
const MAX_BATCHES: usize = 1200;
/// The number of worst points that are listed.
const WORST: usize = 24;
/// Paths of a point, two batches of so many squared, where they only decide whether the edge of a shadow is near.
const EDGE_PATHS: usize = 8;
/// The time limit of a converged bake.
const CONVERGED_TIME: Duration = Duration::from_secs(900);

/// The command line.
struct Request {
    options: BakeOptions,
    points: usize,
    cache: Option<PathBuf>,
    flip: bool,
    pictures: Option<PathBuf>,
    stages: bool,
    reference: Reference,
    effort: Effort,
}

/// What bakes are compared with.
#[derive(Clone, Copy, PartialEq)]
enum Reference {
    /// The points in the tests' folder; where there are none, as [`Reference::CachedLight`].
    Stored,
    /// New points, by paths that end in cached light.
    CachedLight,
    /// New points by full paths, which are unbiased but far noisier.
    Paths,
    /// A converged bake of the same texels.
    Converged,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut request = Request {
        options: BakeOptions::default(),
        points: 800,
        cache: None,
        flip: false,
        pictures: None,
        stages: false,
        reference: Reference::Stored,
        effort: Effort::reference(),
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
            "--point-error" => request.effort = Effort::reference_to(value()?.parse()?),
            "--anew" => request.reference = Reference::CachedLight,
            "--paths" => request.reference = Reference::Paths,
            "--converged" => request.reference = Reference::Converged,
            "--reference" => options.quality = Quality::Reference,
            "--no-denoise" => options.denoise = false,
            "--no-seams" => options.seams = false,
            "--patch-texels" => options.patch_texels = Some(value()?.parse()?),
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
        print_row(name, &request)?;
    }
    Ok(())
}

/// Bakes a level, measures it and prints its row.
fn print_row(name: &str, request: &Request) -> Result<(), Box<dyn Error>> {
    let build = || world_of(Path::new(name));
    let name = Path::new(name).file_stem().unwrap_or_default().to_string_lossy();
    let name = name.as_ref();
    let points = match request.points {
        0 => Vec::new(),
        _ => points(name, build()?, request)?,
    };
    let mut world = build()?;
    let report = baked(&mut world, &request.options)?;
    let errors = (!points.is_empty()).then(|| point_errors::measure(&mut world, &points));
    let flip = match request.flip || request.pictures.is_some() {
        true => compared_views(name, &mut world, build, request)?,
        false => "-".to_owned(),
    };
    let columns = errors.as_ref().map_or_else(|| vec!["-".to_owned(); 9], columns).join(" | ");
    println!(
        "| {name} | {} | {:.1} | {:.2} | {columns} | {flip} |",
        report.texels,
        report.seconds,
        100.0 * report.estimated_error,
    );
    if request.stages {
        println!();
        if let Some(errors) = &errors {
            println!("{errors}\n{}", errors.local);
        }
        println!("{report}");
        if let Some(errors) = &errors {
            print_worst(errors, &points);
        }
    }
    Ok(())
}

/// The columns of a row that tell the errors at the points.
fn columns(errors: &PointErrors) -> Vec<String> {
    let away = errors.local.away_from_edges;
    let percent = [
        away.to_point.median,
        away.to_point.p95,
        away.to_log_average.median,
        away.to_log_average.p95,
        away.to_log_average.rmse,
        errors.rmse_without_noise(),
        errors.bias,
    ]
    .map(|x| format!("{:.2}", 100.0 * x));
    let mut columns = vec![format!("{:.3}/{:.3}", errors.local.mean, errors.local.outside)];
    columns.extend(percent);
    columns.push(format!("{} ({:.1e})", errors.leaks.0, errors.leaks.1));
    columns
}

/// Prints percentiles of the signed errors of the points in the region and away from shadow edges, relative to their
/// own light, and lists the worst of these points.
fn print_worst(errors: &PointErrors, points: &[Irradiance]) {
    let counts = |position: DVec3| points.iter().any(|p| p.position == position && p.inside && !p.edge);
    let channel_mean = |light: DVec3| light.element_sum() / 3.0;
    let mut rows: Vec<(f64, &[DVec3; 5])> = errors
        .rows
        .iter()
        .filter(|row| counts(row[0]) && channel_mean(row[3]) > 0.0)
        .map(|row| ((channel_mean(row[2]) - channel_mean(row[3])) / channel_mean(row[3]), row))
        .collect();
    if rows.is_empty() {
        return;
    }
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let percentile = |share: f64| 100.0 * rows[((rows.len() - 1) as f64 * share) as usize].0;
    println!(
        "signed errors of {} points, relative to their own light: {:+.2}, {:+.2}, {:+.2}, {:+.2}, {:+.2} % at the 5th, 25th, 50th, 75th and 95th percentile",
        rows.len(),
        percentile(0.05),
        percentile(0.25),
        percentile(0.5),
        percentile(0.75),
        percentile(0.95)
    );
    rows.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
    for (relative_error, [position, normal, value, expected, error]) in rows.into_iter().take(WORST) {
        println!(
            "  {:+7.2} % at {position:.3}, normal {normal:.1}: {:.4}, expected {:.4} ± {:.4}",
            100.0 * relative_error,
            channel_mean(*value),
            channel_mean(*expected),
            channel_mean(*error)
        );
    }
}

fn baked(world: &mut World, options: &BakeOptions) -> Result<BakeReport, Box<dyn Error>> {
    Ok(Bake::new(options).run(world)?)
}

/// Reads the level's reference points from the cache or the tests' folder; if there are none, computes them and stores
/// them in the cache.
fn points(name: &str, mut world: World, request: &Request) -> Result<Vec<Irradiance>, Box<dyn Error>> {
    let tests_folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference");
    let extension = if request.reference == Reference::Converged { "converged.csv" } else { "csv" };
    let file = |folder: &Path| folder.join(name).with_extension(extension);
    let tests_folder = Some(&tests_folder).filter(|_| request.reference == Reference::Stored);
    for folder in request.cache.iter().chain(tests_folder) {
        if file(folder).exists() {
            return Ok(reference_points::read(&file(folder)));
        }
    }
    let tracer = PathTracer::new(&mut world);
    let points = match request.reference {
        Reference::Converged => {
            let points = tracer.points(request.points, Effort::fixed(2, EDGE_PATHS), 7);
            converged_points(world, &points, &request.options)?
        }
        Reference::Paths => {
            let [_, most] = request.effort.batches;
            let effort = Effort { batches: [16, most.max(MAX_BATCHES)], ..request.effort };
            tracer.points(request.points, effort, 7)
        }
        Reference::Stored | Reference::CachedLight => {
            tracer.with_indirect_cache(7).points(request.points, request.effort, 7)
        }
    };
    if let Some(folder) = &request.cache {
        reference_points::write(&file(folder), &points)?;
    }
    Ok(points)
}

/// The points with the light that a converged bake of the same texels shows there, as if it were exact.
fn converged_points(
    mut world: World,
    points: &[Irradiance],
    options: &BakeOptions,
) -> Result<Vec<Irradiance>, Box<dyn Error>> {
    let report = baked(&mut world, &converged(options))?;
    eprintln!("converged: {report}");
    let surfaces = common::lightmapped(&mut world);
    let shown = points.iter().filter_map(|point| {
        let Irradiance { position, normal, value: irradiance, .. } = *point;
        let value = common::look_up(&surfaces, &common::ReferencePoint { position, normal, irradiance })?;
        Some(Irradiance { value, error: DVec3::ZERO, ..*point })
    });
    Ok(shown.collect())
}

/// The options of a converged bake of the same texels.
fn converged(options: &BakeOptions) -> BakeOptions {
    let (quality, time) = (Quality::Reference, Some(CONVERGED_TIME));
    BakeOptions { quality, error: 2e-3, time, seed: 99, denoise: true, seams: true, ..*options }
}

/// The mean FLIP error between the views of this bake and of a converged one, both with the exposure of the latter.
/// Without `--flip` it only writes the picture of this bake and returns a dash.
fn compared_views(
    name: &str,
    world: &mut World,
    scene: impl Fn() -> Result<World, lumbre_scene::LoadError>,
    request: &Request,
) -> Result<String, Box<dyn Error>> {
    let view = View::of(world, WIDTH, HEIGHT).ok_or("a level without a camera")?;
    if let (Some(folder), false) = (&request.pictures, request.flip) {
        write_png(&view.exposed(view.exposure()), &folder.join(format!("{name}.png")))?;
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
            let report = baked(&mut world, &converged(&request.options))?;
            eprintln!("{name} converged: {report}");
            let view = View::of(&mut world, WIDTH, HEIGHT).ok_or("a level without a camera")?;
            if let Some(file) = &file {
                write_view(&view, file)?;
            }
            view
        }
    };
    let exposure = converged.exposure();
    let [view, converged] = [view, converged].map(|view| view.exposed(exposure));
    if let Some(folder) = &request.pictures {
        write_png(&view, &folder.join(format!("{name}.png")))?;
        write_png(&converged, &folder.join(format!("{name}_converged.png")))?;
    }
    Ok(format!("{:.4}", mean_flip(&converged, &view)))
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
