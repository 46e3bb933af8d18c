//! The error of a whole map, as its report states it. Not the errors of single texels: those are the `error_ledger`'s.

use super::error_ledger::{ErrorLedger, open_sum, relative_to, root};
use crate::coverage::footprint::Texel;
use crate::direct_light::local_light::LocalLight;
use crate::squared_errors::SquaredErrors;
use crate::{BakeReport, ErrorPart};

/// The expected errors of all texels that show a surface, added up.
pub(crate) struct MapError {
    /// Sum of the squared errors, each relative to the light around its texel.
    pub relative_squares: f64,
    /// Root of their mean.
    pub relative: f64,
    /// Root of the mean squared error over the mean irradiance of the map.
    pub of_mean: f64,
}

impl MapError {
    /// Adds up what `ledger` expects of each texel: `errors` are its total, and `mean` is the map's mean irradiance in W/m², mean of the channels.
    pub fn new(
        ledger: &ErrorLedger<'_>,
        errors: &SquaredErrors,
        texels: &[Texel],
        local: &LocalLight,
        mean: f64,
    ) -> Self {
        let open = texels.iter().filter(|texel| !texel.is_hidden()).count().max(1) as f64;
        let relative_squares =
            open_sum(texels, &local.relative(&errors.expected)) - ledger.by_chance(texels, local);
        Self {
            relative_squares,
            relative: root(relative_squares / open),
            of_mean: relative_to(mean, open_sum(texels, &errors.expected) / open),
        }
    }

    /// States the error in the report, what it is made of, and whether it is the `target` or less.
    pub fn write_report(&self, target: f64, parts: Vec<ErrorPart>, report: &mut BakeReport) {
        report.estimated_error = self.relative;
        report.error_of_mean = self.of_mean;
        report.error_reached = self.relative <= target;
        report.error_parts = parts;
    }
}
