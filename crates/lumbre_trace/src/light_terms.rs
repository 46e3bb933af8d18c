//! Light by where it comes from: every term that a sample sums up, with its source and with how many surfaces turned it on its way to the eye.
//! What auxiliary pictures of single lights are made of. Not the sum itself.

use glam::DVec3;
use smallvec::SmallVec;

/// What sends light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Source {
    /// A light of the scene, by its number.
    Light(usize),
    /// An object that shines, or shows its colour whatever the light, by its number.
    Object(usize),
    /// The background, the sky, the colour of the fog.
    Background,
    /// The ambient light of the scene as a whole.
    Ambient,
    /// Lightmaps and irradiance volumes, which do not say whose light they hold.
    Baked,
}

/// A part of a sample's radiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Term {
    pub source: Source,
    /// Surfaces that reflected or refracted it: 0 of what is seen as it shines, 1 of direct light, more of bounced light.
    pub turns: u32,
    /// W/(m² sr), as it arrives in the pixel.
    pub radiance: DVec3,
}

/// Turns of what is taken for bounced light without having been followed: ambient and baked light.
pub(crate) const BOUNCED: u32 = 2;

/// The terms of a sample, where they are wanted.
#[derive(Clone, Debug, Default)]
pub(crate) struct LightTerms {
    wanted: bool,
    list: SmallVec<[Term; 16]>,
}

impl LightTerms {
    /// None yet; all that come are forgotten unless they are `wanted`.
    pub fn new(wanted: bool) -> Self {
        Self { wanted, list: SmallVec::new() }
    }

    pub fn are_wanted(&self) -> bool {
        self.wanted
    }

    /// Adds a term.
    pub fn add(&mut self, source: Source, turns: u32, radiance: DVec3) {
        if self.wanted && radiance != DVec3::ZERO {
            self.list.push(Term { source, turns, radiance });
        }
    }

    /// How many there are: where those that come next begin.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Times a factor, all since there were so many.
    pub fn scale_since(&mut self, first: usize, factor: DVec3) {
        self.list[first..].iter_mut().for_each(|term| term.radiance *= factor);
    }

    /// Forgets them.
    pub fn clear(&mut self) {
        self.list.clear();
    }

    pub fn iter(&self) -> impl Iterator<Item = &Term> {
        self.list.iter()
    }
}
