//! A picture of a World, from the options to the pixels: reads the scene, chooses the integrator, takes samples until there are enough. Not
//! how light is followed: that is `ray_tree` and `path`.

use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use bevy_ecs::world::World;
use glam::{DVec2, DVec3};
use lumbre_scene::update_transforms;

use crate::TraceError;
use crate::branch::{Branch, Kind};
use crate::camera_ray::CameraRays;
use crate::direct_light::Lighting;
use crate::display::shown;
use crate::film::{Film, FilterSampler, PixelSum, Sample};
use crate::geometry::{Crossing, SpaceRay};
use crate::medium::MediumStack;
use crate::options::{
    DEFAULT_DEPTH, DEFAULT_PATHS, Ended, Integrator, MAXIMUM_SAMPLES, Picture, Progress, TraceOptions,
    TraceReport,
};
use crate::path::Paths;
use crate::random::Numbers;
use crate::ray_tree::{Limits, RayTree};
use crate::scene::Scene;
use crate::surface_point::SurfacePoint;
use crate::tiles::for_every_pixel;

/// Who is told how far a picture is, and says whether to go on.
pub type Listener<'a> = dyn Fn(Progress) -> ControlFlow<()> + Sync + 'a;

/// Rays of one tree at most, shadow rays apart: what glass in glass would multiply without end is cut off, and counted.
const MOST_RAYS: u32 = 100_000;
/// Bytes of a thread's stack: trees of the greatest depth fit, and what is not used is never touched.
const STACK: usize = 256 << 20;
/// Paths of a pixel in one pass: passes are what the standard error is taken from.
const PASS: u32 = 4;

/// Traces a picture of a World. `listener` is called from several threads, one at a time.
///
/// # Errors
/// [`TraceError`], before the first ray.
pub fn trace(
    world: &mut World,
    options: &TraceOptions,
    listener: &Listener<'_>,
) -> Result<(Picture, TraceReport), TraceError> {
    Tracer::new(world, options)?.picture(listener)
}

/// A World that has been read, with what is asked of it.
pub struct Tracer {
    scene: Scene,
    camera: CameraRays,
    /// The media that the eye is in.
    media: MediumStack,
    options: TraceOptions,
    filter: FilterSampler,
}

impl Tracer {
    /// Reads a World. Its global transforms are brought up to date.
    ///
    /// # Errors
    /// [`TraceError`].
    pub fn new(world: &mut World, options: &TraceOptions) -> Result<Self, TraceError> {
        options.validate()?;
        update_transforms(world);
        let camera = CameraRays::new(world, options.camera, options.size)?;
        let baked_light = [options.lightmaps, options.irradiance_volumes];
        let scene = Scene::new(world, camera.eye, options.reflection, baked_light)?;
        let camera = camera.relative_to(scene.origin);
        let media = MediumStack::at(&scene, camera.place());
        Ok(Self {
            media,
            camera,
            options: options.clone(),
            filter: FilterSampler::new(options.filter),
            scene,
        })
    }

    /// Traces the picture.
    ///
    /// # Errors
    /// [`TraceError::Threads`].
    pub fn picture(&self, listener: &Listener<'_>) -> Result<(Picture, TraceReport), TraceError> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.options.threads.unwrap_or(0));
        let pool = pool.stack_size(STACK);
        let pool = pool.build().map_err(|error| TraceError::Threads { reason: error.to_string() })?;
        let started = Instant::now();
        let run = Run {
            tracer: self,
            started,
            listener: Mutex::new(listener),
            interrupted: AtomicBool::new(false),
        };
        let (film, ended) = pool.install(|| match self.options.integrator {
            Integrator::Whitted => run.ray_trees(),
            Integrator::Path => run.paths(),
        });
        Ok(self.developed(&film, ended, started.elapsed().as_secs_f64()))
    }

