//! `lumbre tune`: finds the settings that draw a level within a time or an error, and writes the level with
//! them.

use std::io::Write;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Mutex;

use anyhow::bail;
use lumbre::cost::{CostError, DrawSettings, Goal, LIGHTMAP_BYTES, PAGE, TuneOptions, Tuned, tune};
use lumbre::render::Gpu;
use lumbre::scene::{FileSettings, save_settings};

use crate::arguments::Tune;
use crate::interruption::Interruption;
use crate::progress::{Progress, Shown};

/// Default width and height of the frames: normally, and with `--quick`.
const SIZES: [(u32, u32); 2] = [(1280, 720), (480, 270)];

/// Runs the command.
pub fn run(asked: &Tune) -> anyhow::Result<()> {
    let goal = Goal { milliseconds: asked.frame_ms, error: asked.error };
    let options = TuneOptions {
        file: asked.input.clone(),
        goal,
        quick: asked.quick,
        size: asked.size.unwrap_or(SIZES[usize::from(asked.quick)]),
    };
    let gpu = Gpu::headless()?;
    let interruption = Interruption::handle();
    let shown = Mutex::new(Shown::of("settings", asked.quiet));
    let tuned = interruption.told(|is_asked| {
        tune(&gpu, &options, asked.report.as_deref(), &|fraction| {
            if let (Some(fraction), Ok(mut shown)) = (fraction, shown.lock()) {
                let fraction = fraction as f32;
                shown.update(Progress { stage: "frames", stage_fraction: fraction, fraction, error: None });
            }
            if is_asked() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
    });
    if let Ok(shown) = shown.lock() {
        shown.finish();
    }
    let tuned = match tuned {
        Err(CostError::Interrupted) => bail!("interrupted; nothing was written"),
        tuned => tuned?,
    };
    print(&tuned, asked)?;
    let chosen = tuned.chosen.and_then(|place| tuned.settings.get(place));
    match (chosen, &asked.output) {
        (Some(settings), Some(output)) => write(settings, asked, output),
        (None, _) if goal != Goal::default() => bail!("no settings keep the goal; nothing was written"),
        _ => Ok(()),
    }
}

fn print(tuned: &Tuned, asked: &Tune) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    let points = &tuned.study.points;
    let width = points.iter().map(|point| point.label.len()).max().unwrap_or(0);
    let with_lightmaps = points.iter().any(|point| point.counts.contains_key(LIGHTMAP_BYTES));
    let lightmaps = if with_lightmaps { "  lightmaps, MB" } else { "" };
    writeln!(out, "{:width$}  {:>10}  {:>9}{lightmaps}", "the front", "ms", "error, %")?;
    for &place in &tuned.front {
        let point = &points[place];
        let (time, error) =
            (point.milliseconds.map_or(f64::NAN, |time| time.median), point.error.unwrap_or_default());
        let mark = if tuned.chosen == Some(place) { " <" } else { "" };
        let bytes = point.counts.get(LIGHTMAP_BYTES);
        let bytes = bytes.map_or_else(String::new, |bytes| format!("  {:>13.3}", bytes / 1e6));
        let error = 100.0 * error.relative_rmse;
        writeln!(out, "{:width$}  {time:>10.2}  {error:>9.3}{bytes}{mark}", point.label)?;
    }
    for line in tuned.study.findings.iter().chain(&tuned.study.notes) {
        writeln!(out, "{line}")?;
    }
    if let Some(settings) = tuned.chosen.and_then(|place| tuned.settings.get(place)) {
        writeln!(out, "lumbre render {} {}", asked.input.display(), settings.arguments())?;
    }
    if let Some(report) = &asked.report {
        writeln!(out, "{}", report.join(PAGE).display())?;
    }
    Ok(())
}

/// Writes the level with the chosen settings.
fn write(settings: &DrawSettings, asked: &Tune, output: &Path) -> anyhow::Result<()> {
    let DrawSettings { shading, lightmap_reduction, .. } = *settings;
    let settings = FileSettings { shading, frame: settings.frame(), lightmap_reduction };
    let saved = save_settings(&asked.input, output, settings)?;
    let bytes: u64 = saved.lightmaps.iter().map(|file| file.bytes).sum();
    let maps = match saved.lightmaps.len() {
        0 => String::new(),
        files => format!(" and smaller lightmaps: {files} files of {:.3} MB in all", bytes as f64 / 1e6),
    };
    eprintln!("lumbre: {} has these settings{maps}", output.display());
    Ok(())
}
