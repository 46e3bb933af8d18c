//! The bake from end to end: reads the World, runs the stages, writes the World. Not the stages themselves.

use std::ops::ControlFlow;
use std::sync::Arc;

use bevy_ecs::world::World;
use glam::Vec3;

use crate::checkpoint::Tape;
use crate::content_hash::hashes_of;
use crate::memory;
use crate::notes::{finish, name_what_is_missing, note_direct_error, note_mean, note_whole};
use crate::pages::Pages;
use crate::probes;
use crate::progress::{Stage, Watch};
use crate::rebake::change::Change;
use crate::rebake::{Changes, Found, Samples, Usable, rebake_report};
use crate::scene::{BakeScene, Canonical, WantedProbes, collect, density_of, lights, sky, world_points};
use crate::texels::charts::charts;
use crate::texels::divided_light::DividedLight;
use crate::texels::error_estimate::variances;
use crate::texels::fill::fill;
use crate::texels::footprint::{Texel, footprints};
use crate::texels::gather::{REPLICATES, RadianceCache};
use crate::texels::hidden::remove_hidden;
use crate::texels::resolution_error::{DensePoint, Light, compare};
use crate::texels::rounds::{Bounced, Receivers};
use crate::texels::seams::{Maps, Patience, close_seams};
use crate::texels::straddling::{crossed, straddling};
use crate::texels::texel_radiance::{GatheredLight, mean_reflectances};
use crate::texels::worst_places::worst_places;
use crate::texels::{lighting, rounds};
use crate::transport::direct::Sources;
use crate::transport::emitters::coarse_textures;
use crate::transport::exchange::Exchange;
use crate::{BakeError, BakeOptions, BakeReport, Checkpoint, Ended, ErrorAtTime, Progress, apply, preparing};

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
    on_threads(options, || run(world, options, Former::Forget, checkpoint, progress))
        .map(|(report, _)| report)
}

/// [`bake_with`] that keeps of a former bake what the scene's changes can hardly have affected, and returns the samples for the next time: none
/// where there was nothing to bake, or no time for it. The report's [`rebake`](BakeReport::rebake) says what was kept, or why nothing was: then the whole scene
/// is baked, as it is without `former`. What the light of the kept texels may have changed by is part of the stated error, adds up over
/// several bakes, and is gathered anew when it is no longer small beside the error asked for.
///
/// The same world, options, seed and former samples give the same bits on any number of threads; those of [`bake_with`] where there is nothing
/// to keep, unless [`BakeOptions::memory`] is short: samples take some of it.
///
/// Objects are recognised by name, mesh, material and place as they were before a bake, which gives meshes new coordinates: [`UnwrappedFrom`](crate::UnwrappedFrom)
/// remembers beside such a mesh what it was. A World can so be changed and baked again and again; a level that was saved and loaded again counts as new.
///
/// # Errors
/// As [`bake_with`].
pub fn rebake(
    world: &mut World,
    options: &BakeOptions,
    former: Option<&Samples>,
    checkpoint: Option<&Checkpoint>,
    progress: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
) -> Result<(BakeReport, Option<Samples>), BakeError> {
    let former = former.map_or(Former::None, Former::Samples);
    on_threads(options, || run(world, options, former, checkpoint, progress))
}

/// What is done with samples.
#[derive(Clone, Copy)]
enum Former<'a> {
    /// There are none, and none are kept.
    Forget,
    /// There are none yet.
    None,
    Samples(&'a Samples),
}

fn on_threads<T: Send>(
    options: &BakeOptions,
    bake: impl FnOnce() -> Result<T, BakeError> + Send,
) -> Result<T, BakeError> {
    options.check()?;
    match options.threads {
        None => bake(),
        Some(threads) => {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let pool = pool.map_err(|error| BakeError::Threads { reason: error.to_string() })?;
            pool.install(bake)
        }
    }
}