    /// The ray tree through a place of the picture, in pixels from its upper left corner; the middle of a pixel is half a pixel off.
    pub fn tree(&self, place: DVec2) -> Branch {
        let camera = self.camera.through(place);
        let mut root = Branch::new(Kind::Camera, &camera.ray, self.scene.origin, DVec3::ONE, DVec3::ONE);
        let tree = RayTree { lighting: Lighting { by_light: true, ..self.lighting() }, ..self.ray_tree() };
        let mut grow = || {
            tree.grow(camera.ray, camera.farthest, &self.media_of(&camera.ray), Some(&mut root));
        };
        std::thread::scope(|scope| {
            // Deep trees need more than a main thread's stack.
            let thread = std::thread::Builder::new().stack_size(STACK);
            if let Ok(thread) = thread.spawn_scoped(scope, &mut grow) {
                // What it did is in the tree.
                let _ = thread.join();
            }
        });
        root
    }

    /// The surface that is seen through a place of the picture; nothing where the background is.
    pub fn first_hit(&self, place: DVec2) -> Option<FirstHit> {
        let camera = self.camera.through(place);
        let scene = &self.scene;
        let seen = |crossing: &Crossing| scene.is_seen(crossing);
        let meeting = scene.geometry.closest(&camera.ray, camera.farthest, seen)?;
        let point = SurfacePoint::new(scene, &camera.ray, &meeting);
        Some(FirstHit {
            object: scene.objects[point.object].name.clone(),
            position: point.position + scene.origin,
            normal: point.normal,
            depth: self.camera.depth(point.position),
            albedo: point.surface.diffuse,
            emission: point.emission,
        })
    }

    /// What was left out of the World, and why.
    pub fn notes(&self) -> &[String] {
        &self.scene.notes
    }

    fn lighting(&self) -> Lighting {
        Lighting { shadows: self.options.shadows, by_light: false }
    }

    fn ray_tree(&self) -> RayTree<'_> {
        let limits = Limits {
            depth: self.options.depth.unwrap_or(DEFAULT_DEPTH),
            weight: self.options.weight,
            rays: MOST_RAYS,
        };
        RayTree { scene: &self.scene, camera: &self.camera, limits, lighting: self.lighting() }
    }

    /// Rays of a pinhole start in one place; parallel ones do not.
    fn media_of(&self, ray: &SpaceRay) -> MediumStack {
        if self.scene.solids && self.camera.is_parallel() {
            MediumStack::at(&self.scene, ray.origin)
        } else {
            self.media.clone()
        }
    }

    fn developed(&self, film: &Film, ended: Ended, seconds: f64) -> (Picture, TraceReport) {
        let (width, height) = self.options.size;
        let errors: Option<Vec<DVec3>> = film.pixels.iter().map(|pixel| pixel.standard_error()).collect();
        let picture = Picture {
            width,
            height,
            radiance: film.pixels.iter().map(|pixel| pixel.mean()).collect(),
            standard_error: errors,
            rays: film.pixels.iter().map(|pixel| pixel.rays).collect(),
            exposure: self.camera.exposure,
        };
        let rays: u64 = film.pixels.iter().map(|pixel| u64::from(pixel.rays)).sum();
        let counts = || film.pixels.iter().map(|pixel| pixel.samples);
        let finished = counts().filter(|&samples| samples > 0).count() as f64 / film.pixels.len() as f64;
        let report = TraceReport {
            integrator: self.options.integrator,
            ended,
            seconds,
            rays,
            mega_rays_per_second: rays as f64 / seconds.max(1e-9) / 1e6,
            samples: [counts().min().unwrap_or(0), counts().max().unwrap_or(0)],
            finished,
            standard_error: film.relative_error(),
            cut: film.cut(),
            notes: self.scene.notes.clone(),
        };
        (picture, report)
    }
}

/// What is seen through a place of the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct FirstHit {
    /// What people call the object.
    pub object: String,
    /// In the world, metres.
    pub position: DVec3,
    /// Unit normal that is lit.
    pub normal: DVec3,
    /// Metres along the line of sight.
    pub depth: f64,
    /// k_d with its textures, linear RGB.
    pub albedo: DVec3,
    /// Radiance that the surface sends by itself.
    pub emission: DVec3,
}

