//! The Phong material component. The textures that modulate it are in the scene crate.

use bevy_ecs::component::Component;
use glam::Vec3;

use crate::microfacet_reflection::{Distribution, Fresnel};
use crate::roughness::{MAX_SHININESS, shininess_from_roughness};

/// The Phong coefficients of one side of a surface, all linear RGB. They are normally in [0, 1], except emission,
/// which is only at least 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// k_a.
    pub ambient: Vec3,
    /// k_d; also the diffuse reflectance ρ that the baker uses.
    pub diffuse: Vec3,
    /// k_s.
    pub specular: Vec3,
    /// Radiance that the surface adds, in W/(m² sr). In real time it lights nothing else; in the baker it lights
    /// the scene.
    pub emission: Vec3,
    /// Exponent n, at least 0.
    pub shininess: f32,
}

impl Default for Surface {
    fn default() -> Self {
        Self {
            ambient: Vec3::splat(0.8),
            diffuse: Vec3::splat(0.8),
            specular: Vec3::ZERO,
            emission: Vec3::ZERO,
            shininess: 1.0,
        }
    }
}

impl Surface {
    /// Returns the exponent clamped to the range in use, 0 to [`MAX_SHININESS`]; 0 for NaN.
    pub fn shininess_in_range(&self) -> f32 {
        if self.shininess.is_nan() { 0.0 } else { self.shininess.clamp(0.0, MAX_SHININESS) }
    }

    /// Returns true if the highlight needs the shader feature `SHARP_HIGHLIGHTS`: the exponent is above
    /// [`SHARP_SHININESS`] and k_s is not 0.
    pub fn has_sharp_highlight(&self) -> bool {
        self.shininess > SHARP_SHININESS && self.specular != Vec3::ZERO
    }
}

/// How alpha determines coverage.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// A fragment exists where alpha is at least the cutoff.
    Mask {
        /// Cutoff, finite and at least 0, normally in [0, 1].
        cutoff: f32,
    },
    /// Blended over what is behind, and drawn back to front.
    Blend,
}

/// How the brightness of a highlight is defined.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Lobe {
    /// As in the documents and OpenGL: a bare power of a cosine, k_s at the peak for every exponent.
    #[default]
    Bare,
    /// As in glTF: k_s is the fraction of the light that is reflected along the normal, so that sharp highlights
    /// are bright and wide ones faint. The exponent is that of n·h in every model, and the Torrance-Sparrow model
    /// becomes glTF's own reflectance ([`gltf_reflection`](crate::gltf_reflection)).
    EnergyConserving,
}

impl Lobe {
    /// Both variants.
    pub const ALL: &'static [Self] = &[Self::Bare, Self::EnergyConserving];

    /// The name used in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bare => "bare",
            Self::EnergyConserving => "energy-keeping",
        }
    }

    /// Returns the variant with that name, or `None`.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|lobe| lobe.name() == name)
    }
}

/// A material: what a surface does with light.
#[derive(Component, Clone, Debug, PartialEq)]
pub struct Material {
    /// The front side, where triangles wind counter-clockwise.
    pub front: Surface,
    /// The back side, if it differs. It is only seen if `double_sided`.
    pub back: Option<Surface>,
    /// Opacity in [0, 1], multiplied by texture and vertex alpha.
    pub alpha: f32,
    /// How alpha determines coverage.
    pub alpha_mode: AlphaMode,
    /// Back faces are drawn, and lit with the reversed normal.
    pub double_sided: bool,
    /// Shows `front.diffuse` (times texture and vertex colour) regardless of the lights, without emission
    /// (KHR_materials_unlit).
    pub unlit: bool,
    /// Mirror reflection coefficient k_r of the ray tree, linear RGB.
    pub mirror: Vec3,
    /// Transmission coefficient k_t of the ray tree, linear RGB.
    pub transmission: Vec3,
    /// Index of refraction, at least 1 (1.5 by default).
    pub ior: f32,
    /// How the brightness of its highlight is defined.
    pub lobe: Lobe,
    /// Distribution of the microfacets (only used by bare lobes of Torrance-Sparrow).
    pub distribution: Distribution,
    /// Fresnel reflectance of the microfacets (only used by bare lobes of Torrance-Sparrow).
    pub fresnel: Fresnel,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            front: Surface::default(),
            back: None,
            alpha: 1.0,
            alpha_mode: AlphaMode::Opaque,
            double_sided: false,
            unlit: false,
            mirror: Vec3::ZERO,
            transmission: Vec3::ZERO,
            ior: 1.5,
            lobe: Lobe::default(),
            distribution: Distribution::default(),
            fresnel: Fresnel::default(),
        }
    }
}

