//! The differences between a scene and the one that samples were taken of: objects that moved, came or went, with their
//! bounding boxes before and after, and the lights. Their effect on the light is estimated in
//! `direct_light_invalidation` and `indirect_change`.

use std::collections::HashMap;

use glam::Vec3;

use super::changed_box::ChangedBox;
use super::direct_light_invalidation::{ShadowVolumes, shadowed};
use super::fingerprints::{ObjectFingerprints, fingerprint};
use super::samples::{Content, ObjectSamples, TexelSamples};
use crate::BakeOptions;
use crate::content_hash::{ContentHash, Hashes};
use crate::coverage::CoveredTexels;
use crate::scene::{Canonical, SceneObject, density_of};
use crate::sources::{Direct, Sources};

/// With more changed objects than this the whole scene is baked.
const MAX_CHANGED: usize = 64;
/// The whole scene is baked if its density differs by more than this share, or if its centre has moved by more than
/// this share of its size.
const DENSITY_SLACK: f64 = 0.05;
const CENTER_SLACK: f64 = 0.25;

impl Content {
    /// Whether a bake can use these samples of a former one. `space` is the one that it would use without them.
    ///
    /// # Errors
    /// Why it cannot.
    pub fn check_use(
        &self,
        hashes: &Hashes,
        objects: &[SceneObject],
        space: Canonical,
        options: &BakeOptions,
    ) -> Result<(), String> {
        if self.sampling != hashes.sampling {
            return Err(
                "the former bake had other options (error, density, quality, seed, …) or another version of the baker".into()
            );
        }
        let moved = ((space.center - self.space.center) * self.space.scale).abs().max_element();
        if space.scale != self.space.scale || moved > CENTER_SLACK {
            return Err("the scene is larger or smaller than it was, or somewhere else".into());
        }
        let new = count_missing(&hashes.objects, self.objects.iter().map(|object| &object.hash));
        let gone = count_missing(self.objects.iter().map(|object| &object.hash), &hashes.objects);
        if new.max(gone) > MAX_CHANGED {
            return Err(format!("{} objects have changed or moved", new.max(gone)));
        }
        let density = density_of(objects, self.space, options);
        if (density / self.density - 1.0).abs() > DENSITY_SLACK {
            return Err("the density follows the scene's area, which has changed".into());
        }
        Ok(())
    }
}

/// How many of `these` are not among the others, counted with multiplicity.
fn count_missing<'h>(
    these: impl IntoIterator<Item = &'h ContentHash>,
    others: impl IntoIterator<Item = &'h ContentHash>,
) -> usize {
    let mut unmatched: HashMap<ContentHash, usize> = HashMap::new();
    others.into_iter().for_each(|other| *unmatched.entry(*other).or_default() += 1);
    let is_missing = |hash: &&ContentHash| match unmatched.get_mut(*hash) {
        Some(count) if *count > 0 => {
            *count -= 1;
            false
        }
        _ => true,
    };
    these.into_iter().filter(is_missing).count()
}

/// What differs from the former bake, and what the former bake knows of everything else.
pub(crate) struct Changes<'a> {
    pub former: &'a Content,
    /// Of the new scene.
    pub prints: ObjectFingerprints,
    /// Whether nothing differs, so that everything is kept as it is.
    pub nothing_changed: bool,
    /// Per object, whether it is new or has changed.
    pub changed: Vec<bool>,
    /// Of changed objects, before and after.
    pub boxes: Vec<ChangedBox>,
    /// Where these may block light, or may have blocked it.
    pub shadow_volumes: ShadowVolumes,
    /// Whether lights, the sky or emissive surfaces have changed, so that direct light may differ everywhere.
    pub lights_changed: bool,
    /// What has changed, for the report.
    pub names: Vec<String>,
    /// Per covered texel, its former samples, if it still shows the same surface.
    pub known: Vec<Option<&'a TexelSamples>>,
    /// Per texel of all maps, the irradiance of the former bake, W/m²; NaN where that is not known.
    pub former_light: Vec<Vec3>,
}

