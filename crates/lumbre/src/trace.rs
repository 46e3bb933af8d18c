//! `lumbre trace`: traces a reference picture of a scene, or prints the ray tree of one of its pixels.

use std::io::Write;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Mutex;
use std::time::Duration;

use anyhow::{Context, bail};
use glam::DVec2;
use lumbre::demo::has_light_to_bake;
use lumbre::render::Display;
use lumbre::trace::{
    Aov, Continuation, Ended, Integrator, Metering, Picture, TraceError, TraceOptions, TraceReport, Tracer,
};

use crate::arguments::{Exposure, Frame, Trace};
use crate::interruption::Interruption;
use crate::kept_samples::KeptSamples;
use crate::loading::{extension, frame_options, load};
use crate::picture_files::{Development, write_open_exr, write_png};
use crate::progress::{Progress, Shown};

/// Fraction of a picture that has to be clipped to white before an exposure is metered without being asked
/// for; the same as for frames.
const CLIPPED: f64 = 0.02;
/// Samples per pixel of the ray tree with `--msaa`: as many as a frame has then.
const MULTISAMPLES: u32 = 4;
/// Time between two writes of the samples, which is what a crash may lose.
const KEPT_EVERY: Duration = Duration::from_secs(60);

/// Runs the command.
pub fn run(asked: &Trace) -> anyhow::Result<()> {
    let floats = match asked.output.as_deref().map(extension).transpose()?.as_deref() {
        None | Some("png") => false,
        Some("exr") => true,
        Some(other) => bail!(
            "{}: .{other} is not written, only .png and .exr",
            asked.output.as_deref().unwrap_or(Path::new("")).display()
        ),
    };
    let mut loaded = load(&asked.input, &asked.reading)?;
    for note in meaningless(asked) {
        eprintln!("lumbre: note: {note}");
    }
    let display = asked.frame.display.unwrap_or(if floats { Display::Linear } else { Display::Srgb });
    let aspect = f64::from(asked.size.0) / f64::from(asked.size.1);
    // Paths find the light of emissive objects and the sky without default lights.
    let lit = asked.integrator == Integrator::Path && has_light_to_bake(&mut loaded.world);
    let lighting = Frame { no_default_light: asked.frame.no_default_light || lit, ..asked.frame.clone() };
    let frame = frame_options(&mut loaded.world, &lighting, display, aspect, &asked.input)?;
    let options = options(asked, &frame);
    let tracer = Tracer::new(&mut loaded.world, &options)
        .with_context(|| format!("{} cannot be traced", asked.input.display()))?;
    for note in tracer.notes() {
        eprintln!("lumbre: note: {}: {note}", asked.input.display());
    }
    if let Some((x, y)) = asked.pixel {
        return print_tree(asked, &tracer, (x, y));
    }
    let Some(output) = &asked.output else { bail!("say with -o where the picture goes") };
    let kept = KeptSamples::beside(output);
    let (picture, report) = traced(asked, &tracer, &kept)?;
    let photometric = loaded.report.photometric_lights > 0 && !loaded.report.states_exposure;
    let exposure = exposure(asked, &picture, photometric && display == Display::Srgb);
    write_picture(output, &picture, Development { display, exposure }, floats)?;
    let black = picture.radiance.iter().all(|pixel| pixel.max_element() <= 0.0);
    if black && loaded.report.triangles > 0 && report.finished == 1.0 {
        eprintln!(
            "lumbre: note: {}: the picture is black: no light reaches what the camera sees; try another --camera",
            asked.input.display()
        );
    }
    print_report(asked, &report)?;
    if report.ended == Ended::Interrupted {
        let goes_on =
            if kept.are_kept() { "; the same command with --resume goes on from there" } else { "" };
        bail!(
            "interrupted; {} holds {:.0} % of the picture{goes_on}",
            output.display(),
            100.0 * report.finished
        );
    }
    if asked.resume { Ok(()) } else { kept.remove() }
}

fn options(asked: &Trace, frame: &lumbre::render::FrameOptions) -> TraceOptions {
    TraceOptions {
        camera: frame.camera,
        size: asked.size,
        integrator: asked.integrator,
        reflection: asked.frame.reflection,
        depth: asked.depth,
        weight: asked.weight,
        shadows: !asked.frame.no_shadows,
        lightmaps: !asked.frame.no_lightmaps,
        irradiance_volumes: !asked.frame.no_irradiance_volumes,
        samples: asked
            .samples
            .or((asked.frame.msaa && asked.integrator == Integrator::Whitted).then_some(MULTISAMPLES)),
        error: asked.error,
        time: asked.time,
        threads: asked.threads.map(usize::from),
        filter: asked.filter,
        adaptive: asked.adaptive,
        seed: asked.seed,
        sample_by_noise: asked.sample_by_noise,
        aovs: asked.aov.clone(),
    }
}

