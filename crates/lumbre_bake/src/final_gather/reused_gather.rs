//! The light by bounces that is kept of a former bake. Not the choice of what is: that is `rebake`'s.

use crate::final_gather::gather_sums::GatherSums;

/// The light by bounces that is kept.
pub(crate) struct ReusedGather {
    /// Per covered texel, what it had gathered; nothing where it gathers anew.
    pub gathered: Vec<GatherSums>,
    /// Per covered texel, by how much its light may have changed, W/m², mean of the channels.
    pub reuse_error: Vec<f32>,
}

impl ReusedGather {
    /// Texels that are kept.
    pub fn count(&self) -> usize {
        self.gathered.iter().filter(|own| own.samples > 0).count()
    }

    /// RMSE over `open` texels that is reuse_error, W/m².
    pub fn error(&self, open: usize) -> f64 {
        let sum: f64 = self.reuse_error.iter().map(|&own| f64::from(own).powi(2)).sum();
        (sum / open.max(1) as f64).sqrt()
    }
}
