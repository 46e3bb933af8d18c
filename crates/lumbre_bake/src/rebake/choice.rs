//! Which texels keep the light by bounces that the former bake found: those where leaving it as it is adds little to the error asked for. Not
//! how much it changes: that is `indirect_change`.

use super::changes::Changes;
use super::samples::TexelSamples;
use crate::coverage::footprint::Texel;
use crate::direct_light::local_light::LocalLight;
use crate::final_gather::gather_sums::GatherSums;
use crate::final_gather::reused_gather::ReusedGather;

/// Of the error asked for, what all that is reuse_error may be together (RMSE), and at most in one texel. What is reuse_error is systematic, while the rest of
/// the error is chance: it gets the lesser part.
const SHARE: f64 = 0.3;
const MOST: f64 = 0.5;

/// By the change of each covered texel (W/m², mean of the channels), the light around it, and the RMSE asked for, relative to that.
pub(super) fn choose(
    changes: &Changes<'_>,
    texels: &[Texel],
    change: &[f32],
    local: &LocalLight,
    asked: f64,
) -> ReusedGather {
    let open = texels.iter().filter(|texel| !texel.is_hidden()).count();
    // With what was reuse_error before.
    let all = |index: usize| -> Option<f64> {
        let known = changes.known[index].filter(|known| known.gathered.samples > 0)?;
        let all = f64::from(known.reuse_error + change[index]);
        (all <= MOST * asked * local.at(index)).then_some(all / local.at(index))
    };
    let mut candidates: Vec<(f64, usize)> =
        (0..texels.len()).filter_map(|index| Some((all(index)?, index))).collect();
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let budget = (SHARE * asked).powi(2) * open as f64;
    let mut kept = ReusedGather {
        gathered: vec![GatherSums::default(); texels.len()],
        reuse_error: vec![0.0; texels.len()],
    };
    let mut spent = 0.0;
    for (reuse_error, index) in candidates {
        spent += reuse_error * reuse_error;
        if spent > budget {
            break;
        }
        if let Some(known) = changes.known[index] {
            kept.gathered[index] = known.gathered;
            kept.reuse_error[index] = (reuse_error * local.at(index)) as f32;
        }
    }
    kept
}

/// All that there is, of a scene that has not changed.
pub(super) fn all(changes: &Changes<'_>) -> ReusedGather {
    let gathered = |known: &Option<&TexelSamples>| known.map_or_else(GatherSums::default, |own| own.gathered);
    ReusedGather {
        gathered: changes.known.iter().map(gathered).collect(),
        reuse_error: changes.known.iter().map(|known| known.map_or(0.0, |own| own.reuse_error)).collect(),
    }
}