/// Returns notes on options that have no effect on rays, or not on the chosen integrator.
fn meaningless(asked: &Trace) -> Vec<&'static str> {
    let trees = asked.integrator == Integrator::Whitted;
    let told = [
        (
            asked.frame.shading.is_some() || asked.frame.flat_rule.is_some(),
            "--shading and --flat-rule mean nothing to rays: every point is lit by itself, as under Phong shading",
        ),
        (
            asked.frame.specular_antialiasing.is_some(),
            "--specular-antialiasing means nothing to rays: --samples filters highlights and everything else",
        ),
        (
            asked.frame.light_threshold.is_some()
                || asked.frame.shadow_resolution.is_some()
                || asked.frame.shadow_filter.is_some(),
            "--light-threshold, --shadow-resolution and --shadow-filter mean nothing to rays: no lamp ends early, and shadows are exact",
        ),
        (
            asked.frame.mirror_depth.is_some() || asked.frame.no_refraction,
            "--mirror-depth and --no-refraction are for frames: --depth says how often rays are mirrored and let through",
        ),
        (trees && asked.error.is_some(), "--error is for --integrator path: the ray tree has no noise"),
        (
            !trees && asked.adaptive.is_some(),
            "--adaptive is for the ray tree: --sample-by-noise is what paths have",
        ),
        (
            trees && asked.sample_by_noise,
            "--sample-by-noise is for --integrator path: --adaptive is what the ray tree has",
        ),
        (
            trees && asked.aov.contains(&Aov::StandardError),
            "--aov standard-error is for --integrator path: the ray tree has no noise, and every pixel of that picture is infinite",
        ),
        (
            asked.frame.shadows || asked.frame.every_shadow || asked.frame.rendering_path.is_some(),
            "--shadows, --every-shadow and --rendering-path change nothing: every lamp casts its shadow, and rays have no rendering path",
        ),
        (
            !trees && asked.frame.lightmap_reduction > 1,
            "--lightmap-reduction means nothing to --integrator path: paths find bounced light themselves",
        ),
        (
            asked.frame.lightmap_format.is_some(),
            "--lightmap-format is for frames: the ray tree reads lightmaps in f32, and paths read none",
        ),
        (asked.frame.no_msaa, "--no-msaa changes nothing: --samples says how many samples a pixel has"),
        (!asked.frame.without.is_empty(), "--without is for frames: rays have every effect of the scene"),
        (!trees && asked.frame.msaa, "--msaa is for the ray tree: paths take --samples"),
        (trees && asked.resume, "--resume is for --integrator path: ray trees begin anew"),
        (
            !trees && asked.frame.no_lightmaps,
            "--no-lightmaps is for the ray tree: paths never read lightmaps, they find that light themselves",
        ),
        (
            !trees && asked.frame.no_irradiance_volumes,
            "--no-irradiance-volumes is for the ray tree: paths never read volumes, they find that light themselves",
        ),
        (
            trees && asked.adaptive.is_some() && asked.samples.unwrap_or(1) < 4,
            "--adaptive needs --samples of 4 or more",
        ),
    ];
    told.into_iter().filter_map(|(holds, words)| holds.then_some(words)).collect()
}

fn print_tree(asked: &Trace, tracer: &Tracer, (x, y): (u32, u32)) -> anyhow::Result<()> {
    let (width, height) = asked.size;
    if x >= width || y >= height {
        bail!(
            "there is no pixel {x},{y} in a picture of {width}x{height}; count from 0,0 in its upper left corner"
        );
    }
    if asked.integrator != Integrator::Whitted {
        bail!("paths are no tree; leave out --integrator path, or --pixel");
    }
    let tree = tracer.tree(DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5));
    std::io::stdout().write_all(tracer.draw_tree(&tree, asked.tree).as_bytes())?;
    Ok(())
}

