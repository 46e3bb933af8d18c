//! The passes that draw lit surfaces, and which of them draws an object. Which passes a frame has follows
//! from the number of their objects (`facts`).

use lumbre_optics::AlphaMode;
use lumbre_scene::ObjectTraits;

/// The pass that draws an object. The passes run in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) enum LitPass {
    Lightmap,
    Forward,
    Refraction,
    Transparent,
}

impl LitPass {
    /// All passes in this order.
    pub const ALL: [Self; 4] = [Self::Lightmap, Self::Forward, Self::Refraction, Self::Transparent];

    /// Returns the name of the pass in plans.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lightmap => "lightmap",
            Self::Forward => "forward",
            Self::Refraction => "refractive surfaces",
            Self::Transparent => "transparent",
        }
    }

    /// Returns the pass of an object. `lightmaps` and `refraction` say whether these are used.
    pub fn of(traits: &ObjectTraits, lightmaps: bool, refraction: bool) -> Self {
        match (traits.alpha_mode, refraction && traits.refracts, lightmaps && traits.is_lit_by_lightmap()) {
            (AlphaMode::Blend, ..) => Self::Transparent,
            (_, true, _) => Self::Refraction,
            (_, _, true) => Self::Lightmap,
            (_, _, false) => Self::Forward,
        }
    }
}
