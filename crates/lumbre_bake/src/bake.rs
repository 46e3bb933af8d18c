//! The bake from end to end: reads the World, runs the stages, writes the World. Not the stages themselves.

use std::ops::ControlFlow;

use bevy_ecs::world::World;
use glam::Vec3;

use crate::checkpoint::Tape;
use crate::content_hash::hash_of;
use crate::memory::{self, Plan};
use crate::pages::Pages;
use crate::probes::Wanted;
use crate::progress::Watch;
use crate::scene::{BakeScene, Canonical, collect, lay_out, lights, sky, world_points};
use crate::texels::charts::charts;
use crate::texels::divided_light::DividedLight;
use crate::texels::error_estimate::variances;
use crate::texels::fill::fill;
use crate::texels::footprint::{Texel, footprints};
use crate::texels::gather::{Outgoing, SCRAMBLES};
use crate::texels::hidden::remove_hidden;
use crate::texels::resolution_error::{DensePoint, Light, compare};
use crate::texels::seams::{Maps, close_seams};
use crate::texels::straddling::{crossed, straddling};
use crate::texels::{lighting, rounds};
use crate::transport::direct::Sources;
use crate::transport::exchange::Exchange;
use crate::{BakeError, BakeOptions, BakeReport, Checkpoint, Ended, ErrorAtTime, Progress, apply};

/// Bakes the light of a world's static objects into lightmaps.
///
/// Reads every `Mesh` with a `StaticObject` (dynamic and hidden ones are left out), emissive materials, and lights whose
/// `BakeMode` is `Static` (direct light and bounces) or `Mixed` (bounces only). Afterwards each of those entities has
/// its mesh with `uv1` and a `Lightmap` of E/π; the primitives of a glTF node share one map. If anything fails or is
/// cancelled the world's meshes and lightmaps are as they were (only global transforms are brought up to date).
///
/// `progress` is called between chunks of work; `ControlFlow::Break` ends the bake.
///
/// The same world, options and seed give the same bits on any number of threads, unless `options.time` cuts it short.
///
/// # Errors
/// [`BakeError`], which names the option, node or stage.
pub fn bake(
    world: &mut World,
    options: &BakeOptions,
    progress: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
) -> Result<BakeReport, BakeError> {
    bake_with(world, options, None, progress)
}

/// [`bake`] that keeps what it has computed in a checkpoint, or goes on from one: an interrupted bake that is resumed gives the same
/// bits as one that was not interrupted. What is wrong with a checkpoint that is there and not used stands in the report's warnings.
///
/// # Errors
/// As [`bake`]; [`BakeError::Checkpoint`] if the file cannot be begun, or is something else.
pub fn bake_with(
    world: &mut World,
    options: &BakeOptions,
    checkpoint: Option<&Checkpoint>,
    progress: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
) -> Result<BakeReport, BakeError> {
    options.check()?;
    match options.threads {
        None => run(world, options, checkpoint, progress),
        Some(threads) => {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let pool = pool.map_err(|error| BakeError::Threads { reason: error.to_string() })?;
            pool.install(|| run(world, options, checkpoint, progress))
        }
    }
}

