//! The terms of a map's error that the final gather tells of itself: the spread of its replicates, and what patches have brought it. Not their sum:
//! that is `error_ledger`; and not a comparison with a better bake: that is a test's.

use crate::denoise::replicates::standard_error;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::coverage::footprint::Texel;
use crate::denoise::neighbourhoods::Neighbourhoods;
use crate::denoise::replicates::{Estimates, mean};
use crate::final_gather::gather_sums::GatherSums;

/// Texels around one over which checks are put together.
const CHECK_RADIUS: usize = 3;
/// A difference between patches and real bounces counts as known, and is taken away, where it is this many times its own error.
const KNOWN: f64 = 3.0;

/// What reading patches instead of bouncing on has brought a texel.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PatchBias {
    /// The part that is known: to be taken away.
    pub correction: Vec3,
    /// Square of what is left, mean of the channels.
    pub rest: f32,
    /// As `rest`, and below zero where chance alone would make more: of a single texel that says nothing, but the mean of many is right.
    pub expected: f32,
}

/// The same of one neighbourhood alone, its squares apart and perhaps negative.
#[derive(Clone, Copy, Debug, Default)]
struct Unsmoothed {
    correction: Vec3,
    unknown: f32,
    later: f32,
}

/// Steps each way, and texels of a step, over which squares of what is unknown are put together.
const WIDER_STEPS: usize = 2;
const WIDER_STEP: usize = 4;

/// Checks put together.
#[derive(Clone, Copy, Default)]
struct Checks {
    count: f64,
    difference: DVec3,
    square: f64,
    /// Light by bounces of the texels that were checked, times their checks.
    light: DVec3,
}

impl Checks {
    /// With the light by bounces that the checked texel's samples tell.
    fn of(gathered: &GatherSums, light: Vec3) -> Self {
        Self {
            count: f64::from(gathered.checks),
            difference: gathered.differences.as_dvec3(),
            square: f64::from(gathered.squared_differences),
            light: light.as_dvec3() * f64::from(gathered.checks),
        }
    }

    /// In single precision.
    fn numbers(&self) -> [f32; 8] {
        let ([r, g, b], light) = (self.difference.as_vec3().to_array(), self.light.as_vec3());
        [self.count as f32, r, g, b, self.square as f32, light.x, light.y, light.z]
    }

    /// The sums of some.
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

    /// The mean difference, beyond `expected` of it; how much of it is known, in [0, 1]; the square of what chance may have made of it.
    fn known(&self, expected: DVec3) -> (DVec3, f64, f64) {
        if self.count < 2.0 {
            return (DVec3::ZERO, 0.0, 0.0);
        }
        let mean = self.difference / self.count;
        let grey = mean.element_sum() / 3.0;
        let by_chance = (self.square / self.count - grey * grey).max(0.0) / self.count;
        let beyond = mean - expected;
        let squared = (beyond.element_sum() / 3.0).powi(2).max(f64::MIN_POSITIVE);
        (beyond, (1.0 - KNOWN * KNOWN * by_chance / squared).max(0.0), by_chance)
    }
}

/// The mean difference between patches and real bounces: of a map, in terms of its light by bounces, where many checks tell it well;
/// and beyond that around each texel. The real bounces read patches too, one bounce later: of a difference d about d ρ/(1 - ρ)
/// stays, with the scene's mean reflectance ρ. Samples that read a texel are not checked: the texel is a mean of samples that were, and so one
/// bounce later, without d and with ρ times what else stays. Where a share s of a texel's samples read patches, s d is taken away, and of the rest s + (1 - s) ρ stays.
pub(crate) fn patch_bias(
    neighbourhoods: &Neighbourhoods<'_>,
    texels: &[Texel],
    gathered: &[GatherSums],
    raw: &[Estimates],
    reflectance: f64,
) -> Vec<PatchBias> {
    let later = reflectance / (1.0 - reflectance);
    let maps = texels.iter().map(|texel| texel.object as usize + 1).max().unwrap_or(0);
    let mut of_maps = vec![Checks::default(); maps];
    let checked: Vec<Checks> =
        gathered.par_iter().zip(raw).map(|(own, raw)| Checks::of(own, mean(raw))).collect();
    for (texel, checked) in texels.iter().zip(&checked) {
        of_maps[texel.object as usize].add(checked);
    }
    // Per unit of light by bounces.
    let of_maps: Vec<DVec3> = of_maps
        .iter()
        .map(|checks| {
            let (mean, known, _) = checks.known(DVec3::ZERO);
            known * mean * checks.count / checks.light.max(DVec3::splat(f64::MIN_POSITIVE))
        })
        .collect();
    let around = |((texel, own), sums): ((&Texel, &GatherSums), [f32; 8])| {
        let checks = Checks::from_numbers(sums);
        if checks.count < 2.0 {
            return Unsmoothed::default();
        }
        let of_map = of_maps[texel.object as usize] * checks.light / checks.count;
        let (beyond, known, by_chance) = checks.known(of_map);
        let correction = of_map + known * beyond;
        let square = |v: DVec3| (v.element_sum() / 3.0).powi(2);
        let unknown = (1.0 - known).powi(2) * square(beyond) - by_chance;
        // What is taken away has come by chance in part.
        let unknown = unknown + known * known * by_chance;
        let correction = if correction.is_finite() { correction } else { DVec3::ZERO };
        let later = later.powi(2) * square(correction);
        let share = 1.0 - own.texel_share();
        let stays = (share + (1.0 - share) * reflectance).powi(2);
        Unsmoothed {
            correction: (share * correction).as_vec3(),
            unknown: (stays * unknown) as f32,
            later: (stays * later) as f32,
        }
    };
    let sums = neighbourhoods.sums(|index| checked[index].numbers(), CHECK_RADIUS, 1);
    let alone: Vec<Unsmoothed> = texels.par_iter().zip(gathered).zip(sums).map(around).collect();
    // One neighbourhood's checks tell the square of what is unknown by a single sample, which may be as good as nothing: others' tell it too.
    // With one standard error of their mean, as what is to be known is how large it may be.
    let numbers = |index: usize| [1.0, alone[index].unknown, alone[index].unknown.powi(2)];
    let sums = neighbourhoods.sums(numbers, WIDER_STEPS, WIDER_STEP);
    let wider = |(sums, own): ([f32; 3], &Unsmoothed)| {
        let [count, sum, _] = sums;
        let unknown = own.unknown.max(sum / count.max(1.0) + standard_error(sums));
        PatchBias {
            correction: own.correction,
            rest: unknown.max(0.0) + own.later,
            expected: own.unknown + own.later,
        }
    };
    sums.into_par_iter().zip(&alone).map(wider).collect()
}
