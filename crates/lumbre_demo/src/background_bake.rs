//! A bake in a thread of its own, which hands out its light as it refines while frames are drawn. The baker
//! is `lumbre_bake`; `window` shows the results.
//!
//! The thread reads the file again, so that the World that frames are drawn from stays free. It bakes three
//! times: twice with fewer texels and a larger error for a quick look, and then with the requested options.
//! After each pass it hands out meshes and lightmaps, which are assigned by the nodes of the file.

use std::collections::HashMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use bevy_ecs::prelude::*;
use glam::Vec3;
use lumbre_bake::{
    Bake, BakeOptions, BakeReport, CancelToken, Density, Quality, baked_area, has_light_to_bake,
};
use lumbre_scene::{
    IrradianceVolume, Lightmap, LoadError, LoadOptions, MaterialTextures, Mesh, Name, PackedFormat,
    Primitive, SaveError, SaveOptions, SceneSettings, SourceFile, Transform, save_baked,
};

/// One of several bakes of increasing quality.
struct Pass {
    name: &'static str,
    /// Texel density as a fraction of the requested one.
    density: f64,
    /// The target error, if the requested one is not larger.
    error: f64,
    quality: Quality,
}

/// The passes before the requested one: a first result within moments, then one good enough to judge the
/// lighting by.
const FIRST: [Pass; 2] = [
    Pass { name: "first light", density: 0.2, error: 0.2, quality: Quality::Draft },
    Pass { name: "draft", density: 0.5, error: 0.05, quality: Quality::Draft },
];
/// The name of the final pass, with the requested options.
const FINAL: &str = "final";
/// The approximate number of texels that the baker chooses for a whole scene.
const AUTOMATIC_TEXELS: f64 = 500_000.0;
/// The smallest map size that a pass may ask for.
const SMALLEST_MAP: u32 = 4;
/// Radiance of the uniform sky that a file without any light is baked under, W/(m² sr).
const SKY: f32 = 1.0;

/// Reasons why a bake ended without a result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BakeError {
    /// The file cannot be read again.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// The baker failed or refused the scene.
    #[error(transparent)]
    Bake(#[from] lumbre_bake::BakeError),
    /// The baked file cannot be written.
    #[error(transparent)]
    Save(#[from] SaveError),
    /// The system cannot start a thread.
    #[error("no thread can be started for the bake: {0}; close other programs")]
    Thread(#[from] std::io::Error),
    /// The thread ended by a panic.
    #[error(
        "the bake has ended unexpectedly: this is a fault of the program; please report it with the file"
    )]
    Lost,
}

/// Progress of a bake.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeStatus {
    /// The name of the pass.
    pub pass: &'static str,
    /// The stage of the baker, in words.
    pub stage: &'static str,
    /// Fraction of this pass that is done, in [0, 1].
    pub fraction: f32,
    /// Estimated relative error so far, once one is known.
    pub error: Option<f64>,
    /// Time since the first pass began.
    pub elapsed: Duration,
}

/// The result of a pass: meshes and lightmaps by node and primitive of the file, and irradiance volumes for
/// moving objects.
#[derive(Debug, Default)]
pub struct BakedLight {
    parts: HashMap<(usize, usize), (Mesh, Option<MaterialTextures>, Lightmap)>,
    volumes: Vec<(IrradianceVolume, Transform)>,
    /// The name of the pass.
    pub pass: &'static str,
    /// Estimated relative error.
    pub error: f64,
    /// Whether a uniform sky was added because the file has no light to bake.
    pub under_a_sky: bool,
    /// Whether this is the result of the last pass.
    pub is_final: bool,
}

impl BakedLight {
    fn of(world: &mut World, nodes: &[Entity], report: &BakeReport) -> Self {
        let node_of: HashMap<Entity, usize> =
            nodes.iter().enumerate().map(|(index, &entity)| (entity, index)).collect();
        let mut baked = world.query::<(&ChildOf, &Primitive, &Mesh, Option<&MaterialTextures>, &Lightmap)>();
        let parts = baked
            .iter(world)
            .filter_map(|(parent, primitive, mesh, textures, lightmap)| {
                let node = *node_of.get(&parent.parent())?;
                Some(((node, primitive.index), (mesh.clone(), textures.cloned(), lightmap.clone())))
            })
            .collect();
        let mut volumes = world.query::<(&IrradianceVolume, &Transform)>();
        let volumes = volumes.iter(world).map(|(volume, place)| (volume.clone(), *place)).collect();
        Self { parts, volumes, error: report.estimated_error, ..Self::default() }
    }

