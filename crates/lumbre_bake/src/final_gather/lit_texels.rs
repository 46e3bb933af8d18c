//! The covered texels with all their light, for the stages after the gather. Finished maps are made from it in
//! `finish`.

use glam::Vec3;

use super::rounds::IndirectLight;
use crate::coverage::CoveredTexels;
use crate::direct_light::DirectLight;

/// The covered texels and their light.
pub(crate) struct LitTexels<'a> {
    pub texels: &'a CoveredTexels<'a>,
    pub direct: &'a DirectLight,
    pub indirect: &'a IndirectLight,
    /// Per covered texel, the sum of direct and indirect irradiance, W/m².
    pub light: &'a [Vec3],
}
