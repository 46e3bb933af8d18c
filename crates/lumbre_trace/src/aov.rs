//! Auxiliary pictures beside the main one ("arbitrary output variables", AOVs): the first visible surface,
//! light by its path and by its source, and cost per pixel. This module defines them and their names; which
//! light belongs to each is in `light_aovs`, and no files are written here.

use std::fmt;

use glam::DVec3;

/// An auxiliary picture that can be requested.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Aov {
    /// Diffuse colour k_d O_d of the first surface, linear RGB, averaged over a pixel's samples; 0 where the
    /// background is visible.
    Albedo,
    /// Unit shading normal of the first surface in world space, towards the eye unless the scene's two-sided
    /// rule says otherwise, averaged over a pixel's samples; 0 where the background is visible.
    Normal,
    /// Distance in metres along the camera's viewing axis to the first surface through the pixel's centre;
    /// infinite where the background is visible.
    Depth,
    /// Number of rays that the pixel took, shadow rays included.
    Rays,
    /// Standard error of each pixel's radiance, linear RGB, estimated from the differences between the passes
    /// of path tracing; infinite where a pixel has too few samples to state it, as those of ray trees have.
    StandardError,
    /// Direct light, or all other light.
    Light(LightPart),
    /// The light of one source, or its direct or indirect part. A source is all lights and emissive objects
    /// of one name together, or one of `background`, `ambient` and `baked`. Summed over all sources, each
    /// part gives that part of the picture.
    Source {
        /// The name of the source.
        name: String,
        /// Which part; `None` means both.
        part: Option<LightPart>,
    },
    /// One picture of [`Source`](Self::Source) for each source of the scene.
    EverySource {
        /// Which part; `None` means both.
        part: Option<LightPart>,
    },
}

/// Light classified by its path to the eye.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LightPart {
    /// Emission that is seen directly, and light that one surface has reflected or refracted.
    Direct,
    /// Light that more than one surface has reflected or refracted, and what stands for it: ambient light,
    /// lightmaps and irradiance volumes.
    Indirect,
}

impl LightPart {
    fn name(self) -> &'static str {
        match self {
            Self::Direct => "direct",
            Self::Indirect => "indirect",
        }
    }

    pub(crate) fn holds(self, turns: u32) -> bool {
        (self == Self::Direct) == (turns <= 1)
    }
}

/// Stands for the names of all sources.
const EACH: &str = "*";

impl Aov {
    /// Returns the picture with that name, or `None` if there is none: `albedo`, `normal`, `depth`, `rays`,
    /// `standard-error`, `direct`, `indirect` (or `bounced`), `light:NAME`, `direct:NAME`, `indirect:NAME`,
    /// where `*` as NAME means every source.
    pub fn from_name(name: &str) -> Option<Self> {
        let (kind, source) = name.split_once(':').map_or((name, None), |(kind, source)| (kind, Some(source)));
        let part = match kind {
            "direct" => Some(LightPart::Direct),
            "indirect" | "bounced" => Some(LightPart::Indirect),
            _ => None,
        };
        match (kind, part, source) {
            ("albedo", _, None) => Some(Self::Albedo),
            ("normal", _, None) => Some(Self::Normal),
            ("depth", _, None) => Some(Self::Depth),
            ("rays", _, None) => Some(Self::Rays),
            ("standard-error", _, None) => Some(Self::StandardError),
            (_, Some(part), None) => Some(Self::Light(part)),
            (_, _, Some("")) => None,
            (_, Some(_), Some(source)) | ("light", None, Some(source)) => Some(match source {
                EACH => Self::EverySource { part },
                name => Self::Source { name: name.to_owned(), part },
            }),
            _ => None,
        }
    }

    /// Returns true for a property of the first visible surface.
    pub(crate) fn is_first_hit(&self) -> bool {
        matches!(self, Self::Albedo | Self::Normal | Self::Depth)
    }
}

impl fmt::Display for Aov {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = |part: &Option<LightPart>| part.map_or("light", LightPart::name);
        match self {
            Self::Albedo => f.write_str("albedo"),
            Self::Normal => f.write_str("normal"),
            Self::Depth => f.write_str("depth"),
            Self::Rays => f.write_str("rays"),
            Self::StandardError => f.write_str("standard-error"),
            Self::Light(part) => f.write_str(part.name()),
            Self::Source { name, part } => write!(f, "{}:{name}", kind(part)),
            Self::EverySource { part } => write!(f, "{}:{EACH}", kind(part)),
        }
    }
}

/// An auxiliary picture, top row first.
#[derive(Clone, Debug, PartialEq)]
pub struct AovPicture {
    /// What it shows.
    pub aov: Aov,
    /// Its pixels.
    pub values: AovValues,
}

/// Pixels of an auxiliary picture.
#[derive(Clone, Debug, PartialEq)]
pub enum AovValues {
    /// Linear RGB: radiance in W/(m² sr), or an albedo.
    Colors(Vec<DVec3>),
    /// Directions in world space.
    Directions(Vec<DVec3>),
    /// Metres, or counts.
    Numbers(Vec<f64>),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_they_are_written() {
        for name in [
            "albedo",
            "normal",
            "depth",
            "rays",
            "standard-error",
            "direct",
            "indirect",
            "light:lamp: left",
            "direct:*",
        ] {
            let aov = Aov::from_name(name);
            assert_eq!(aov.map(|aov| aov.to_string()).as_deref(), Some(name));
        }
        assert_eq!(Aov::from_name("bounced"), Aov::from_name("indirect"));
        for name in ["", "light", "light:", "depth:lamp", "beauty"] {
            assert_eq!(Aov::from_name(name), None, "{name}");
        }
    }
}
