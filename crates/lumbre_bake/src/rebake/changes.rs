//! What differs between a scene and the one that samples are of: objects that moved, came or went, with the boxes around them then and now,
//! and the lights. Not what that does to the light.

use super::fingerprints::bounds;
use crate::rebake::changed_box::ChangedBox;
use crate::rebake::fingerprints::{emission, layouts};
use std::collections::HashMap;

use glam::Vec3;

use super::direct_light_invalidation::shadowed;
use super::fingerprints::{fingerprint, first_triangles};
use super::samples::{Content, ObjectSamples, Samples, TexelSamples};
use crate::content_hash::{ContentHash, Hashes};
use crate::coverage::covered_texels::CoveredTexels;
use crate::coverage::footprint::Texel;
use crate::scene::{BakeScene, Canonical, LightmapLayout, SceneObject, StaticScene, density_of};
use crate::sources::direct::Direct;
use crate::sources::light_sources::Sources;
use crate::{BakeOptions, BakeReport, RebakeReport};

/// More changed objects than this are as good as a new scene.
const MAX_CHANGED: usize = 64;
/// The density and the middle of a scene may be off by so much of the density and of the scene's size before everything is laid out anew.
const DENSITY_SLACK: f64 = 0.05;
const CENTER_SLACK: f64 = 0.25;

/// A former bake whose samples can be used, before the scene is laid out.
pub(crate) struct ReusableBake<'a> {
    pub former: &'a Content,
    pub space: Canonical,
    pub density: f64,
}

impl<'a> ReusableBake<'a> {
    /// What of a former bake can be used; the report says why where nothing can.
    pub fn of(
        samples: Option<&'a Samples>,
        hashes: &Hashes,
        input: &StaticScene,
        options: &BakeOptions,
        report: &mut BakeReport,
    ) -> Option<Self> {
        match Self::new(samples?, hashes, &input.objects, input.space(), options) {
            Ok(reusable) => Some(reusable),
            Err(whole) => {
                report.rebake = Some(RebakeReport { whole, ..RebakeReport::default() });
                None
            }
        }
    }

    /// In `space`, where a whole bake would work.
    ///
    /// # Errors
    /// Why they cannot be used.
    fn new(
        samples: &'a Samples,
        hashes: &Hashes,
        objects: &[SceneObject],
        space: Canonical,
        options: &BakeOptions,
    ) -> Result<Self, String> {
        let former = &samples.0;
        if former.sampling != hashes.sampling {
            return Err(
                "the former bake had other options (error, density, quality, seed, …) or another version of the baker".into()
            );
        }
        let moved = ((space.center - former.space.center) * former.space.scale).abs().max_element();
        if space.scale != former.space.scale || moved > CENTER_SLACK {
            return Err("the scene is larger or smaller than it was, or somewhere else".into());
        }
        let here = missing(&hashes.objects, former.objects.iter().map(|object| &object.hash));
        let gone = missing(former.objects.iter().map(|object| &object.hash), &hashes.objects);
        if here.max(gone) > MAX_CHANGED {
            return Err(format!("{} objects have changed or moved", here.max(gone)));
        }
        let density = density_of(objects, former.space, options);
        if (density / former.density - 1.0).abs() > DENSITY_SLACK {
            return Err("the density follows the scene's area, which has changed".into());
        }
        Ok(Self { former, space: former.space, density: former.density })
    }

    /// Of a bake of `content` that keeps these. Where nothing has changed, everything is kept, and so are its bits.
    pub fn identity(&self, content: ContentHash) -> ContentHash {
        if self.former.content == content {
            self.former.identity
        } else {
            content.made_from(&self.former.identity)
        }
    }
}

/// How many of the one are not among the other.
fn missing<'h>(
    these: impl IntoIterator<Item = &'h ContentHash>,
    others: impl IntoIterator<Item = &'h ContentHash>,
) -> usize {
    let mut left: HashMap<ContentHash, usize> = HashMap::new();
    others.into_iter().for_each(|other| *left.entry(*other).or_default() += 1);
    let is_missing = |hash: &&ContentHash| match left.get_mut(*hash) {
        Some(count) if *count > 0 => {
            *count -= 1;
            false
        }
        _ => true,
    };
    these.into_iter().filter(is_missing).count()
}

/// What differs, and what is known of the rest.
pub(crate) struct Changes<'a> {
    pub former: &'a Content,
    /// Nothing differs: all is kept as it is.
    pub none: bool,
    /// Per object, whether it is new, or another than it was.
    pub changed: Vec<bool>,
    pub boxes: Vec<ChangedBox>,
    /// Direct light is different everywhere.
    pub lights: bool,
    /// For people.
    pub names: Vec<String>,
    /// Per covered texel, its samples, if it shows what it showed.
    pub known: Vec<Option<&'a TexelSamples>>,
    /// Per covered texel, the direct light that cannot have changed.
    pub known_direct: Vec<Option<Direct>>,
    /// Per texel of all maps, the irradiance that the former bake found there, W/m²; NaN where it is not known.
    pub former_light: Vec<Vec3>,
}

