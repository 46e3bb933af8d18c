//! Whether the times of a report are those that `lumbre render --timings` states: runs the command of every frame of a report that `lumbre cost` has made, and prints both. Exit status 1 if they are off by
//! more than a tenth in the median.
//!
//! `cargo run --release -p lumbre --example cost_times -- REPORT [STUDY…]`, with the program built beside it (`cargo build --release`).

#![allow(clippy::print_stdout, reason = "a program whose result is text")]

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use anyhow::{Context, bail};
use lumbre::cost::{Spread, command_words, read_report};

/// By how much the two may differ in the median, as a share.
const APART: f64 = 0.1;
/// Frames that pipelines are made for.
const COLD: usize = 2;

fn main() -> anyhow::Result<ExitCode> {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().context("name the folder of a report")?);
    let studies: Vec<String> = arguments.collect();
    let program = program()?;
    let report = read_report(&folder)?;
    println!("{}; {}", report.machine.adapter, report.machine.version);
    println!("| study | point | report, ms | --timings, ms | ratio |\n|---|---|---|---|---|");
    let mut ratios = Vec::new();
    for study in report.studies.iter().filter(|study| studies.is_empty() || studies.contains(&study.name)) {
        for point in &study.points {
            let commands = command_words(&point.command);
            let [words] = &commands[..] else { continue };
            let (Some(reported), true) = (point.milliseconds, words.iter().any(|word| word == "--timings"))
            else {
                continue;
            };
            let stated = timed(&program, words, &folder)?;
            let ratio = reported.median / stated.median;
            println!(
                "| {} | {}, {} | {:.2} ({:.2} to {:.2}) | {:.2} ({:.2} to {:.2}) | {ratio:.2} |",
                study.name,
                point.series,
                point.label,
                reported.median,
                reported.lower,
                reported.upper,
                stated.median,
                stated.lower,
                stated.upper
            );
            ratios.push(ratio);
        }
    }
    let Some(all) = Spread::of_median(&ratios) else {
        bail!("no point of the report is a frame with a time")
    };
    let within = ratios.iter().filter(|ratio| (*ratio - 1.0).abs() <= APART).count();
    println!(
        "{within} of {} within {} %; in the median {:.3} times ({:.3} to {:.3})",
        ratios.len(),
        100.0 * APART,
        all.median,
        all.lower,
        all.upper
    );
    Ok(if (all.median - 1.0).abs() <= APART { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The program that was built beside this one.
fn program() -> anyhow::Result<PathBuf> {
    let own = std::env::current_exe()?;
    let folder = own.parent().and_then(Path::parent).context("an example has a folder")?;
    let program = folder.join("lumbre").with_extension(std::env::consts::EXE_EXTENSION);
    if !program.exists() {
        bail!("{} is not there: build it first", program.display());
    }
    Ok(program)
}

/// Runs a command in the folder of a report.
fn run(program: &Path, words: &[String], folder: &Path) -> anyhow::Result<()> {
    let output = Command::new(program).args(&words[1..]).current_dir(folder).output()?;
    if !output.status.success() {
        bail!("{}: {}", words.join(" "), String::from_utf8_lossy(&output.stderr));
    }
    Ok(())
}

/// The times of the frames that a command draws.
fn timed(program: &Path, words: &[String], folder: &Path) -> anyhow::Result<Spread> {
    run(program, words, folder)?;
    let timings: serde_json::Value = serde_json::from_slice(&std::fs::read(folder.join("times.json"))?)?;
    let frames = timings["frames"].as_array().context("no frames in times.json")?;
    let times: Vec<f64> = frames.iter().skip(COLD).filter_map(|frame| frame["wall_ms"].as_f64()).collect();
    Spread::of(&times).with_context(|| format!("{} drew too few frames", words.join(" ")))
}
