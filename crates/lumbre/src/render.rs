//! `lumbre render`: draws frames without a window, and measures them.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, bail};
use lumbre::graph;
use lumbre::render::{Accounting, Display, Gpu, Measure, Offscreen, OffscreenFormat, Renderer, Statistics};
use lumbre::scene::Census;
use serde::Serialize;

use crate::arguments::Render;
use crate::loading::{exposure, extension, frame_options, load};
use crate::output::write_file;

/// The contents of the file of `--timings`.
#[derive(Serialize)]
struct Timings {
    /// The device and its driver, on which all times depend.
    device: String,
    width: u32,
    height: u32,
    /// The scene's census, by which passes and shader variants were chosen.
    census: Option<Census>,
    frames: Vec<FrameTimes>,
}

/// The measurements of one frame.
#[derive(Serialize)]
struct FrameTimes {
    /// From the call until the GPU has finished the frame.
    wall_ms: f64,
    cpu_ms: Option<f64>,
    gpu_ms: Option<f64>,
    statistics: Statistics,
    passes: Vec<PassTimes>,
    /// The account of the frame by stages, passes and effects.
    accounting: Option<Accounting>,
    /// Milliseconds of the wall-clock time that neither stages nor passes account for.
    remainder_ms: Option<f64>,
}

/// The measurements of one pass.
#[derive(Serialize)]
struct PassTimes {
    name: String,
    /// Index of the group of merged passes that it belongs to.
    group: usize,
    cpu_ms: Option<f64>,
    gpu_ms: Option<f64>,
    vertex_invocations: Option<u64>,
    fragment_invocations: Option<u64>,
    compute_invocations: Option<u64>,
    /// Lights tested against each object of this pass.
    lights_tested: u32,
    /// Average number of lights in the list of a visible object, which its vertices or fragments evaluate.
    /// Lights that fragments find by clusters are counted in the frame's `light_lists`.
    lights_shaded: f32,
    /// Evaluations of lights, and how many of them contributed more than 1/255 (`--count-lights`).
    light_evaluations: Option<u64>,
    light_contributions: Option<u64>,
}

/// Runs the command.
pub fn run(asked: &Render) -> anyhow::Result<()> {
    let floats = match extension(&asked.output)?.as_str() {
        "png" => false,
        "exr" => true,
        other => bail!("{}: .{other} is not written, only .png and .exr", asked.output.display()),
    };
    let is_text = asked.timings.as_deref().and_then(Path::extension).is_some_and(|end| end == "txt");
    let mut loaded = load(&asked.input, &asked.reading)?;
    let (width, height) = asked.size;
    let display = asked.frame.display.unwrap_or(if floats { Display::Linear } else { Display::Srgb });
    let aspect = f64::from(width) / f64::from(height);
    let mut options = frame_options(&mut loaded.world, &asked.frame, display, aspect, &asked.input)?;
    let gpu = Gpu::headless()?;
    let photometric = loaded.report.photometric_lights > 0 && !loaded.report.states_exposure;
    options.exposure =
        exposure(asked.frame.exposure, photometric, &mut loaded.world, &gpu, &options, aspect, &asked.input)?;
    let mut renderer = Renderer::new(&gpu);
    let format = if floats { OffscreenFormat::LinearFloat } else { OffscreenFormat::Rgba8 };
    let target = Offscreen::new(&gpu, width, height, format)?;
    let (mut frames, mut census) = (Vec::new(), None);
    for number in 0..asked.frames {
        // Counting invocations takes time. The first frame is not like the others anyway, since pipelines are
        // made in it.
        options.measure = match number {
            _ if asked.timings.is_none() => Measure::Nothing,
            0 => Measure::TimeAndInvocations,
            _ => Measure::Time,
        };
        let start = Instant::now();
        let report = renderer
            .render(&mut loaded.world, &target.target(), &options)
            .with_context(|| format!("{} could not be drawn", asked.input.display()))?;
        let measured = renderer.wait()?.cloned();
        let wall_ms = start.elapsed().as_secs_f64() * 1e3;
        let accounting = renderer.accounting().filter(|_| asked.timings.is_some()).cloned();
        frames.push(frame_times(wall_ms, report.statistics, measured, accounting));
        census = Some(Census::clone(&report.census));
    }
    if let [counted, others @ ..] = &mut frames[..]
        && let Some(counted) = &counted.accounting
    {
        others.iter_mut().for_each(|frame| frame.take_invocations_of(counted));
    }
    let shows_something = write_frame(&asked.output, &gpu, &target, floats)?;
    if !shows_something && loaded.report.triangles > 0 {
        eprintln!(
            "lumbre: note: {}: the frame is black: no light reaches what the camera sees; try another --camera or --exposure",
            asked.input.display()
        );
    }
    if asked.count_lights {
        options.measure = Measure::Lights;
        renderer
            .render(&mut loaded.world, &target.target(), &options)
            .with_context(|| format!("{} could not be drawn", asked.input.display()))?;
        renderer.wait()?;
        if let Some(counted) = renderer.accounting() {
            frames.iter_mut().for_each(|frame| frame.take_lights_of(counted));
        }
    }
    if let Some(path) = &asked.timings {
        let timings = Timings { device: gpu.describe(), width, height, census, frames };
        let text = if is_text { timings.to_text() } else { serde_json::to_string_pretty(&timings)? + "\n" };
        write_file(path, |path| Ok(std::fs::write(path, text)?))?;
    }
    Ok(())
}

