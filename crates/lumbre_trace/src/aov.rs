//! Auxiliary pictures ("arbitrary output variables", AOVs) beside the picture itself: what is seen first, light by how it came and by whose it
//! is, what a pixel cost. Which there are and what they are called. Not how light falls to them, nor the files that they are written to.

use std::fmt;

use glam::DVec3;

/// An auxiliary picture that can be asked for.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Aov {
    /// Diffuse colour k_d O_d of the first surface, linear RGB; 0 where the background is.
    Albedo,
    /// Unit normal in the world of the first surface, as it is lit: towards the eye unless the scene says otherwise; averaged over a pixel's
    /// samples. 0 where the background is.
    Normal,
    /// Metres along the line of sight to the first surface through the pixel's middle; infinite where the background is.
    Depth,
    /// How many rays the pixel took, shadow rays too.
    Rays,
    /// Light that one surface at most has turned on its way to the eye, or all other light.
    Light(LightPart),
    /// The light of one source in the whole picture, or its direct or indirect part: of all lights and shining objects of that name
    /// together, or of `background`, `ambient` or `baked` light. Over all sources each part sums up to the picture's.
    Source {
        /// What the source is called.
        name: String,
        /// Which part; without it both.
        part: Option<LightPart>,
    },
    /// One such picture for each source that there is.
    EverySource {
        /// Which part; without it both.
        part: Option<LightPart>,
    },
}

/// Light by how it came.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LightPart {
    /// What shines itself, and what one surface reflects or refracts of it.
    Direct,
    /// What more than one surface has turned, and what stands for that: ambient light, lightmaps, irradiance volumes.
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

/// In place of a name: each.
const EACH: &str = "*";

impl Aov {
    /// The picture with that name, if there is one: `albedo`, `normal`, `depth`, `rays`, `direct`, `indirect` (or `bounced`), `light:NAME`,
    /// `direct:NAME`, `indirect:NAME`, and `*` as NAME for each.
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
            (_, Some(part), None) => Some(Self::Light(part)),
            (_, _, Some("")) => None,
            (_, Some(_), Some(source)) | ("light", None, Some(source)) => Some(match source {
                EACH => Self::EverySource { part },
                name => Self::Source { name: name.to_owned(), part },
            }),
            _ => None,
        }
    }

    /// Whether it is what is seen first.
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
            Self::Light(part) => f.write_str(part.name()),
            Self::Source { name, part } => write!(f, "{}:{name}", kind(part)),
            Self::EverySource { part } => write!(f, "{}:{EACH}", kind(part)),
        }
    }
}

/// An auxiliary picture, top row first.
#[derive(Clone, Debug, PartialEq)]
pub struct AovPicture {
    /// Which.
    pub aov: Aov,
    /// Its pixels.
    pub values: AovValues,
}

/// Pixels of an auxiliary picture.
#[derive(Clone, Debug, PartialEq)]
pub enum AovValues {
    /// Linear RGB: radiance in W/(m² sr), or a share of what falls in.
    Colors(Vec<DVec3>),
    /// Directions in the world.
    Directions(Vec<DVec3>),
    /// Metres, or counts.
    Numbers(Vec<f64>),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_they_are_written() {
        for name in
            ["albedo", "normal", "depth", "rays", "direct", "indirect", "light:lamp: left", "direct:*"]
        {
            let aov = Aov::from_name(name);
            assert_eq!(aov.map(|aov| aov.to_string()).as_deref(), Some(name));
        }
        assert_eq!(Aov::from_name("bounced"), Aov::from_name("indirect"));
        for name in ["", "light", "light:", "depth:lamp", "beauty"] {
            assert_eq!(Aov::from_name(name), None, "{name}");
        }
    }
}
