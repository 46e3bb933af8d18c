//! Rounds of the final gather: every texel first, then those whose error is still too large, until the error asked for is
//! reached, the time is up or the quality's most rays are cast.

use glam::Vec3;

use super::footprint::Texel;
use super::gather::{Gathered, Outgoing, SCRAMBLES};
use super::in_chunks;
use super::smooth::{Estimates, mean, smooth, variance};
use crate::progress::Watch;
use crate::{BakeError, BakeOptions, BakeReport};

/// Irradiance by bounces of every covered texel.
pub(crate) fn gather(
    outgoing: &Outgoing<'_>,
    texels: &[Texel],
    charts: &[u32],
    mean_direct: f64,
    options: &BakeOptions,
    watch: &mut Watch<'_>,
    report: &mut BakeReport,
) -> Result<Vec<Vec3>, BakeError> {
    let [first, most] = options.quality.effort().gather.map(|samples| samples / SCRAMBLES as u32);
    let mut gathered = vec![Gathered::default(); texels.len()];
    let mut wanted: Vec<u32> =
        (0..texels.len() as u32).filter(|&i| !texels[i as usize].is_hidden()).collect();
    let open = wanted.len().max(1) as f64;
    let mut samples = first;
    let estimates = loop {
        let round = in_chunks(wanted.len(), watch, |place| {
            let index = wanted[place] as usize;
            let mut own = gathered[index];
            outgoing.gather(&texels[index], &mut own, samples, options.seed);
            own
        })?;
        for (&index, own) in wanted.iter().zip(round) {
            gathered[index as usize] = own;
        }
        let raw: Vec<Estimates> = gathered.iter().map(Gathered::estimates).collect();
        let estimates =
            if options.denoise { smooth(outgoing.scene, outgoing.layout, texels, charts, &raw) } else { raw };
        let channel_mean = |v: Vec3| f64::from(v.element_sum()) / 3.0;
        let total = mean_direct + estimates.iter().map(|e| channel_mean(mean(e))).sum::<f64>() / open;
        let variances: Vec<f64> = estimates.iter().map(|e| channel_mean(variance(e))).collect();
        let error = (variances.iter().sum::<f64>() / open).sqrt();
        report.estimated_error = if total > 0.0 { error / total } else { 0.0 };
        report.error_reached = report.estimated_error <= options.error;
        let late = options.time.is_some_and(|time| watch.seconds() >= time.as_secs_f64());
        if report.error_reached || samples >= most || late {
            break estimates;
        }
        samples = (samples * 2).min(most);
        let limit = (0.7 * options.error * total).powi(2);
        wanted.retain(|&index| variances[index as usize] > limit);
    };
    report.rays += gathered.iter().map(|own| own.rays).sum::<u64>();
    let cast: u64 = gathered.iter().map(|own| u64::from(own.samples) * SCRAMBLES as u64).sum();
    report.gather_rays = cast as f64 / open;
    Ok(estimates.iter().map(mean).collect())
}