impl<'a> Changes<'a> {
    /// Finds them.
    pub fn find(
        reusable: &ReusableBake<'a>,
        hashes: &Hashes,
        objects: &[SceneObject],
        sources: &Sources<'_>,
        texels: &CoveredTexels<'_>,
    ) -> Self {
        let (scene, former) = (sources.scene, reusable.former);
        let CoveredTexels { layout, list: texels, charts, .. } = texels;
        let mut by_hash: HashMap<ContentHash, Vec<&'a ObjectSamples>> = HashMap::new();
        // Of several that are the same, the first is taken first.
        for object in former.objects.iter().rev() {
            by_hash.entry(object.hash).or_default().push(object);
        }
        // Objects that share their mesh share their unwrap, which may be another although they have not changed.
        let same: Vec<Option<&'a ObjectSamples>> = hashes
            .objects
            .iter()
            .zip(layouts(scene, layout))
            .map(|(hash, layout)| by_hash.get_mut(hash)?.pop_if(|object| object.layout == layout))
            .collect();
        let gone: Vec<&ObjectSamples> = former
            .objects
            .iter()
            .filter(|object| !same.iter().flatten().any(|kept| std::ptr::eq(*kept, *object)))
            .collect();
        let changed: Vec<bool> = same.iter().map(Option::is_none).collect();
        let shines = emission(scene, sources, layout);
        let of_lamps =
            shines.iter().zip(&same).any(|(own, same)| *own != same.map_or(0, |same| same.emission))
                || gone.iter().any(|gone| gone.emission != 0);
        let of_lights = former.lights != hashes.lights;
        let bounds = bounds(scene, layout);
        let now = (0..objects.len()).filter(|&object| changed[object]);
        let now = now.map(|object| ChangedBox { low: bounds[object].0, high: bounds[object].1, left: None });
        let then = gone.iter().map(|o| ChangedBox { low: o.low, high: o.high, left: Some(o.exitance) });
        let boxes: Vec<ChangedBox> = now.chain(then).filter(|b| b.low.cmple(b.high).all()).collect();
        let names = names(objects, &changed, &gone, of_lights);
        let (known, former_light) = known(scene, layout, texels, &same);
        let none = former.content == hashes.content;
        let lights = of_lamps || of_lights;
        let of = |(known, shadowed): (&Option<&TexelSamples>, bool)| {
            known.filter(|_| !shadowed).map(|known| known.direct)
        };
        let known_direct = match lights {
            true => vec![None; texels.len()],
            false => known.iter().zip(shadowed(sources, texels, charts, &boxes)).map(of).collect(),
        };
        Self { former, none, changed, boxes, lights, names, known, known_direct, former_light }
    }

    /// Covered texels whose direct light is found anew.
    pub fn relit(&self, texels: &[Texel]) -> usize {
        let pairs = texels.iter().zip(&self.known_direct);
        pairs.filter(|(texel, known)| known.is_none() && !texel.is_hidden()).count()
    }
}

/// What is different, by name.
fn names(objects: &[SceneObject], changed: &[bool], gone: &[&ObjectSamples], lights: bool) -> Vec<String> {
    let mut names = Vec::new();
    for (object, _) in objects.iter().zip(changed).filter(|(_, changed)| **changed) {
        let before = gone.iter().any(|gone| gone.name == object.name);
        names.push(format!("{} ({})", object.name, if before { "changed" } else { "new" }));
    }
    for gone in gone.iter().filter(|gone| {
        !objects.iter().zip(changed).any(|(object, changed)| *changed && object.name == gone.name)
    }) {
        names.push(format!("{} (gone)", gone.name));
    }
    if lights {
        names.push("the lights".into());
    }
    names
}

/// The samples of every covered texel that shows what it showed; and the light of all, per texel of all maps.
fn known<'a>(
    scene: &BakeScene,
    layout: &LightmapLayout,
    texels: &[Texel],
    same: &[Option<&'a ObjectSamples>],
) -> (Vec<Option<&'a TexelSamples>>, Vec<Vec3>) {
    let first = first_triangles(scene, layout);
    let mut light = vec![Vec3::NAN; layout.texels];
    for (map, object) in layout.maps.iter().zip(same) {
        for texel in object.iter().flat_map(|object| &object.texels) {
            if texel.cell < map.width * map.height {
                light[map.first + texel.cell as usize] = texel.direct.total() + texel.bounced;
            }
        }
    }
    let known = texels
        .iter()
        .map(|texel| {
            let object = texel.object as usize;
            let list = &same[object].filter(|_| !texel.is_hidden())?.texels;
            let cell = texel.y * layout.maps[object].width + texel.x;
            let own = &list[list.binary_search_by_key(&cell, |own| own.cell).ok()?];
            (own.footprint == fingerprint(texel, first[object])).then_some(own)
        })
        .collect();
    (known, light)
}
