//! The report on what was kept of a former bake. What is kept is chosen in `changes` and `choice`.

use super::changes::Changes;
use crate::coverage::Texel;
use crate::final_gather::ReusedGather;
use crate::report::{BakeReport, RebakeReport};

/// The report of a bake with usable former samples. `report` must hold the mean irradiance already.
pub(crate) fn rebake_report(
    changes: &Changes<'_>,
    texels: &[Texel],
    kept: Option<&ReusedGather>,
    report: &BakeReport,
) -> RebakeReport {
    let open = texels.iter().filter(|texel| !texel.is_hidden()).count();
    let mean = report.mean_of_channels();
    let error = kept.map_or(0.0, |kept| kept.error(open));
    RebakeReport {
        whole: String::new(),
        changed: changes.names.clone(),
        texels: open,
        relit: changes.relit(texels),
        gathered: kept.map_or(0, |kept| open - kept.count()),
        neglected: if mean > 0.0 { error / mean } else { 0.0 },
    }
}