impl Material {
    /// A matt material of one colour.
    pub fn matt(color: Vec3) -> Self {
        Self { front: Surface { ambient: color, diffuse: color, ..Surface::default() }, ..Self::default() }
    }

    /// A black material that emits this radiance.
    pub fn emissive(radiance: Vec3) -> Self {
        let mut black = Self::matt(Vec3::ZERO);
        black.front.emission = radiance;
        black
    }

    /// Returns the coefficients of the side that is seen. The front's hold for both sides if there is no `back`.
    pub fn surface(&self, front_facing: bool) -> &Surface {
        match &self.back {
            Some(back) if !front_facing => back,
            _ => &self.front,
        }
    }

    /// Returns the material for a glTF metallic-roughness material: k_d = base (1 - metallic), k_s = mix(0.04,
    /// base, metallic), n = 2/α² - 2 with α = roughness², clamped to [0, 10⁶] (beyond which f32 cannot tell the
    /// highlight from a point), with the energy-conserving lobe.
    pub fn from_metallic_roughness(base: Vec3, metallic: f32, roughness: f32) -> Self {
        let front = Surface {
            ambient: base,
            diffuse: base * (1.0 - metallic),
            specular: Vec3::splat(0.04).lerp(base, metallic),
            emission: Vec3::ZERO,
            shininess: shininess_from_roughness(roughness),
        };
        let (fresnel, lobe) = (Fresnel::NormalReflectance, Lobe::EnergyConserving);
        Self { front, fresnel, lobe, ..Self::default() }
    }
}

/// Largest exponent up to which f32's pow of the cosine is good to 10⁻⁴: 256. Larger ones need the shader feature
/// `SHARP_HIGHLIGHTS`.
pub const SHARP_SHININESS: f32 = 256.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metals_and_dielectrics() {
        let base = Vec3::new(0.5, 0.25, 0.125);
        let metal = Material::from_metallic_roughness(base, 1.0, 0.5).front;
        assert_eq!((metal.diffuse, metal.specular), (Vec3::ZERO, base));
        let plastic = Material::from_metallic_roughness(base, 0.0, 0.5).front;
        assert_eq!((plastic.diffuse, plastic.specular), (base, Vec3::splat(0.04)));
    }

    #[test]
    fn the_back_defaults_to_the_front() {
        let one_sided = Material::matt(Vec3::ONE);
        assert_eq!(one_sided.surface(false), &one_sided.front);
        let back = Surface { shininess: 9.0, ..Surface::default() };
        let two_sided = Material { back: Some(back), ..Material::default() };
        assert_eq!(two_sided.surface(false), &back);
        assert_eq!(two_sided.surface(true), &two_sided.front);
    }

    #[test]
    fn a_sharp_highlight_needs_specular_light() {
        let sharp = Surface { shininess: 1000.0, specular: Vec3::ONE, ..Surface::default() };
        assert!(sharp.has_sharp_highlight());
        assert!(!Surface { specular: Vec3::ZERO, ..sharp }.has_sharp_highlight());
        assert!(!Surface { shininess: 256.0, ..sharp }.has_sharp_highlight());
        assert_eq!(Surface { shininess: 1e9, ..sharp }.shininess_in_range(), MAX_SHININESS);
    }
}
