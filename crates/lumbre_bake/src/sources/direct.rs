//! The direct light of a receiver, with its error and what was seen of the sources. Not how it is found.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::sampling::hash;

/// Irradiance, W/m².
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Direct {
    /// From emissive triangles and static lights: goes into the map.
    pub baked: Vec3,
    /// From mixed lights: bounces only.
    pub mixed: Vec3,
    /// Variance that sampling leaves in `baked`, mean of the channels, as it is stated of this receiver alone.
    pub variance: f32,
    /// The part of it that is caution: what it is more than is to be expected of many such receivers.
    pub caution: f32,
    /// Rays cast.
    pub rays: u32,
    /// Whether samples had a part in it: more would tell more.
    pub sampled: bool,
    /// What of the sources was seen.
    pub seen: VisibilitySummary,
}

/// What a receiver saw of the sources.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct VisibilitySummary {
    /// Some source was seen by one sample and not by another: a penumbra, or a shadow's edge.
    pub partly: bool,
    /// One number for each combination of hidden sources.
    pub signature: u32,
}

impl VisibilitySummary {
    /// What the samples to source `id` found. Sources that are wholly seen, or that do not shine here, leave no mark: which of them
    /// are asked together differs from receiver to receiver.
    pub(crate) fn add(&mut self, id: u32, visible: u32, hidden: u32) {
        self.partly |= visible > 0 && hidden > 0;
        if hidden > 0 && visible == 0 {
            self.signature ^= hash(id.wrapping_add(1));
        }
    }
}

impl Direct {
    /// What bounces.
    pub fn total(&self) -> Vec3 {
        self.baked + self.mixed
    }
}
