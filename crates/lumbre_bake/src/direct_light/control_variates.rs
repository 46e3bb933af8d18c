//! Control variates for sources that share samples: what the brightest of them would bring without occluders can be
//! computed, so that of this part the samples only find the visible share (Lavenberg and Welch, "A Perspective on the Use
//! of Control Variables to Increase the Efficiency of Monte Carlo Simulations", 1981). The samples themselves are in
//! `shared_light`.
//!
//! With S the mean light of some samples, C the mean of what the same samples would bring without occluders, and U its
//! expectation, the estimate is S - β (C - U). It has the expectation of S for every β that these samples did not choose,
//! and most of the noise that S and C have in common cancels if β is the visible share of the light. So each replicate
//! takes β from the other replicates, of the texels around. (Heitz, Hill and McGuire, "Combining Analytic Direct
//! Illumination and Stochastic Shadows", 2018, divide S by C, which is biased where samples are few.)

use glam::Vec3;
use rayon::prelude::*;

use super::shared_light::SampleSums;
use crate::color::channel_mean;
use crate::coverage::{Footprint, FootprintPoint, Texel, TexelGroups, receiver};
use crate::denoise::{Estimates, Neighbourhoods, REPLICATES};
use crate::sources::Sources;
use crate::sources::light_cut::SharedSources;
use crate::sources::receiver_quadrature::ReceiverQuadrature;
use crate::texel_index::CoveredTexel;

/// The points of a texel whose light stands for the mean over it.
enum TexelPoints<'a> {
    /// Its middle.
    Middle,
    /// Four points.
    Few,
    /// Sixteen points, unless four have about the same light.
    Many,
    /// All points of a footprint that is a list of them.
    All(&'a [FootprintPoint]),
}

/// Distance from a flat texel to the controlled sources, in sides of the texel, from which on its middle stands for all of
/// it: of the light of a small lamp right opposite, that makes an error of h²/(3d²) = 0.13 %.
const FAR: f32 = 16.0;
/// The same for four points instead of the middle, whose error is a sixteenth of that.
const NEAR: f32 = 4.0;

impl<'a> TexelPoints<'a> {
    fn of(sources: &Sources<'_>, shared: &SharedSources, texel: &'a Texel) -> Self {
        let scene = sources.scene;
        match &texel.footprint {
            Footprint::Points(points) => return Self::All(points),
            Footprint::Hidden => return Self::All(&[]),
            Footprint::Whole(_) => {}
        }
        let middle = texel.point(scene, 0.5, 0.5).zip(texel.flat_side(scene));
        let sides_away = middle.map_or(0.0, |(middle, side)| {
            sources.nearest_controlled(shared, &receiver(scene, &middle)) / side
        });
        match sides_away {
            _ if sides_away > FAR => Self::Middle,
            _ if sides_away > NEAR => Self::Few,
            _ => Self::Many,
        }
    }

    /// Their number, at most.
    fn count(&self) -> u32 {
        match self {
            Self::Middle => 1,
            Self::Few => 4,
            Self::Many => 4 + 16,
            Self::All(points) => points.len() as u32,
        }
    }
}

/// The number of samples that take about as long as [`mean_controlled_light`] of a texel.
pub(crate) fn control_cost(sources: &Sources<'_>, shared: &SharedSources, texel: &Texel) -> u32 {
    shared.control_cost() * TexelPoints::of(sources, shared, texel).count()
}

/// The mean light of the controlled sources over a texel, without occluders.
pub(crate) fn mean_controlled_light(sources: &Sources<'_>, shared: &SharedSources, texel: &Texel) -> Vec3 {
    let at_point = |point: FootprintPoint| sources.controlled_light(shared, &receiver(sources.scene, &point));
    let light = |x: f32, y: f32| texel.point(sources.scene, x, y).map(at_point);
    match TexelPoints::of(sources, shared, texel) {
        TexelPoints::Middle => light(0.5, 0.5).unwrap_or_default(),
        TexelPoints::Few => ReceiverQuadrature::of_few(light),
        TexelPoints::Many => ReceiverQuadrature::mean(light).0,
        TexelPoints::All(points) => {
            points.iter().copied().map(at_point).sum::<Vec3>() / points.len().max(1) as f32
        }
    }
}

