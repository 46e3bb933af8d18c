//! [`Bake`], the entry point of the crate, and `run`, which calls the stages in order. The stages themselves are in the
//! folders beside.

use std::ops::ControlFlow;
use std::sync::Arc;

use bevy_ecs::world::World;

use crate::apply::apply;
use crate::baked_scene::BakedScene;
use crate::checkpoint::CheckpointFile;
use crate::chunks::decide;
use crate::coverage::CoveredTexels;
use crate::direct_light::{DirectLight, SHORT_OF_TIME, direct_light};
use crate::final_gather::rounds;
use crate::final_gather::{GatherReport, IndirectLight, LitTexels, RadianceCache};
use crate::finish::finished_maps::{filled_maps, finished_maps};
use crate::finish::resolution_error::{self, dense_points};
use crate::memory;
use crate::monitor::{BakeMonitor, Callback};
use crate::probes;
use crate::radiosity::patch_light::patch_light;
use crate::radiosity::{Exchange, ExchangeReport, PatchResolution, Transport};
use crate::rebake::{Rebake, Samples};
use crate::report::StageNotes;
use crate::scene::{StaticScene, from_world};
use crate::sources::Sources;
use crate::stage::Stage;
use crate::summary::{self, LightFigures};
use crate::{BakeError, BakeOptions, BakeReport, CancelToken, Checkpoint, Progress, prepare};

/// Configures and runs a bake, which computes the light on the static objects of a scene and stores it in lightmaps.
///
/// [`Bake::run`] bakes the entities of a World that have a `Mesh` and a `StaticObject`, except hidden and unlit ones and
/// those that are or are below a `DynamicObject` ([`baked_meshes`](crate::baked_meshes)). Light comes from emissive
/// materials, from the sky, and from lights whose `BakeMode` is `Static` (direct light and bounces are baked) or `Mixed`
/// (only the bounces are). After the bake each of these entities has a mesh with lightmap coordinates in `uv1`, and a
/// `Lightmap` of E/π. The primitives of a glTF node share one map.
///
/// If the bake fails or is cancelled, the World's meshes and lightmaps are unchanged; only global transforms have been
/// updated.
///
/// The same World and options give the same bits on any number of threads, unless [`BakeOptions::time`] limits the bake.
///
/// ```
/// # use bevy_ecs::world::World;
/// # use lumbre_bake::{Bake, BakeOptions};
/// # use std::ops::ControlFlow;
/// # let mut world = World::new();
/// let options = BakeOptions::default();
/// let report = Bake::new(&options)
///     .progress(|progress| {
///         eprintln!("{}: {:.0} %", progress.stage, 100.0 * progress.fraction);
///         ControlFlow::Continue(())
///     })
///     .run(&mut world)?;
/// # assert_eq!(report.texels, 0);
/// # Ok::<(), lumbre_bake::BakeError>(())
/// ```
pub struct Bake<'a> {
    request: Request<'a>,
    progress: Box<Callback<'a>>,
    cancel: CancelToken,
    samples: Option<&'a mut Option<Samples>>,
}

impl<'a> Bake<'a> {
    /// A bake with these options, without a progress callback, a checkpoint or samples of a previous bake.
    pub fn new(options: &BakeOptions) -> Self {
        Self {
            request: Request { options: *options, checkpoint: None, former: None, keeps_samples: false },
            progress: Box::new(|_| ControlFlow::Continue(())),
            cancel: CancelToken::default(),
            samples: None,
        }
    }

    /// Sets a callback that is called between chunks of work, and about twenty times a second during a long one. If it
    /// returns `ControlFlow::Break`, the bake is cancelled.
    #[must_use]
    pub fn progress(self, progress: impl FnMut(Progress) -> ControlFlow<()> + Send + 'a) -> Self {
        Self { progress: Box::new(progress), ..self }
    }

    /// Sets a token by which any thread can cancel the bake. A progress callback that returns `ControlFlow::Break`
    /// cancels it, too.
    #[must_use]
    pub fn cancel(self, token: &CancelToken) -> Self {
        Self { cancel: token.clone(), ..self }
    }

