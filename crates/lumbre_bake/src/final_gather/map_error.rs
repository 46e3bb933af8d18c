//! The error of all lightmaps together, as the report states it. The errors of single texels are in `error_ledger`.

use super::error_ledger::{ErrorLedger, open_sum, relative_to, root};
use crate::ErrorPart;
use crate::squared_errors::SquaredErrors;

/// The expected error over all texels that are not hidden.
pub(crate) struct MapError {
    /// Sum of the squared errors, each relative to the light around its texel.
    pub relative_squares: f64,
    /// Square root of their mean.
    pub relative: f64,
    /// RMSE relative to the mean irradiance of the map.
    pub of_mean: f64,
    /// What it is made of, the largest part first.
    pub parts: Vec<ErrorPart>,
}

impl MapError {
    /// Sums up `errors`, the ledger's total per texel. `mean` is the map's mean irradiance in W/m², mean of the
    /// channels.
    pub fn new(ledger: &ErrorLedger<'_>, errors: &SquaredErrors, mean: f64) -> Self {
        let open = ledger.open_texels();
        let relative_squares = ledger.relative_sum(&errors.expected) - ledger.by_chance();
        Self {
            relative_squares,
            relative: root(relative_squares / open),
            of_mean: relative_to(mean, open_sum(&ledger.texels.list, &errors.expected) / open),
            parts: ledger.parts(),
        }
    }
}
