//! The bake from end to end: a static scene in, its light out, through the stages. Not the stages themselves.

use std::ops::ControlFlow;
use std::sync::Arc;

use bevy_ecs::world::World;
use lumbre_scene::{IrradianceVolume, Transform};

use crate::apply::apply;
use crate::checkpoint::CheckpointFile;
use crate::content_hash::hashes_of;
use crate::coverage::covered_texels::CoveredTexels;
use crate::direct_light::direct_light;
use crate::final_gather::lit_texels::LitTexels;
use crate::final_gather::radiance_cache::RadianceCache;
use crate::final_gather::rounds::{self, IndirectLight};
use crate::finish::baked_scene::{BakedMap, BakedObject, BakedScene};
use crate::finish::finished_maps::finished_maps;
use crate::finish::resolution_error::dense_points;
use crate::memory;
use crate::monitor::{BakeMonitor, Callback, Stage};
use crate::probes;
use crate::radiosity::exchange::Exchange;
use crate::radiosity::patch_light::patch_light;
use crate::radiosity::patches::Patches;
use crate::rebake::{Reuse, Samples, rebake_report, reused_gather};
use crate::scene::{StaticScene, from_world};
use crate::summary;
use crate::{BakeError, BakeOptions, BakeReport, CancelToken, Checkpoint, Ended, Progress, preparing};

/// A bake that is about to run: the light of a world's static objects, in lightmaps.
///
/// Reads every `Mesh` with a `SceneObject` (dynamic and hidden ones are left out), emissive materials, and lights whose
/// `BakeMode` is `Static` (direct light and bounces) or `Mixed` (bounces only). Afterwards each of those entities has
/// its mesh with `uv1` and a `Lightmap` of E/π; the primitives of a glTF node share one map. If anything fails or is
/// cancelled the world's meshes and lightmaps are as they were (only global transforms are brought up to date).
///
/// The same world, options and seed give the same bits on any number of threads, unless [`BakeOptions::time`] cuts it short.
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
    /// With these options, and nothing else.
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

    /// Calls back between chunks of work, and some twenty times a second while one takes long; `ControlFlow::Break` cancels the bake.
    #[must_use]
    pub fn progress(self, progress: impl FnMut(Progress) -> ControlFlow<()> + Send + 'a) -> Self {
        Self { progress: Box::new(progress), ..self }
    }

    /// Ends when the token is cancelled, from whatever thread. (A callback that breaks cancels it, too.)
    #[must_use]
    pub fn cancel(self, token: &CancelToken) -> Self {
        Self { cancel: token.clone(), ..self }
    }

    /// Keeps what has been computed in a checkpoint, or goes on from one: an interrupted bake that is resumed gives the same bits as one that was not
    /// interrupted. What is wrong with a checkpoint that is there and not used stands in the report's warnings.
    #[must_use]
    pub fn checkpoint(self, checkpoint: impl Into<Option<&'a Checkpoint>>) -> Self {
        Self { checkpoint: checkpoint.into(), ..self }
    }

    /// Keeps of a former bake what the scene's changes can hardly have affected. The report's [`rebake`](BakeReport::rebake) says what was kept, or why
    /// nothing was: then the whole scene is baked. What the light of the kept texels may have changed by is part of the stated error, adds up over
    /// several bakes, and is gathered anew when it is no longer small beside the error asked for.
    ///
    /// The same world, options, seed and former samples give the same bits on any number of threads; those of a whole bake where there is nothing to
    /// keep, unless [`BakeOptions::memory`] is short: samples take some of it.
    ///
    /// Objects are recognised by name, mesh, material and place as they were before a bake, which gives meshes new coordinates:
    /// [`UnwrappedFrom`](crate::UnwrappedFrom) remembers beside such a mesh what it was. A World can so be changed and baked again and again; a level that
    /// was saved and loaded again counts as new.
    #[must_use]
    pub fn former(self, samples: impl Into<Option<&'a Samples>>) -> Self {
        Self { former: samples.into(), ..self }
    }

    /// Bakes a World's static scene, and gives its objects their maps.
    ///
    /// # Errors
    /// [`BakeError`], which names the option, node or stage; [`BakeError::Checkpoint`] if the checkpoint's file cannot be begun, or is something else.
    pub fn run(self, world: &mut World) -> Result<BakeReport, BakeError> {
        self.on_world(world).map(|(report, _)| report)
    }

    /// As [`Bake::run`], and returns the samples for [`Bake::former`] of the next time: none where there was nothing to bake, or no time for it.
    ///
    /// # Errors
    /// As [`Bake::run`].
    pub fn run_keeping_samples(self, world: &mut World) -> Result<(BakeReport, Option<Samples>), BakeError> {
        Self { keeps_samples: true, ..self }.on_world(world)
    }

    /// Bakes plain data, without a World. With [`Bake::keep_samples`] the samples for the next time come with the maps.
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

    /// Keeps samples for [`Bake::former`] of the next time.
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