/// One picture on its way.
struct Run<'a> {
    tracer: &'a Tracer,
    started: Instant,
    listener: Mutex<&'a Listener<'a>>,
    interrupted: AtomicBool,
}

/// What can be said of a picture before a pass.
#[derive(Clone, Copy, Default)]
struct Before {
    /// Of the whole.
    fraction: f64,
    samples: u32,
    error: Option<f64>,
}

impl Run<'_> {
    fn ray_trees(&self) -> (Film, Ended) {
        let options = &self.tracer.options;
        let samples = options.samples.unwrap_or(1);
        let mut film = self.film();
        let Some(threshold) = options.adaptive.filter(|_| samples >= 4) else {
            let ended = self.pass(&mut film, 0, 1.0, Before::default(), |_, _| samples);
            return (film, ended);
        };
        // A quarter of the samples everywhere, the rest where they show something.
        let first = samples / 4;
        let ended = self.pass(&mut film, 0, 0.5, Before::default(), |_, _| first);
        if ended != Ended::Complete {
            return (film, ended);
        }
        let busy = busy_pixels(&film, threshold, self.tracer);
        let before = Before { fraction: 0.5, samples: first, error: None };
        let width = film.width;
        let rest = samples - first;
        let ended = self.pass(&mut film, 1, 0.5, before, |x, y| if busy[y * width + x] { rest } else { 0 });
        (film, ended)
    }

    fn paths(&self) -> (Film, Ended) {
        let options = &self.tracer.options;
        let open_ended = options.error.is_some() || options.time.is_some();
        let most = options.samples.unwrap_or(if open_ended { MAXIMUM_SAMPLES } else { DEFAULT_PATHS });
        let passes = most.div_ceil(PASS);
        let mut film = self.film();
        let mut error = None;
        for pass in 0..passes {
            let done = f64::from(pass) / f64::from(passes);
            let before = Before { fraction: self.fraction(done, error), samples: pass * PASS, error };
            let share = if open_ended { 0.0 } else { 1.0 / f64::from(passes) };
            let ended = self.pass(&mut film, pass, share, before, |_, _| PASS);
            if ended != Ended::Complete {
                return (film, ended);
            }
            error = film.relative_error();
            // Two passes that happen to agree are no proof: so many are wanted before their error is believed.
            let believed = pass + 1 >= FEWEST_PASSES;
            if believed && options.error.zip(error).is_some_and(|(wanted, error)| error <= wanted) {
                return (film, Ended::Error);
            }
        }
        (film, Ended::Complete)
    }

    /// How far a picture is whose end is an error or a time: errors fall with the root of the samples.
    fn fraction(&self, by_samples: f64, error: Option<f64>) -> f64 {
        let options = &self.tracer.options;
        let by_error = options.error.zip(error).map_or(0.0, |(wanted, error)| (wanted / error).powi(2));
        let by_time =
            options.time.map_or(0.0, |time| self.started.elapsed().as_secs_f64() / time.as_secs_f64());
        by_samples.max(by_error).max(by_time).min(1.0)
    }

    fn film(&self) -> Film {
        let (width, height) = self.tracer.options.size;
        Film::new(width as usize, height as usize)
    }

    /// Adds a pass to the film. One that does not end is added where it did if there is nothing else, and left out otherwise, so that all
    /// pixels of a picture have as many samples.
    fn pass(
        &self,
        film: &mut Film,
        pass: u32,
        share: f64,
        before: Before,
        samples: impl Fn(usize, usize) -> u32 + Sync,
    ) -> Ended {
        let tracer = self.tracer;
        let size = (film.width, film.pixels.len() / film.width);
        let advance = |part: f64| {
            let fraction = before.fraction + share * part;
            self.tell(Progress { fraction, samples: before.samples, error: before.error });
        };
        let integrator = Estimator::of(tracer);
        let pixel = |x: usize, y: usize| integrator.pixel(x, y, pass, samples(x, y));
        let squares = for_every_pixel(size, pixel, || self.is_over(), advance);
        let whole = squares.iter().all(|(_, values)| values.is_some());
        if whole || pass == 0 {
            for (square, values) in squares {
                for ((x, y), sum) in square.pixels().zip(values.into_iter().flatten()) {
                    if sum.samples > 0 {
                        film.pixels[y * size.0 + x].add(&sum);
                    }
                }
            }
        }
        match (whole, self.interrupted.load(Ordering::Relaxed)) {
            (true, false) => Ended::Complete,
            (_, true) => Ended::Interrupted,
            (false, false) => Ended::Time,
        }
    }

    fn is_over(&self) -> bool {
        let time = self.tracer.options.time.is_some_and(|time| self.started.elapsed() >= time);
        time || self.interrupted.load(Ordering::Relaxed)
    }

    fn tell(&self, progress: Progress) {
        // Whoever comes while another is telling has nothing newer to say.
        let Ok(listener) = self.listener.try_lock() else { return };
        if listener(progress).is_break() {
            self.interrupted.store(true, Ordering::Relaxed);
        }
    }
}

