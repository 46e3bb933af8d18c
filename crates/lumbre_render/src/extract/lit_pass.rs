//! The passes that draw lit surfaces, and which of them draws an object. Not which exist in a frame: that follows from how many objects each has (`facts`).

use lumbre_optics::AlphaMode;
use lumbre_scene::ObjectTraits;

/// The pass that draws an object; in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) enum LitPass {
    Lightmap,
    Forward,
    Transparent,
}

impl LitPass {
    /// Every one, in this order.
    pub const ALL: [Self; 3] = [Self::Lightmap, Self::Forward, Self::Transparent];

    /// The name of the pass in plans.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lightmap => "lightmap",
            Self::Forward => "forward",
            Self::Transparent => "transparent",
        }
    }

    /// The pass of an object, where lightmaps are used or not.
    pub fn of(traits: &ObjectTraits, lightmaps: bool) -> Self {
        match (traits.alpha_mode, lightmaps && traits.is_lit_by_lightmap()) {
            (AlphaMode::Blend, _) => Self::Transparent,
            (_, true) => Self::Lightmap,
            (_, false) => Self::Forward,
        }
    }
}
