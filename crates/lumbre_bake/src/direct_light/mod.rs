//! Direct light of every covered texel. Sources that matter by themselves, in passes: a few shadow rays everywhere, many where the first pass,
//! there or next to it, saw a source partly or differently, unless it was exact (a penumbra's faint ends are found by their neighbours),
//! then more where the error asked for is not in sight. The other sources share samples: that is `shared_light`.

pub(crate) mod light_cuts;
pub(crate) mod light_visibility;
pub(crate) mod local_light;
pub(crate) mod shafts;
pub(crate) mod shared_light;

use glam::Vec3;

use crate::chunks::{in_chunks, in_chunks_until_deadline};
use crate::coverage::covered_texels::CoveredTexels;
use crate::coverage::footprint::{Texel, receiver};
use crate::denoise::neighbourhoods::Neighbourhoods;
use crate::direct_light::light_cuts::LightCuts;
use crate::direct_light::local_light::LocalLight;
use crate::direct_light::shafts::Shafts;
use crate::direct_light::shared_light::SharedLight;
use crate::monitor::BakeMonitor;
use crate::sample_allocation::allocate;
use crate::sampling::{Sequence, Stream};
use crate::scene::LightmapLayout;
use crate::sources::direct::{Direct, VisibilitySummary};
use crate::sources::light_sources::Sources;
use crate::texel_index::CoveredTexel;
use crate::{BakeError, BakeOptions, BakeReport};

/// How far a penumbra is suspected around a texel that saw one, in texels.
const REACH: u32 = 2;

/// What arrives from lamps, lights and emissive surfaces without a bounce.
pub(crate) struct DirectLight {
    /// Per covered texel.
    pub texels: Vec<Direct>,
    /// The light around each of them, beside which errors count.
    pub local: LocalLight,
}

impl DirectLight {
    /// Per texel of all maps, irradiance (mixed lights included); NaN where nothing is shown.
    pub fn by_place(&self, texels: &CoveredTexels<'_>) -> Vec<Vec3> {
        let mut total = vec![Vec3::NAN; texels.layout.texels];
        for (texel, direct) in texels.list.iter().zip(&self.texels).filter(|(texel, _)| !texel.is_hidden()) {
            total[texel.index.place()] = direct.total();
        }
        total
    }
}

/// Direct light of every covered texel, and the light around it. What is `known` of a former bake stays as it is; an empty list knows nothing.
///
/// # Errors
/// [`BakeError::Cancelled`].
pub(crate) fn direct_light(
    sources: &Sources<'_>,
    texels: &CoveredTexels<'_>,
    known: &[Option<Direct>],
    options: &BakeOptions,
    monitor: &mut BakeMonitor<'_>,
    report: &mut BakeReport,
) -> Result<DirectLight, BakeError> {
    let scene = sources.scene;
    let CoveredTexels { layout, list: texels, charts, .. } = texels;
    let known = |texel: CoveredTexel| known.get(texel.place()).copied().flatten();
    let [few, many, most] = options.effort().direct;
    let mut cuts = monitor.run_interruptible(1.0, || LightCuts::new(sources, texels, charts))?;
    let wanted = |texel: CoveredTexel| known(texel).is_none();
    let shafts = monitor.run_interruptible(1.0, || Shafts::new(scene, sources, texels, &cuts, wanted))?;
    // Where rays would have to tell, one to any of the sources tells as much as one to each.
    cuts.share(sources, &shafts.unresolved(&cuts));
    let cuts = cuts;
    let light = |own: CoveredTexel, samples: u32| {
        let (place, texel) = (own.place(), &texels[own.place()]);
        if texel.is_hidden() {
            return Direct::default();
        }
        let sequence = Sequence::new(options.seed, Stream::DirectLight, texel.index.0);
        sources.irradiance_per_source(
            cuts.of(place),
            &shafts.visibility(place, texel),
            sequence,
            samples,
            &|x, y| texel.point(scene, x, y).map(|point| receiver(scene, &point)),
        )
    };
    // A complete map first, whatever time it takes.
    let clock = monitor.clock();
    monitor.pass(PASS);
    let unknown: Vec<CoveredTexel> = CoveredTexel::all(texels.len()).filter(|&texel| wanted(texel)).collect();
    let found = in_chunks(unknown.len(), monitor, |place| {
        light(unknown[place], if clock.is_over() { few.min(LATE) } else { few })
    })?;
    let mut direct: Vec<Direct> =
        CoveredTexel::all(texels.len()).map(|texel| known(texel).unwrap_or_default()).collect();
    for (texel, found) in unknown.iter().zip(found) {
        direct[texel.place()] = found;
    }
    let shared = match cuts.share_samples() {
        true => {
            let wanted = |place: usize| wanted(CoveredTexel::new(place));
            // What is known has no samples that others could be compared with.
            let keys = cuts.keys().into_iter().enumerate();
            let groups: Vec<u32> = keys.map(|(place, key)| 2 * key + u32::from(wanted(place))).collect();
            let neighbourhoods = Neighbourhoods::new(scene, layout, texels, charts, &groups);
            monitor.pass(PASS);
            Some(SharedLight::new(sources, neighbourhoods, &cuts, wanted, options, monitor)?)
        }
        false => None,
    };
    monitor.pass(PASS_OF_LOCAL_LIGHT);
    let so_far = shared.as_ref().map(|shared| shared.with(&direct));
    let local = so_far.as_ref().unwrap_or(&direct);
    let local = LocalLight::new(sources, layout, texels, charts, local, monitor)?;
    let open = texels.iter().filter(|texel| !texel.is_hidden()).count().max(1) as f64;
    let asked = open * options.error.powi(2);
    // Shared samples are mostly cheaper than rays of the gather, so that direct light is held to a smaller share of the error.
    let gathers = scene.surfaces.iter().any(|surface| !surface.is_black());
    let share = if shared.is_some() && gathers { SHARED_SHARE } else { OWN_SHARE };
    let own_goal = asked * if shared.is_some() { 0.5 * share } else { share };

    let mut again = in_doubt(layout, texels, &direct);
    again.retain(|&texel| wanted(texel) && direct[texel.place()].sampled);
    monitor.pass(PASS);
    let better = in_chunks_until_deadline(again.len(), monitor, |place| light(again[place], many))?;
    replace(&mut direct, &again, better);
    // Then more where the error asked for is not in sight yet, in the shadows' edges mostly.
    let mut samples = vec![many; texels.len()];
    loop {
        let relative = relative(&direct, &local);
        if sum(&relative) <= own_goal {
            break;
        }
        let wanted = allocate(again.iter().copied(), &relative, &samples, most, ORDER, own_goal);
        monitor.pass(PASS);
        let better = in_chunks_until_deadline(wanted.len(), monitor, |place| {
            light(wanted[place].texel, wanted[place].samples)
        })?;
        if better.is_empty() {
            break;
        }
        for wanted in &wanted {
            samples[wanted.texel.place()] = wanted.samples;
        }
        let again: Vec<CoveredTexel> = wanted.iter().map(|wanted| wanted.texel).collect();
        replace(&mut direct, &again, better);
    }
    if let Some(shared) = shared {
        let own = sum(&relative(&direct, &local));
        let goal = |share: f64| (asked * share - own).max(own_goal);
        let share = |samples: f64| if gathers { share_beside_gather(samples) } else { share };
        shared.finish(&mut direct, &local, (share(0.0), &share), &goal, monitor)?;
    }
    let new = unknown.iter().map(|texel| u64::from(direct[texel.place()].rays));
    report.rays += new.sum::<u64>();
    Ok(DirectLight { texels: direct, local })
}

