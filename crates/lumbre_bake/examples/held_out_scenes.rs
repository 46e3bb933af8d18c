//! Writes the held-out scenes and, on request, reference points: `held_out_scenes FOLDER [NAME …] [--points N]`.
//!
//! NAME.glb is written into FOLDER; for rooms and halls also NAME_small.glb (scaled by 2⁻⁷) and NAME_large.glb (by
//! 2¹⁰). With `--points`, NAME.csv has the columns of the conformance suite; the standard error of a point is 0.4 % of
//! its irradiance unless 58,000 paths leave more.

use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/held_out/mod.rs"]
mod held_out;

use held_out::path_tracer::{Effort, Irradiance, PathTracer};

fn main() -> Result<(), Box<dyn Error>> {
    let (mut points, mut words) = (None, Vec::new());
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--points" => points = Some(arguments.next().ok_or("--points needs a number")?.parse()?),
            _ => words.push(argument),
        }
    }
    let (folder, names) = words.split_first().ok_or("give a folder")?;
    let folder = PathBuf::from(folder);
    std::fs::create_dir_all(&folder)?;
    for (name, scene, layout) in held_out::scenes::all() {
        if !names.is_empty() && !names.iter().any(|requested| *requested == name) {
            continue;
        }
        let scales = [("", 1.0), ("_small", 1.0 / 128.0), ("_large", 1024.0)];
        let all_scales = held_out::scenes::of_any_scale().iter().any(|(other, ..)| *other == name);
        for (suffix, scale) in &scales[..if all_scales { 3 } else { 1 }] {
            let mut world = scene(layout, *scale);
            lumbre_scene::save(&mut world, &folder.join(format!("{name}{suffix}.glb")))?;
        }
        if let Some(count) = points {
            let started = Instant::now();
            let tracer = PathTracer::new(&mut scene(layout, 1.0)).with_indirect_cache(layout);
            let reference = tracer.points(count, Effort::reference(), 7 + layout);
            held_out::reference_points::write(&folder.join(format!("{name}.csv")), &reference)?;
            eprintln!("{name}: {}, {:.0} s", summary(&reference), started.elapsed().as_secs_f64());
        }
    }
    Ok(())
}

/// A line about the points: their number, mean irradiance, and relative standard errors.
fn summary(points: &[Irradiance]) -> String {
    let mean = |point: &Irradiance| point.value.element_sum() / 3.0;
    let inside: Vec<_> = points.iter().filter(|point| point.inside).collect();
    let sum: f64 = inside.iter().map(|point| mean(point)).sum();
    let mut errors: Vec<f64> = inside
        .iter()
        .map(|point| point.error.element_sum() / (3.0 * mean(point)))
        .filter(|error| error.is_finite())
        .collect();
    errors.sort_by(f64::total_cmp);
    let percentile =
        |share: f64| errors.get((share * errors.len() as f64) as usize).map_or(0.0, |error| 100.0 * error);
    let edges = inside.iter().filter(|point| point.edge).count();
    format!(
        "{} points, {} inside, {edges} of them near edges; mean {:.4}, errors relative to a point's own light: median {:.2} %, p95 {:.2} %",
        points.len(),
        inside.len(),
        sum / inside.len() as f64,
        percentile(0.5),
        percentile(0.95)
    )
}
