//! What a bake takes from a former one and leaves for the next. The stages of direct and gathered light get what
//! may be reused as an input; all others know nothing of it. Not the choice of what is kept: that is `choice`.

use super::changes::Changes;
use super::fingerprints::{bounds, emission, layouts};
use super::samples::{Content, ObjectSamples, Samples, TexelSamples};
use crate::content_hash::{ContentHash, Hashes};
use crate::coverage::CoveredTexels;
use crate::final_gather::{LitTexels, ReusedGather};
use crate::scene::{Canonical, SceneObject, StaticScene, density_of};
use crate::sources::Sources;
use crate::{BakeOptions, RebakeReport};
use glam::Vec3;

/// The former bake, if it can be used, and the identity of this one.
pub(crate) struct Reuse<'a> {
    hashes: Hashes,
    former: Option<&'a Content>,
    /// Why there was a former bake, but it cannot be used.
    refusal: Option<String>,
    /// Hash of everything that the bits of this bake follow from, former bakes included.
    pub identity: ContentHash,
}

impl<'a> Reuse<'a> {
    /// Decides whether the samples of a `former` bake can be used. `limited` says that memory is limited and samples take some
    /// of it, so that other patches may fit.
    pub fn new(
        former: Option<&'a Samples>,
        hashes: Hashes,
        limited: bool,
        input: &StaticScene,
        options: &BakeOptions,
    ) -> Self {
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
        let identity = if limited { identity.made_from(&hashes.sampling) } else { identity };
        Self { hashes, former, refusal, identity }
    }

    /// Hash of what is baked.
    pub fn content_hash(&self) -> ContentHash {
        self.hashes.content
    }

    /// The report on a former bake that cannot be used.
    pub fn refusal(&self) -> Option<RebakeReport> {
        self.refusal.clone().map(|whole| RebakeReport { whole, ..RebakeReport::default() })
    }

    /// Returns true if there is a former bake that can be used.
    pub fn is_possible(&self) -> bool {
        self.former.is_some()
    }

    /// The space that the bake works in: the former bake's, so that texels stay where they were.
    pub fn space(&self, input: &StaticScene) -> Canonical {
        self.former.map_or_else(|| input.space(), |former| former.space)
    }

    /// Texels per canonical unit: those of the former bake, or what the options ask for.
    pub fn density(&self, input: &StaticScene, options: &BakeOptions) -> f64 {
        self.former
            .map_or_else(|| density_of(&input.objects, self.space(input), options), |former| former.density)
    }

    /// Compares the scene with that of the former bake; `None` if there is none.
    pub fn changes(
        &self,
        objects: &[SceneObject],
        sources: &Sources<'_>,
        texels: &CoveredTexels<'_>,
    ) -> Option<Changes<'a>> {
        Some(Changes::find(self.former?, &self.hashes, objects, sources, texels))
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
        let LitTexels { texels, .. } = lit;
        let (bounds, emission, layouts) = (bounds(texels), emission(sources, texels), layouts(texels));
        let of_object = |(index, texels): (usize, Vec<TexelSamples>)| ObjectSamples {
            hash: self.hashes.objects[index],
            name: objects[index].name.clone(),
            bounds: bounds[index],
            emission: emission[index],
            exitance: exitance.get(index).copied().unwrap_or_default(),
            layout: layouts[index],
            texels,
        };
        let by_object = TexelSamples::by_object(lit, reused.map_or(&[], |reused| &reused.reuse_error));
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