/// Of the squared error asked for, what direct light may have for itself.
const OWN_SHARE: f64 = 0.35;
/// The same where sources share samples, and a gather follows, at least and at most.
const SHARED_SHARE: f64 = 0.2;
const MAX_SHARED_SHARE: f64 = 0.5;
/// What direct light and the gather may leave together.
const BOTH: f64 = 0.85;
/// What a gather takes: its rays for each texel times the share of the squared error that they leave. From 7 in a room to 30 in the demo level.
const GATHER: f64 = 30.0;

/// The share of the squared error asked for that sources may leave which take so many samples for each texel to leave the least share: as noise falls
/// with the samples, both take the fewest together where their shares are as the roots of what each takes.
fn share_beside_gather(samples: f64) -> f64 {
    let (own, gather) = ((samples * SHARED_SHARE).sqrt(), GATHER.sqrt());
    (BOTH * own / (own + gather)).clamp(SHARED_SHARE, MAX_SHARED_SHARE)
}
/// Order of the variance's fall with the samples at straight edges of shadows, as measured.
const ORDER: f64 = 1.5;

/// A pass's usual share of the time that this one and those after it take.
const PASS: f32 = 0.5;
const PASS_OF_LOCAL_LIGHT: f32 = 0.2;

/// Shadow rays of a texel when the time is up: their spread still tells the error.
const LATE: u32 = 4;
/// The variances as they are expected, in shares of the squared light around.
fn relative(direct: &[Direct], local: &LocalLight) -> Vec<f32> {
    let variances: Vec<f32> = direct.iter().map(|direct| direct.variance - direct.caution).collect();
    local.relative(&variances)
}

fn sum(numbers: &[f32]) -> f64 {
    numbers.iter().map(|&number| f64::from(number)).sum()
}

/// Those that there was time for.
fn replace(direct: &mut [Direct], at: &[CoveredTexel], better: Vec<Direct>) {
    for (texel, better) in at.iter().zip(better) {
        let first = &mut direct[texel.place()];
        *first = Direct { rays: first.rays + better.rays, ..better };
    }
}

/// Texels that saw a source partly, or near one that did, or next to one that saw other sources.
fn in_doubt(layout: &LightmapLayout, texels: &[Texel], direct: &[Direct]) -> Vec<CoveredTexel> {
    let mut seen: Vec<Option<VisibilitySummary>> = vec![None; layout.texels];
    for (texel, direct) in texels.iter().zip(direct).filter(|(texel, _)| !texel.is_hidden()) {
        seen[texel.index.place()] = Some(direct.seen);
    }
    let doubtful = |texel: &Texel| {
        let Some(own) = seen[texel.index.place()] else { return false };
        let map = &layout.maps[texel.object as usize];
        let rows = texel.y.saturating_sub(REACH)..=(texel.y + REACH).min(map.height - 1);
        let columns = texel.x.saturating_sub(REACH)..=(texel.x + REACH).min(map.width - 1);
        rows.flat_map(|y| columns.clone().map(move |x| (x, y))).any(|(x, y)| {
            seen[map.texel(x, y).place()]
                .is_some_and(|other| other.partly || other.signature != own.signature)
        })
    };
    CoveredTexel::all(texels.len()).filter(|own| doubtful(&texels[own.place()])).collect()
}
