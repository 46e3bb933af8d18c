//! `lumbre bake`: a level in, the same level with lightmaps out.

use std::io::Write;
use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Context, bail};
use lumbre::bake::{BakeOptions, BakeReport, Density, Probes, Quality, bake};
use lumbre::scene::{LightmapEncoding, SaveOptions, Supercompression, save_with};

use crate::arguments::{Bake, BakeProbes, BakeQuality, ExrTexels};
use crate::lightmap_report::{FileLine, summary_of_files, warnings_of_files};
use crate::loading::{extension, load};
use crate::output::progress_bar;

/// Runs the command.
pub fn run(asked: &Bake) -> anyhow::Result<()> {
    check_output(&asked.output)?;
    let mut world = load(&asked.input)?;
    if asked.resume {
        eprintln!(
            "lumbre: note: there is no checkpoint of {}: baking from the start",
            asked.output.display()
        );
    }
    let density = match (asked.texels_per_meter, asked.map_size) {
        (Some(density), _) => Density::TexelsPerMeter(density),
        (None, Some(side)) => Density::MapSize(side),
        (None, None) => Density::Automatic,
    };
    let options = BakeOptions {
        density,
        error: asked.error,
        time: asked.time,
        quality: match asked.quality {
            BakeQuality::Draft => Quality::Draft,
            BakeQuality::Final => Quality::Final,
        },
        probes: match asked.probes {
            BakeProbes::Auto => Probes::Automatic,
            BakeProbes::Always => Probes::Always,
            BakeProbes::Never => Probes::Never,
        },
        probe_spacing: asked.probe_spacing,
        threads: asked.threads.map(usize::from),
        gap: asked.gap,
        atlas_size: asked.atlas_size,
        seams: !asked.no_seams,
        ..BakeOptions::default()
    };
    let bar = progress_bar();
    let report = bake(&mut world, &options, &mut |progress| {
        bar.set_message(progress.stage);
        bar.set_position((progress.fraction * 1000.0) as u64);
        ControlFlow::Continue(())
    })?;
    bar.finish_and_clear();
    let saved = save_with(&mut world, &asked.output, &save_options(asked))?;
    for note in saved.notes {
        eprintln!("lumbre: note: {}: {note}", asked.output.display());
    }
    for warning in report.warnings.iter().cloned().chain(warnings_of_files(&saved.lightmaps)) {
        eprintln!("lumbre: warning: {warning}");
    }
    let mut out = std::io::stdout().lock();
    if asked.json {
        let mut json = serde_json::to_value(&report)?;
        let files: Vec<_> = saved.lightmaps.iter().map(FileLine::from).collect();
        json["files"] = serde_json::to_value(files)?;
        serde_json::to_writer_pretty(&mut out, &json)?;
        writeln!(out)?;
    } else {
        write!(out, "{}{}", summary(&report), summary_of_files(&saved.lightmaps))?;
    }
    Ok(())
}

fn save_options(asked: &Bake) -> SaveOptions {
    SaveOptions {
        encoding: match asked.exr {
            ExrTexels::Float => None,
            ExrTexels::Half => Some(LightmapEncoding::Rgb16Float),
        },
        ktx2: asked.ktx2,
        supercompression: if asked.ktx2_raw { Supercompression::None } else { Supercompression::Zstandard },
    }
}

/// What would be wrong with the output is said before the work, not after it.
fn check_output(path: &Path) -> anyhow::Result<()> {
    let extension = extension(path)?;
    if !["glb", "gltf"].contains(&extension.as_str()) {
        bail!("{}: .{extension} is not written, only .glb and .gltf", path.display());
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    tempfile::tempfile_in(folder)
        .map(drop)
        .with_context(|| format!("{}: the folder {} cannot be written to", path.display(), folder.display()))
}

/// The report for people.
fn summary(report: &BakeReport) -> String {
    let mut text = format!(
        "{} maps, {} texels ({:.0} % covered), {} patches, {:.1} million rays at {:.2} Mrays/s\n\
         estimated error {:.2} % ({}), {:.1} s on {} threads\n",
        report.maps,
        report.texels,
        100.0 * report.coverage,
        report.patches,
        report.rays as f64 * 1e-6,
        report.mega_rays_per_second,
        100.0 * report.estimated_error,
        if report.error_reached {
            "reached"
        } else {
            "not reached: give it more --time or ask for a larger --error"
        },
        report.seconds,
        report.threads,
    );
    if report.probes.resolution != [0; 3] {
        let [x, y, z] = report.probes.resolution;
        text.push_str(&format!(
            "{x} x {y} x {z} probes ({} inside geometry), estimated error {:.2} %\n",
            report.probes.inside,
            100.0 * report.probes.estimated_error
        ));
    }
    for stage in &report.stages {
        text.push_str(&format!("  {:24} {:7.2} s\n", stage.stage, stage.seconds));
    }
    for skipped in &report.skipped {
        text.push_str(&format!("  skipped: {skipped}\n"));
    }
    text
}