/// Traces the picture, going on from the samples of an earlier run if that is requested.
fn traced(asked: &Trace, tracer: &Tracer, samples: &KeptSamples) -> anyhow::Result<(Picture, TraceReport)> {
    let from = if asked.resume { samples.read()? } else { None };
    if !asked.resume && asked.integrator == Integrator::Path && samples.path.exists() {
        eprintln!(
            "lumbre: note: {}: the samples of an earlier picture are not used (--resume would go on with them)",
            samples.path.display()
        );
    }
    let keep = |bytes: &[u8]| samples.write(bytes);
    let continuation = Continuation {
        from: from.as_deref(),
        keep: Some(&keep),
        keep_complete: asked.resume,
        interval: KEPT_EVERY,
    };
    let stage = match asked.integrator {
        Integrator::Whitted => "ray trees",
        Integrator::Path => "paths",
    };
    let interruption = Interruption::handle();
    let shown = Mutex::new(Shown::of("picture", asked.quiet));
    let found = interruption.told(|is_asked| {
        tracer.continued(&continuation, &|progress| {
            if let Ok(mut shown) = shown.lock() {
                let fraction = progress.fraction as f32;
                let error = progress.error;
                shown.update(Progress { stage, stage_fraction: fraction, fraction, error });
            }
            if is_asked() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
    });
    if let Ok(shown) = shown.lock() {
        shown.finish();
    }
    found.map_err(|error| match error {
        TraceError::Checkpoint(_) => anyhow::Error::new(error).context(format!(
            "{} cannot be gone on with; remove it, or leave out --resume",
            samples.path.display()
        )),
        error => error.into(),
    })
}

/// Returns the requested exposure, a metered one, or the camera's.
fn exposure(asked: &Trace, picture: &Picture, may_be_metered: bool) -> f64 {
    let metered = match asked.frame.exposure {
        Some(Exposure::Factor(factor)) => return f64::from(factor),
        Some(Exposure::Auto) => Metering::of(&picture.radiance),
        None if may_be_metered => Metering::of(&picture.radiance).filter(|found| found.clipped > CLIPPED),
        None => None,
    };
    let Some(found) = metered else { return f64::from(picture.exposure) };
    eprintln!(
        "lumbre: note: {}: exposure {:.3e} ({:.1} EV), metered: the log-average luminance is {:.4} (--exposure X or EV for another)",
        asked.input.display(),
        found.exposure,
        found.exposure_value(),
        found.luminance
    );
    f64::from(found.exposure)
}

fn write_picture(path: &Path, picture: &Picture, how: Development, floats: bool) -> anyhow::Result<()> {
    if floats {
        return write_open_exr(path, picture, how);
    }
    for (beside, meaning) in write_png(path, picture, how)? {
        if let Some(meaning) = meaning {
            eprintln!("lumbre: note: {}: {meaning}", beside.display());
        }
    }
    Ok(())
}

fn print_report(asked: &Trace, report: &TraceReport) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    if asked.json {
        writeln!(out, "{}", serde_json::to_string_pretty(report)?)?;
        return Ok(());
    }
    let [least, most] = report.samples;
    let samples = if least == most { format!("{most}") } else { format!("{least} to {most}") };
    writeln!(
        out,
        "{} x {}, {samples} samples a pixel, {:.1} million rays in {:.1} s ({:.2} million a second)",
        asked.size.0,
        asked.size.1,
        report.rays as f64 / 1e6,
        report.seconds,
        report.mega_rays_per_second
    )?;
    match (asked.integrator, report.standard_error) {
        (Integrator::Path, Some(error)) => {
            writeln!(out, "standard error of the picture: {:.2} %", 100.0 * error)?
        }
        (Integrator::Path, None) => writeln!(out, "too few samples to state an error")?,
        (Integrator::Whitted, _) if report.cut.largest_weight > 0.0 => {
            let missing = match report.cut.bound {
                Some(bound) => format!("at most a radiance of {bound:.3}"),
                None => format!(
                    "of the brightest that was met a radiance of {:.3}, but without a bound: a surface passes on all light and adds some",
                    report.cut.largest_weight * report.cut.brightest
                ),
            };
            writeln!(
                out,
                "cut off by depth and weight: {:.2e} of a pixel's light in the mean, {:.2e} at most; {missing}",
                report.cut.mean_weight, report.cut.largest_weight
            )?;
        }
        (Integrator::Whitted, _) => writeln!(out, "no ray was cut off")?,
    }
    match report.ended {
        Ended::Complete => {}
        Ended::Error => writeln!(out, "ended: the error asked for is reached")?,
        Ended::Time => {
            writeln!(out, "ended: the time is over, with {:.0} % of the picture", 100.0 * report.finished)?
        }
        Ended::Interrupted => writeln!(out, "ended: interrupted")?,
    }
    Ok(())
}
