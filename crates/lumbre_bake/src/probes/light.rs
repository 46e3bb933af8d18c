//! The light at a probe: that of emissive faces as in direct light, and bounces by rays over the sphere, which read the
//! light that leaves the surfaces they hit. Where probes are is decided in `grid`.

use std::f32::consts::PI;

use glam::Vec3;
use lumbre_scene::AmbientCube;

use super::ProbeEffort;
use crate::denoise::REPLICATES;
use crate::final_gather::RadianceCache;
use crate::sampling::{Sequence, Stream, sphere_direction};
use crate::scene::Receiver;
use crate::scene::{BakeScene, SurfaceHit};
use crate::sources::{Direct, Sources};

/// Normals of a cube's sides, in the order of [`AmbientCube`].
const SIDES: [Vec3; 6] = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];

/// A probe is inside geometry if at least this share of its rays hits backs of single-sided faces or insides of solids.
const INSIDE: f32 = 0.25;

/// How many times more samples are taken if the first ones were all below the side's horizon.
const RETRY_FACTOR: u32 = 16;

/// A pilot run takes the number of samples to the emitters divided by `PILOT_DIVISOR`. All samples are taken only where
/// the standard error of the pilot is larger than `MAX_PILOT_ERROR` of the side's light.
const PILOT_DIVISOR: u32 = 4;
const MAX_PILOT_ERROR: f32 = 0.02;

/// The light sources of probes.
pub(crate) struct ProbeLight<'a> {
    pub scene: &'a BakeScene,
    /// Emissive faces that probes include.
    pub emitters: &'a Sources<'a>,
    /// The light that surfaces reflect; `None` if nothing bounces.
    pub cache: Option<&'a RadianceCache<'a>>,
    pub effort: ProbeEffort,
}

/// The light at a probe, and how it was sampled.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ProbeSample {
    /// E/π.
    pub cube: AmbientCube,
    /// Variance of the estimate, mean of the sides and channels.
    pub variance: f32,
    /// Whether the probe is inside geometry; its light is then not computed.
    pub inside: bool,
    /// Rays cast.
    pub rays: u64,
}

impl ProbeLight<'_> {
    /// The light at a point, canonical units.
    pub fn at(&self, position: Vec3, seed: u32, index: u32) -> ProbeSample {
        let mut replicates = [[Vec3::ZERO; 6]; REPLICATES];
        let mut probe = ProbeSample::default();
        let mut backs = 0u32;
        for (replicate, sums) in replicates.iter_mut().enumerate() {
            let sequence = Sequence::new(seed, Stream::ProbeSphere(replicate as u32), index);
            backs += self.bounces(position, sequence, sums);
            probe.rays += u64::from(self.effort.sphere);
        }
        let all = self.effort.sphere * REPLICATES as u32;
        probe.inside = backs as f32 >= INSIDE * all as f32;
        if probe.inside {
            return probe;
        }
        let count = REPLICATES as f32;
        for (side, (light, normal)) in probe.cube.0.iter_mut().zip(SIDES).enumerate() {
            *light = replicates.iter().map(|sums| sums[side]).sum::<Vec3>() / count;
            let squares: Vec3 = replicates.iter().map(|sums| (sums[side] - *light).powf(2.0)).sum();
            let variance_of_mean = squares / (count * (count - 1.0));
            let sequence = Sequence::new(seed, Stream::ProbeSide(side as u32), index);
            let pilot =
                self.emitter_irradiance(position, normal, sequence, self.effort.shadow / PILOT_DIVISOR);
            let is_uncertain = pilot.variance.sqrt() / PI
                > MAX_PILOT_ERROR * (*light + pilot.baked / PI).element_sum() / 3.0;
            let direct = match is_uncertain {
                true => self.emitter_irradiance(position, normal, sequence, self.effort.shadow),
                false => Direct { rays: 0, ..pilot },
            };
            *light += direct.baked / PI;
            probe.rays += u64::from(pilot.rays + direct.rays);
            let variance = variance_of_mean.element_sum() / 3.0 + direct.variance / (PI * PI);
            probe.variance += variance / SIDES.len() as f32;
        }
        probe
    }

    /// Irradiance by the emissive faces.
    fn emitter_irradiance(&self, position: Vec3, normal: Vec3, sequence: Sequence, samples: u32) -> Direct {
        let receiver = Receiver { position, origin: position, geometric_normal: normal, normal };
        let point = |_: f32, _: f32| Some(receiver);
        let direct = self.emitters.irradiance(sequence, samples, &point);
        // If every sample was below the side's horizon, emitters just above it may have been missed.
        let may_have_missed = direct.rays == 0 && !self.emitters.is_empty();
        if may_have_missed {
            self.emitters.irradiance(sequence, RETRY_FACTOR * samples, &point)
        } else {
            direct
        }
    }

    /// Adds E/π by bounces to each side, and returns the number of rays that hit a back or an inside.
    ///
    /// With N uniformly distributed directions ω, a side with normal n has E/π = Σ B max(n·ω, 0) / (π Σ max(n·ω, 0)):
    /// the sum of the weights replaces its expectation N/4, so that uniform light is exact.
    fn bounces(&self, position: Vec3, sequence: Sequence, light: &mut [Vec3; 6]) -> u32 {
        let (mut sums, mut weights) = ([Vec3::ZERO; 6], [0.0f32; 6]);
        let mut backs = 0;
        for sample in 0..self.effort.sphere {
            let [u, v, ..] = sequence.point(sample, 0);
            let direction = sphere_direction(u, v);
            let radiosity = match self.scene.first_hit(position, direction) {
                SurfaceHit::Lit { triangle, side, at, .. } => {
                    self.cache.map_or(Vec3::ZERO, |cache| cache.leaving(triangle, side, at))
                }
                SurfaceHit::None => self.cache.map_or(Vec3::ZERO, |cache| cache.sources.sky),
                SurfaceHit::Back | SurfaceHit::Inside => {
                    backs += 1;
                    Vec3::ZERO
                }
            };
            for (side, normal) in SIDES.iter().enumerate() {
                let cosine = normal.dot(direction).max(0.0);
                weights[side] += cosine;
                sums[side] += cosine * radiosity;
            }
        }
        for ((light, sum), weight) in light.iter_mut().zip(sums).zip(weights) {
            if weight > 0.0 {
                *light += sum / (PI * weight);
            }
        }
        backs
    }
}

/// Root mean square of the standard errors of the probes outside geometry, relative to the mean of their light.
pub(crate) fn relative_error(probes: &[ProbeSample]) -> f64 {
    let (mut variance, mut sum, mut count) = (0.0, 0.0, 0u32);
    for probe in probes.iter().filter(|probe| !probe.inside) {
        variance += f64::from(probe.variance);
        sum += probe.cube.0.iter().map(|side| f64::from(side.element_sum())).sum::<f64>() / 18.0;
        count += 1;
    }
    let count = f64::from(count.max(1));
    let mean = sum / count;
    if mean > 0.0 { (variance / count).sqrt() / mean } else { 0.0 }
}
