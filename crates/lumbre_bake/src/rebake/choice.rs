//! Chooses the texels that keep the light by bounces of the former bake: those where keeping it adds little to the
//! requested error. By how much the light changes is estimated in `indirect_change`.

use super::changes::Changes;
use super::samples::TexelSamples;
use crate::coverage::Texel;
use crate::direct_light::LocalLight;
use crate::final_gather::{GatherSums, ReusedGather};
use crate::texel_index::CoveredTexel;

/// Largest error by reuse as a share of the requested error: the RMSE of all texels, and that of any one texel. The
/// error by reuse is systematic, while the rest of the error is noise, so it gets the smaller share.
const MAX_SHARE: f64 = 0.3;
const MAX_TEXEL_SHARE: f64 = 0.5;

/// Chooses texels in the order of their errors by reuse until the limit is reached, given the change of each covered
/// texel (W/m², root mean square of the channels), the light around it, and the requested RMSE relative to that light.
pub(super) fn choose(
    changes: &Changes<'_>,
    texels: &[Texel],
    change: &[f32],
    local: &LocalLight,
    target: f64,
) -> ReusedGather {
    let open = texels.iter().filter(|texel| !texel.is_hidden()).count();
    // Relative to the light around, including the texel's error by reuse in the former bake; `None` for a texel that
    // cannot be kept.
    let relative_error = |index: usize| -> Option<f64> {
        let known = changes.known[index].filter(|known| known.gathered.samples > 0)?;
        let error = f64::from(known.reuse_error + change[index]);
        (error <= MAX_TEXEL_SHARE * target * local.at(CoveredTexel::new(index)))
            .then_some(error / local.at(CoveredTexel::new(index)))
    };
    let mut candidates: Vec<(f64, usize)> =
        (0..texels.len()).filter_map(|index| Some((relative_error(index)?, index))).collect();
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let budget = (MAX_SHARE * target).powi(2) * open as f64;
    let mut reused = ReusedGather {
        gathered: vec![GatherSums::default(); texels.len()],
        reuse_error: vec![0.0; texels.len()],
    };
    let mut spent = 0.0;
    for (error, index) in candidates {
        spent += error * error;
        if spent > budget {
            break;
        }
        if let Some(known) = changes.known[index] {
            reused.gathered[index] = known.gathered;
            reused.reuse_error[index] = (error * local.at(CoveredTexel::new(index))) as f32;
        }
    }
    reused
}

/// Keeps every texel's light, for a scene that has not changed.
pub(super) fn keep_all(changes: &Changes<'_>) -> ReusedGather {
    let gathered =
        |known: &Option<&TexelSamples>| known.map_or_else(GatherSums::default, |known| known.gathered);
    ReusedGather {
        gathered: changes.known.iter().map(gathered).collect(),
        reuse_error: changes.known.iter().map(|known| known.map_or(0.0, |known| known.reuse_error)).collect(),
    }
}