impl<'a> Changes<'a> {
    /// Compares a scene with that of a former bake.
    pub fn find(
        former: &'a Content,
        hashes: &Hashes,
        objects: &[SceneObject],
        sources: &Sources<'_>,
        texels: &CoveredTexels<'_>,
    ) -> Self {
        let prints = ObjectFingerprints::new(sources, texels);
        let mut by_hash: HashMap<ContentHash, Vec<&'a ObjectSamples>> = HashMap::new();
        // Lists are in reverse order, so that of several equal objects the first is popped first.
        for object in former.objects.iter().rev() {
            by_hash.entry(object.hash).or_default().push(object);
        }
        // Objects that share their mesh share their unwrap, which may be different although the object has not changed.
        let unchanged: Vec<Option<&'a ObjectSamples>> = hashes
            .objects
            .iter()
            .zip(&prints.layouts)
            .map(|(hash, layout)| by_hash.get_mut(hash)?.pop_if(|object| object.layout == *layout))
            .collect();
        let gone: Vec<&ObjectSamples> = former
            .objects
            .iter()
            .filter(|object| !unchanged.iter().flatten().any(|other| std::ptr::eq(*other, *object)))
            .collect();
        let changed: Vec<bool> = unchanged.iter().map(Option::is_none).collect();
        let differs = |(emission, former): (&u32, &Option<&ObjectSamples>)| {
            *emission != former.map_or(0, |former| former.emission)
        };
        let emitters_changed =
            prints.emission.iter().zip(&unchanged).any(differs) || gone.iter().any(|gone| gone.emission != 0);
        let lights_or_sky_changed = former.lights != hashes.lights;
        let after = prints.bounds.iter().zip(&changed).filter(|(_, changed)| **changed);
        let after = after.map(|(&bounds, _)| ChangedBox { bounds, former_exitance: None });
        let before = gone
            .iter()
            .map(|object| ChangedBox { bounds: object.bounds, former_exitance: Some(object.exitance) });
        let boxes: Vec<ChangedBox> = after.chain(before).filter(|b| !b.bounds.is_empty()).collect();
        let names = names(objects, &changed, &gone, lights_or_sky_changed);
        let (known, former_light) = known(texels, &prints.first_triangles, &unchanged);
        let nothing_changed = former.content == hashes.content;
        let lights_changed = emitters_changed || lights_or_sky_changed;
        let shadow_volumes = ShadowVolumes::new(sources, &boxes);
        Self {
            former,
            prints,
            nothing_changed,
            changed,
            boxes,
            shadow_volumes,
            lights_changed,
            names,
            known,
            former_light,
        }
    }

    /// Per covered texel, its former direct light, if that cannot have changed.
    pub fn known_direct_light(&self, texels: &CoveredTexels<'_>) -> Vec<Option<Direct>> {
        if self.lights_changed {
            return vec![None; texels.list.len()];
        }
        let unless_shadowed = |(known, is_shadowed): (&Option<&TexelSamples>, bool)| {
            known.filter(|_| !is_shadowed).map(|known| known.direct)
        };
        self.known.iter().zip(shadowed(texels, &self.shadow_volumes)).map(unless_shadowed).collect()
    }
}

/// The names of what has changed.
fn names(objects: &[SceneObject], changed: &[bool], gone: &[&ObjectSamples], lights: bool) -> Vec<String> {
    let mut names = Vec::new();
    for (object, _) in objects.iter().zip(changed).filter(|(_, changed)| **changed) {
        let was_there = gone.iter().any(|gone| gone.name == object.name);
        names.push(format!("{} ({})", object.name, if was_there { "changed" } else { "new" }));
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

/// The former samples of every covered texel that still shows the same surface, and the former irradiance per texel of
/// all maps. `first` holds each object's first triangle, `unchanged` the former samples of each object that has not
/// changed.
fn known<'a>(
    texels: &CoveredTexels<'_>,
    first: &[u32],
    unchanged: &[Option<&'a ObjectSamples>],
) -> (Vec<Option<&'a TexelSamples>>, Vec<Vec3>) {
    let layout = texels.layout;
    let mut light = vec![Vec3::NAN; layout.texels];
    for (map, object) in layout.maps.iter().zip(unchanged) {
        for texel in object.iter().flat_map(|object| &object.texels) {
            if texel.cell < map.width * map.height {
                light[map.first + texel.cell as usize] = texel.direct.total() + texel.bounced;
            }
        }
    }
    let known = texels
        .list
        .iter()
        .map(|texel| {
            let object = texel.map.place();
            let list = &unchanged[object].filter(|_| !texel.is_hidden())?.texels;
            let cell = texel.y * layout.maps[object].width + texel.x;
            let samples = &list[list.binary_search_by_key(&cell, |samples| samples.cell).ok()?];
            (samples.footprint == fingerprint(texel, first[object])).then_some(samples)
        })
        .collect();
    (known, light)
}
