//! The terms that a sample's radiance is the sum of, each with its source and with the number of surfaces on
//! its way to the eye. Auxiliary pictures of single lights are built from them; the sum itself is not
//! computed here.

use std::ops::Range;

use glam::DVec3;
use smallvec::SmallVec;

/// What emits light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Source {
    /// A light of the scene, by its index.
    Light(usize),
    /// An emissive or unlit object, by its index.
    Object(usize),
    /// The background, the sky and the colour of the fog.
    Background,
    /// The scene's global ambient light.
    Ambient,
    /// Lightmaps and irradiance volumes, which do not record whose light they hold.
    Baked,
}

/// One part of a sample's radiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Term {
    pub source: Source,
    /// Surfaces that reflected or refracted it: 0 for emission that is seen directly, 1 for direct light,
    /// more for indirect light.
    pub turns: u32,
    /// W/(m² sr), as it contributes to the pixel.
    pub radiance: DVec3,
}

/// Number of turns of light that stands for indirect light without having been traced: ambient and baked
/// light.
pub(crate) const BOUNCED: u32 = 2;

/// The terms of a sample, if they are wanted.
#[derive(Clone, Debug, Default)]
pub(crate) struct LightTerms {
    wanted: bool,
    list: SmallVec<[Term; 16]>,
}

impl LightTerms {
    /// Creates an empty list, which discards all terms that are added unless they are `wanted`.
    pub fn new(wanted: bool) -> Self {
        Self { wanted, list: SmallVec::new() }
    }

    pub fn are_wanted(&self) -> bool {
        self.wanted
    }

    pub fn add(&mut self, source: Source, turns: u32, radiance: DVec3) {
        if self.wanted && radiance != DVec3::ZERO {
            self.list.push(Term { source, turns, radiance });
        }
    }

    /// Returns the number of terms, which is the index of the next one.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Multiplies the terms with some indices by a factor.
    pub fn scale(&mut self, terms: Range<usize>, factor: DVec3) {
        self.list[terms].iter_mut().for_each(|term| term.radiance *= factor);
    }

    /// Removes all terms.
    pub fn clear(&mut self) {
        self.list.clear();
    }

    pub fn iter(&self) -> impl Iterator<Item = &Term> {
        self.list.iter()
    }
}
