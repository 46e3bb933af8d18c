//! `lumbre tune`: finds the settings that draw a level within a time or an error, and writes the level with
//! them.

use std::io::Write;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Mutex;

use anyhow::bail;
use lumbre::cost::{CostError, DrawSettings, Goal, PAGE, TuneOptions, Tuned, tune};
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
    writeln!(out, "{:width$}  {:>10}  {:>9}", "the front", "ms", "error, %")?;
    for &place in &tuned.front {
        let point = &points[place];
        let (time, error) =
            (point.milliseconds.map_or(f64::NAN, |time| time.median), point.error.unwrap_or_default());
        let mark = if tuned.chosen == Some(place) { " <" } else { "" };
        writeln!(out, "{:width$}  {time:>10.2}  {:>9.3}{mark}", point.label, 100.0 * error.relative_rmse)?;
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

/// Writes the level with the chosen settings: shading, frame settings, and whether its lights cast shadows.
fn write(settings: &DrawSettings, asked: &Tune, output: &Path) -> anyhow::Result<()> {
    let DrawSettings { shading, shadows, .. } = *settings;
    save_settings(&asked.input, output, FileSettings { shading, shadows, frame: settings.frame() })?;
    eprintln!("lumbre: {} has these settings", output.display());
    Ok(())
}
