//! Serialization of a partly finished path-traced picture, so that a later run goes on from there and ends
//! with the same bits. Reading and writing the files is left to the caller.
//!
//! ```text
//!   magic      8 bytes   "LUMBRETR"
//!   version    u32       VERSION; everything is little endian
//!   identity  96 bytes   BLAKE3 of the program's version, of the scene, of the view and the options
//!   checksum  32 bytes   BLAKE3 of everything after it
//!   round      u32       number of complete rounds
//!   shares     u8        1 if samples are already distributed by noise, else 0
//!   pixels               for each pixel: sum, means and squares of its passes (3 f64 each),
//!                        the brightest sample (f64), passes, samples, rays (u32 each)
//!   light                for each auxiliary picture of light and each pixel: the sum (3 f64)
//!   shares               for each pixel an f64, if samples are distributed by noise
//! ```
//!
//! A pass of a pixel depends on the pixel and the number of the pass alone, so that the accumulated passes of
//! every pixel and the number of rounds are all the state there is.

use std::sync::OnceLock;
use std::time::Duration;

use glam::DVec3;

use crate::error::CheckpointError;
use crate::film::{Film, FilmPixel};
use crate::fingerprint::{Fingerprint, of_debug};
use crate::light_aovs::LightAovs;
use crate::options::Ended;
use crate::sample_distribution::SampleDistribution;
use crate::view::View;

/// The state of a path-traced picture between two rounds, or within one.
#[derive(Debug)]
pub(crate) struct PathState {
    /// Complete rounds; some pixels may already have their passes of the next one.
    pub round: u32,
    pub film: Film,
    pub distribution: Option<SampleDistribution>,
}

/// Receives the bytes of a checkpoint, to store them.
pub type Keep<'a> = dyn Fn(&[u8]) + Sync + 'a;

/// How a picture goes on from an earlier run, and when its samples are kept for a later one. Applies to paths
/// alone; a ray tree always starts from the beginning.
#[derive(Clone, Copy, Default)]
pub struct Continuation<'a> {
    /// The checkpoint of an earlier run of the same picture.
    pub from: Option<&'a [u8]>,
    /// Is called with a checkpoint each time `interval` is over, and when the picture was interrupted.
    pub keep: Option<&'a Keep<'a>>,
    /// Whether `keep` is also called when the picture ends without an interruption, so that a later run can
    /// go on with more samples.
    pub keep_complete: bool,
    /// Least time between two checkpoints.
    pub interval: Duration,
}

/// Writes and reads the checkpoints of a picture.
pub(crate) struct Keeper<'a> {
    view: &'a View,
    aovs: &'a LightAovs,
    continuation: Continuation<'a>,
    /// Computed when it is first needed, since hashing a scene with large textures takes a while.
    identity: OnceLock<[Fingerprint; 3]>,
}

impl<'a> Keeper<'a> {
    pub fn new(view: &'a View, aovs: &'a LightAovs, continuation: &Continuation<'a>) -> Self {
        Self { view, aovs, continuation: *continuation, identity: OnceLock::new() }
    }

    /// Reads the checkpoint of the earlier run, if there is one.
    ///
    /// # Errors
    /// [`CheckpointError`] if it cannot be continued.
    pub fn kept(&self) -> Result<Option<PathState>, CheckpointError> {
        let from = self.continuation.from;
        from.map(|bytes| from_bytes(bytes, self.view, self.aovs, self.identity())).transpose()
    }

    /// Least time between two checkpoints.
    pub fn interval(&self) -> Duration {
        self.continuation.interval
    }

    pub fn keep(&self, state: &PathState) {
        if let Some(keep) = self.continuation.keep {
            keep(&bytes(state, self.identity()));
        }
    }

    pub fn keep_at_end(&self, state: &PathState, ended: Ended) {
        if self.continuation.keep_complete || ended == Ended::Interrupted {
            self.keep(state);
        }
    }

    fn identity(&self) -> &[Fingerprint; 3] {
        self.identity.get_or_init(|| identity(self.view, self.aovs))
    }
}

const MAGIC: &[u8; 8] = b"LUMBRETR";
/// Version of the format and of the samples themselves: it is raised when the same options give other
/// samples.
const VERSION: u32 = 3;
const HEADER: usize = 8 + 4 + 96 + 32;
/// Bytes per pixel.
const PIXEL: usize = 10 * 8 + 3 * 4;