/// What the stages have made: a baked scene without its report.
#[derive(Default)]
struct BakeOutput {
    objects: Vec<BakedObject>,
    maps: Vec<BakedMap>,
    volume: Option<(Transform, IrradianceVolume)>,
    samples: Option<Samples>,
}

/// What a bake is asked to do, apart from whom it reports to.
struct Request<'a> {
    options: &'a BakeOptions,
    checkpoint: Option<&'a Checkpoint>,
    former: Option<&'a Samples>,
    keeps_samples: bool,
}

/// Runs the stages in their order: each takes the values that those before it returned.
fn run(
    input: &Arc<StaticScene>,
    request: &Request<'_>,
    monitor: &mut BakeMonitor<'_>,
    report: &mut BakeReport,
) -> Result<BakeOutput, BakeError> {
    let options = request.options;
    monitor.stage(Stage::Layout, report)?;
    let mut reuse = request.prepare_reuse(input, monitor, report)?;
    if input.objects.is_empty() {
        return Ok(nothing_to_bake("the scene has no static mesh", report));
    }
    let (space, density) = (reuse.space(input), reuse.density(input, options));
    let layout = preparing::layout(input, space, density, options, monitor, report)?;

    monitor.stage(Stage::Hierarchy, report)?;
    let (scene, layout, emitters) = preparing::scene(input, layout, space, monitor, report)?;
    let sources = preparing::sources(input, &scene, emitters, monitor, report)?;
    if sources.is_empty() {
        let why = "no surface emits, no light is static or mixed, and there is no sky";
        return Ok(nothing_to_bake(why, report));
    }
    let sample_bytes = request.sample_bytes(reuse.is_possible());
    memory::check_texels(&scene, &layout, sample_bytes, options)?;

    monitor.stage(Stage::DirectLight, report)?;
    let texels = CoveredTexels::new(&scene, &layout, monitor, report)?;
    let patch_options = options.for_patches(monitor.clock().is_past(SHORT_OF_TIME));
    let resolution = monitor.run_interruptible(1.0, || {
        memory::resolution(&scene, &texels, sample_bytes, &patch_options, report)
    })??;
    let changes = monitor.run_interruptible(1.0, || reuse.changes(&input.objects, &sources, &texels))?;
    let known = changes.as_ref().map_or(&[][..], |changes| &changes.known_direct);
    let direct = direct_light(&sources, &texels, known, options, monitor, report)?;

    let patch_light = |patches: &Patches| patch_light(&scene, &texels, &direct, patches);
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
    let lit =
        LitTexels { scene: &scene, texels: &texels, direct: &direct, indirect: &indirect, light: &light };
    summary::write(&lit, cache.is_some(), &input.objects, options, monitor, report)?;
    report.rebake = report.rebake.take().or_else(|| {
        changes.as_ref().map(|changes| rebake_report(changes, &texels.list, reused.as_ref(), report))
    });
    let samples = match request.keeps_samples && report.ended != Ended::Time {
        // A bake with more time would not want to keep what was cut short.
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

/// If more than this share of the time for direct light is over before any light is known, then the time is short for a scene of this size.
const SHORT_OF_TIME: f64 = 0.3;

/// Reports why there is no light to bake.
fn nothing_to_bake(why: &str, report: &mut BakeReport) -> BakeOutput {
    report.skipped.push(format!("everything: {why}"));
    report.error_reached = true;
    BakeOutput::default()
}

impl Request<'_> {
    /// Hashes the scene, decides whether samples of a former bake can be used, and opens the checkpoint.
    fn prepare_reuse(
        &self,
        input: &StaticScene,
        monitor: &mut BakeMonitor<'_>,
        report: &mut BakeReport,
    ) -> Result<Reuse<'_>, BakeError> {
        let hashes = monitor.run_interruptible(0.0, || hashes_of(input, self.options))?;
        report.content_hash = hashes.content.to_string();
        // Samples take memory: within a limit, whether they are kept decides which patches fit.
        let limited = self.options.memory.is_some() && self.sample_bytes(self.former.is_some()) > 0;
        let reuse = Reuse::new(self.former, hashes, limited, input, self.options, report);
        if let Some(checkpoint) = self.checkpoint {
            let opened = CheckpointFile::open(checkpoint, &reuse.identity);
            monitor.checkpoint =
                opened.map_err(|source| BakeError::Checkpoint { path: checkpoint.path.clone(), source })?;
        }
        Ok(reuse)
    }

    /// Bytes that each covered texel takes for samples: those that this bake keeps, and those of a former bake where they are used.
    fn sample_bytes(&self, uses_former: bool) -> u64 {
        let own = if self.keeps_samples { memory::SAMPLES_BYTES } else { 0 };
        own + if uses_former { memory::FORMER_SAMPLES_BYTES } else { 0 }
    }
}