/// Texels each way over which the visible share is averaged: with fewer its noise counts, and with more the edges of
/// shadows are blurred.
const STEPS: usize = 2;

/// For every covered texel and each of its replicates, the visible share of the controlled sources' light, by the samples
/// of the other replicates around it.
pub(crate) fn visible_shares(
    neighbourhoods: &Neighbourhoods<'_>,
    sums: &[SampleSums],
) -> Vec<[f32; REPLICATES]> {
    let terms = |place: usize| -> [f32; 2 * REPLICATES] {
        let SampleSums { visible_controls, controls, .. } = &sums[place];
        std::array::from_fn(|term| match term < REPLICATES {
            true => visible_controls[term],
            false => controls[term - REPLICATES],
        })
    };
    let share = |around: [f32; 2 * REPLICATES]| {
        std::array::from_fn(|replicate| {
            let others = (0..REPLICATES).filter(|other| *other != replicate);
            let (visible, all) = others.fold((0.0, 0.0), |(visible, all), other| {
                (visible + around[other], all + around[REPLICATES + other])
            });
            if all > 0.0 && all.is_finite() { (visible / all).min(1.0) } else { 0.0 }
        })
    };
    neighbourhoods.sums(terms, STEPS, 1).into_par_iter().map(share).collect()
}

/// Texels each way over which the noise is summed up that control variates would leave: about as many as the smoothing
/// uses. Samples of neighbours are spread evenly together, so that their noise partly cancels even without control.
const NOISE_STEPS: usize = 3;

/// For every block, the share of the shared samples' variance that control variates would leave there.
pub(crate) fn variance_left(
    neighbourhoods: &Neighbourhoods<'_>,
    sums: &[SampleSums],
    blocks: &TexelGroups,
) -> Vec<f32> {
    // The same for all replicates, so that the expectation of the control variate, which is not known yet, cancels.
    let share = |shares: [f32; REPLICATES]| shares.iter().sum::<f32>() / REPLICATES as f32;
    let shares: Vec<f32> = visible_shares(neighbourhoods, sums).into_iter().map(share).collect();
    let terms = |place: usize| -> [f32; 2 * REPLICATES] {
        let SampleSums { sums, controls, .. } = &sums[place];
        std::array::from_fn(|term| {
            let (replicate, is_controlled) = (term % REPLICATES, term >= REPLICATES);
            let plain = channel_mean(sums[replicate]);
            if is_controlled { plain - shares[place] * controls[replicate] } else { plain }
        })
    };
    let around = neighbourhoods.sums(terms, NOISE_STEPS, 1);
    let of_block = |members: &Vec<CoveredTexel>| {
        let sum = |first: usize| {
            members
                .iter()
                .map(|texel| squared_deviations(&around[texel.place()][first..][..REPLICATES]))
                .sum::<f32>()
        };
        let (plain, controlled) = (sum(0), sum(REPLICATES));
        if plain > 0.0 { (controlled / plain).min(1.0) } else { 1.0 }
    };
    blocks.members.par_iter().map(of_block).collect()
}

/// The sum of the squared differences of numbers from their mean.
fn squared_deviations(numbers: &[f32]) -> f32 {
    let mean = numbers.iter().sum::<f32>() / numbers.len() as f32;
    numbers.iter().map(|number| (number - mean).powi(2)).sum()
}