fn run(
    world: &mut World,
    options: &BakeOptions,
    former: Former<'_>,
    checkpoint: Option<&Checkpoint>,
    progress: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
) -> Result<(BakeReport, Option<Samples>), BakeError> {
    let mut report = BakeReport { threads: rayon::current_num_threads(), ..BakeReport::default() };
    let mut watch = Watch::new(progress, options.time);
    watch.stage(Stage::Layout, &mut report)?;
    let objects = Arc::new(watch.during(0.0, || collect(world))??);
    let (placed, sky) = (lights(world), sky(world));
    let wanted = WantedProbes::of(world, &objects);
    let hashes = watch.during(0.0, || hashes_of(&objects, &placed, sky, &wanted, options))?;
    report.content_hash = hashes.content.to_string();
    let points = || {
        objects.iter().flat_map(|o| &o.primitives).flat_map(|part| world_points(&part.transform, &part.mesh))
    };
    let mut space = Canonical::of(points());
    let usable = match former {
        Former::Samples(samples) => Some(Usable::new(samples, &hashes, &objects, space, options)),
        Former::None | Former::Forget => None,
    };
    let usable = note_whole(usable, &mut report);
    let identity = usable.as_ref().map_or(hashes.content, |usable| usable.identity(hashes.content));
    // What is kept takes memory, too: within a limit, other patches may fit.
    let limited = options.memory.is_some() && !matches!(former, Former::Forget);
    let identity = if limited { identity.made_from(&hashes.sampling) } else { identity };
    if let Some(checkpoint) = checkpoint {
        watch.tape = Tape::open(checkpoint, &identity)
            .map_err(|source| BakeError::Checkpoint { path: checkpoint.path.clone(), source })?;
    }
    if objects.is_empty() {
        report.skipped.push("everything: the scene has no static mesh".into());
        apply::forget_lightmaps(world, &[]);
        apply::place_volume(world, None);
        report.error_reached = true;
        return Ok((finish(report, &mut watch), None));
    }
    let mut density = None;
    if let Some(usable) = &usable {
        (space, density) = (usable.space, Some(usable.density));
    }
    let density = density.unwrap_or_else(|| density_of(&objects, space, options));
    let layout = preparing::layout(&objects, space, density, options, &mut watch, &mut report.warnings)?;

    watch.stage(Stage::Hierarchy, &mut report)?;
    let (mut scene, layout) = preparing::scene(&objects, layout, space, &mut watch, &mut report.warnings)?;
    scene.dark_outside = watch.during(0.8, || Sources::new(&scene, placed.clone(), sky).are_inside())?;
    let sources = watch.during(0.9, || Sources::new(&scene, placed, sky))?;
    report.triangles = scene.triangles.iter().filter(|triangle| !triangle.superseded).count();
    if sources.is_empty() {
        report
            .skipped
            .push("everything: no surface emits, no light is static or mixed, and there is no sky".into());
        apply::forget_lightmaps(world, &[]);
        apply::place_volume(world, None);
        report.error_reached = true;
        return Ok((finish(report, &mut watch), None));
    }
    name_what_is_missing(&sources, &mut report);
    report.warnings.extend(watch.during(1.0, || coarse_textures(&scene))?);
    let for_samples = match (former, &usable) {
        (Former::Forget, _) => 0,
        (Former::None | Former::Samples(_), None) => memory::SAMPLES,
        (_, Some(_)) => memory::SAMPLES + memory::FORMER,
    };
    memory::check_texels(&scene, &layout, for_samples, options)?;

    watch.stage(Stage::DirectLight, &mut report)?;
    let (mut texels, charts, crossed) =
        watch.during(0.0, || (footprints(&scene, &layout), charts(&scene), crossed(&scene, &layout)))?;
    let touched: Vec<usize> = watch.during(0.0, || {
        let divided = straddling(&layout, &texels, &crossed);
        divided.iter().map(|straddling| texels[straddling.texel as usize].index as usize).collect()
    })?;
    let crossed_places = crossed.iter().map(|(place, _)| *place);
    (report.hidden_texels, report.rays) =
        remove_hidden(&scene, &layout, &mut texels, crossed_places, &touched, &mut watch)?;
    report.texels = layout.texels;
    report.coverage = texels.len() as f64 / layout.texels.max(1) as f64;
    let side = texel_side(&scene, &texels);
    let for_patches = options.of_patches(watch.clock().is_past(SHORT));
    let resolution = watch.during(1.0, || {
        memory::resolution(&scene, &layout, &texels, side, for_samples, &for_patches, &mut report)
    })??;
    let find = |u| Changes::find(&u, &hashes, &objects, &sources, &layout, &texels);
    let changes = watch.during(1.0, || usable.map(find))?;
    let known = |changes: &Changes<'_>| changes.known_direct(&sources, &texels, &charts);
    let known = watch.during(1.0, || changes.as_ref().map_or_else(Vec::new, known))?;
    let (direct, local) =
        lighting::direct_light(&sources, &layout, &texels, &charts, &known, options, &mut watch)?;
    let relit = |index: usize| known.get(index).is_none_or(Option::is_none);
    let new = direct.iter().enumerate().filter(|(index, _)| relit(*index));
    report.rays += new.map(|(_, direct)| u64::from(direct.rays)).sum::<u64>();
    let baked: Vec<Vec3> = direct.iter().map(|direct| direct.baked).collect();

    let change = |changes| Change::new(&sources, &layout, changes, &texels, &charts, &direct);
    let change = watch.during(1.0, || changes.as_ref().map(change))?;
    let exchange = Exchange::new(&scene, &sources, &for_patches, resolution, &mut watch, &mut report)?;
    let (exchange, changed_patches) = match exchange {
        None => (None, Vec::new()),
        Some((exchange, factors)) => {
            let of_patches =
                change.as_ref().map(|own| own.of_patches(&exchange, &factors, options, &mut watch));
            (Some(exchange), of_patches.transpose()?.unwrap_or_default())
        }
    };
    let mut kept = None;
    let (indirect, volume, points) = match &exchange {
        None => {
            let volume = probes::bake(&wanted, &scene, &sources, None, options, &mut watch, &mut report)?;
            let light = Light { scene: &scene, sources: &sources, cache: None };
            (None, volume, dense_points(&light, options, &mut watch, &mut report)?)
        }
        Some(exchange) => {
            watch.stage(Stage::FinalGather, &mut report)?;
            let straddling = watch.during(0.0, || straddling(&layout, &texels, &crossed))?;
            // What one part sends out is read by many rays of many texels: its noise falls out of their means.
            let samples =
                if watch.clock().is_past(SHORT_OF_GATHER) { 1 } else { 2 } * options.effort().direct[0];
            let (divided, rays) = watch
                .during(0.0, || DividedLight::new(&sources, &texels, &straddling, (samples, options.seed)))?;
            report.rays += rays;
            report.warnings.extend(divided.warning());
            let mut total = vec![Vec3::NAN; layout.texels];
            for (texel, direct) in texels.iter().zip(&direct).filter(|(texel, _)| !texel.is_hidden()) {
                total[texel.index as usize] = direct.total();
            }
            divided.places().for_each(|index| total[index] = Vec3::NAN);
            let reflectance =
                watch.during(0.0, || mean_reflectances(&scene, &layout, &exchange.patches, &texels))?;
            let unknown = GatheredLight::default();
            let cache = RadianceCache {
                gathered: &unknown,
                correlated: CORRELATED_TEXELS * side,
                reflectance: &reflectance,
                scene: &scene,
                layout: &layout,
                patches: &exchange.patches,
                direct: &total,
                divided: &divided,
                sky: sources.sky,
                patch_direct: &exchange.direct,
                patch_indirect: &exchange.indirect,
                patch_error: &exchange.indirect_error,
                near: &exchange.near,
                guide: &exchange.guide,
                run: options.effort().gather[0] / REPLICATES as u32,
            };
            let leaked_before = scene.leaks.count();
            if let Some(change) = &change {
                kept = Some(change.keep(exchange, &changed_patches, &texels, &local, options, &mut watch)?);
            }
            let receivers = Receivers {
                texels: &texels,
                charts: &charts,
                direct: &direct,
                local: &local,
                kept: kept.as_ref(),
            };
            let gathered = rounds::gather(&cache, receivers, options, &mut watch, &mut report)?;
            report.leaked_rays = scene.leaks.count() - leaked_before;
            let variances = &gathered.variances.expected;
            let light = watch.during(1.0, || {
                GatheredLight::new(&texels, &gathered.gathered, &gathered.light, variances, &total)
            })?;
            let cache = RadianceCache { gathered: &light, ..cache };
            let volume =
                probes::bake(&wanted, &scene, &sources, Some(&cache), options, &mut watch, &mut report)?;
            let light = Light { scene: &scene, sources: &sources, cache: Some(&cache) };
            let points = dense_points(&light, options, &mut watch, &mut report)?;
            (Some(gathered), volume, points)
        }
    };

    watch.stage(Stage::Texels, &mut report)?;
    let (values, bounced): (Vec<Vec3>, Bounced) = match indirect {
        Some(bounced) => {
            let sum = baked.iter().zip(&bounced.light).map(|(direct, indirect)| *direct + *indirect);
            (sum.collect(), bounced)
        }
        None => (baked, Bounced { variances: variances(&direct, None, 0.0), ..Bounced::default() }),
    };
    let variances = &bounced.variances;
    note_mean(&texels, &values, &mut report);
    if let Some(changes) = &changes {
        let relit = (0..texels.len()).filter(|&index| relit(index) && !texels[index].is_hidden()).count();
        report.rebake = Some(rebake_report(changes, &texels, relit, kept.as_ref(), &report));
    }
    if exchange.is_none() {
        note_direct_error(&texels, &variances.expected, &local, options, &mut report);
        report.ended = Ended::after(report.error_reached, watch.is_late(), true);
        report.curve.push(ErrorAtTime { seconds: watch.seconds(), error: report.estimated_error });
    }
    let (squares, whole) = (local.relative(&variances.expected), report.estimated_error);
    report.worst = watch.during(0.0, || worst_places(&scene, &objects, &texels, &squares, whole))?;
    let samples = match former {
        Former::Forget => None,
        // Whoever has more time would not want to keep these.
        _ if report.ended == Ended::Time => None,
        Former::None | Former::Samples(_) => {
            let neglected = kept.as_ref().map_or(&[][..], |kept| &kept.neglected);
            let found = Found {
                scene: &scene,
                layout: &layout,
                texels: &texels,
                direct: &direct,
                gathered: &bounced.gathered,
                bounced: &bounced.light,
                neglected,
            };
            let exitance = exchange.as_ref().map(|e| e.exitance_of(&scene, layout.maps.len()));
            let exitance = exitance.unwrap_or_default();
            Some(watch.during(0.0, || found.samples(identity, &hashes, &objects, &sources, &exitance))?)
        }
    };
    watch.advance(0.2)?;
    let known = (values.as_slice(), variances.cautious.as_slice());
    let (mut filled, errors) =
        watch.during(0.2, || fill(&layout, &texels, &charts, known, options.gap, &scene.stop))?;
    watch.advance(1.0)?;
    watch.stage(Stage::Seams, &mut report)?;
    let mean = report.mean_irradiance.iter().sum::<f64>() / 3.0;
    let maps =
        Maps { scene: &scene, layout: &layout, texels: &texels, charts: &charts, variances: &errors, mean };
    note_seams(&maps, &mut filled, options, &mut watch, &mut report)?;
    watch.advance(0.9)?;
    report.resolution = watch.during(0.9, || compare(&scene, &layout, &filled, &errors, &points))?;
    let pages = watch.during(1.0, || Pages::new(&layout, options.atlas_size, options.gap))?;
    watch.advance(1.0)?;
    apply::apply(world, &objects, &layout, &filled, &errors, &pages);
    report.rays += change.as_ref().map_or(0, |change| change.rays(&changed_patches));
    report.atlases = pages.pages.len();
    report.maps = report.atlases + pages.places.iter().filter(|place| place.is_none()).count();
    apply::place_volume(world, volume.map(|placed| (placed.grid.transform(space), placed.volume)));
    Ok((finish(report, &mut watch), samples))
}

