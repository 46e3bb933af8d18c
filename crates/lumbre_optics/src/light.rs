//! The light component: what a light emits and how it spreads. Its position and direction are its entity's
//! transform. The equations are in the neighbouring files.

use bevy_ecs::component::Component;
use glam::Vec3;

use crate::{Attenuation, SpotCone};

/// What kind of source the light comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightKind {
    /// From everywhere: adds `k_a ambient`, without position or direction.
    Ambient,
    /// From infinitely far along the entity's -Z axis (the light travels along -Z); no distance attenuation.
    Directional,
    /// From the entity's position.
    Point,
}

/// What evaluates a light: the baker, the frame, or both.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum BakeMode {
    /// Shaded every frame and ignored by the baker. The default for lights made in code.
    #[default]
    Dynamic,
    /// Direct light is shaded every frame; its bounces are baked.
    Mixed,
    /// Baked entirely: a lightmapped mesh skips the light's diffuse part and keeps the specular; any other mesh is
    /// lit in full. The default for lights imported from glTF.
    Static,
}

/// A light source.
///
/// Its three colours are the rows of document \[I\]'s 3x3 matrix ([`LightMatrix`](crate::LightMatrix)): a material
/// with ambient, diffuse and specular coefficients k receives `k_a ambient + attenuation spot (k_d diffuse (l·n) +
/// k_s specular (r·v)^n)`.
///
/// Units: the factor on k_d is irradiance / π, so a KHR_lights_punctual intensity (candela, lux) is divided by π.
#[derive(Component, Clone, Debug, PartialEq)]
pub struct Light {
    /// What kind of source it comes from.
    pub kind: LightKind,
    /// L_a: linear RGB added through k_a. It is attenuated like the rest but does not depend on l·n.
    pub ambient: Vec3,
    /// L_d: linear RGB, (W/m²)/π at distance factor 1.
    pub diffuse: Vec3,
    /// L_s: linear RGB, in the units of `diffuse`.
    pub specular: Vec3,
    /// Distance attenuation; ignored by directional and ambient lights.
    pub attenuation: Attenuation,
    /// The cone, if it is a spotlight. Applies to directional lights too, as in OpenGL.
    pub spot: Option<SpotCone>,
    /// Whether the light is on. A light that is off costs nothing.
    pub enabled: bool,
    /// Whether the light asks for a shadow map.
    pub shadow: bool,
    /// What evaluates it.
    pub bake: BakeMode,
    /// Radius in metres of the sphere that a point light or spotlight is, at least 0. It determines how soft the
    /// light's shadows are; the unoccluded light is that of a point at the centre. Other kinds of light do not use
    /// it.
    pub radius: f32,
    /// Angular diameter in radians of the disc that a directional light is, in [0, π/2] (the sun: 0.0093). It
    /// determines how soft the light's shadows are. Other kinds of light do not use it.
    pub angle: f32,
}

impl Light {
    /// A point light that follows the inverse-square law, with the same diffuse and specular colour.
    pub fn point(color: Vec3) -> Self {
        Self {
            kind: LightKind::Point,
            ambient: Vec3::ZERO,
            diffuse: color,
            specular: color,
            attenuation: Attenuation::INVERSE_SQUARE,
            spot: None,
            enabled: true,
            shadow: false,
            bake: BakeMode::Dynamic,
            radius: 0.0,
            angle: 0.0,
        }
    }

    /// A distant light shining along its entity's -Z axis.
    pub fn directional(color: Vec3) -> Self {
        Self { kind: LightKind::Directional, attenuation: Attenuation::NONE, ..Self::point(color) }
    }

    /// A spotlight shining along its entity's -Z axis.
    pub fn spot(color: Vec3, cone: SpotCone) -> Self {
        Self { spot: Some(cone), ..Self::point(color) }
    }

    /// The same light, fading to nothing at this distance in metres, as KHR_lights_punctual's `range` does.
    #[must_use]
    pub fn with_range(self, range: f32) -> Self {
        Self { attenuation: Attenuation { range, ..self.attenuation }, ..self }
    }

    /// An ambient light.
    pub fn ambient(color: Vec3) -> Self {
        Self {
            kind: LightKind::Ambient,
            ambient: color,
            diffuse: Vec3::ZERO,
            specular: Vec3::ZERO,
            attenuation: Attenuation::NONE,
            ..Self::point(color)
        }
    }
}
