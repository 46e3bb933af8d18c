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
    /// The mean of the squared relative errors over the view from each block of texels.
    pub in_views: Vec<f64>,
    /// Square root of the largest of these that counts.
    pub in_worst_view: f64,
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
        let relative = ledger.direct.local.relative(&errors.expected);
        let sum = open_sum(&ledger.texels.list, &relative);
        let relative_squares = sum - ledger.by_chance();
        let in_views = ledger.in_views(&relative);
        let views = &ledger.direct.local.views;
        Self {
            relative_squares,
            relative: root(relative_squares / open),
            in_worst_view: root(views.worst(&in_views)),
            in_views,
            of_mean: relative_to(mean, open_sum(&ledger.texels.list, &errors.expected) / open),
            parts: ledger.parts(),
        }
    }

    /// The larger one of the whole level's error and that in the worst view.
    pub fn worst(&self) -> f64 {
        self.relative.max(self.in_worst_view)
    }

    /// Whether both the whole level and its worst view have at most this error.
    pub fn reaches(&self, requested: f64) -> bool {
        self.worst() <= requested
    }
}
