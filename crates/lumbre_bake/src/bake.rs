//! [`Bake`], the entry point of the crate, and `run`, which calls the stages in order. The stages themselves are in the
//! folders beside.

use std::ops::ControlFlow;
use std::sync::Arc;

use bevy_ecs::world::World;
use lumbre_scene::{IrradianceVolume, Transform};

use crate::apply::apply;
use crate::baked_scene::BakedScene;
use crate::checkpoint::CheckpointFile;
use crate::chunks::decide;
use crate::content_hash::hashes_of;
use crate::coverage::covered_texels::CoveredTexels;
use crate::direct_light::{SHORT_OF_TIME, direct_light};
use crate::final_gather::lit_texels::LitTexels;
use crate::final_gather::radiance_cache::RadianceCache;
use crate::final_gather::rounds::{self, IndirectLight};
use crate::finish::baked_maps::{BakedMap, BakedObject};
use crate::finish::finished_maps::finished_maps;
use crate::finish::resolution_error::dense_points;
use crate::memory;
use crate::monitor::{BakeMonitor, Callback};
use crate::probes;
use crate::radiosity::exchange::Exchange;
use crate::radiosity::patch_light::patch_light;
use crate::radiosity::patches::Patches;
use crate::rebake::{Reuse, Samples, rebake_report, reused_gather};
use crate::scene::{StaticScene, from_world};
use crate::stage::Stage;
use crate::summary;
use crate::{BakeError, BakeOptions, BakeReport, CancelToken, Checkpoint, Ended, Progress, prepare};

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
    options: BakeOptions,
    progress: Box<Callback<'a>>,
    cancel: CancelToken,
    checkpoint: Option<&'a Checkpoint>,
    former: Option<&'a Samples>,
    keeps_samples: bool,
}

impl<'a> Bake<'a> {
    /// A bake with these options, without a progress callback, a checkpoint or samples of a previous bake.
    pub fn new(options: &BakeOptions) -> Self {
        Self {
            options: *options,
            progress: Box::new(|_| ControlFlow::Continue(())),
            cancel: CancelToken::default(),
            checkpoint: None,
            former: None,
            keeps_samples: false,
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
        Self { checkpoint: checkpoint.into(), ..self }
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
        Self { former: samples.into(), ..self }
    }

    /// Bakes the static objects of a World and gives them their lightmaps.
    ///
    /// # Errors
    /// [`BakeError`], which names the option, node or stage. [`BakeError::Checkpoint`] if the checkpoint's file cannot
    /// be created, or is not a checkpoint.
    pub fn run(self, world: &mut World) -> Result<BakeReport, BakeError> {
        self.on_world(world).map(|(report, _)| report)
    }

    /// As [`Bake::run`], but also returns samples that the next bake can be given by [`Bake::former`]. They are `None`
    /// if there was nothing to bake, or if [`BakeOptions::time`] ended the bake.
    ///
    /// # Errors
    /// As [`Bake::run`].
    pub fn run_keeping_samples(self, world: &mut World) -> Result<(BakeReport, Option<Samples>), BakeError> {
        Self { keeps_samples: true, ..self }.on_world(world)
    }

    /// Bakes plain data, without a World. With [`Bake::keep_samples`] the result also contains the samples for the next
    /// bake.
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
        self.options.check()?;
        self.on_threads(&Arc::new(scene.checked()?))
    }

    /// Makes [`Bake::run_scene`] return samples that the next bake can be given by [`Bake::former`].
    #[must_use]
    pub fn keep_samples(self) -> Self {
        Self { keeps_samples: true, ..self }
    }

    fn on_world(self, world: &mut World) -> Result<(BakeReport, Option<Samples>), BakeError> {
        self.options.check()?;
        let (scene, entities) = from_world(world);
        let scene = Arc::new(scene.checked()?);
        let mut baked = self.on_threads(&scene)?;
        apply(world, &scene, &entities, &mut baked);
        Ok((baked.report, baked.samples))
    }

    fn on_threads(mut self, scene: &Arc<StaticScene>) -> Result<BakedScene, BakeError> {
        let mut bake = || {
            let mut report = BakeReport { threads: rayon::current_num_threads(), ..BakeReport::default() };
            let monitor = BakeMonitor::new(&mut *self.progress, self.options.time);
            let mut monitor = monitor.cancelled_by(self.cancel.clone());
            let request = Request {
                options: &self.options,
                checkpoint: self.checkpoint,
                former: self.former,
                keeps_samples: self.keeps_samples,
            };
            let BakeOutput { objects, maps, volume, samples } =
                run(scene, &request, &mut monitor, &mut report)?;
            Ok(BakedScene { objects, maps, volume, samples, report: summary::finish(report, &mut monitor) })
        };
        match self.options.threads {
            None => bake(),
            Some(threads) => {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                pool.map_err(|error| BakeError::Threads { reason: error.to_string() })?.install(bake)
            }
        }
    }
}

/// The result of the stages: a baked scene without its report.
#[derive(Default)]
struct BakeOutput {
    objects: Vec<BakedObject>,
    maps: Vec<BakedMap>,
    volume: Option<(Transform, IrradianceVolume)>,
    samples: Option<Samples>,
}

/// What the caller has requested, apart from progress and cancellation, which are the monitor's.
struct Request<'a> {
    options: &'a BakeOptions,
    checkpoint: Option<&'a Checkpoint>,
    former: Option<&'a Samples>,
    keeps_samples: bool,
}