    /// Saves intermediate results in a checkpoint, or resumes from one. A bake that was interrupted and resumed gives
    /// the same bits as one that was not. If a checkpoint exists but cannot be resumed, the report's warnings say why.
    #[must_use]
    pub fn checkpoint(self, checkpoint: impl Into<Option<&'a Checkpoint>>) -> Self {
        Self { request: Request { checkpoint: checkpoint.into(), ..self.request }, ..self }
    }

    /// Passes the samples of a previous bake, so that texels whose light the scene's changes hardly affect are not
    /// computed again. The report's [`rebake`](BakeReport::rebake) says what was reused, or why the whole scene had to
    /// be baked.
    ///
    /// The light of a reused texel may be off by the change that was neglected. This is part of the stated error and
    /// adds up over successive bakes; once it is no longer small compared with the requested error, the texel is
    /// gathered anew.
    ///
    /// The same World, options and samples give the same bits on any number of threads. If nothing can be reused, these
    /// are the bits of a bake without samples, unless [`BakeOptions::memory`] is limited: samples take up a part of it.
    ///
    /// Objects are recognised by their name, mesh, material and transform. Since a bake replaces meshes by unwrapped
    /// ones, it records the original beside each of them ([`UnwrappedFrom`](crate::UnwrappedFrom)), so that a World can
    /// be edited and baked repeatedly. That record is not saved: all objects of a level that was saved and loaded again
    /// count as new.
    #[must_use]
    pub fn former(self, samples: impl Into<Option<&'a Samples>>) -> Self {
        Self { request: Request { former: samples.into(), ..self.request }, ..self }
    }

    /// Puts the samples that the next bake can be given by [`Bake::former`] into `samples`. They are `None` if there was
    /// nothing to bake, or if [`BakeOptions::time`] ended the bake.
    #[must_use]
    pub fn keep_samples(self, samples: &'a mut Option<Samples>) -> Self {
        Self { request: Request { keeps_samples: true, ..self.request }, samples: Some(samples), ..self }
    }

    /// Bakes the static objects of a World and gives them their lightmaps.
    ///
    /// # Errors
    /// [`BakeError`], which names the option, node or stage. [`BakeError::Checkpoint`] if the checkpoint's file cannot
    /// be created, or is not a checkpoint.
    pub fn run(self, world: &mut World) -> Result<BakeReport, BakeError> {
        self.request.options.check()?;
        let (scene, entities) = from_world(world);
        let scene = Arc::new(scene.checked()?);
        let mut baked = self.on_threads(&scene)?;
        apply(world, &scene, &entities, &mut baked);
        Ok(baked.report)
    }

    /// Bakes plain data, without a World.
    ///
    /// # Errors
    /// As [`Bake::run`].
    ///
    /// ```
    /// # use std::sync::Arc;
    /// # use lumbre_bake::{Bake, BakeOptions, Density, PlacedPrimitive, Quality, SceneObject, StaticScene};
    /// # use glam::Vec3;
    /// let floor = PlacedPrimitive {
    ///     mesh: Arc::new(lumbre_mesh::shapes::cuboid(Vec3::new(4.0, 0.2, 4.0), 1)),
    ///     ..PlacedPrimitive::default()
    /// };
    /// let objects = vec![SceneObject::new("floor", vec![floor])];
    /// let scene = StaticScene { objects, sky: Vec3::ONE, ..StaticScene::default() };
    /// let options = BakeOptions { density: Density::MapSize(32), quality: Quality::Draft, ..BakeOptions::default() };
    /// let baked = Bake::new(&options).run_scene(scene)?;
    /// let map = &baked.maps[baked.objects[0].map];
    /// assert_eq!(map.image.width, 32);
    /// assert_eq!(baked.objects[0].meshes[0].uv1.len(), baked.objects[0].meshes[0].positions.len());
    /// # Ok::<(), lumbre_bake::BakeError>(())
    /// ```
    pub fn run_scene(self, scene: StaticScene) -> Result<BakedScene, BakeError> {
        self.request.options.check()?;
        self.on_threads(&Arc::new(scene.checked()?))
    }