fn run(
    world: &mut World,
    options: &BakeOptions,
    checkpoint: Option<&Checkpoint>,
    progress: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
) -> Result<BakeReport, BakeError> {
    let mut report = BakeReport { threads: rayon::current_num_threads(), ..BakeReport::default() };
    let mut watch = Watch::new(progress, options.time);
    watch.stage("layout", &mut report)?;
    let objects = collect(world)?;
    let (placed, sky) = (lights(world), sky(world));
    let wanted = Wanted::of(world, &objects);
    let hash = hash_of(&objects, &placed, sky, &wanted, options);
    report.content_hash = hash.to_string();
    if let Some(checkpoint) = checkpoint {
        watch.tape = Tape::open(checkpoint, &hash)
            .map_err(|source| BakeError::Checkpoint { path: checkpoint.path.clone(), source })?;
    }
    if objects.is_empty() {
        report.skipped.push("everything: the scene has no static mesh".into());
        apply::forget_lightmaps(world, &[]);
        apply::place_volume(world, None);
        report.error_reached = true;
        return Ok(finish(report, &mut watch));
    }
    let points =
        objects.iter().flat_map(|o| &o.parts).flat_map(|part| world_points(&part.transform, &part.mesh));
    let space = Canonical::of(points);
    let layout = lay_out(&objects, space, options, &mut report.warnings)?;

    watch.stage("hierarchy", &mut report)?;
    let scene = BakeScene::new(&objects, &layout, space, &mut report.warnings)?;
    let sources = Sources::new(&scene, placed, sky);
    report.triangles = scene.triangles.iter().filter(|triangle| !triangle.superseded).count();
    if sources.is_empty() {
        report
            .skipped
            .push("everything: no surface emits, no light is static or mixed, and there is no sky".into());
        apply::forget_lightmaps(world, &[]);
        apply::place_volume(world, None);
        report.error_reached = true;
        return Ok(finish(report, &mut watch));
    }
    name_what_is_missing(&sources, &mut report);
    memory::check_texels(&scene, &layout, options)?;

    watch.stage("direct light", &mut report)?;
    let mut texels = footprints(&scene, &layout);
    watch.advance(0.0)?;
    let charts = charts(&scene);
    let crossed = crossed(&scene, &layout);
    let touched: Vec<usize> = straddling(&layout, &texels, &crossed)
        .iter()
        .map(|straddling| texels[straddling.texel as usize].index as usize)
        .collect();
    let (hidden, rays) = remove_hidden(&scene, &layout, &mut texels, &touched);
    (report.hidden_texels, report.rays) = (hidden, rays);
    report.texels = layout.texels;
    report.coverage = texels.len() as f64 / layout.texels.max(1) as f64;
    let plan = Plan::new(&scene, &layout, &texels, texel_side(&scene, &texels), options, &mut report)?;
    let direct = lighting::direct_light(&sources, &scene, &layout, &texels, options, &mut watch)?;
    report.rays += direct.iter().map(|direct| u64::from(direct.rays)).sum::<u64>();
    let baked: Vec<Vec3> = direct.iter().map(|direct| direct.baked).collect();

    let exchange = Exchange::new(&scene, &sources, options, &plan, &mut watch, &mut report)?;
    let (indirect, volume, points) = match &exchange {
        None => {
            let volume = wanted.bake(&scene, &sources, None, options, &mut watch, &mut report)?;
            let light = Light { scene: &scene, sources: &sources, outgoing: None };
            (None, volume, dense_points(&light, options, &mut watch, &mut report)?)
        }
        Some(exchange) => {
            watch.stage("final gather", &mut report)?;
            let straddling = straddling(&layout, &texels, &crossed);
            let [_, samples, _] = options.quality.effort().direct;
            let (divided, rays) = DividedLight::new(&sources, &texels, &straddling, (samples, options.seed));
            report.rays += rays;
            watch.advance(0.0)?;
            let mut total = vec![Vec3::NAN; layout.texels];
            for (texel, direct) in texels.iter().zip(&direct).filter(|(texel, _)| !texel.is_hidden()) {
                total[texel.index as usize] = direct.total();
            }
            divided.places().for_each(|index| total[index] = Vec3::NAN);
            let outgoing = Outgoing {
                scene: &scene,
                layout: &layout,
                patches: &exchange.patches,
                direct: &total,
                divided: &divided,
                sky: sources.sky,
                patch_direct: &exchange.direct,
                patch_indirect: &exchange.indirect,
                patch_error: &exchange.indirect_error,
                near: exchange.near,
                guide: &exchange.guide,
                run: options.quality.effort().gather[0] / SCRAMBLES as u32,
            };
            let leaked_before = scene.leaks.count();
            let gathered =
                rounds::gather(&outgoing, &texels, &charts, &direct, options, &mut watch, &mut report)?;
            report.leaked_rays = scene.leaks.count() - leaked_before;
            let volume = wanted.bake(&scene, &sources, Some(&outgoing), options, &mut watch, &mut report)?;
            let light = Light { scene: &scene, sources: &sources, outgoing: Some(&outgoing) };
            let points = dense_points(&light, options, &mut watch, &mut report)?;
            (Some(gathered), volume, points)
        }
    };

    watch.stage("texels", &mut report)?;
    let (values, variances): (Vec<Vec3>, Vec<f32>) = match indirect {
        Some((indirect, variances)) => {
            let sum = baked.iter().zip(&indirect).map(|(direct, indirect)| *direct + *indirect);
            (sum.collect(), variances)
        }
        None => (baked, variances(&direct, None, 0.0)),
    };
    note_mean(&texels, &values, &mut report);
    if exchange.is_none() {
        note_direct_error(&texels, &variances, options, &mut report);
        report.ended = Ended::after(report.error_reached, watch.clock().late(), true);
        report.curve.push(ErrorAtTime { seconds: watch.seconds(), error: report.estimated_error });
    }
    let known = (values.as_slice(), variances.as_slice());
    let (mut filled, errors) =
        fill(&layout, &texels, &charts, known, options.gap, &mut |done| watch.advance(done))?;
    watch.advance(1.0)?;
    watch.stage("seams", &mut report)?;
    let mean = report.mean_irradiance.iter().sum::<f64>() / 3.0;
    let maps =
        Maps { scene: &scene, layout: &layout, texels: &texels, charts: &charts, variances: &errors, mean };
    note_seams(&maps, &mut filled, options, &mut watch, &mut report)?;
    report.resolution = compare(&scene, &layout, &filled, &errors, &points);
    watch.advance(1.0)?;
    let pages = Pages::new(&layout, options.atlas_size, options.gap);
    apply::apply(world, &objects, &layout, &filled, &errors, &pages);
    report.atlases = pages.pages.len();
    report.maps = report.atlases + pages.places.iter().filter(|place| place.is_none()).count();
    apply::place_volume(world, volume.map(|placed| (placed.grid.transform(space), placed.volume)));
    Ok(finish(report, &mut watch))
}