    /// Returns the number of surfaces that have a lightmap.
    pub fn len(&self) -> usize {
        self.parts.len()
    }

    /// Returns true if no surface has a lightmap.
    pub fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    /// Replaces the baked light of a World that the same file was loaded into; `nodes` are the entities of
    /// its nodes.
    pub fn apply(&self, world: &mut World, nodes: &[Entity]) {
        let stale: Vec<Entity> = world.query_filtered::<Entity, With<Lightmap>>().iter(world).collect();
        for entity in stale {
            world.entity_mut(entity).remove::<Lightmap>();
        }
        let stale: Vec<Entity> =
            world.query_filtered::<Entity, With<IrradianceVolume>>().iter(world).collect();
        for entity in stale {
            // Volumes of the file belong to its nodes; the others were spawned by an earlier pass.
            if nodes.contains(&entity) {
                world.entity_mut(entity).remove::<IrradianceVolume>();
            } else {
                world.despawn(entity);
            }
        }
        for (volume, place) in &self.volumes {
            world.spawn((Name::new("irradiance volume"), volume.clone(), *place));
        }
        let node_of: HashMap<Entity, usize> =
            nodes.iter().enumerate().map(|(index, &entity)| (entity, index)).collect();
        let mut primitives = world.query_filtered::<(Entity, &ChildOf, &Primitive), With<Mesh>>();
        let found: Vec<_> = primitives
            .iter(world)
            .filter_map(|(entity, parent, primitive)| {
                let node = *node_of.get(&parent.parent())?;
                Some((entity, self.parts.get(&(node, primitive.index))?))
            })
            .collect();
        for (entity, (mesh, textures, lightmap)) in found {
            let mut entity = world.entity_mut(entity);
            entity.insert((mesh.clone(), lightmap.clone()));
            if let Some(textures) = textures {
                entity.insert(textures.clone());
            }
        }
    }
}

/// An event of a background bake.
#[derive(Debug)]
pub enum BakeNews {
    /// The light of another pass is ready.
    Light(BakedLight),
    /// The baked file is written.
    Saved(PathBuf),
    /// The bake was cancelled on request.
    Cancelled,
    /// The bake or the writing of its file failed.
    Failed(BakeError),
}

enum Message {
    Status(BakeStatus),
    News(BakeNews),
    /// All passes are done, or the file was written; the result can be saved.
    Done(Box<Baked>),
}

struct Baked {
    source: SourceFile,
    world: World,
}

/// What the threads are doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Work {
    Baking,
    Saving,
    Nothing,
}

/// A bake that runs or has run in the background. Dropping it cancels the bake; a file that is being written
/// is finished first.
pub struct BackgroundBake {
    messages: Receiver<Message>,
    sender: Sender<Message>,
    cancel: CancelToken,
    status: Option<BakeStatus>,
    work: Work,
    baked: Option<Box<Baked>>,
    /// The thread that writes the file.
    saving: Option<JoinHandle<()>>,
}

impl BackgroundBake {
    /// Starts to bake a file; `wanted` are the options of the last pass.
    ///
    /// # Errors
    /// [`BakeError::Thread`] if no thread can be started.
    pub fn start(path: &Path, options: &LoadOptions, wanted: &BakeOptions) -> Result<Self, BakeError> {
        let (sender, messages) = channel();
        let cancel = CancelToken::default();
        let job = Job {
            path: path.to_owned(),
            options: options.clone(),
            wanted: *wanted,
            cancel: cancel.clone(),
            begun: Instant::now(),
            sender: sender.clone(),
        };
        thread::Builder::new().name("bake".to_owned()).spawn(move || job.run())?;
        Ok(Self { messages, sender, cancel, status: None, work: Work::Baking, baked: None, saving: None })
    }

    /// Returns true while it bakes or writes a file.
    pub fn is_running(&self) -> bool {
        self.work != Work::Nothing
    }

    /// Returns true while it bakes.
    pub fn is_baking(&self) -> bool {
        self.work == Work::Baking
    }

