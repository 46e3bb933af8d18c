//! Which reflection model is evaluated and how often. These are the choices; the equations are in their own
//! modules.

use std::fmt;
use std::str::FromStr;

use bevy_ecs::component::Component;

use crate::ErrorBound;

/// How often the lighting equation is evaluated on an object. As a component, it overrides the scene's choice.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Shading {
    /// Once per polygon, at its centroid with the face's normal.
    Flat,
    /// At the vertices, with the colours interpolated.
    Gouraud,
    /// At every fragment, with the normals interpolated.
    #[default]
    Phong,
    /// As rarely as an error bound allows: each object in view gets the cheapest of the other three for which an
    /// estimate made in advance keeps every pixel within this error of Phong shading. No shader implements this
    /// variant; it is resolved to one of the others before anything is drawn.
    Auto {
        /// The largest difference of any pixel and channel, in exposed linear radiance between 0 and 1, the
        /// display's white.
        max_error: ErrorBound,
    },
}

/// Where flat shading evaluates the lighting of a polygon.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum FlatRule {
    /// At its centroid with the face's normal: document \[M\].
    #[default]
    Centroid,
    /// At its first vertex with that vertex's normal and colour: document \[I\].
    FirstVertex,
    /// At its last vertex with that vertex's normal and colour: OpenGL's `GL_FLAT`.
    LastVertex,
}

/// The specular reflection model. As a component, it overrides the scene's choice for one object.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum ReflectionModel {
    /// (r·v)^n, Phong 1975.
    #[default]
    Phong,
    /// (n·h)^n, with the exponent used unchanged (OpenGL).
    Blinn,
    /// (n·h)^(4n), equal to Phong's highlight in the plane of incidence.
    Blinn4n,
    /// (n·h)^(4 n cos θ_i), which keeps Phong's energy.
    BlinnMatched,
    /// D G F / (n·v), Blinn 1977 after Torrance and Sparrow.
    TorranceSparrow,
}

macro_rules! names {
    ($type:ident, $($variant:ident => $name:literal),+ $(; $other:ident { .. } => $other_name:literal)?) => {
        impl $type {
            /// Every variant without parameters, in the order of the documentation.
            pub const ALL: &'static [Self] = &[$(Self::$variant),+];

            /// The name used in files and on the command line.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)+ $(Self::$other { .. } => $other_name)? }
            }

            /// Returns the variant with that name, or `None`. Variants with parameters are not found.
            pub fn from_name(name: &str) -> Option<Self> {
                match name { $($name => Some(Self::$variant),)+ _ => None }
            }
        }
    };
}

names!(Shading, Flat => "flat", Gouraud => "gouraud", Phong => "phong"; Auto { .. } => "auto");
names!(FlatRule, Centroid => "centroid", FirstVertex => "first-vertex", LastVertex => "last-vertex");
names!(ReflectionModel, Phong => "phong", Blinn => "blinn", Blinn4n => "blinn-4n",
    BlinnMatched => "blinn-matched", TorranceSparrow => "torrance-sparrow");

impl fmt::Display for Shading {
    /// Formats it as in files and on the command line: `phong`, `auto:0.01`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto { max_error } => write!(f, "{}:{}", self.name(), max_error.get()),
            _ => f.write_str(self.name()),
        }
    }
}

/// The text does not name a shading.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("use one of flat, gouraud, phong, or auto:ERROR with an error above 0 and at most 1, like auto:0.01")]
pub struct NoShading;

impl FromStr for Shading {
    type Err = NoShading;

    fn from_str(text: &str) -> Result<Self, NoShading> {
        if let Some(error) = text.strip_prefix("auto:") {
            let max_error = error.trim().parse().ok().and_then(ErrorBound::new);
            return max_error.map(|max_error| Self::Auto { max_error }).ok_or(NoShading);
        }
        Self::from_name(text).ok_or(NoShading)
    }
}

impl ReflectionModel {
    /// The feature under which `shaders/optics/shade.wesl` compiles this model.
    pub fn shader_feature(self) -> &'static str {
        match self {
            Self::Phong => "REFLECTION_PHONG",
            Self::Blinn => "REFLECTION_BLINN",
            Self::Blinn4n => "REFLECTION_BLINN_4N",
            Self::BlinnMatched => "REFLECTION_BLINN_MATCHED",
            Self::TorranceSparrow => "REFLECTION_TORRANCE_SPARROW",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_leads_back() {
        for &model in ReflectionModel::ALL {
            assert_eq!(ReflectionModel::from_name(model.name()), Some(model));
        }
        for &shading in Shading::ALL {
            assert_eq!(Shading::from_name(shading.name()), Some(shading));
        }
        for &rule in FlatRule::ALL {
            assert_eq!(FlatRule::from_name(rule.name()), Some(rule));
        }
        assert_eq!(ReflectionModel::from_name("Phong"), None);
    }

    #[test]
    fn a_shading_is_read_as_it_is_written() {
        let auto = |max_error| Shading::Auto { max_error: ErrorBound::new(max_error).unwrap() };
        for shading in [Shading::Flat, Shading::Phong, auto(0.01), auto(1.0), auto(1e-6)] {
            assert_eq!(shading.to_string().parse(), Ok(shading));
        }
        assert_eq!(auto(0.01).to_string(), "auto:0.01");
        for text in ["auto", "auto:", "auto:0", "auto:-0.1", "auto:1.5", "auto:NaN", "auto:x", "Phong", ""] {
            assert_eq!(text.parse::<Shading>(), Err(NoShading), "{text}");
        }
    }
}