/// Runs the stages in order. Each takes values that earlier stages have returned.
fn run(
    input: &Arc<StaticScene>,
    request: &Request<'_>,
    monitor: &mut BakeMonitor<'_>,
    report: &mut BakeReport,
) -> Result<BakeOutput, BakeError> {
    let options = request.options;
    monitor.stage(Stage::Layout, report)?;
    let reuse = request.prepare_reuse(input, monitor, report)?;
    if input.objects.is_empty() {
        return Ok(nothing_to_bake("the scene has no static mesh", report));
    }
    let (space, density) = (reuse.space(input), reuse.density(input, options));
    let layout = prepare::layout(input, space, density, options, monitor, report)?;

    monitor.stage(Stage::Hierarchy, report)?;
    let (scene, layout, emitters) = prepare::scene(input, layout, space, monitor, report)?;
    let sources = prepare::sources(input, &scene, emitters, monitor, report)?;
    if sources.is_empty() {
        let why = "no surface emits, no light is static or mixed, and there is no sky";
        return Ok(nothing_to_bake(why, report));
    }
    let sample_bytes = request.sample_bytes(reuse.is_possible());
    memory::check_texels(&scene, &layout, sample_bytes, options)?;

    monitor.stage(Stage::DirectLight, report)?;
    let texels = CoveredTexels::new(&scene, &layout, monitor, report)?;
    let is_time_short = monitor.clock().is_past(SHORT_OF_TIME);
    let patch_options = options.for_patches(decide(monitor, is_time_short)?);
    let resolution = monitor
        .run_interruptible(1.0, || memory::resolution(&texels, sample_bytes, &patch_options, report))??;
    let changes = monitor.run_interruptible(1.0, || reuse.changes(&input.objects, &sources, &texels))?;
    let known = changes.as_ref().map_or(&[][..], |changes| &changes.known_direct);
    let direct = direct_light(&sources, &texels, known, options, monitor, report)?;

    let patch_light = |patches: &Patches| patch_light(&texels, &direct, patches);
    let exchange = Exchange::new(&scene, &sources, &patch_options, resolution, patch_light, monitor, report)?;
    let reused = match (&exchange, &changes) {
        (Some((exchange, factors)), Some(changes)) => {
            let exchange = (exchange, factors);
            Some(reused_gather(changes, &sources, &texels, &direct, exchange, options, monitor, report)?)
        }
        _ => None,
    };
    let exchange = exchange.map(|(exchange, _)| exchange);
    let (indirect, cache) = match &exchange {
        None => (IndirectLight::none(&direct), None),
        Some(exchange) => {
            monitor.stage(Stage::FinalGather, report)?;
            let mut cache = RadianceCache::new(&sources, &texels, &direct, exchange, options, monitor)?;
            let indirect =
                rounds::gather(&mut cache, &texels, &direct, reused.as_ref(), options, monitor, report)?;
            (indirect, Some(cache))
        }
    };
    let volume = probes::bake(input, &scene, &sources, cache.as_ref(), options, monitor, report)?;
    let points = dense_points(&sources, cache.as_ref(), options, monitor, report)?;

    monitor.stage(Stage::Texels, report)?;
    let light = indirect.with(&direct);
    let lit = LitTexels { texels: &texels, direct: &direct, indirect: &indirect, light: &light };
    summary::write(&lit, cache.is_some(), &input.objects, options, monitor, report)?;
    report.rebake = report.rebake.take().or_else(|| {
        changes.as_ref().map(|changes| rebake_report(changes, &texels.list, reused.as_ref(), report))
    });
    let samples = match request.keeps_samples && report.ended != Ended::Time {
        // Samples that were cut short would not be good enough for a later bake that has more time.
        false => None,
        true => Some(monitor.run_interruptible(0.0, || {
            let exitance = exchange.as_ref().map(|exchange| exchange.exitance_of(&scene, layout.maps.len()));
            reuse.samples(&lit, reused.as_ref(), &input.objects, &sources, &exitance.unwrap_or_default())
        })?),
    };
    let (objects, maps) = finished_maps(&lit, &points, &input.objects, options, monitor, report)?;
    let volume = volume.map(|placed| (placed.grid.transform(space), placed.volume));
    Ok(BakeOutput { objects, maps, volume, samples })
}

/// Reports why there is no light to bake.
fn nothing_to_bake(why: &str, report: &mut BakeReport) -> BakeOutput {
    report.skipped.push(format!("everything: {why}"));
    report.error_reached = true;
    BakeOutput::default()
}

impl Request<'_> {
    /// Hashes the scene, decides whether samples of a previous bake can be used, and opens the checkpoint.
    fn prepare_reuse(
        &self,
        input: &StaticScene,
        monitor: &mut BakeMonitor<'_>,
        report: &mut BakeReport,
    ) -> Result<Reuse<'_>, BakeError> {
        let hashes = monitor.run_interruptible(0.0, || hashes_of(input, self.options))?;
        report.content_hash = hashes.content.to_string();
        // Samples take memory. If that is limited, fewer patches may fit beside them, and the light would differ.
        let limited = self.options.memory.is_some() && self.sample_bytes(self.former.is_some()) > 0;
        let reuse = Reuse::new(self.former, hashes, limited, input, self.options, report);
        if let Some(checkpoint) = self.checkpoint {
            let opened = CheckpointFile::open(checkpoint, &reuse.identity);
            monitor.checkpoint =
                opened.map_err(|source| BakeError::Checkpoint { path: checkpoint.path.clone(), source })?;
        }
        Ok(reuse)
    }

    /// Bytes per covered texel for samples: those that this bake returns, and those of the previous bake if they are
    /// used.
    fn sample_bytes(&self, uses_former: bool) -> u64 {
        let returned = if self.keeps_samples { memory::SAMPLES_BYTES } else { 0 };
        returned + if uses_former { memory::FORMER_SAMPLES_BYTES } else { 0 }
    }
}
