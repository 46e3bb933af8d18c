//! Assigns the terms of a sample to the auxiliary pictures of light, by their sources and parts. The pictures
//! themselves accumulate in `film`.

use std::collections::BTreeSet;

use glam::DVec3;

use crate::TraceError;
use crate::aov::{Aov, LightPart};
use crate::light_terms::{Source, Term};
use crate::options::Integrator;
use crate::scene::{Object, Scene};

/// Names of the sources that are neither lights nor objects.
const BACKGROUND: &str = "background";
const AMBIENT: &str = "ambient";
const BAKED: &str = "baked";
/// The auxiliary pictures of light that are asked for, with the terms that belong to each.
#[derive(Clone, Debug, Default)]
pub(crate) struct LightAovs {
    pub aovs: Vec<Aov>,
    /// For each picture, its part and its sources; `None` means both parts and all sources.
    taken: Vec<(Option<LightPart>, Option<Vec<Source>>)>,
}

impl LightAovs {
    /// Selects the pictures of light from `asked` and resolves the names of their sources.
    ///
    /// # Errors
    /// [`TraceError::NoSuchSource`].
    pub fn new(asked: &[Aov], scene: &Scene, integrator: Integrator) -> Result<Self, TraceError> {
        let named = named_sources(scene, integrator);
        let mut found = Self::default();
        for aov in asked {
            match aov {
                Aov::Light(part) => found.take(aov.clone(), Some(*part), None),
                Aov::Source { name, part } => {
                    let sources = sources_of(&named, name);
                    if sources.is_empty() {
                        let known: BTreeSet<&str> = named.iter().map(|(name, _)| name.as_str()).collect();
                        let known = known.into_iter().map(|name| format!("\"{name}\""));
                        let known = known.collect::<Vec<_>>().join(", ");
                        return Err(TraceError::NoSuchSource { name: name.clone(), known });
                    }
                    found.take(aov.clone(), *part, Some(sources));
                }
                Aov::EverySource { part } => {
                    let mut told = BTreeSet::new();
                    for (name, _) in named.iter().filter(|(name, _)| told.insert(name.clone())) {
                        let own = Aov::Source { name: name.clone(), part: *part };
                        found.take(own, *part, Some(sources_of(&named, name)));
                    }
                }
                Aov::Albedo | Aov::Normal | Aov::Depth | Aov::Rays | Aov::StandardError => {}
            }
        }
        Ok(found)
    }

    fn take(&mut self, aov: Aov, part: Option<LightPart>, sources: Option<Vec<Source>>) {
        if !self.aovs.contains(&aov) {
            self.aovs.push(aov);
            self.taken.push((part, sources));
        }
    }

    pub fn are_wanted(&self) -> bool {
        !self.aovs.is_empty()
    }

    /// Adds the terms of a sample, times its weight, to the sums of a pixel in all pictures.
    pub fn add<'t>(&self, sums: &mut Vec<DVec3>, terms: impl Iterator<Item = &'t Term>, weight: f64) {
        sums.resize(self.aovs.len(), DVec3::ZERO);
        for term in terms {
            for (sum, (part, sources)) in sums.iter_mut().zip(&self.taken) {
                let of_part = part.is_none_or(|part| part.holds(term.turns));
                if of_part && sources.as_ref().is_none_or(|sources| sources.contains(&term.source)) {
                    *sum += term.radiance * weight;
                }
            }
        }
    }
}

/// Returns every source that may contribute to the picture, with its name. Several sources may share a name.
fn named_sources(scene: &Scene, integrator: Integrator) -> Vec<(String, Source)> {
    let lights =
        scene.lights.iter().enumerate().map(|(number, placed)| (placed.name.clone(), Source::Light(number)));
    let shining = |object: &Object| object.glows() || object.material.unlit;
    let objects = scene.objects.iter().enumerate().filter(|(_, object)| shining(object));
    let objects = objects.map(|(number, object)| (object.name.clone(), Source::Object(number)));
    let others = [
        (BACKGROUND, Source::Background, true),
        // Paths trace the light that ambient and baked light stand for.
        (AMBIENT, Source::Ambient, integrator == Integrator::Whitted),
        (BAKED, Source::Baked, integrator == Integrator::Whitted && scene.has_baked_light()),
    ];
    let others = others.into_iter().filter(|(.., there)| *there);
    lights.chain(objects).chain(others.map(|(name, source, _)| (name.to_owned(), source))).collect()
}

fn sources_of(named: &[(String, Source)], wanted: &str) -> Vec<Source> {
    named.iter().filter(|(name, _)| name == wanted).map(|(_, source)| *source).collect()
}
