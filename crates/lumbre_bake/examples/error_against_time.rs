//! The error of a bake against the time it takes: `error_against_time [--scene NAME] [--threads N] [--rounds N]` bakes
//! the scenes that have converged reference points in several variants and prints a Markdown table with the estimated
//! error, the true error, and the seconds of wall clock and of all processors.
//!
//! `cargo run --release -p lumbre_bake --example error_against_time`. Compare only times of the same run: the load of a
//! machine differs from run to run.

#![allow(clippy::print_stdout, reason = "a program whose result is text")]

use std::error::Error;
use std::path::Path;

use bevy_ecs::world::World;
use lumbre_bake::{Bake, BakeOptions, BakeReport, Density, Quality};

#[path = "../tests/common/mod.rs"]
mod common;

/// A scene with its reference points and the lightmap density that it is baked with.
struct Scene {
    name: &'static str,
    model: &'static str,
    points: &'static str,
    density: Density,
}

const SCENES: [Scene; 2] = [
    Scene {
        name: "Cornell box",
        model: "models/cornell_box.glb",
        points: "conformance/bake/cornell_box.csv",
        density: Density::MapSize(256),
    },
    Scene {
        name: "alcove",
        model: "conformance/bake/alcove.glb",
        points: "conformance/bake/alcove.csv",
        density: Density::TexelsPerMeter(24.0),
    },
];

/// The variants of the options, each with the target errors that it is baked with.
fn variants() -> Vec<(&'static str, BakeOptions, &'static [f64])> {
    // The resolution error needs no estimate: it is part of the true error that is measured here.
    let plain = BakeOptions { resolution_error: false, ..BakeOptions::default() };
    vec![
        ("default", plain, &[0.05, 0.014, 0.01, 0.007, 0.005]),
        ("without denoise", BakeOptions { denoise: false, ..plain }, &[0.05, 0.02, 0.014, 0.01]),
        ("draft", BakeOptions { quality: Quality::Draft, ..plain }, &[0.05]),
    ]
}

fn main() -> Result<(), Box<dyn Error>> {
    let (mut only, mut threads, mut rounds) = (None, None, 1);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or_else(|| format!("{argument} needs a value"));
        match argument.as_str() {
            "--scene" => only = Some(value()?),
            "--threads" => threads = Some(value()?.parse()?),
            "--rounds" => rounds = value()?.parse()?,
            _ => return Err(format!("{argument} is no option").into()),
        }
    }
    println!(
        "| scene | variant | asked % | seconds | processor s | stated % | true RMSE % | median % | p95 % | bias % | million rays | ended |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    for scene in SCENES.iter().filter(|scene| only.as_deref().is_none_or(|only| scene.name.contains(only))) {
        let (Some(model), Some(points)) = (common::shared(scene.model), common::shared(scene.points)) else {
            continue;
        };
        let noise = noise_of_reference(&points)?;
        let points = common::read_reference(&points);
        for (variant, options, errors) in variants() {
            for &error in errors {
                let options = BakeOptions { density: scene.density, error, threads, ..options };
                let (report, comparison, [seconds, processor]) = fastest(&model, &points, &options, rounds)?;
                // The noise of the reference is known and independent of the bake, so that its variance can be
                // subtracted.
                let rmse = (comparison.rmse.powi(2) - (noise / comparison.mean).powi(2)).max(0.0).sqrt();
                let percent = [
                    error,
                    seconds / 100.0,
                    processor / 100.0,
                    report.estimated_error,
                    rmse,
                    comparison.median,
                    comparison.p95,
                    comparison.bias,
                ]
                .map(|value| format!("{:.3}", 100.0 * value));
                println!(
                    "| {} | {variant} | {} | {:.1} | {} |",
                    scene.name,
                    percent.join(" | "),
                    report.rays as f64 * 1e-6,
                    report.ended.to_string().split(':').next_back().unwrap_or_default().trim()
                );
            }
        }
    }
    Ok(())
}

/// Bakes `rounds` times and returns the bake that took the least processor time, with its seconds of wall clock and of
/// processor time: other processes may slow a single bake down.
fn fastest(
    model: &Path,
    points: &[common::ReferencePoint],
    options: &BakeOptions,
    rounds: u32,
) -> Result<(BakeReport, common::Comparison, [f64; 2]), Box<dyn Error>> {
    let mut best: Option<(BakeReport, common::Comparison, [f64; 2])> = None;
    for _ in 0..rounds.max(1) {
        let mut world = World::new();
        lumbre_scene::load(&mut world, model)?;
        let before = processor_seconds();
        let report = Bake::new(options).run(&mut world)?;
        let times = [report.seconds, processor_seconds() - before];
        if best.as_ref().is_none_or(|(.., least)| times[1] < least[1]) {
            best = Some((report, common::compare(&mut world, points), times));
        }
    }
    best.ok_or_else(|| "nothing was baked".into())
}

/// The root mean square of the standard errors that the reference file states for its points, W/m².
fn noise_of_reference(path: &Path) -> Result<f64, Box<dyn Error>> {
    let text = std::fs::read_to_string(path)?;
    let numbers = text.lines().skip(1).flat_map(|line| line.split(',').skip(9).take(3));
    let (mut sum, mut count) = (0.0, 0.0);
    for number in numbers.filter_map(|field| field.parse::<f64>().ok()).filter(|value| value.is_finite()) {
        sum += number * number;
        count += 1.0;
    }
    Ok(if count > 0.0 { (sum / count).sqrt() } else { 0.0 })
}

/// The processor time that this process has used so far, in seconds, summed over all processors. On Linux, fields 14
/// and 15 of `/proc/self/stat` give the user and the system time in hundredths of a second; elsewhere the result is 0.
fn processor_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // The second field is the program's name in parentheses, which may contain spaces.
    let after = text.rsplit(')').next().unwrap_or_default();
    after.split_whitespace().skip(11).take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>()
        / 100.0
}
