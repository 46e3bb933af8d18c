//! The parameters of one smoothing pass over all texels, and the type of its input and output. What a pass computes is
//! in `smooth`.

use super::plane::VALUES;
use super::texel_rows::ChannelRows;

/// The estimates of all replicates, and the squared bias that smoothing has brought so far, mean of the channels.
pub(crate) type Smoothed = ChannelRows<{ VALUES + 1 }>;
pub(crate) const BIAS: usize = VALUES;

/// The parameters of a pass.
pub(crate) struct FilterPass {
    /// The distance in texels at which a neighbour has weight e⁻¹.
    pub width: f32,
    /// Where other surfaces are near, that distance is less than their harmonic mean distance divided by this, in the
    /// directions in which they are near.
    pub near: f32,
    /// The reach, in steps, of the means by which edges are detected.
    pub feature_steps: usize,
    /// The share of the input's variance that noise alone leaves in the estimate of the squared bias.
    pub bias_noise: f32,
}
