//! The light by bounces that is kept from a former bake. Not the choice of which texels keep it: that is `rebake`'s.

use super::gather_sums::GatherSums;

/// The light by bounces that is kept from a former bake.
pub(crate) struct ReusedGather {
    /// Per covered texel, what it gathered in the former bake; empty sums where it gathers anew.
    pub gathered: Vec<GatherSums>,
    /// Per covered texel, by how much its light may have changed since, W/m², mean of the channels.
    pub reuse_error: Vec<f32>,
}

impl ReusedGather {
    /// How many texels keep their light.
    pub fn count(&self) -> usize {
        self.gathered.iter().filter(|sums| sums.samples > 0).count()
    }

    /// The RMSE over `open` texels that keeping the light may add, W/m².
    pub fn error(&self, open: usize) -> f64 {
        let sum: f64 = self.reuse_error.iter().map(|&error| f64::from(error).powi(2)).sum();
        (sum / open.max(1) as f64).sqrt()
    }
}
