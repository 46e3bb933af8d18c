//! What a bake takes from a former one and leaves for the next. The stages of direct and gathered light get what
//! may be reused as an input; all others know nothing of it. Not the choice of what is kept: that is `choice`.

use super::changes::{Changes, ReusableBake};
use super::samples::{SampleCollector, Samples};
use crate::content_hash::{ContentHash, Hashes};
use crate::coverage::covered_texels::CoveredTexels;
use crate::final_gather::lit_texels::LitTexels;
use crate::final_gather::reused_gather::ReusedGather;
use crate::scene::{Canonical, SceneObject, StaticScene, density_of};
use crate::sources::light_sources::Sources;
use crate::{BakeOptions, BakeReport};
use glam::Vec3;

/// The former bake, if it can be used, and the identity of this one.
pub(crate) struct Reuse<'a> {
    hashes: Hashes,
    reusable: Option<ReusableBake<'a>>,
    /// Hash of everything that the bits of this bake follow from, former bakes included.
    pub identity: ContentHash,
}

impl<'a> Reuse<'a> {
    /// Decides whether the samples of a `former` bake can be used; the report says why not. `limited` says that memory is limited and samples take some
    /// of it, so that other patches may fit.
    pub fn new(
        former: Option<&'a Samples>,
        hashes: Hashes,
        limited: bool,
        input: &StaticScene,
        options: &BakeOptions,
        report: &mut BakeReport,
    ) -> Self {
        let reusable = ReusableBake::of(former, &hashes, input, options, report);
        let identity = reusable.as_ref().map_or(hashes.content, |former| former.identity(hashes.content));
        let identity = if limited { identity.made_from(&hashes.sampling) } else { identity };
        Self { hashes, reusable, identity }
    }

    /// Returns true if there is a former bake that can be used.
    pub fn is_possible(&self) -> bool {
        self.reusable.is_some()
    }

    /// The space that the bake works in: the former bake's, so that texels stay where they were.
    pub fn space(&self, input: &StaticScene) -> Canonical {
        self.reusable.as_ref().map_or_else(|| input.space(), |former| former.space)
    }

    /// Texels per canonical unit: those of the former bake, or what the options ask for.
    pub fn density(&self, input: &StaticScene, options: &BakeOptions) -> f64 {
        let density = self.reusable.as_ref().map(|former| former.density);
        density.unwrap_or_else(|| density_of(&input.objects, self.space(input), options))
    }

    /// Compares the scene with that of the former bake; `None` if there is none. The former bake is given up by that: its samples are then in the result.
    pub fn changes(
        &mut self,
        objects: &[SceneObject],
        sources: &Sources<'_>,
        texels: &CoveredTexels<'_>,
    ) -> Option<Changes<'a>> {
        let former = self.reusable.take()?;
        Some(Changes::find(&former, &self.hashes, objects, sources, texels))
    }

    /// The samples of this bake, for the next one. `exitance` holds the least and most of each object, or is empty.
    pub fn samples(
        &self,
        lit: &LitTexels<'_>,
        reused: Option<&ReusedGather>,
        objects: &[SceneObject],
        sources: &Sources<'_>,
        exitance: &[[Vec3; 2]],
    ) -> Samples {
        let collector = SampleCollector {
            scene: sources.scene,
            layout: lit.texels.layout,
            texels: &lit.texels.list,
            direct: &lit.direct.texels,
            gathered: &lit.indirect.gathered,
            bounced: &lit.indirect.light,
            reuse_error: reused.map_or(&[], |reused| &reused.reuse_error),
        };
        collector.samples(self.identity, &self.hashes, objects, sources, exitance)
    }
}
