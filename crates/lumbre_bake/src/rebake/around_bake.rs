//! What stands around the stages of a bake: before them the comparison with the former bake, after them the samples for
//! the next one. In between it answers what is known already, which is nothing without a former bake. Not the choice of
//! what is kept: that is `choice`.

use super::changes::Changes;
use super::fingerprints::ObjectFingerprints;
use super::indirect_change;
use super::samples::{Content, ObjectSamples, Samples, TexelSamples};
use crate::content_hash::{ContentHash, Hashes, hashes_of};
use crate::coverage::CoveredTexels;
use crate::direct_light::DirectLight;
use crate::final_gather::{GatherSums, LitTexels, ReusedGather};
use crate::monitor::BakeMonitor;
use crate::prepare::BakePlan;
use crate::radiosity::{Exchange, FormFactors};
use crate::report::StageNotes;
use crate::scene::{StaticScene, density_of};
use crate::sources::{Direct, Sources};
use crate::{BakeError, BakeOptions, BakeReport, Ended, RebakeReport};

/// Bytes per covered texel for the samples that the bake returns.
const SAMPLES_BYTES: u64 = size_of::<TexelSamples>() as u64;

/// Bytes per covered texel for the samples of the former bake: the samples themselves, the sums and direct light reused
/// from them, the change of its light, and its light and direct light in the former bake.
const FORMER_SAMPLES_BYTES: u64 =
    (size_of::<TexelSamples>() + size_of::<GatherSums>() + size_of::<Option<Direct>>() + 8 + 4 + 4 + 4 * 12)
        as u64;

/// A bake between the former and the next one.
pub(crate) struct Rebake<'a> {
    input: &'a StaticScene,
    options: &'a BakeOptions,
    hashes: Hashes,
    /// The former bake, if there is one that can be used.
    former: Option<&'a Content>,
    keeps_samples: bool,
    /// Hash of everything that the bits of this bake follow from, former bakes included.
    pub identity: ContentHash,
    /// What differs from the former bake; `None` before it is known, or without a former bake.
    changes: Option<Changes<'a>>,
    /// The light by bounces that is kept; `None` before it is known, or without a former bake.
    reused: Option<ReusedGather>,
    /// `None` without a former bake.
    report: Option<RebakeReport>,
    /// For the next bake.
    samples: Option<Samples>,
}

impl<'a> Rebake<'a> {
    /// Hashes the scene and decides whether the samples of a `former` bake can be used. `keeps_samples` says that there
    /// will be a next one.
    pub fn new(
        former: Option<&'a Samples>,
        keeps_samples: bool,
        input: &'a StaticScene,
        options: &'a BakeOptions,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<Self, BakeError> {
        let hashes = monitor.run_interruptible(0.0, || hashes_of(input, options))?;
        // Samples take memory. If that is limited, fewer patches may fit beside them, and the light would differ.
        let is_limited = options.memory.is_some() && (keeps_samples || former.is_some());
        let space = input.space();
        let checked = former
            .map(|samples| samples.0.check_use(&hashes, &input.objects, space, options).map(|()| &samples.0));
        let (former, refusal) = match checked {
            Some(Ok(former)) => (Some(former), None),
            Some(Err(reason)) => (None, Some(reason)),
            None => (None, None),
        };
        let identity = match former {
            None => hashes.content,
            // If nothing has changed, everything is kept, with the same bits.
            Some(former) if former.content == hashes.content => former.identity,
            Some(former) => hashes.content.made_from(&former.identity),
        };
        let identity = if is_limited { identity.made_from(&hashes.sampling) } else { identity };
        let report = refusal.map(|whole| RebakeReport { whole, ..RebakeReport::default() });
        let (changes, reused, samples) = (None, None, None);
        Ok(Self { input, options, hashes, former, keeps_samples, identity, changes, reused, report, samples })
    }

    /// Space and density of the former bake, so that texels stay where they were; without one, the scene's own space
    /// and what the options ask for.
    pub fn plan(&self) -> BakePlan {
        let space = self.former.map_or_else(|| self.input.space(), |former| former.space);
        let new_density = || density_of(&self.input.objects, space, self.options);
        let density = self.former.map_or_else(new_density, |former| former.density);
        let kept = if self.keeps_samples { SAMPLES_BYTES } else { 0 };
        let former = if self.former.is_some() { FORMER_SAMPLES_BYTES } else { 0 };
        BakePlan { space, density, sample_bytes: kept + former }
    }