    /// Returns the progress while it bakes; `None` before the first report.
    pub fn status(&self) -> Option<&BakeStatus> {
        self.status.as_ref().filter(|_| self.is_baking())
    }

    /// Returns true once all passes are done, so that the file can be written.
    pub fn can_be_saved(&self) -> bool {
        self.baked.is_some()
    }

    /// Asks it to end; [`BakeNews::Cancelled`] follows when it has.
    pub fn cancel(&self) {
        self.cancel.cancel();
    }

    /// Writes the baked file in a thread of its own. Does nothing before all passes are done. If it fails, the
    /// bake is kept and can be saved again.
    pub fn save(&mut self, path: &Path) {
        self.save_in(thread::Builder::new().name("save".to_owned()), path);
    }

    fn save_in(&mut self, thread: thread::Builder, path: &Path) {
        let Some(baked) = self.baked.take() else { return };
        let (sender, path) = (self.sender.clone(), path.to_owned());
        // The bake is handed over once the thread runs, so that it is not lost if the thread cannot be started.
        let (hand_over, taken) = channel::<Box<Baked>>();
        let started = thread.spawn(move || {
            let Ok(mut baked) = taken.recv() else { return };
            let saved = save_baked(&mut baked.world, &baked.source, &path, &written_as());
            // The receiver may be gone.
            let _ = sender.send(Message::News(match saved {
                Ok(_) => BakeNews::Saved(path),
                Err(error) => BakeNews::Failed(error.into()),
            }));
            let _ = sender.send(Message::Done(baked));
        });
        match started {
            Ok(thread) => {
                (self.work, self.saving) = (Work::Saving, Some(thread));
                // The thread waits for it.
                let _ = hand_over.send(baked);
            }
            Err(error) => {
                (self.work, self.baked) = (Work::Nothing, Some(baked));
                let _ = self.sender.send(Message::News(BakeNews::Failed(error.into())));
            }
        }
    }

    /// Returns what has happened since the last call.
    pub fn news(&mut self) -> Vec<BakeNews> {
        let mut news = Vec::new();
        loop {
            match self.messages.try_recv() {
                Ok(Message::Status(status)) => self.status = Some(status),
                Ok(Message::Done(baked)) => {
                    self.work = Work::Nothing;
                    self.baked = Some(baked);
                }
                Ok(Message::News(one)) => {
                    if matches!(one, BakeNews::Cancelled) || is_of_the_bake(&one) {
                        self.work = Work::Nothing;
                    }
                    news.push(one);
                }
                Err(TryRecvError::Empty | TryRecvError::Disconnected) => break,
            }
        }
        // A panic while saving is a bug of this program; it is reported instead of closing the window.
        if let Some(thread) = self.saving.take_if(|thread| thread.is_finished())
            && thread.join().is_err()
        {
            self.work = Work::Nothing;
            news.push(BakeNews::Failed(BakeError::Lost));
        }
        news
    }
}

/// Returns the options by which `lumbre bake` writes by default: KTX2 beside OpenEXR.
fn written_as() -> SaveOptions {
    SaveOptions { ktx2: Some(PackedFormat::Rgb9E5), ..SaveOptions::default() }
}

/// Returns true for a failure that ends the bake. After a failure to save, the bake is handed back and can be
/// saved again.
fn is_of_the_bake(news: &BakeNews) -> bool {
    matches!(news, BakeNews::Failed(error) if !matches!(error, BakeError::Save(_)))
}

impl Drop for BackgroundBake {
    fn drop(&mut self) {
        self.cancel();
        if let Some(thread) = self.saving.take() {
            // The panic, if there was one, has nobody left to report to.
            let _ = thread.join();
        }
    }
}

/// The data of the baking thread.
struct Job {
    path: PathBuf,
    options: LoadOptions,
    wanted: BakeOptions,
    cancel: CancelToken,
    begun: Instant,
    sender: Sender<Message>,
}

