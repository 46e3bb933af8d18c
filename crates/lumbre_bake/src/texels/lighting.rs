//! Direct light of every covered texel, in two passes: a few shadow rays everywhere, many where the first pass, there or
//! next to it, saw a source partly or differently, unless it was exact. A penumbra's faint ends are found by their neighbours.

use super::allocation::allot;
use super::chunks::{in_chunks, in_chunks_in_time};
use super::footprint::{Texel, receiver};
use super::shafts::Shafts;
use crate::progress::Watch;
use crate::sampling::Sequence;
use crate::scene::LightmapLayout;
use crate::transport::direct::{Direct, Seen, Sources};
use crate::{BakeError, BakeOptions};

/// How far a penumbra is suspected around a texel that saw one, in texels.
const REACH: u32 = 2;

/// Direct light of every covered texel. What is `known` of a former bake stays as it is; an empty list knows nothing.
pub(crate) fn direct_light(
    sources: &Sources<'_>,
    layout: &LightmapLayout,
    texels: &[Texel],
    known: &[Option<Direct>],
    options: &BakeOptions,
    watch: &mut Watch<'_>,
) -> Result<Vec<Direct>, BakeError> {
    let scene = sources.scene;
    let known = |index: u32| known.get(index as usize).copied().flatten();
    let [few, many, most] = options.quality.effort().direct;
    let shafts = watch.during(0.0, || Shafts::new(scene, sources, texels, |index| known(index).is_none()))?;
    let light = |place: usize, samples: u32| {
        let texel = &texels[place];
        if texel.is_hidden() {
            return Direct::default();
        }
        let sequence = Sequence::new(options.seed, 4, texel.index);
        sources.irradiance_past(&shafts.between(place, texel), sequence, samples, &|x, y| {
            texel.point(scene, x, y).map(|point| receiver(scene, &point))
        })
    };
    // A complete map first, whatever time it takes.
    let clock = watch.clock();
    watch.pass(PASS);
    let unknown: Vec<u32> = (0..texels.len() as u32).filter(|&index| known(index).is_none()).collect();
    let found = in_chunks(unknown.len(), watch, |place| {
        light(unknown[place] as usize, if clock.late() { few.min(LATE) } else { few })
    })?;
    let mut direct: Vec<Direct> =
        (0..texels.len() as u32).map(|index| known(index).unwrap_or_default()).collect();
    for (&index, found) in unknown.iter().zip(found) {
        direct[index as usize] = found;
    }
    let mut again = in_doubt(layout, texels, &direct);
    again.retain(|&index| known(index).is_none() && direct[index as usize].sampled);
    watch.pass(PASS);
    let better = in_chunks_in_time(again.len(), watch, |place| light(again[place] as usize, many))?;
    replace(&mut direct, &again, better);
    // Then more where the error asked for is not in sight yet, in the shadows' edges mostly.
    let open = texels.iter().filter(|texel| !texel.is_hidden()).count().max(1) as f64;
    let grey = |direct: &Direct| f64::from(direct.baked.element_sum()) / 3.0;
    let mean = direct.iter().map(grey).sum::<f64>() / open;
    let goal = OWN_SHARE * open * (options.error * mean).powi(2);
    let mut samples = vec![many; texels.len()];
    loop {
        let variances: Vec<f32> = direct.iter().map(|direct| direct.variance).collect();
        if variances.iter().map(|&variance| f64::from(variance)).sum::<f64>() <= goal {
            break;
        }
        let wanted = allot(again.iter().copied(), &variances, &samples, most, ORDER, goal);
        watch.pass(PASS);
        let better = in_chunks_in_time(wanted.len(), watch, |place| {
            light(wanted[place].index as usize, wanted[place].samples)
        })?;
        if better.is_empty() {
            break;
        }
        for wanted in &wanted {
            samples[wanted.index as usize] = wanted.samples;
        }
        let again: Vec<u32> = wanted.iter().map(|wanted| wanted.index).collect();
        replace(&mut direct, &again, better);
    }
    Ok(direct)
}

/// Of the squared error asked for, what direct light may have for itself.
const OWN_SHARE: f64 = 0.25;
/// Order of the variance's fall with the samples at straight edges of shadows, as measured.
const ORDER: f64 = 1.5;

/// A pass's usual share of the time that this one and those after it take.
const PASS: f32 = 0.5;

/// Shadow rays of a texel when the time is up: their spread still tells the error.
const LATE: u32 = 4;

/// Those that there was time for.
fn replace(direct: &mut [Direct], at: &[u32], better: Vec<Direct>) {
    for (&index, better) in at.iter().zip(better) {
        let first = &mut direct[index as usize];
        *first = Direct { rays: first.rays + better.rays, ..better };
    }
}

/// Texels that saw a source partly, or near one that did, or next to one that saw other sources.
fn in_doubt(layout: &LightmapLayout, texels: &[Texel], direct: &[Direct]) -> Vec<u32> {
    let mut seen: Vec<Option<Seen>> = vec![None; layout.texels];
    for (texel, direct) in texels.iter().zip(direct).filter(|(texel, _)| !texel.is_hidden()) {
        seen[texel.index as usize] = Some(direct.seen);
    }
    let doubtful = |texel: &Texel| {
        let Some(own) = seen[texel.index as usize] else { return false };
        let map = &layout.maps[texel.object as usize];
        let rows = texel.y.saturating_sub(REACH)..=(texel.y + REACH).min(map.height - 1);
        let columns = texel.x.saturating_sub(REACH)..=(texel.x + REACH).min(map.width - 1);
        rows.flat_map(|y| columns.clone().map(move |x| (x, y))).any(|(x, y)| {
            seen[map.first + (y * map.width + x) as usize]
                .is_some_and(|other| other.partly || other.signature != own.signature)
        })
    };
    (0..texels.len() as u32).filter(|&index| doubtful(&texels[index as usize])).collect()
}
