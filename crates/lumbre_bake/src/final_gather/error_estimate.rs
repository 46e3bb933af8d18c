//! The bias that reading patches brings into the final gather, estimated from checks against real bounces. Not the
//! other terms of a map's error, nor their sum: that is `error_ledger`; and not a comparison with a better bake: that
//! is a test's.

use crate::denoise::replicates::standard_error;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::gather_sums::GatherSums;
use crate::coverage::Texel;
use crate::denoise::replicates::mean;
use crate::denoise::{Estimates, Neighbourhoods};

/// Texels each way around a texel over which its neighbourhood's checks are pooled.
const CHECK_RADIUS: usize = 3;
/// A difference between patches and real bounces counts as known, and is subtracted, as far as it exceeds this many of
/// its own standard errors.
const SIGNIFICANT: f64 = 3.0;

/// By how much reading patches instead of bouncing on has changed a texel's light.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PatchBias {
    /// The known part, which is to be subtracted.
    pub correction: Vec3,
    /// Square of what is left, mean of the channels.
    pub rest: f32,
    /// As `rest`, but negative where chance alone would explain more than was found: it says nothing about a single
    /// texel, but its mean over many is unbiased.
    pub expected: f32,
}

/// The same from the checks of one neighbourhood alone; its squares are kept apart, and may be negative.
#[derive(Clone, Copy, Debug, Default)]
struct LocalBias {
    correction: Vec3,
    /// Square of the part that is not known.
    unknown: f32,
    /// Square of what later bounces add.
    later: f32,
}

/// How much of what is not known of the patches' bias remains in the texels that rays of later rounds have read, over
/// the whole level: it becomes less with every round, as each reads the texels of the one before.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TexelReads {
    /// Mean reflectance of the level's surfaces, below 1.
    reflectance: f64,
    /// Samples that have read texels, and the sum over them of the share that remained in what they read.
    samples: f64,
    rest: f64,
}

impl TexelReads {
    /// Before the first round. Of texels that the `reused` samples of a former bake have read, nothing is known: the
    /// whole rest counts.
    pub fn new(reflectance: f64, reused: &[GatherSums]) -> Self {
        let samples: f64 = reused.iter().map(|sums| f64::from(sums.texel_reads)).sum();
        Self { reflectance, samples, rest: samples }
    }

    /// Adds the samples of a round, which reads texels of which each still contains the share `rest`.
    pub fn add(&mut self, samples: f64, rest: f64) {
        self.samples += samples;
        self.rest += samples * rest;
    }

    /// The share of the rest that remains in a texel, in [0, 1]: with a share s of its samples that read patches and t
    /// that read texels, it is s + t ρ r, where r remained in the texels that were read.
    pub fn rest_in(&self, gathered: &GatherSums) -> f64 {
        let read = if self.samples > 0.0 { self.rest / self.samples } else { 1.0 };
        gathered.patch_share() + gathered.texel_share() * self.reflectance * read
    }
}

/// The wider neighbourhood over which squares of the unknown part are pooled: steps each way, and texels of a step.
const WIDER_STEPS: usize = 2;
const WIDER_STEP: usize = 4;

/// Sums over checks of patches against real bounces.
#[derive(Clone, Copy, Default)]
struct Checks {
    count: f64,
    difference: DVec3,
    square: f64,
    /// Light by bounces of the texels that were checked, times their checks.
    light: DVec3,
}

impl Checks {
    /// The checks of one texel, whose samples estimate `light` by bounces.
    fn of(gathered: &GatherSums, light: Vec3) -> Self {
        Self {
            count: f64::from(gathered.checks),
            difference: gathered.differences.as_dvec3(),
            square: f64::from(gathered.squared_differences),
            light: light.as_dvec3() * f64::from(gathered.checks),
        }
    }

    /// As plain numbers in single precision, to be summed over neighbourhoods.
    fn numbers(&self) -> [f32; 8] {
        let ([r, g, b], light) = (self.difference.as_vec3().to_array(), self.light.as_vec3());
        [self.count as f32, r, g, b, self.square as f32, light.x, light.y, light.z]
    }

    /// From sums of such numbers.
    fn from_numbers([count, r, g, b, square, light @ ..]: [f32; 8]) -> Self {
        Self {
            count: f64::from(count),
            difference: DVec3::new(r.into(), g.into(), b.into()),
            square: f64::from(square),
            light: Vec3::from(light).as_dvec3(),
        }
    }

    fn add(&mut self, other: &Self) {
        self.count += other.count;
        self.difference += other.difference;
        self.square += other.square;
        self.light += other.light;
    }

    /// The mean difference beyond `expected`; the share of it that is known, in [0, 1]; and the variance of the mean
    /// difference, which is the square that chance alone would give it.
    fn difference_beyond(&self, expected: DVec3) -> (DVec3, f64, f64) {
        if self.count < 2.0 {
            return (DVec3::ZERO, 0.0, 0.0);
        }
        let mean = self.difference / self.count;
        let channel_mean = mean.element_sum() / 3.0;
        let variance = (self.square / self.count - channel_mean * channel_mean).max(0.0) / self.count;
        let excess = mean - expected;
        let squared = (excess.element_sum() / 3.0).powi(2).max(f64::MIN_POSITIVE);
        (excess, (1.0 - SIGNIFICANT * SIGNIFICANT * variance / squared).max(0.0), variance)
    }
}

