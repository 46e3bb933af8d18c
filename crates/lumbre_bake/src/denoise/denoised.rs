//! Sampled light after smoothing, with the errors that are left in it. How it is smoothed is in `smooth`.

use rayon::prelude::*;

use super::nearness::Nearness;
use super::neighbourhoods::Neighbourhoods;
use super::replicates::{Estimates, spread};
use super::smooth::smooth;
use crate::BakeError;
use crate::monitor::BakeMonitor;
use crate::squared_errors::SquaredErrors;

/// Smoothed light, per covered texel.
#[derive(Default)]
pub(crate) struct Denoised {
    pub estimates: Vec<Estimates>,
    /// Variance of the mean of each texel's replicates.
    pub noise: SquaredErrors,
    /// The squared bias that smoothing may have brought, mean of the channels.
    pub smoothing: Vec<f32>,
}

impl Denoised {
    /// Smooths `raw` estimates, unless `smooths` is false or there is no noise in them. `nearness` is, per texel, the mean
    /// of that of the surfaces or lights that its samples reached.
    pub fn new(
        neighbourhoods: &Neighbourhoods<'_>,
        raw: &[Estimates],
        nearness: impl Fn(usize) -> Nearness + Sync,
        smooths: bool,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<Self, BakeError> {
        let is_noisy = |estimates: &Estimates| estimates.iter().any(|estimate| *estimate != estimates[0]);
        if !raw.par_iter().any(is_noisy) {
            let (expected, smoothing) = (vec![0.0; raw.len()], vec![0.0; raw.len()]);
            let noise = SquaredErrors { cautious: expected.clone(), expected };
            return Ok(Self { estimates: raw.to_vec(), noise, smoothing });
        }
        let (estimates, smoothing) = monitor.run_interruptible(1.0, || match smooths {
            true => smooth(neighbourhoods, raw, nearness),
            false => (raw.to_vec(), vec![0.0; raw.len()]),
        })?;
        let noise = monitor.run_interruptible(1.0, || spread(neighbourhoods, &estimates))?;
        Ok(Self { estimates, noise, smoothing })
    }

    /// The squared errors by noise and by smoothing together.
    pub fn errors(&self) -> SquaredErrors {
        self.noise.with(&self.smoothing)
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::neighbours_tests::random;
    use super::super::replicates::{REPLICATES, mean, variance};
    use super::*;
    use crate::coverage::on_a_floor::on_a_floor;

    const SIDE: u32 = 192;

    /// What is left in smoothed estimates of a known light.
    struct Left {
        /// Mean of the squared errors, and of those that are stated for noise and smoothing, over all texels.
        error: f32,
        noise: f32,
        smoothing: f32,
        /// The share of texels within twice the cautious error by noise, and within twice the spread of their own four
        /// replicates.
        within_cautious: f32,
        within_own: f32,
    }

    /// Replicates of the `light` at each texel (column, row) of a floor, with noise of this standard deviation.
    fn left(light: impl Fn(u32, u32) -> f32, noise: f32, distance: f32, smooths: bool) -> Left {
        on_a_floor(SIDE, |texels, monitor| {
            let mut state = 5;
            // A sum of twelve numbers, each with a variance of 1/12, is almost normally distributed.
            let mut normal = || (0..12).map(|_| random(&mut state)).sum::<f32>() - 6.0;
            let truth: Vec<f32> = texels.list.iter().map(|texel| light(texel.x, texel.y)).collect();
            let mut raw: Vec<Estimates> = Vec::new();
            for light in &truth {
                raw.push(std::array::from_fn::<_, REPLICATES, _>(|_| Vec3::splat(light + noise * normal())));
            }
            let neighbourhoods = Neighbourhoods::new(texels, &[]);
            let denoised = Denoised::new(
                &neighbourhoods,
                &raw,
                |_| Nearness::of_lamp((distance * texels.side).recip()),
                smooths,
                monitor,
            )
            .unwrap();
            let count = truth.len() as f32;
            assert!(count > 0.9 * (SIDE * SIDE) as f32, "{count}");
            let off = |place: usize| mean(&denoised.estimates[place]).x - truth[place];
            let all = 0..truth.len();
            let share = |squared: &dyn Fn(usize) -> f32| {
                all.clone().filter(|&place| off(place).powi(2) <= 4.0 * squared(place)).count() as f32 / count
            };
            Left {
                error: all.clone().map(|place| off(place).powi(2)).sum::<f32>() / count,
                noise: denoised.noise.expected.iter().sum::<f32>() / count,
                smoothing: denoised.smoothing.iter().sum::<f32>() / count,
                within_cautious: share(&|place| denoised.noise.cautious[place]),
                within_own: share(&|place| variance(&denoised.estimates[place]).x),
            }
        })
    }

    #[test]
    fn the_spread_of_replicates_tells_their_noise() {
        let left = left(|_, _| 3.0, 0.4, f32::INFINITY, false);
        let truth = 0.4f32.powi(2) / REPLICATES as f32;
        let [error, stated] = [left.error, left.noise].map(|squares| squares / truth);
        assert!((error - 1.0).abs() < 0.03, "{error}");
        // The larger one of two estimates is stated, which on average exceeds both.
        assert!((1.0..1.12).contains(&stated), "{stated}");
        assert!(left.within_cautious > 0.97, "{}", left.within_cautious);
        // Student's t with three degrees of freedom: 86 %.
        assert!(left.within_own < 0.88, "{}", left.within_own);
    }

    /// Waves of the light, where other surfaces are a third of a wave away, as they would have to be to cause them.
    #[test]
    fn what_smoothing_takes_away_of_the_light_is_stated() {
        for (period, most) in [(12.0, 2.1), (24.0, 1.5), (48.0, 1.1)] {
            for noise in [0.1, 0.4] {
                let wave = |x: u32, y: u32| {
                    let [x, y] = [x, y].map(|place| place as f32 * std::f32::consts::TAU / period);
                    3.0 + 0.25 * x.sin() * y.cos()
                };
                let left = left(wave, noise, period / 3.0, true);
                let [true_error, stated, noise_alone] =
                    [left.error, left.noise + left.smoothing, left.noise].map(f32::sqrt);
                println!(
                    "waves of {period} texels, noise {noise}: off by {true_error:.4}, stated {stated:.4}, of which noise {noise_alone:.4}"
                );
                assert!(true_error < most * stated && stated < 1.3 * true_error, "{period} {noise}");
                // Smoothing removes most of the noise, whatever it takes away of the light.
                assert!(true_error < 0.7 * noise / (REPLICATES as f32).sqrt());
            }
        }
        // Without noise, the light stays as it is.
        let exact = left(|x, y| (x * y) as f32, 0.0, 10.0, true);
        assert_eq!([exact.error, exact.noise, exact.smoothing], [0.0; 3]);
        // Without light to take away, hardly anything is stated for it.
        let flat = left(|_, _| 3.0, 0.4, f32::INFINITY, true);
        assert!(flat.smoothing < 0.02 * 0.4f32.powi(2) / REPLICATES as f32, "{}", flat.smoothing);
    }
}
