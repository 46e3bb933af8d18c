//! Whether the times of a report are those that `lumbre render --timings` states: runs the command of every frame of a report that `lumbre cost` has made in several processes, and prints both. Compared are
//! lower quartiles, the least of all processes and of all reports (of the same scenes and settings), if there are several: on a software rasterizer a whole process may be slow, because of how the operating system spreads the threads of a frame over the cores, and none is fast by chance.
//! Exit status 1 if they are off by more than a tenth in the median.
//!
//! `cargo run --release -p lumbre --example cost_times -- REPORT… [STUDY…]`, with the program built beside it (`cargo build --release`).

#![allow(clippy::print_stdout, reason = "a program whose result is text")]

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use anyhow::{Context, bail};
use lumbre::cost::{CostReport, Point, Spread, command_words, read_report};

/// By how much the two may differ in the median, as a share.
const APART: f64 = 0.1;
/// Frames that pipelines are made for, and in which invocations are counted.
const COLD: usize = 2;
/// Processes that draw each frame, in turns with those of the others.
const PROCESSES: usize = 3;
/// Frames of each process.
const FRAMES: usize = 40;

fn main() -> anyhow::Result<ExitCode> {
    let named: Vec<String> = std::env::args().skip(1).collect();
    let (folders, studies): (Vec<String>, Vec<String>) =
        named.into_iter().partition(|name| Path::new(name).is_dir());
    let folder = PathBuf::from(folders.first().context("name the folder of a report")?);
    let program = program()?;
    let report = read_report(&folder)?;
    let others: Vec<CostReport> =
        folders[1..].iter().map(|other| read_report(Path::new(other))).collect::<Result<_, _>>()?;
    if others.iter().any(|other| other.settings != report.settings) {
        bail!("the reports have different settings");
    }
    println!("{}; {}", report.machine.adapter, report.machine.version);
    let mut frames = Vec::new();
    for study in report.studies.iter().filter(|study| studies.is_empty() || studies.contains(&study.name)) {
        for point in &study.points {
            let commands = command_words(&point.command);
            // A frame of a quick report has one command, one of a full report one for its picture and one
            // for its time. Whatever bakes first is left out.
            let Some(timed) = commands.last().filter(|words| words.iter().any(|word| word == "--timings"))
            else {
                continue;
            };
            let draws = |words: &Vec<String>| words.get(1).is_some_and(|command| command == "render");
            if let Some(reported) = point.milliseconds
                && commands.iter().all(draws)
            {
                let name = format!("{} | {}, {}", study.name, point.series, point.label);
                let same = others.iter().filter_map(|other| {
                    let points = &other.study(&study.name)?.points;
                    let is_same = |found: &&Point| found.series == point.series && found.label == point.label;
                    Some(points.iter().find(is_same)?.milliseconds?.lower)
                });
                let least = same.fold(reported.lower, f64::min);
                frames.push((name, with_more_frames(timed), (reported, least), Vec::new()));
            }
        }
    }
    for _ in 0..PROCESSES {
        for (_, words, _, stated) in &mut frames {
            stated.push(timed(&program, words, &folder)?);
        }
    }
    println!(
        "| study | point | report, ms | --timings, ms, in {PROCESSES} processes | ratio |\n|---|---|---|---|---|"
    );
    let mut ratios = Vec::new();
    for (name, _, (reported, of_reports), stated) in &frames {
        let least = stated.iter().map(|one: &Spread| one.lower).fold(f64::INFINITY, f64::min);
        let ratio = of_reports / least;
        let all: Vec<String> = stated
            .iter()
            .map(|one| format!("{:.2} ({:.2} to {:.2})", one.median, one.lower, one.upper))
            .collect();
        let Spread { median, lower, upper, .. } = reported;
        println!("| {name} | {median:.2} ({lower:.2} to {upper:.2}) | {} | {ratio:.2} |", all.join(", "));
        ratios.push(ratio);
    }
    let Some(all) = Spread::of_median(&ratios) else {
        bail!("no point of the report is a frame with a time")
    };
    let within = ratios.iter().filter(|ratio| (*ratio - 1.0).abs() <= APART).count();
    println!(
        "{within} of {} lower quartiles within {} %; in the median {:.3} times ({:.3} to {:.3})",
        ratios.len(),
        100.0 * APART,
        all.median,
        all.lower,
        all.upper
    );
    Ok(if (all.median - 1.0).abs() <= APART { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The words of a command that draws, with the number of frames that are wanted here.
fn with_more_frames(words: &[String]) -> Vec<String> {
    let is_number = |place: usize| place > 0 && words[place - 1] == "--frames";
    let word =
        |(place, word): (usize, &String)| if is_number(place) { FRAMES.to_string() } else { word.clone() };
    words.iter().enumerate().map(word).collect()
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