/// Passes before a standard error is believed.
const FEWEST_PASSES: u32 = 8;

/// What takes the samples of a pixel.
enum Estimator<'a> {
    Trees(&'a Tracer, RayTree<'a>),
    Paths(&'a Tracer, Paths<'a>),
}

impl<'a> Estimator<'a> {
    fn of(tracer: &'a Tracer) -> Self {
        match tracer.options.integrator {
            Integrator::Whitted => Self::Trees(tracer, tracer.ray_tree()),
            Integrator::Path => {
                let depth = tracer.options.depth;
                Self::Paths(tracer, Paths::new(&tracer.scene, &tracer.camera, depth, tracer.options.shadows))
            }
        }
    }

    fn pixel(&self, x: usize, y: usize, pass: u32, samples: u32) -> PixelSum {
        let tracer = match self {
            Self::Trees(tracer, _) | Self::Paths(tracer, _) => tracer,
        };
        let middle = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        let pixel = (y as u32).wrapping_mul(65_537).wrapping_add(x as u32);
        let mut sum = PixelSum::default();
        for index in 0..samples {
            let mut numbers = Numbers::new(pixel, pass, index);
            // One ray of a tree goes through the middle, as a frame's does.
            let alone = matches!(self, Self::Trees(..)) && tracer.options.samples.unwrap_or(1) == 1;
            let (offset, sign) = match alone {
                true => (DVec2::ZERO, 1.0),
                false => tracer.filter.place(numbers.pair()),
            };
            sum.add(&self.sample(tracer, middle + offset, numbers), sign);
        }
        sum
    }

    fn sample(&self, tracer: &Tracer, place: DVec2, mut numbers: Numbers) -> Sample {
        let camera = tracer.camera.through(place);
        let media = tracer.media_of(&camera.ray);
        match self {
            Self::Trees(_, tree) => {
                let seen = tree.grow(camera.ray, camera.farthest, &media, None);
                let (radiance, rays) = (seen.radiance, seen.rays);
                Sample { radiance, rays, cut: seen.cut, brightest: seen.brightest, limit: seen.limit }
            }
            Self::Paths(_, paths) => paths.sample(&camera, media, &mut numbers),
        }
    }
}

/// The pixels that differ from a neighbour by more than a threshold, as they are shown.
fn busy_pixels(film: &Film, threshold: f64, tracer: &Tracer) -> Vec<bool> {
    let width = film.width;
    let height = film.pixels.len() / width;
    let exposure = f64::from(tracer.camera.exposure);
    let shown: Vec<DVec3> = film.pixels.iter().map(|pixel| shown(pixel.mean() * exposure)).collect();
    let differs = |at: usize, other: usize| (shown[at] - shown[other]).abs().max_element() > threshold;
    let mut busy = vec![false; shown.len()];
    for y in 0..height {
        for x in 0..width {
            let at = y * width + x;
            let right = (x + 1 < width).then_some(at + 1);
            let below = (y + 1 < height).then_some(at + width);
            for other in [right, below].into_iter().flatten().filter(|other| differs(at, *other)) {
                (busy[at], busy[other]) = (true, true);
            }
        }
    }
    busy
}