impl Job {
    fn run(self) {
        // A panic in the baker is a bug of this program; it is reported instead of closing the window.
        let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| self.bake_all()));
        let message = match outcome {
            Ok(Ok(Some(baked))) => Message::Done(Box::new(baked)),
            Ok(Ok(None) | Err(BakeError::Bake(lumbre_bake::BakeError::Cancelled { .. }))) => {
                Message::News(BakeNews::Cancelled)
            }
            Ok(Err(error)) => Message::News(BakeNews::Failed(error)),
            Err(_) => Message::News(BakeNews::Failed(BakeError::Lost)),
        };
        // The window may be gone.
        let _ = self.sender.send(message);
    }

    /// Runs all passes; returns `None` if cancelled between two of them.
    fn bake_all(&self) -> Result<Option<Baked>, BakeError> {
        let mut world = World::new();
        let mut file = SourceFile::read(&self.path, &self.options)?;
        let nodes = file.load_into(&mut world)?.nodes;
        let under_a_sky = !has_light_to_bake(&mut world);
        if under_a_sky {
            world.get_resource_or_init::<SceneSettings>().sky = Vec3::splat(SKY);
        }
        let area = baked_area(&mut world);
        let first = FIRST.iter().map(|pass| (pass.name, rougher(&self.wanted, pass, area)));
        for (name, options) in first.chain([(FINAL, self.wanted)]) {
            if self.cancel.is_cancelled() {
                return Ok(None);
            }
            let report = Bake::new(&leaving_a_core(options))
                .cancel(&self.cancel)
                .progress(|progress| {
                    let status = BakeStatus {
                        pass: name,
                        stage: progress.stage,
                        fraction: progress.fraction,
                        error: progress.error,
                        elapsed: self.begun.elapsed(),
                    };
                    // The window may be gone.
                    let _ = self.sender.send(Message::Status(status));
                    ControlFlow::Continue(())
                })
                .run(&mut world)?;
            let mut light = BakedLight::of(&mut world, &nodes, &report);
            (light.pass, light.under_a_sky, light.is_final) = (name, under_a_sky, name == FINAL);
            let _ = self.sender.send(Message::News(BakeNews::Light(light)));
        }
        Ok(Some(Baked { source: file, world }))
    }
}

/// Returns the requested options, made faster for an early pass.
fn rougher(wanted: &BakeOptions, pass: &Pass, area: f64) -> BakeOptions {
    let density = match wanted.density {
        Density::Automatic if area > 0.0 && area.is_finite() => {
            Density::TexelsPerMeter(pass.density * (AUTOMATIC_TEXELS / area).sqrt())
        }
        Density::Automatic => Density::Automatic,
        Density::TexelsPerMeter(texels) => Density::TexelsPerMeter(pass.density * texels),
        Density::MapSize(side) => {
            Density::MapSize(((pass.density * f64::from(side)) as u32).max(SMALLEST_MAP))
        }
    };
    let (error, quality) = (pass.error.max(wanted.error), pass.quality);
    BakeOptions { density, error, quality, resolution_error: false, ..*wanted }
}

/// Leaves one core to the frames, unless a number of threads was requested.
fn leaving_a_core(options: BakeOptions) -> BakeOptions {
    let cores = thread::available_parallelism().map_or(1, |cores| (cores.get() - 1).max(1));
    BakeOptions { threads: options.threads.or(Some(cores)), ..options }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bake_outlasts_a_thread_that_cannot_be_started() {
        let folder = tempfile::tempdir().unwrap();
        let [input, output] = ["in.gltf", "out.gltf"].map(|name| folder.path().join(name));
        std::fs::write(&input, r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{}]}"#).unwrap();
        let mut source = SourceFile::read(&input, &LoadOptions::default()).unwrap();
        let mut world = World::new();
        source.load_into(&mut world).unwrap();
        let (sender, messages) = channel();
        let mut bake = BackgroundBake {
            messages,
            sender,
            cancel: CancelToken::default(),
            status: None,
            work: Work::Nothing,
            baked: Some(Box::new(Baked { source, world })),
            saving: None,
        };
        // No system has this much memory for a stack.
        bake.save_in(thread::Builder::new().stack_size(1 << 60), &output);
        let news = bake.news();
        assert!(matches!(news.as_slice(), [BakeNews::Failed(BakeError::Thread(_))]), "{news:?}");
        assert!(bake.can_be_saved() && !bake.is_running());
        bake.save(&output);
        while bake.is_running() {
            for news in bake.news() {
                assert!(matches!(news, BakeNews::Saved(_)), "{news:?}");
            }
            thread::sleep(Duration::from_millis(1));
        }
        assert!(output.exists() && bake.can_be_saved());
    }
}