    /// Compares the scene with that of the former bake. Returns the direct light of every covered texel that cannot
    /// have changed; an empty list without a former bake.
    pub fn known_direct_light(
        &mut self,
        sources: &Sources<'_>,
        texels: &CoveredTexels<'_>,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<Vec<Option<Direct>>, BakeError> {
        let Some(former) = self.former else { return Ok(Vec::new()) };
        let (objects, hashes) = (&self.input.objects, &self.hashes);
        let (changes, known) = monitor.run_interruptible(1.0, || {
            let changes = Changes::find(former, hashes, objects, sources, texels);
            let known = changes.known_direct_light(texels);
            (changes, known)
        })?;
        self.report = Some(RebakeReport {
            changed: changes.names.clone(),
            texels: texels.open().count(),
            relit: texels.open().filter(|(texel, _)| known[texel.place()].is_none()).count(),
            ..RebakeReport::default()
        });
        self.changes = Some(changes);
        Ok(known)
    }

    /// The light by bounces of the former bake that this one keeps, given the new scene's exchange with its form
    /// factors; `None` without a former bake.
    pub fn reused_gather(
        &mut self,
        sources: &Sources<'_>,
        texels: &CoveredTexels<'_>,
        direct: &DirectLight,
        exchange: &Exchange,
        factors: &FormFactors,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<(Option<&ReusedGather>, StageNotes), BakeError> {
        let Some(changes) = &self.changes else { return Ok((None, StageNotes::default())) };
        let change = monitor.run_interruptible(1.0, || {
            indirect_change::IndirectChange::new(sources, changes, texels, &direct.texels)
        })?;
        let (reused, notes) = change.kept(exchange, factors, &direct.local, self.options, monitor)?;
        Ok((Some(self.reused.insert(reused)), notes))
    }

    /// Takes down what was reused, and the samples for the next bake if they are requested. `exchange` is `None` where
    /// nothing bounces.
    pub fn keep_for_next_bake(
        &mut self,
        lit: &LitTexels<'_>,
        sources: &Sources<'_>,
        exchange: Option<&Exchange>,
        report: &BakeReport,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<(), BakeError> {
        if let Some(rebake) = self.report.as_mut().filter(|_| self.changes.is_some()) {
            let (open, mean) = (rebake.texels, report.mean_of_channels());
            let error = self.reused.as_ref().map_or(0.0, |reused| reused.error(open));
            rebake.gathered = self.reused.as_ref().map_or(0, |reused| open - reused.count());
            rebake.neglected = if mean > 0.0 { error / mean } else { 0.0 };
        }
        // Samples that were cut short would not be good enough for a later bake that has more time.
        if self.keeps_samples && report.ended != Ended::Time {
            let samples = monitor.run_interruptible(0.0, || self.samples_of(lit, sources, exchange))?;
            self.samples = Some(samples);
        }
        Ok(())
    }

    /// Completes the report; returns the samples for the next bake, if they are requested.
    pub fn finish(self, report: &mut BakeReport) -> Option<Samples> {
        report.content_hash = self.hashes.content.to_string();
        report.rebake = self.report;
        self.samples
    }

    fn samples_of(&self, lit: &LitTexels<'_>, sources: &Sources<'_>, exchange: Option<&Exchange>) -> Samples {
        let LitTexels { texels, .. } = lit;
        let new_prints;
        let prints = match &self.changes {
            Some(changes) => &changes.prints,
            None => {
                new_prints = ObjectFingerprints::new(sources, texels);
                &new_prints
            }
        };
        let exitance = exchange
            .map(|exchange| exchange.exitance_of(texels.scene, texels.layout.maps.len()))
            .unwrap_or_default();
        let of_object = |(index, texels): (usize, Vec<TexelSamples>)| ObjectSamples {
            hash: self.hashes.objects[index],
            name: self.input.objects[index].name.clone(),
            bounds: prints.bounds[index],
            emission: prints.emission[index],
            exitance: exitance.get(index).copied().unwrap_or_default(),
            layout: prints.layouts[index],
            texels,
        };
        let reuse_error = self.reused.as_ref().map_or(&[][..], |reused| &reused.reuse_error);
        let by_object = TexelSamples::by_object(lit, &prints.first_triangles, reuse_error);
        Samples(Content {
            content: self.hashes.content,
            identity: self.identity,
            sampling: self.hashes.sampling,
            lights: self.hashes.lights,
            sky: sources.sky,
            space: texels.scene.space,
            density: texels.layout.density,
            objects: by_object.into_iter().enumerate().map(of_object).collect(),
        })
    }
}