/// Where more than this share of direct light's time is gone before any light is known, the time is short beside the scene's size.
const SHORT: f64 = 0.3;
/// The same of the gather's time, before any ray of it.
const SHORT_OF_GATHER: f64 = 0.4;

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
    watch.stage(Stage::Resolution, report)?;
    let points = light.at_points(report.rays, options, watch)?;
    report.rays += points.iter().map(|point| point.rays).sum::<u64>();
    Ok(points)
}

fn note_seams(
    maps: &Maps<'_>,
    filled: &mut [Vec3],
    options: &BakeOptions,
    watch: &mut Watch<'_>,
    report: &mut BakeReport,
) -> Result<(), BakeError> {
    if !options.seams {
        report.skipped.push("seams: switched off".into());
        return Ok(());
    }
    let patience = if watch.clock().late() { Patience::LATE } else { Patience::WHOLE };
    let closed = watch.during(0.0, || close_seams(maps, filled, patience))?;
    report.rays += closed.rays;
    report.warnings.extend(closed.warning);
    match closed.report {
        Ok(closed) => report.seams = closed,
        Err(reason) => report.skipped.push(format!("seams: {reason}")),
    }
    Ok(())
}

/// Radius, in texels, of the disc over which the errors that smoothing leaves are correlated: 4.1 after the first round of the demo level, 5.4 after the
/// second.
const CORRELATED_TEXELS: f32 = 4.5;

/// Length of a texel's side on the surface, canonical units, by the mean of all.
fn texel_side(scene: &BakeScene, texels: &[Texel]) -> f32 {
    let area: f64 = scene.triangles.iter().map(|triangle| f64::from(triangle.area)).sum();
    (area / texels.len().max(1) as f64).sqrt() as f32
}