fn finish(mut report: BakeReport, watch: &mut Watch<'_>) -> BakeReport {
    watch.end_stage(&mut report);
    // What is still to be done with the result may be interrupted too.
    watch.tape.flush();
    report.seconds = watch.seconds();
    // From here on there is a map of that error.
    if !report.curve.is_empty() {
        report.curve.push(ErrorAtTime { seconds: report.seconds, error: report.estimated_error });
    }
    report.resumed_seconds = watch.tape.resumed;
    report.warnings.append(&mut watch.tape.warnings);
    let casting: f64 = report
        .stages
        .iter()
        .filter(|stage| {
            ["direct light", "form factors", "final gather", "probes", "resolution"]
                .contains(&stage.stage.as_str())
        })
        .map(|stage| stage.seconds)
        .sum();
    report.mega_rays_per_second = if casting > 0.0 { report.rays as f64 * 1e-6 / casting } else { 0.0 };
    report
}

/// Points that the finished map is compared with; none if that is not asked for.
fn dense_points(
    light: &Light<'_>,
    options: &BakeOptions,
    watch: &mut Watch<'_>,
    report: &mut BakeReport,
) -> Result<Vec<DensePoint>, BakeError> {
    if !options.resolution_error || watch.clock().late() {
        let why = if options.resolution_error { "the time is up" } else { "switched off" };
        report.skipped.push(format!("resolution error: {why}"));
        return Ok(Vec::new());
    }
    watch.stage("resolution", report)?;
    let points = light.at_points(report.rays, options, watch)?;
    report.rays += points.iter().map(|point| point.rays).sum::<u64>();
    Ok(points)
}

fn name_what_is_missing(sources: &Sources<'_>, report: &mut BakeReport) {
    if sources.emitters.is_empty() {
        report.skipped.push("area light: no surface emits".into());
    }
    if !sources.has_sky() {
        report.skipped.push("sky light: the scene has no sky".into());
    }
    if sources.lights.is_empty() {
        report.skipped.push("punctual light: no point, spot or directional light is static or mixed".into());
    }
}

fn note_seams(
    maps: &Maps<'_>,
    filled: &mut [Vec3],
    options: &BakeOptions,
    watch: &mut Watch<'_>,
    report: &mut BakeReport,
) -> Result<(), BakeError> {
    let (closed, rays) = match options.seams {
        true => close_seams(maps, filled, &mut |done| watch.advance(done))?,
        false => (Err("switched off"), 0),
    };
    report.rays += rays;
    match closed {
        Ok(closed) => report.seams = closed,
        Err(reason) => report.skipped.push(format!("seams: {reason}")),
    }
    Ok(())
}

/// Length of a texel's side on the surface, canonical units, by the mean of all.
fn texel_side(scene: &BakeScene, texels: &[Texel]) -> f32 {
    let area: f64 = scene.triangles.iter().map(|triangle| f64::from(triangle.area)).sum();
    (area / texels.len().max(1) as f64).sqrt() as f32
}

fn note_mean(texels: &[Texel], values: &[Vec3], report: &mut BakeReport) {
    let (mut sum, mut count) = (glam::DVec3::ZERO, 0u32);
    for (_, value) in texels.iter().zip(values).filter(|(texel, _)| !texel.is_hidden()) {
        sum += value.as_dvec3();
        count += 1;
    }
    report.mean_irradiance = (sum / f64::from(count.max(1))).to_array();
}

/// The error of a map without bounces.
fn note_direct_error(texels: &[Texel], variances: &[f32], options: &BakeOptions, report: &mut BakeReport) {
    let open = texels.iter().zip(variances).filter(|(texel, _)| !texel.is_hidden());
    let (sum, count) =
        open.fold((0.0, 0u32), |(sum, count), (_, variance)| (sum + f64::from(*variance), count + 1));
    let mean = report.mean_irradiance.iter().sum::<f64>() / 3.0;
    let error = (sum / f64::from(count.max(1))).sqrt();
    report.estimated_error = if mean > 0.0 { error / mean } else { 0.0 };
    report.error_reached = report.estimated_error <= options.error;
}