    fn on_threads(mut self, scene: &Arc<StaticScene>) -> Result<BakedScene, BakeError> {
        let Request { options, .. } = self.request;
        let mut bake = || {
            let monitor = BakeMonitor::new(&mut *self.progress, options.time);
            let mut monitor = monitor.cancelled_by(self.cancel.clone());
            around_stages(scene, &self.request, &mut monitor)
        };
        let (baked, samples) = match options.threads {
            None => bake()?,
            Some(threads) => {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                pool.map_err(|error| BakeError::Threads { reason: error.to_string() })?.install(bake)?
            }
        };
        if let Some(kept) = self.samples {
            *kept = samples;
        }
        Ok(baked)
    }
}

/// What the caller has requested, apart from progress and cancellation, which are the monitor's.
struct Request<'a> {
    options: BakeOptions,
    checkpoint: Option<&'a Checkpoint>,
    former: Option<&'a Samples>,
    keeps_samples: bool,
}

/// A bake with what stands around its stages: the former bake, the checkpoint and the clock. Also returns the samples
/// for the next bake, if they are requested.
fn around_stages(
    input: &Arc<StaticScene>,
    request: &Request<'_>,
    monitor: &mut BakeMonitor<'_>,
) -> Result<(BakedScene, Option<Samples>), BakeError> {
    monitor.stage(Stage::Layout)?;
    let mut rebake = Rebake::new(request.former, request.keeps_samples, input, &request.options, monitor)?;
    if let Some(checkpoint) = request.checkpoint {
        let opened = CheckpointFile::open(checkpoint, &rebake.identity);
        monitor.checkpoint =
            opened.map_err(|source| BakeError::Checkpoint { path: checkpoint.path.clone(), source })?;
    }
    let mut baked = run(input, &mut rebake, &request.options, monitor)?;
    let samples = rebake.finish(&mut baked.report);
    summary::finish(&mut baked.report, monitor);
    Ok((baked, samples))
}

/// Runs the stages in order. Each takes values that earlier stages have returned, and its notes are collected for the
/// report. Two of them skip what `rebake` knows already, which is nothing without a former bake.
fn run(
    input: &Arc<StaticScene>,
    rebake: &mut Rebake<'_>,
    options: &BakeOptions,
    monitor: &mut BakeMonitor<'_>,
) -> Result<BakedScene, BakeError> {
    let mut notes = StageNotes::default();
    if input.objects.is_empty() {
        return Ok(BakedScene::dark("the scene has no static mesh", 0, notes));
    }
    let plan = rebake.plan();
    let layout = notes.noted(prepare::layout(input, &plan, options, monitor)?);

    monitor.stage(Stage::Hierarchy)?;
    let (scene, layout, emitters) = notes.noted(prepare::scene(input, layout, plan.space, monitor)?);
    let triangles = scene.triangles.iter().filter(|triangle| !triangle.is_hidden_duplicate).count();
    let sources = notes.noted(prepare::sources(input, &scene, emitters, monitor)?);
    if sources.is_empty() {
        let why = "no surface emits, no light is static or mixed, and there is no sky";
        return Ok(BakedScene::dark(why, triangles, notes));
    }
    memory::check_texels(&sources, &layout, plan.sample_bytes, options)?;

    monitor.stage(Stage::DirectLight)?;
    let texels = notes.noted(CoveredTexels::new(&scene, &layout, monitor)?);
    let patch_resolution =
        notes.noted(patch_resolution(&sources, &texels, plan.sample_bytes, options, monitor)?);
    let known = rebake.known_direct_light(&sources, &texels, monitor)?;
    let direct = notes.noted(direct_light(&sources, &texels, &known, options, monitor)?);
    drop(known);

    let bounces = bounces(&sources, &texels, &direct, &patch_resolution, rebake, options, monitor)?;
    let Bounces { indirect, cache, exchanged, gathered } = notes.noted(bounces);
    let volume = match probes::emitters_of_probes(input, &sources, cache.is_some(), options) {
        Err(why) => notes.without("probes", why),
        Ok(emitters) => {
            monitor.stage(Stage::Probes)?;
            Some(notes.noted(probes::bake(input, &emitters, cache.as_ref(), options, monitor)?))
        }
    };
    let points = match resolution_error::why_left_out(options, monitor.clock()) {
        Some(why) => notes.without("resolution error", why),
        None => {
            monitor.stage(Stage::Resolution)?;
            notes.noted(dense_points(&sources, cache.as_ref(), notes.rays, options, monitor)?)
        }
    };

    monitor.stage(Stage::Texels)?;
    let light = indirect.with(&direct);
    let lit = LitTexels { texels: &texels, direct: &direct, indirect: &indirect, light: &light };
    let figures = LightFigures { patch_resolution, exchanged, gathered, volume: volume.as_ref() };
    let mut report = BakeReport { triangles, ..BakeReport::default() };
    summary::write_light(&lit, figures, &input.objects, options, monitor, &mut report)?;
    rebake.keep_for_next_bake(
        &lit,
        &sources,
        cache.as_ref().map(|cache| &cache.exchange),
        &report,
        monitor,
    )?;
    let filled = filled_maps(&lit, options.gap, monitor)?;

    monitor.stage(Stage::Seams)?;
    let mean = report.mean_of_channels();
    let finished = finished_maps(&lit, filled, &points, mean, &input.objects, options, monitor)?;
    let finished = notes.noted(finished);
    summary::write_maps(&finished, notes, &mut report);
    let volume = volume.map(|placed| (placed.grid.transform(plan.space), placed.volume));
    Ok(BakedScene { objects: finished.objects, maps: finished.maps, volume, report })
}

