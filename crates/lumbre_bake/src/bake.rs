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
use crate::direct_light::{SHORT_OF_TIME, direct_light};
use crate::final_gather::rounds;
use crate::final_gather::{IndirectLight, LitTexels, RadianceCache};
use crate::finish::FinishedMaps;
use crate::finish::finished_maps::finished_maps;
use crate::finish::resolution_error::dense_points;
use crate::memory;
use crate::monitor::{BakeMonitor, Callback};
use crate::probes;
use crate::radiosity::patch_light::patch_light;
use crate::radiosity::{Exchange, Patches};
use crate::rebake::{Rebake, Samples};
use crate::scene::{StaticScene, from_world};
use crate::stage::Stage;
use crate::summary;
use crate::{BakeError, BakeOptions, BakeReport, CancelToken, Checkpoint, Progress, prepare};

/// Configures and runs a bake, which computes the light on the static objects of a scene and stores it in lightmaps.
///
/// [`Bake::run`] bakes the entities of a World that have a `Mesh` and a `StaticObject`, except hidden ones and those
/// that are or are below a `DynamicObject`. Light comes from emissive materials, from the sky, and from lights whose
/// `BakeMode` is `Static` (direct light and bounces are baked) or `Mixed` (only the bounces are). After the bake each
/// of these entities has a mesh with lightmap coordinates in `uv1`, and a `Lightmap` of E/π. The primitives of a glTF
/// node share one map.
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

/// A bake with what stands around its stages: the former bake, the checkpoint and the clock. Also returns the samples for
/// the next bake, if they are requested.
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

/// Runs the stages in order. Each takes values that earlier stages have returned, and its notes go into the report.
/// Two of them skip what `rebake` knows already, which is nothing without a former bake.
fn run(
    input: &Arc<StaticScene>,
    rebake: &mut Rebake<'_>,
    options: &BakeOptions,
    monitor: &mut BakeMonitor<'_>,
) -> Result<BakedScene, BakeError> {
    let mut report = BakeReport::default();
    if input.objects.is_empty() {
        return Ok(BakedScene::dark("the scene has no static mesh", report));
    }
    let plan = rebake.plan();
    let layout = report.noted(prepare::layout(input, &plan, options, monitor)?);

    monitor.stage(Stage::Hierarchy)?;
    let (scene, layout, emitters) = report.noted(prepare::scene(input, layout, plan.space, monitor)?);
    report.triangles = scene.triangles.iter().filter(|triangle| !triangle.is_hidden_duplicate).count();
    let sources = report.noted(prepare::sources(input, &scene, emitters, monitor)?);
    if sources.is_empty() {
        let why = "no surface emits, no light is static or mixed, and there is no sky";
        return Ok(BakedScene::dark(why, report));
    }
    memory::check_texels(&scene, &layout, plan.sample_bytes, options)?;

    monitor.stage(Stage::DirectLight)?;
    let texels = report.noted(CoveredTexels::new(&scene, &layout, monitor)?);
    let is_time_short = monitor.clock().is_past(SHORT_OF_TIME);
    let patch_options = options.for_patches(decide(monitor, is_time_short)?);
    let resolution = report.noted(
        monitor
            .run_interruptible(1.0, || memory::resolution(&texels, plan.sample_bytes, &patch_options))??,
    );
    let known = rebake.known_direct_light(&sources, &texels, monitor)?;
    let direct = report.noted(direct_light(&sources, &texels, &known, options, monitor)?);

    let patch_light = |patches: &Patches| patch_light(&texels, &direct, patches);
    let (exchange, exchanged) =
        report.noted(Exchange::new(&sources, &patch_options, resolution, patch_light, monitor)?);
    let reused = match &exchange {
        Some((exchange, factors)) => {
            report.noted(rebake.reused_gather(&sources, &texels, &direct, exchange, factors, monitor)?)
        }
        None => None,
    };
    let exchange = exchange.map(|(exchange, _)| exchange);
    let (indirect, gathered, cache) = match &exchange {
        None => (IndirectLight::none(&texels, &direct), None, None),
        Some(exchange) => {
            monitor.stage(Stage::FinalGather)?;
            let mut cache = RadianceCache::new(&sources, &texels, &direct, exchange, options, monitor)?;
            let (indirect, gathered) =
                report.noted(rounds::gather(&mut cache, &texels, &direct, reused, options, monitor)?);
            (indirect, Some(gathered), Some(cache))
        }
    };
    let volume = report.noted(probes::bake(input, &scene, &sources, cache.as_ref(), options, monitor)?);
    let points = report.noted(dense_points(&sources, cache.as_ref(), report.rays, options, monitor)?);

    monitor.stage(Stage::Texels)?;
    let light = indirect.with(&direct);
    let lit = LitTexels { texels: &texels, direct: &direct, indirect: &indirect, light: &light };
    summary::write_stages(&lit, &resolution, exchanged, volume.as_ref(), &mut report);
    summary::write_errors(&lit, gathered, &input.objects, options, monitor, &mut report)?;
    rebake.record(&lit, &sources, exchange.as_ref(), &report, monitor)?;
    let mean = report.mean_of_channels();
    let finished = finished_maps(&lit, &points, mean, &input.objects, options, monitor)?;
    let FinishedMaps { objects, maps, atlases, seams, resolution } = report.noted(finished);
    report = BakeReport { maps: maps.len(), atlases, seams, resolution, ..report };
    let volume = volume.map(|placed| (placed.grid.transform(plan.space), placed.volume));
    Ok(BakedScene { objects, maps, volume, report })
}
