//! Which model is evaluated, and how often: the choices, not the equations.

use bevy_ecs::component::Component;

/// How often the lighting equation is evaluated on an object. As a component it overrides the scene's choice.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Shading {
    /// Once per polygon, at its centroid with the face's normal.
    Flat,
    /// At the vertices; colours are interpolated.
    Gouraud,
    /// At every fragment; normals are interpolated.
    #[default]
    Phong,
}

/// Where flat shading evaluates a polygon.
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

/// The specular model. As a component it overrides the scene's choice for one object.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum ReflectionModel {
    /// (r·v)^n, Phong 1975.
    #[default]
    Phong,
    /// (n·h)^n, the exponent as it stands (OpenGL).
    Blinn,
    /// (n·h)^(4n), equal to Phong's highlight in the plane of incidence.
    Blinn4n,
    /// (n·h)^(4 n cos θ_i), which keeps Phong's energy.
    BlinnMatched,
    /// D G F / (n·v), Blinn 1977 after Torrance and Sparrow.
    TorranceSparrow,
}

macro_rules! names {
    ($type:ident, $($variant:ident => $name:literal),+) => {
        impl $type {
            /// Every choice, in the order of the documentation.
            pub const ALL: &'static [Self] = &[$(Self::$variant),+];

            /// The name used in files and on the command line.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name),+ }
            }

            /// The choice with that name, if there is one.
            pub fn from_name(name: &str) -> Option<Self> {
                match name { $($name => Some(Self::$variant),)+ _ => None }
            }
        }
    };
}

names!(Shading, Flat => "flat", Gouraud => "gouraud", Phong => "phong");
names!(FlatRule, Centroid => "centroid", FirstVertex => "first-vertex", LastVertex => "last-vertex");
names!(ReflectionModel, Phong => "phong", Blinn => "blinn", Blinn4n => "blinn-4n",
    BlinnMatched => "blinn-matched", TorranceSparrow => "torrance-sparrow");

impl ReflectionModel {
    /// The feature that `shaders/optics/shade.wesl` compiles this model under.
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
}
