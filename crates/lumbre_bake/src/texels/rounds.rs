//! Rounds of the final gather: every texel first, then those whose error is still too large, until the error asked for is
//! reached, the time is up or the quality's most rays are cast.

use glam::Vec3;

use super::chunks::in_chunks_in_time;
use super::error_estimate::{GatherErrors, PatchBias, patch_bias, spread, variances};
use super::footprint::Texel;
use super::gather::{Gathered, Outgoing, SCRAMBLES};
use super::late::from_patches;
use super::smooth::{Estimates, Surroundings, mean, smooth};
use crate::progress::Watch;
use crate::transport::direct::Direct;
use crate::{BakeError, BakeOptions, BakeReport, Ended};

/// Share of the squared error below which the gather's own noise is not worth more rays.
const WORTH_RAYS: f64 = 0.1;
/// And a round that leaves more than this of the squared error that it was to lower was the last.
const STALLED: f64 = 0.95;

/// Irradiance by bounces of every covered texel, and the variance of what the map then holds, mean of the channels.
pub(crate) fn gather(
    outgoing: &Outgoing<'_>,
    texels: &[Texel],
    charts: &[u32],
    direct: &[Direct],
    options: &BakeOptions,
    watch: &mut Watch<'_>,
    report: &mut BakeReport,
) -> Result<(Vec<Vec3>, Vec<f32>), BakeError> {
    let [first, most] = options.quality.effort().gather.map(|samples| samples / SCRAMBLES as u32);
    let mut gathered = vec![Gathered::default(); texels.len()];
    let mut wanted: Vec<u32> =
        (0..texels.len() as u32).filter(|&i| !texels[i as usize].is_hidden()).collect();
    let open = wanted.len().max(1) as f64;
    let channel_mean = |v: Vec3| f64::from(v.element_sum()) / 3.0;
    let mean_direct = direct.iter().map(|direct| channel_mean(direct.baked)).sum::<f64>() / open;
    let surroundings = Surroundings::new(outgoing.scene, outgoing.layout, texels, charts);
    let mut samples = first;
    let mut helped_before = f64::INFINITY;
    let (estimates, variances) = loop {
        let round = in_chunks_in_time(wanted.len(), watch, |place| {
            let index = wanted[place] as usize;
            let mut own = gathered[index];
            outgoing.gather(&texels[index], &mut own, samples, options.seed);
            own
        })?;
        let in_time = round.len() == wanted.len();
        for (&index, own) in wanted.iter().zip(round) {
            gathered[index as usize] = own;
        }
        if !in_time && samples == first {
            from_patches(outgoing, texels, &mut gathered);
        }
        let raw: Vec<Estimates> = gathered.iter().map(Gathered::estimates).collect();
        let (estimates, smoothing_bias) = match options.denoise {
            true => {
                let near: Vec<f32> = gathered.iter().map(Gathered::inverse_distance).collect();
                smooth(&surroundings, &raw, &near)
            }
            false => (raw.clone(), vec![0.0; texels.len()]),
        };
        let patch_bias = patch_bias(&surroundings, texels, &gathered, outgoing.patches.mean_reflectance());
        let spread = spread(&surroundings, texels, &estimates);
        let errors = GatherErrors {
            gathered: &gathered,
            estimates: &estimates,
            spread: &spread,
            smoothing_bias: &smoothing_bias,
            patch_bias: &patch_bias,
            residual_bound: report.residual_bound,
        };
        let variances = variances(direct, Some(&errors));
        let total = mean_direct + estimates.iter().map(|e| channel_mean(mean(e))).sum::<f64>() / open;
        let sum: f64 = open_variances(texels, &variances).sum();
        report.estimated_error = if total > 0.0 { (sum / open).sqrt() / total } else { 0.0 };
        report.error_reached = report.estimated_error <= options.error;
        let late = !in_time || watch.clock().late();
        // Of the error, the part that more rays make smaller: what the patches leave stays.
        let by_rays = errors.by_rays();
        let helped: f64 = open_variances(texels, &by_rays).sum();
        let helpless = helped <= WORTH_RAYS * sum || helped > STALLED * helped_before;
        if std::env::var_os("LUMBRE_DEBUG").is_some() {
            let weights: f64 = gathered.iter().flat_map(|g| g.weights).map(|w| f64::from(w.sum)).sum();
            let counts: f64 = gathered.iter().map(|g| f64::from(g.samples) * 4.0).sum();
            let meanraw: f64 =
                gathered.iter().flat_map(|g| g.sums).map(|w| f64::from(w.element_sum()) / 3.0).sum::<f64>()
                    / counts;
            let meanest: f64 = raw.iter().map(|e| channel_mean(mean(e))).sum::<f64>() / open;
            let meansm: f64 = estimates.iter().map(|e| channel_mean(mean(e))).sum::<f64>() / open;
            let corr: f64 = patch_bias.iter().map(|p| channel_mean(p.correction)).sum::<f64>() / open;
            eprintln!(
                "mean weight {} raw {meanraw} est {meanest} smoothed {meansm} correction {corr}",
                weights / counts
            );
            let share = |values: &mut dyn Iterator<Item = f32>| {
                (values.map(f64::from).sum::<f64>() / open).sqrt() / total * 100.0
            };
            eprintln!(
                "samples {samples} wanted {} est {:.3}: direct {:.3} noise {:.3} smoothing {:.3} factors {:.3} patches {:.3}",
                wanted.len(),
                report.estimated_error * 100.0,
                share(&mut direct.iter().map(|d| d.variance)),
                share(&mut spread.iter().copied()),
                share(&mut smoothing_bias.iter().copied()),
                share(&mut gathered.iter().map(|g| g.patch_error().powi(2))),
                share(&mut patch_bias.iter().map(|p| p.rest))
            );
        }
        if std::env::var_os("LUMBRE_DEBUG").is_some_and(|v| v == "2") {
            let mut order: Vec<usize> = (0..texels.len()).filter(|&i| !texels[i].is_hidden()).collect();
            order.sort_by(|&a, &b| variances[b].total_cmp(&variances[a]));
            let mut cumulative = 0.0;
            for (rank, &i) in order.iter().enumerate() {
                cumulative += f64::from(variances[i]);
                if rank < 40 || rank % 2000 == 0 {
                    let t = &texels[i];
                    let f = match &t.footprint {
                        super::footprint::Footprint::Points(p) => p.len(),
                        _ => 99,
                    };
                    eprintln!(
                        "{rank} share {:.3} obj {} at {} {} points {f}: sd {:.3} value {:.3} direct {:.4} noise {:.4} raw {:.4} smoothing {:.4} factors {:.4} patches {:.4} samples {}",
                        cumulative / sum,
                        t.object,
                        t.x,
                        t.y,
                        f64::from(variances[i]).sqrt() / total,
                        (f64::from(direct[i].baked.element_sum())
                            + f64::from(mean(&estimates[i]).element_sum()))
                            / 3.0
                            / total,
                        f64::from(direct[i].variance).sqrt() / total,
                        f64::from(super::smooth::variance(&estimates[i]).element_sum() / 3.0).sqrt() / total,
                        f64::from(super::smooth::variance(&raw[i]).element_sum() / 3.0).sqrt() / total,
                        f64::from(smoothing_bias[i]).sqrt() / total,
                        f64::from(gathered[i].patch_error()) / total,
                        f64::from(patch_bias[i].rest).sqrt() / total,
                        gathered[i].samples
                    );
                }
            }
        }
        helped_before = helped;
        report.ended = Ended::after(report.error_reached, late, samples >= most);
        if report.error_reached || samples >= most || late || helpless {
            break (corrected(&estimates, &patch_bias), variances);
        }
        samples = (samples * 2).min(most);
        let limit = (0.7 * options.error * total).powi(2);
        wanted.retain(|&index| f64::from(by_rays[index as usize]) > limit);
        if wanted.is_empty() {
            break (corrected(&estimates, &patch_bias), variances);
        }
    };
    report.rays += gathered.iter().map(|own| own.rays).sum::<u64>();
    // Without rays: the patches' light, for want of time.
    let cast = gathered.iter().filter(|own| own.rays > 0);
    let cast: u64 = cast.map(|own| u64::from(own.samples) * SCRAMBLES as u64).sum();
    report.gather_rays = cast as f64 / open;
    Ok((estimates, variances))
}

/// The estimates without what is known to be the patches' fault.
fn corrected(estimates: &[Estimates], bias: &[PatchBias]) -> Vec<Vec3> {
    let corrected = estimates.iter().zip(bias).map(|(e, bias)| (mean(e) - bias.correction).max(Vec3::ZERO));
    corrected.collect()
}

/// The variances of texels that show a surface.
fn open_variances<'a>(texels: &'a [Texel], variances: &'a [f32]) -> impl Iterator<Item = f64> + 'a {
    let open = texels.iter().zip(variances).filter(|(texel, _)| !texel.is_hidden());
    open.map(|(_, variance)| f64::from(*variance))
}