/// How finely light is exchanged: as the quality and the memory allow, and coarser if time is short, so that most of it
/// is left for the final gather.
fn patch_resolution(
    sources: &Sources<'_>,
    texels: &CoveredTexels<'_>,
    sample_bytes: u64,
    options: &BakeOptions,
    monitor: &mut BakeMonitor<'_>,
) -> Result<(PatchResolution, StageNotes), BakeError> {
    let is_time_short = monitor.clock().is_past(SHORT_OF_TIME);
    let options = options.for_patches(decide(monitor, is_time_short)?);
    monitor.run_interruptible(1.0, || memory::patch_resolution(sources, texels, sample_bytes, &options))?
}

/// The light by bounces of all covered texels.
struct Bounces<'a> {
    indirect: IndirectLight,
    /// The light that leaves surfaces, for rays of later stages; `None` where nothing bounces, as are the figures of
    /// the gather.
    cache: Option<RadianceCache<'a>>,
    exchanged: ExchangeReport,
    gathered: Option<GatherReport>,
}

/// Exchanges light between patches, and gathers it at the covered texels.
fn bounces<'a>(
    sources: &'a Sources<'a>,
    texels: &CoveredTexels<'a>,
    direct: &DirectLight,
    resolution: &PatchResolution,
    rebake: &mut Rebake<'_>,
    options: &BakeOptions,
    monitor: &mut BakeMonitor<'_>,
) -> Result<(Bounces<'a>, StageNotes), BakeError> {
    let mut notes = StageNotes::default();
    monitor.stage(Stage::FormFactors)?;
    let transport = notes.noted(Transport::new(sources.scene, resolution, options, monitor)?);
    let exchange = match transport.is_black() {
        true => monitor.run_interruptible(0.5, || Exchange::black(sources, transport))?,
        false => {
            monitor.stage(Stage::Radiosity)?;
            let known = monitor.run_interruptible(0.1, || patch_light(texels, direct, &transport.patches))?;
            Exchange::new(sources, transport, &known, options, monitor)?
        }
    };
    let (exchange, exchanged) = notes.noted(exchange);
    let Some((exchange, factors)) = exchange else {
        let indirect = IndirectLight::none(texels, direct);
        return Ok((Bounces { indirect, cache: None, exchanged, gathered: None }, notes));
    };
    let reused = rebake.reused_gather(sources, texels, direct, &exchange, &factors, monitor)?;
    let reused = notes.noted(reused);
    // They are large, and the gather needs memory.
    drop(factors);

    monitor.stage(Stage::FinalGather)?;
    let mut cache = RadianceCache::new(sources, texels, direct, exchange, options, monitor)?;
    let gathered = rounds::gather(&mut cache, texels, direct, reused, options, monitor)?;
    let (indirect, gathered) = notes.noted(gathered);
    Ok((Bounces { indirect, cache: Some(cache), exchanged, gathered: Some(gathered) }, notes))
}
