//! The light at a probe: emissive faces as direct light has them, bounces by rays over the sphere that read what leaves the surfaces
//! they meet. Not the choice of places.

use std::f32::consts::PI;

use glam::Vec3;
use lumbre_scene::AmbientCube;

use super::ProbeEffort;
use crate::denoise::replicates::REPLICATES;
use crate::final_gather::radiance_cache::RadianceCache;
use crate::sampling::{Sequence, Stream, sphere_direction};
use crate::scene::Receiver;
use crate::scene::{BakeScene, SurfaceHit};
use crate::sources::direct::Direct;
use crate::sources::light_sources::Sources;

/// Normals of the sides, in the order of [`AmbientCube`].
const SIDES: [Vec3; 6] = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];

/// A probe that sees backs of single-sided faces or insides of solids with this share of its rays is inside geometry.
const INSIDE: f32 = 0.25;

/// So many times more samples where the first ones told nothing.
const AGAIN: u32 = 16;

/// Of the samples to the emitters, one in so many tells whether the others are worth casting: where its standard error is more than this share of
/// the side's light.
const FEWER: u32 = 4;
const ENOUGH: f32 = 0.02;

/// What lights probes.
pub(crate) struct ProbeLight<'a> {
    pub scene: &'a BakeScene,
    /// Emissive faces.
    pub emitters: &'a Sources<'a>,
    /// What surfaces reflect; `None` where nothing bounces.
    pub cache: Option<&'a RadianceCache<'a>>,
    pub effort: ProbeEffort,
}

/// What a probe sees.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ProbeSample {
    /// E/π.
    pub cube: AmbientCube,
    /// Variance that sampling leaves, mean of the sides and channels.
    pub variance: f32,
    /// Inside geometry: what it sees lights nobody.
    pub inside: bool,
    pub rays: u64,
}

impl ProbeLight<'_> {
    /// The light at a point, canonical units.
    pub fn at(&self, position: Vec3, seed: u32, index: u32) -> ProbeSample {
        let mut runs = [[Vec3::ZERO; 6]; REPLICATES];
        let mut seen = ProbeSample::default();
        let mut backs = 0u32;
        for (replicate, run) in runs.iter_mut().enumerate() {
            let sequence = Sequence::new(seed, Stream::ProbeSphere(replicate as u32), index);
            backs += self.bounces(position, sequence, run);
            seen.rays += u64::from(self.effort.sphere);
        }
        let all = self.effort.sphere * REPLICATES as u32;
        seen.inside = backs as f32 >= INSIDE * all as f32;
        if seen.inside {
            return seen;
        }
        let count = REPLICATES as f32;
        for (side, (light, normal)) in seen.cube.0.iter_mut().zip(SIDES).enumerate() {
            *light = runs.iter().map(|run| run[side]).sum::<Vec3>() / count;
            let squares: Vec3 = runs.iter().map(|run| (run[side] - *light).powf(2.0)).sum();
            let of_mean = squares / (count * (count - 1.0));
            let sequence = Sequence::new(seed, Stream::ProbeSide(side as u32), index);
            let few = self.shining(position, normal, sequence, self.effort.shadow / FEWER);
            let uncertain = few.variance.sqrt() / PI > ENOUGH * (*light + few.baked / PI).element_sum() / 3.0;
            let direct = match uncertain {
                true => self.shining(position, normal, sequence, self.effort.shadow),
                false => Direct { rays: 0, ..few },
            };
            *light += direct.baked / PI;
            seen.rays += u64::from(few.rays + direct.rays);
            let variance = of_mean.element_sum() / 3.0 + direct.variance / (PI * PI);
            seen.variance += variance / SIDES.len() as f32;
        }
        seen
    }

    /// Irradiance by the emissive faces, by so many samples.
    fn shining(&self, position: Vec3, normal: Vec3, sequence: Sequence, samples: u32) -> Direct {
        let receiver = Receiver { position, origin: position, geometric_normal: normal, normal };
        let point = |_: f32, _: f32| Some(receiver);
        let direct = self.emitters.irradiance(sequence, samples, &point);
        // Where every sample fell below the side's horizon, nothing is known of what shines just above it.
        let few = direct.rays == 0 && !self.emitters.is_empty();
        if few { self.emitters.irradiance(sequence, AGAIN * samples, &point) } else { direct }
    }

    /// Adds E/π by bounces to each side, and counts the rays that met a back.
    ///
    /// Of evenly spread directions, a side with normal n has E/π = Σ B max(n·ω, 0) / (π Σ max(n·ω, 0)): the sum of the weights is in
    /// place of its expectation N/4, so that even light is exact.
    fn bounces(&self, position: Vec3, sequence: Sequence, light: &mut [Vec3; 6]) -> u32 {
        let (mut sums, mut weights) = ([Vec3::ZERO; 6], [0.0f32; 6]);
        let mut backs = 0;
        for sample in 0..self.effort.sphere {
            let [u, v, ..] = sequence.point(sample, 0);
            let direction = sphere_direction(u, v);
            let leaves = match self.scene.first_hit(position, direction) {
                SurfaceHit::Lit { triangle, side, at, .. } => {
                    self.cache.map_or(Vec3::ZERO, |cache| cache.leaving(triangle, side, at))
                }
                SurfaceHit::None => self.cache.map_or(Vec3::ZERO, |cache| cache.sky),
                SurfaceHit::Back | SurfaceHit::Inside => {
                    backs += 1;
                    Vec3::ZERO
                }
            };
            for (side, normal) in SIDES.iter().enumerate() {
                let cosine = normal.dot(direction).max(0.0);
                weights[side] += cosine;
                sums[side] += cosine * leaves;
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

/// Root mean square of the probes' standard errors over their mean.
pub(crate) fn relative_error(seen: &[ProbeSample]) -> f64 {
    let (mut variance, mut sum, mut count) = (0.0, 0.0, 0u32);
    for seen in seen.iter().filter(|seen| !seen.inside) {
        variance += f64::from(seen.variance);
        sum += seen.cube.0.iter().map(|side| f64::from(side.element_sum())).sum::<f64>() / 18.0;
        count += 1;
    }
    let count = f64::from(count.max(1));
    let mean = sum / count;
    if mean > 0.0 { (variance / count).sqrt() / mean } else { 0.0 }
}
