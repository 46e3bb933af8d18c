//! The direct light of a receiver, with its variance and a summary of which sources are visible. `irradiance` computes
//! it.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::sampling::hash;

/// Direct irradiance of a receiver, W/m².
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Direct {
    /// From emissive triangles and static lights; stored in the lightmap.
    pub baked: Vec3,
    /// From mixed lights; only its bounces are stored.
    pub mixed: Vec3,
    /// Variance that sampling leaves in `baked`, mean of the channels, as stated for this receiver alone.
    pub variance: f32,
    /// The safety margin in `variance`: by how much it exceeds the variance to be expected over many such receivers.
    pub caution: f32,
    /// Number of rays cast.
    pub rays: u32,
    /// Number of samples shared by sources that cast no ray, as they could bring no light, and the number of samples that
    /// take as long as the control variate. Counted for texels only.
    pub samples_without_ray: u32,
    /// Whether it was estimated from samples, so that more samples would improve it.
    pub sampled: bool,
    /// Which sources are visible.
    pub seen: VisibilitySummary,
}

/// A summary of which sources are visible from a receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct VisibilitySummary {
    /// Whether some source is visible from one sample and hidden from another: a penumbra or a shadow edge.
    pub partly: bool,
    /// A hash of the set of hidden sources.
    pub signature: u32,
}

impl VisibilitySummary {
    /// Adds how many samples found source `id` visible and how many found it hidden. A source that is fully visible, or
    /// does not shine here, leaves no trace: which sources are sampled together differs from receiver to receiver.
    pub(crate) fn add(&mut self, id: u32, visible: u32, hidden: u32) {
        self.partly |= visible > 0 && hidden > 0;
        if hidden > 0 && visible == 0 {
            self.signature ^= hash(id.wrapping_add(1));
        }
    }
}

impl Direct {
    /// The light that bounces on.
    pub fn total(&self) -> Vec3 {
        self.baked + self.mixed
    }
}