impl Timings {
    /// Formats the last frame's account as text.
    fn to_text(&self) -> String {
        let account = self.frames.last().and_then(|frame| frame.accounting.as_ref());
        let account = account.map_or_else(String::new, Accounting::to_text);
        format!("{}, {} x {}\n{account}", self.device, self.width, self.height)
    }
}

impl FrameTimes {
    /// Takes over the shader invocations of another frame of the same scene.
    fn take_invocations_of(&mut self, counted: &Accounting) {
        for pass in &mut self.passes {
            let same = counted.passes.iter().find(|other| other.pass == pass.name);
            let invocations = same.and_then(|same| same.invocations);
            pass.vertex_invocations = invocations.map(|counts| counts.vertex);
            pass.fragment_invocations = invocations.map(|counts| counts.fragment);
            pass.compute_invocations = invocations.map(|counts| counts.compute);
        }
        if let Some(accounting) = &mut self.accounting {
            accounting.take_invocations_of(counted);
        }
    }

    /// Takes over the light counts of another frame of the same scene.
    fn take_lights_of(&mut self, counted: &Accounting) {
        for pass in &mut self.passes {
            let same = counted.passes.iter().find(|other| other.pass == pass.name);
            let lights = same.and_then(|same| same.lights);
            pass.light_evaluations = lights.map(|lights| lights.tested);
            pass.light_contributions = lights.map(|lights| lights.contributing);
        }
        if let Some(accounting) = &mut self.accounting {
            accounting.take_lights_of(counted);
        }
    }
}

fn frame_times(
    wall_ms: f64,
    statistics: Statistics,
    measured: Option<graph::GraphReport>,
    accounting: Option<Accounting>,
) -> FrameTimes {
    let measured = measured.unwrap_or_default();
    let passes = measured.passes.iter().map(|pass| {
        let lights = statistics.lit_passes.of(&pass.name).copied().unwrap_or_default();
        PassTimes {
            name: pass.name.to_string(),
            group: pass.group,
            cpu_ms: pass.cpu_ms,
            gpu_ms: pass.gpu.ms(),
            vertex_invocations: pass.invocations.map(|counts| counts.vertex),
            fragment_invocations: pass.invocations.map(|counts| counts.fragment),
            compute_invocations: pass.invocations.map(|counts| counts.compute),
            lights_tested: lights.lights,
            lights_shaded: lights.lights_per_object,
            light_evaluations: None,
            light_contributions: None,
        }
    });
    FrameTimes {
        wall_ms,
        cpu_ms: measured.cpu_ms,
        gpu_ms: measured.gpu_ms,
        statistics,
        passes: passes.collect(),
        remainder_ms: accounting.as_ref().and_then(Accounting::remainder_ms),
        accounting,
    }
}

/// Writes the frame; returns true if any of its pixels is not black.
fn write_frame(path: &Path, gpu: &Gpu, target: &Offscreen, floats: bool) -> anyhow::Result<bool> {
    let (width, height) = target.size();
    let shows_something;
    let image = if floats {
        let values: Vec<f32> =
            target.read_linear(gpu)?.iter().flat_map(|pixel| pixel.truncate().to_array()).collect();
        shows_something = values.iter().any(|&value| value > 0.0);
        image::Rgb32FImage::from_raw(width, height, values).map(image::DynamicImage::ImageRgb32F)
    } else {
        let mut bytes = target.read_rgba8(gpu)?;
        // The picture is opaque, whatever blending left in the alpha channel.
        bytes.chunks_exact_mut(4).for_each(|pixel| pixel[3] = 255);
        shows_something = bytes.chunks_exact(4).any(|pixel| pixel[..3] != [0; 3]);
        image::RgbaImage::from_raw(width, height, bytes).map(image::DynamicImage::ImageRgba8)
    };
    let image = image.context("the frame has another size than was asked for")?;
    let path: PathBuf = path.to_owned();
    write_file(&path, |path| Ok(image.save(path)?))?;
    Ok(shows_something)
}
