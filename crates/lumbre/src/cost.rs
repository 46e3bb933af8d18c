//! `lumbre cost`: measures what accuracy costs in time, and compares two such reports.

use std::io::Write;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use anyhow::{Context, bail};
use lumbre::cost::{
    CostError, CostOptions, CostReport, PAGE, compare_reports, measure, read_report, studies_named,
};
use lumbre::render::Gpu;

use crate::arguments::Cost;
use crate::interruption::Interruption;
use crate::progress::{Progress, Shown};

/// Default width and height of the pictures: normally, and with `--quick`.
const SIZES: [(u32, u32); 2] = [(480, 270), (240, 135)];

/// Runs the command.
pub fn run(asked: &Cost) -> anyhow::Result<()> {
    match (&asked.compare, &asked.output) {
        (Some(reports), _) => compare(asked, reports),
        (None, Some(output)) => report(asked, output),
        (None, None) => bail!("say with -o where the report goes"),
    }
}

fn report(asked: &Cost, output: &Path) -> anyhow::Result<()> {
    let options = CostOptions {
        files: asked.inputs.clone(),
        studies: studies_named(&asked.studies)?,
        quick: asked.quick,
        counts_only: asked.counts_only,
        size: asked.size.unwrap_or(SIZES[usize::from(asked.quick)]),
        seed: asked.seed,
        resume: asked.resume,
    };
    let gpu = Gpu::headless()?;
    let interruption = Interruption::handle();
    let shown = Mutex::new(Shown::of("report", asked.quiet));
    let measured = interruption.told(|is_asked| {
        measure(&gpu, &options, output, &|progress| {
            if let (Some(fraction), Ok(mut shown)) = (progress.fraction, shown.lock()) {
                let whole = (progress.number as f64 + fraction) / progress.of as f64;
                let (stage_fraction, fraction) = (fraction as f32, whole as f32);
                shown.update(Progress { stage: progress.study, stage_fraction, fraction, error: None });
            }
            if is_asked() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
    });
    if let Ok(shown) = shown.lock() {
        shown.finish();
    }
    match measured {
        Ok(report) => print(&report, output),
        Err(CostError::Interrupted) => {
            bail!(
                "interrupted; {} keeps the studies that are finished, and --resume goes on with them",
                output.display()
            )
        }
        Err(error) => Err(error.into()),
    }
}

fn print(report: &CostReport, output: &Path) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    for study in &report.studies {
        writeln!(out, "{} ({} points in {:.0} s)", study.title, study.points.len(), study.seconds)?;
        for finding in &study.findings {
            writeln!(out, "  {finding}")?;
        }
        for note in &study.notes {
            writeln!(out, "  note: {note}")?;
        }
    }
    writeln!(out, "{}", output.join(PAGE).display())?;
    Ok(())
}

fn compare(asked: &Cost, reports: &[PathBuf]) -> anyhow::Result<()> {
    let [before, after] = reports else { bail!("two reports are compared, not {}", reports.len()) };
    let (before, after) = (read_report(before)?, read_report(after)?);
    let changes = compare_reports(&before, &after, asked.factor);
    let mut out = std::io::stdout().lock();
    if before.settings != after.settings {
        writeln!(
            out,
            "note: the two were measured with different settings, so that counts and errors differ by themselves"
        )?;
    }
    if !before.machine.is_same_place(&after.machine) {
        writeln!(out, "note: the two were measured on different machines: their times say little")?;
    }
    for change in &changes {
        writeln!(out, "{change}")?;
    }
    let worse = changes.iter().filter(|change| change.is_worse()).count();
    let slower = changes.iter().filter(|change| change.is_slower()).count();
    writeln!(
        out,
        "{worse} counts, errors or points are worse beyond a factor of {}, and {slower} times beyond noise and drift; {} other changes",
        asked.factor,
        changes.len() - worse - slower
    )?;
    out.flush().context("standard output")?;
    if worse > 0 || (asked.times && slower > 0) {
        bail!("the second report is worse than the first");
    }
    Ok(())
}