/// The mean difference between patches and real bounces: that of a whole map, in proportion to its light by bounces,
/// where many checks determine it well; and around each texel, what goes beyond that.
///
/// The real bounces read patches too, one bounce later: of a difference d they leave about d ρ/(1 - ρ), with the
/// scene's mean reflectance ρ. Samples that read a texel are not checked: that texel is itself a mean of samples that
/// were, and so one bounce later; d has been subtracted from it, and ρ times the rest that was in it remains. Where a
/// share s of a texel's samples read patches, s d is subtracted, and the rest counts as [`TexelReads`] says.
pub(crate) fn patch_bias(
    neighbourhoods: &Neighbourhoods<'_>,
    texels: &[Texel],
    gathered: &[GatherSums],
    raw: &[Estimates],
    reads: &TexelReads,
) -> Vec<PatchBias> {
    let later_bounces = reads.reflectance / (1.0 - reads.reflectance);
    let maps = texels.iter().map(|texel| texel.map.place() + 1).max().unwrap_or(0);
    let mut map_checks = vec![Checks::default(); maps];
    let texel_checks: Vec<Checks> =
        gathered.par_iter().zip(raw).map(|(sums, raw)| Checks::of(sums, mean(raw))).collect();
    for (texel, checks) in texels.iter().zip(&texel_checks) {
        map_checks[texel.map.place()].add(checks);
    }
    // The difference per unit of light by bounces.
    let map_ratios: Vec<DVec3> = map_checks
        .iter()
        .map(|checks| {
            let (mean, known, _) = checks.difference_beyond(DVec3::ZERO);
            known * mean * checks.count / checks.light.max(DVec3::splat(f64::MIN_POSITIVE))
        })
        .collect();
    let local_bias = |((texel, sums), numbers): ((&Texel, &GatherSums), [f32; 8])| {
        let checks = Checks::from_numbers(numbers);
        if checks.count < 2.0 {
            return LocalBias::default();
        }
        let of_map = map_ratios[texel.map.place()] * checks.light / checks.count;
        let (excess, known, variance) = checks.difference_beyond(of_map);
        let correction = of_map + known * excess;
        let square = |v: DVec3| (v.element_sum() / 3.0).powi(2);
        let unknown = (1.0 - known).powi(2) * square(excess) - variance;
        // The correction itself is partly chance.
        let unknown = unknown + known * known * variance;
        let correction = if correction.is_finite() { correction } else { DVec3::ZERO };
        let later = later_bounces.powi(2) * square(correction);
        let patch_share = sums.patch_share();
        let remaining = reads.rest_in(sums).powi(2);
        LocalBias {
            correction: (patch_share * correction).as_vec3(),
            unknown: (remaining * unknown) as f32,
            later: (remaining * later) as f32,
        }
    };
    let sums = neighbourhoods.sums(|index| texel_checks[index].numbers(), CHECK_RADIUS, 1);
    let local: Vec<LocalBias> = texels.par_iter().zip(gathered).zip(sums).map(local_bias).collect();
    // The checks of one neighbourhood give a single sample of the unknown part's square, which may be almost worthless,
    // so other neighbourhoods' samples are averaged in. One standard error is added to their mean, as a cautious figure
    // is wanted.
    let numbers = |index: usize| [1.0, local[index].unknown, local[index].unknown.powi(2)];
    let sums = neighbourhoods.sums(numbers, WIDER_STEPS, WIDER_STEP);
    let pooled = |(sums, local): ([f32; 3], &LocalBias)| {
        let [count, sum, _] = sums;
        let unknown = local.unknown.max(sum / count.max(1.0) + standard_error(sums));
        PatchBias {
            correction: local.correction,
            rest: unknown.max(0.0) + local.later,
            expected: local.unknown + local.later,
        }
    };
    sums.into_par_iter().zip(&local).map(pooled).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_round_leaves_less_of_the_patches_bias() {
        let of_texel =
            |samples: u32, texel_reads: u32| GatherSums { samples, texel_reads, ..GatherSums::default() };
        let first = of_texel(4, 0);
        let mut reads = TexelReads::new(0.5, &[first]);
        assert_eq!(reads.rest_in(&first), 1.0, "all samples read patches");
        // Half of the samples read texels of which all the bias is left.
        reads.add(4.0, 1.0);
        let second = of_texel(8, 16);
        assert_eq!(reads.rest_in(&second), 0.75);
        // Three quarters of what was read by then contains 0.75 of it.
        reads.add(12.0, 0.75);
        let third = of_texel(16, 64);
        assert_eq!(reads.rest_in(&third), 0.5 * (0.25 + 0.75 * 0.75));
        let reused = TexelReads::new(0.5, &[second]);
        assert_eq!(reused.rest_in(&third), 0.5, "nothing is known of what a former bake read");
    }
}