impl SampleSums {
    /// The estimates of each replicate, of which so much of the controlled light is visible nearby.
    pub fn controlled_estimates(&self, visible_shares: [f32; REPLICATES]) -> Estimates {
        let mut estimates = self.estimates();
        let Some(light) = self.controlled_light else { return estimates };
        let (mean, count) = (channel_mean(light), self.samples.max(1) as f32);
        for (replicate, estimate) in estimates.iter_mut().enumerate() {
            let missed = mean - self.controls[replicate] / count;
            // The samples' control is a mean of the channels, so what they missed is taken to have the colour of the
            // whole.
            let correction = light * (visible_shares[replicate] * (missed / mean));
            if correction.is_finite() {
                *estimate += correction;
            }
        }
        estimates
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coverage::on_a_floor::on_a_floor;
    use crate::sampling::hash;

    /// Texels along the floor's side.
    const SIDE: u32 = 64;
    const SAMPLES: u32 = 2;
    /// The mean light where bright sources are more visible than dim ones: of a light c, uniform in [0.5, 1.5], c/2 of it.
    const PARTLY_VISIBLE: f32 = 0.5 * (1.0 + 1.0 / 12.0);

    /// A random number in [0, 1) for each texel, replicate and purpose.
    fn random(place: usize, replicate: usize, purpose: u32) -> f32 {
        hash((place * REPLICATES + replicate) as u32 ^ hash(purpose)) as f32 / 2.0f32.powi(32)
    }

    /// The samples of a texel whose light without occluders is 1 but for the noise of the choice of sources. On the left
    /// half of the floor all of it is visible, and on the right half some of it, at random.
    fn sampled(texel: &Texel, place: usize) -> SampleSums {
        let is_left = texel.x < SIDE / 2;
        let mut sums = SampleSums { samples: SAMPLES, ..SampleSums::default() };
        for replicate in 0..REPLICATES {
            let light = 0.5 + random(place, replicate, 1);
            let is_visible = is_left || random(place, replicate, 2) < 0.5 * light;
            let control = SAMPLES as f32 * light;
            let visible = if is_visible { control } else { 0.0 };
            sums.controls[replicate] = control;
            sums.visible_controls[replicate] = visible;
            sums.sums[replicate] = Vec3::new(2.0, 1.0, 0.0) * visible;
        }
        sums
    }

    #[test]
    fn the_noise_that_both_have_in_common_cancels_and_the_mean_stays() {
        on_a_floor(SIDE, |texels, _| {
            let neighbourhoods = Neighbourhoods::new(texels, &[]);
            let sampled_at = |(place, texel): (usize, &Texel)| sampled(texel, place);
            let mut sums: Vec<SampleSums> = texels.list.iter().enumerate().map(sampled_at).collect();
            let plain = sums[0].estimates();
            assert_eq!(sums[0].controlled_estimates([0.5; REPLICATES]), plain, "its light is not known");
            for sums in &mut sums {
                sums.controlled_light = Some(Vec3::new(2.0, 1.0, 0.0));
            }
            let shares = visible_shares(&neighbourhoods, &sums);
            let (mut partly_visible, mut count) = (0.0, 0.0);
            for ((texel, sums), share) in texels.list.iter().zip(&sums).zip(shares) {
                let estimates = sums.controlled_estimates(share);
                // Two texels away from the border, where the neighbours are partly visible.
                if texel.x + 2 < SIDE / 2 {
                    let truth = Vec3::new(2.0, 1.0, 0.0);
                    assert!(estimates.iter().all(|e| e.distance(truth) < 1e-5), "{share:?}: {estimates:?}");
                } else if texel.x >= SIDE / 2 + 2 {
                    partly_visible += estimates.iter().map(|e| e.y).sum::<f32>();
                    count += REPLICATES as f32;
                }
            }
            // Its standard error is 0.006.
            let mean = partly_visible / count;
            assert!((mean - PARTLY_VISIBLE).abs() < 0.02, "{mean}");
        });
    }

    #[test]
    fn what_control_variates_would_leave_is_foreseen() {
        on_a_floor(SIDE, |texels, _| {
            let neighbourhoods = Neighbourhoods::new(texels, &[]);
            let sampled_at = |(place, texel): (usize, &Texel)| sampled(texel, place);
            let sums: Vec<SampleSums> = texels.list.iter().enumerate().map(sampled_at).collect();
            let blocks = TexelGroups::blocks(&texels.list, &texels.charts, 8);
            let left = variance_left(&neighbourhoods, &sums, &blocks);
            let (mut visible, mut partly_visible) = (Vec::new(), Vec::new());
            for (members, left) in blocks.members.iter().zip(left) {
                let xs = || members.iter().map(|member| texels.list[member.place()].x);
                if xs().all(|x| x + 8 < SIDE / 2) {
                    visible.push(left);
                } else if xs().all(|x| x > SIDE / 2 + 8) {
                    partly_visible.push(left);
                }
            }
            assert!(!visible.is_empty() && visible.iter().all(|left| *left < 1e-6), "{visible:?}");
            assert!(!partly_visible.is_empty(), "no block is partly visible");
            // Of the visible light's variance, 0.332, an average of 0.266 is left.
            let mean = partly_visible.iter().sum::<f32>() / partly_visible.len() as f32;
            assert!((0.7..0.9).contains(&mean), "{partly_visible:?}");
        });
    }
}
