//! The bounds in the doc comments of `lumbre_optics` ("Error of the f32 twin") as functions of the inputs, one per
//! function, in the terms of those comments. All are to first order in u, except where a step near a corner is
//! evaluated at both ends; terms of second order are under 10⁻⁵ of them. The running error of `lumbre_tests` is
//! something else: it is derived automatically from the shader itself, and every bound here is checked against it.

pub mod atmosphere;
pub mod lights;
pub mod lobes;
pub mod materials;
pub mod microfacets;
pub mod polygons;
pub mod powers;
pub mod probes;
pub mod refraction;
pub mod shading;
pub mod vectors;

use glam::DVec3;
use smallvec::SmallVec;

/// u, the relative error of one rounding to f32. A unit in the last place is at most 2 u of a number.
pub const U: f64 = 5.960_464_477_539_063e-8;
/// The smallest normal number. Smaller numbers may be flushed to zero, in inputs, intermediate values and results.
pub const FLUSHED: f64 = 1.175_494_350_822_287_5e-38;

/// A few numbers: the results of a function.
pub type Numbers = SmallVec<[f64; 9]>;

/// How much the results for one input may be off.
pub struct Allowed {
    /// For each result.
    pub error: Numbers,
    /// Where rounding decides a condition, the results on its other side, which are equally valid.
    pub other: Option<Numbers>,
}

impl Allowed {
    /// Adds the results of `other` as equally valid if `open`.
    pub fn or(mut self, open: bool, other: impl FnOnce() -> Numbers) -> Self {
        if open {
            self.other = Some(other());
        }
        self
    }
}

impl From<f64> for Allowed {
    fn from(error: f64) -> Self {
        Self { error: SmallVec::from_slice(&[error]), other: None }
    }
}

impl From<DVec3> for Allowed {
    fn from(error: DVec3) -> Self {
        Self { error: SmallVec::from_slice(&error.to_array()), other: None }
    }
}

impl From<&[f64]> for Allowed {
    fn from(error: &[f64]) -> Self {
        Self { error: SmallVec::from_slice(error), other: None }
    }
}
