//! The passes that draw lit surfaces, and which of them draws an object. Not which exist in a frame: that follows from how many objects each has (`facts`).

use lumbre_optics::AlphaMode;
use lumbre_scene::ObjectTraits;

/// The pass that draws an object; in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) enum LitPass {
    Lightmap,
    Forward,
    Refraction,
    Transparent,
}

impl LitPass {
    /// Every one, in this order.
    pub const ALL: [Self; 4] = [Self::Lightmap, Self::Forward, Self::Refraction, Self::Transparent];

    /// The name of the pass in plans.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lightmap => "lightmap",
            Self::Forward => "forward",
            Self::Refraction => "refractive surfaces",
            Self::Transparent => "transparent",
        }
    }

    /// The pass of an object, where lightmaps are used or not, and refraction is.
    pub fn of(traits: &ObjectTraits, lightmaps: bool, refraction: bool) -> Self {
        match (traits.alpha_mode, refraction && traits.refracts, lightmaps && traits.is_lit_by_lightmap()) {
            (AlphaMode::Blend, ..) => Self::Transparent,
            (_, true, _) => Self::Refraction,
            (_, _, true) => Self::Lightmap,
            (_, _, false) => Self::Forward,
        }
    }
}
