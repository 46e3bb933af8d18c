//! What was kept of a former bake, for people and programs. Not the keeping.

use serde::{Deserialize, Serialize};

use super::changes::Changes;
use super::kept::Kept;
use crate::BakeReport;
use crate::texels::footprint::Texel;

/// What a bake kept of the former one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RebakeReport {
    /// Why nothing could be kept; empty if something was.
    pub whole: String,
    /// What differs from the former bake: objects by name, or the lights.
    pub changed: Vec<String>,
    /// Texels that show a surface.
    pub texels: usize,
    /// Of them, those whose direct light was computed anew.
    pub relit: usize,
    /// Of them, those whose light by bounces was gathered anew.
    pub gathered: usize,
    /// RMSE relative to the mean irradiance by which the light of all others may have changed; it is part of the stated error.
    pub neglected: f64,
}

/// Of a bake that kept something, or tried to. `report` has the mean irradiance already.
pub(crate) fn rebake_report(
    changes: &Changes<'_>,
    texels: &[Texel],
    relit: usize,
    kept: Option<&Kept>,
    report: &BakeReport,
) -> RebakeReport {
    let open = texels.iter().filter(|texel| !texel.is_hidden()).count();
    let mean = report.mean_irradiance.iter().sum::<f64>() / 3.0;
    let neglected = kept.map_or(0.0, |kept| kept.error(open));
    RebakeReport {
        whole: String::new(),
        changed: changes.names.clone(),
        texels: open,
        relit,
        gathered: kept.map_or(0, |kept| open - kept.count()),
        neglected: if mean > 0.0 { neglected / mean } else { 0.0 },
    }
}

impl std::fmt::Display for RebakeReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        /// Names that are listed.
        const NAMED: usize = 5;
        if !self.whole.is_empty() {
            return write!(f, "baked whole: {}", self.whole);
        }
        let named = self.changed.iter().take(NAMED).map(String::as_str).collect::<Vec<_>>().join(", ");
        let others = self.changed.len().saturating_sub(NAMED);
        let others = if others > 0 { format!(" and {others} more") } else { String::new() };
        let named = if named.is_empty() { "no object".to_owned() } else { named + &others };
        let share = |count: usize| 100.0 * count as f64 / self.texels.max(1) as f64;
        write!(
            f,
            "baked again what changed: {named}; {:.1} % of the texels gathered anew, direct light of {:.1} % anew, the others kept (their light may \
             have changed by {:.3} % of the mean)",
            share(self.gathered),
            share(self.relit),
            100.0 * self.neglected
        )
    }
}