/// Fingerprints of everything that the samples depend on: the program, the scene, and the view with its
/// options.
fn identity(view: &View, aovs: &LightAovs) -> [Fingerprint; 3] {
    let options = &view.options;
    let asked = (options.size, options.integrator, options.depth, options.shadows, options.filter);
    let view_and_options = (&view.camera, asked, options.seed, options.sample_by_noise, &aovs.aovs);
    [of_debug(&env!("CARGO_PKG_VERSION")), view.scene.fingerprint(), of_debug(&view_and_options)]
}

fn bytes(state: &PathState, identity: &[Fingerprint; 3]) -> Vec<u8> {
    let mut body = Vec::with_capacity(5 + state.film.pixels.len() * PIXEL);
    let color = |body: &mut Vec<u8>, color: DVec3| {
        color.to_array().iter().for_each(|value| body.extend(value.to_le_bytes()));
    };
    body.extend(state.round.to_le_bytes());
    body.push(u8::from(state.distribution.is_some()));
    for pixel in &state.film.pixels {
        [pixel.sum, pixel.means, pixel.squares].into_iter().for_each(|value| color(&mut body, value));
        body.extend(pixel.brightest.to_le_bytes());
        [pixel.passes, pixel.samples, pixel.rays].iter().for_each(|count| body.extend(count.to_le_bytes()));
    }
    for sums in &state.film.light {
        sums.iter().for_each(|sum| color(&mut body, *sum));
    }
    for share in state.distribution.iter().flat_map(|found| found.shares()) {
        body.extend(share.to_le_bytes());
    }
    let mut file = Vec::with_capacity(HEADER + body.len());
    file.extend(MAGIC);
    file.extend(VERSION.to_le_bytes());
    identity.iter().for_each(|part| file.extend(part));
    file.extend(blake3::hash(&body).as_bytes());
    file.extend(body);
    file
}

/// Reads a checkpoint, if it belongs to this picture.
fn from_bytes(
    file: &[u8],
    view: &View,
    aovs: &LightAovs,
    [program, scene, options]: &[Fingerprint; 3],
) -> Result<PathState, CheckpointError> {
    let mut left = Left(file);
    let magic = left.take(8).ok_or(CheckpointError::NotSamples)?;
    if magic != MAGIC {
        return Err(CheckpointError::NotSamples);
    }
    let version = left.number32().ok_or(CheckpointError::Damaged)?;
    let parts = [(); 3].map(|()| left.take(32));
    let checksum = left.take(32).ok_or(CheckpointError::Damaged)?;
    if version != VERSION || parts[0] != Some(&program[..]) {
        return Err(CheckpointError::Version);
    }
    if blake3::hash(left.0).as_bytes()[..] != *checksum {
        return Err(CheckpointError::Damaged);
    }
    if parts[1] != Some(&scene[..]) {
        return Err(CheckpointError::Scene);
    }
    if parts[2] != Some(&options[..]) {
        return Err(CheckpointError::Options);
    }
    state(left, view, aovs).ok_or(CheckpointError::Damaged)
}

fn state(mut left: Left<'_>, view: &View, aovs: &LightAovs) -> Option<PathState> {
    let mut film = Film::new(view.size(), aovs.aovs.len());
    let round = left.number32()?;
    let distributed = left.take(1)? == [1];
    for pixel in &mut film.pixels {
        *pixel = FilmPixel {
            sum: left.color()?,
            means: left.color()?,
            squares: left.color()?,
            brightest: left.number64()?,
            passes: left.number32()?,
            samples: left.number32()?,
            rays: left.number32()?,
            ..FilmPixel::default()
        };
    }
    for sums in &mut film.light {
        for sum in sums {
            *sum = left.color()?;
        }
    }
    let mut distribution = None;
    if distributed {
        let shares = (0..film.pixels.len()).map(|_| left.number64()).collect::<Option<Vec<f64>>>()?;
        distribution = Some(SampleDistribution::from_shares(shares));
    }
    left.0.is_empty().then_some(PathState { round, film, distribution })
}

/// The bytes that were not read yet.
struct Left<'a>(&'a [u8]);

impl<'a> Left<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, left) = self.0.split_at_checked(count)?;
        self.0 = left;
        Some(taken)
    }

    fn number32(&mut self) -> Option<u32> {
        self.take(4).and_then(|bytes| bytes.try_into().ok()).map(u32::from_le_bytes)
    }

    fn number64(&mut self) -> Option<f64> {
        self.take(8).and_then(|bytes| bytes.try_into().ok()).map(f64::from_le_bytes)
    }

    fn color(&mut self) -> Option<DVec3> {
        Some(DVec3::new(self.number64()?, self.number64()?, self.number64()?))
    }
}
