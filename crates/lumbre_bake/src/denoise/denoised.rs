//! Sampled light after smoothing, with the errors that are left in it. How it is smoothed is in `smooth`.

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
    /// Smooths `raw` estimates, unless `smooths` is false. `nearness` is, per texel, the mean of that of the surfaces or
    /// lights that its samples reached.
    pub fn new(
        neighbourhoods: &Neighbourhoods<'_>,
        raw: &[Estimates],
        nearness: impl Fn(usize) -> Nearness + Sync,
        smooths: bool,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<Self, BakeError> {
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
