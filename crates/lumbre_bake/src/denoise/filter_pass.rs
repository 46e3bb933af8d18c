//! One pass of the smoothing over all texels: how far it reaches, and what it hands to the next. Not what it computes.

use super::plane::VALUES;
use super::texel_rows::ChannelRows;

/// The channels of the estimates, and the squared bias, mean of the channels.
pub(crate) type Smoothed = ChannelRows<{ VALUES + 1 }>;
pub(crate) const BIAS: usize = VALUES;

/// One pass over all texels.
pub(crate) struct FilterPass {
    /// Texels at which a neighbour weighs e⁻¹; and where things are near, the share of their harmonic mean distance, inverted.
    pub width: f32,
    pub near: f32,
    /// Reach of the means that tell edges, in steps.
    pub guide_steps: usize,
    /// Of the variance of what goes in, the part that chance leaves in the squared bias.
    pub chance: f32,
}
