//! The choices of the microfacet model: which distribution of normals and which Fresnel reflectance. The terms
//! themselves are in `microfacets`, `fresnel` and `torrance_sparrow`.

use glam::{DVec3, Vec3};

use crate::fresnel::{fresnel_conductor, fresnel_dielectric};
use crate::microfacets::{distribution_cosine_power, distribution_gaussian, distribution_trowbridge_reitz};
use crate::normalization::{TINY_LENGTH_SQUARED, safe_normalize};
use crate::torrance_sparrow::geometric_attenuation;

/// The distribution of the microfacets' normals, after Blinn 1977.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Distribution {
    /// D1: cosⁿ, Phong's.
    CosinePower,
    /// D2: exp(-(c₂ α)²), Torrance and Sparrow's.
    Gaussian,
    /// D3: Trowbridge and Reitz's, with the longest tail; the one that Blinn recommends.
    #[default]
    TrowbridgeReitz,
}

impl Distribution {
    /// Every variant.
    pub const ALL: &'static [Self] = &[Self::CosinePower, Self::Gaussian, Self::TrowbridgeReitz];

    /// The name used in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::CosinePower => "cosine-power",
            Self::Gaussian => "gaussian",
            Self::TrowbridgeReitz => "trowbridge-reitz",
        }
    }

    /// Returns the variant with that name, or `None`.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|choice| choice.name() == name)
    }
}

/// How much light a microfacet reflects. All variants use the exact Fresnel equations; only the Torrance-Sparrow
/// model reads them.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Fresnel {
    /// k_s times the reflectance of a dielectric with the material's index of refraction.
    #[default]
    Dielectric,
    /// k_s times the reflectance of a conductor.
    Conductor {
        /// Real part of the index of refraction, per channel, at least 0.
        eta: Vec3,
        /// Imaginary part, per channel, at least 0.
        absorption: Vec3,
    },
    /// k_s is itself the reflectance at normal incidence: each channel is a dielectric with the index that gives
    /// it. This is the meaning of glTF's metallic-roughness materials, whose 0.04 is an index of 1.5.
    NormalReflectance,
}

impl Fresnel {
    /// The name used in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Dielectric => "dielectric",
            Self::Conductor { .. } => "conductor",
            Self::NormalReflectance => "normal-reflectance",
        }
    }
}

/// Largest square root of a reflectance at normal incidence that is converted to an index of refraction; it gives
/// an index of 10⁴.
const LARGEST_ROOT: f64 = 0.9998;

/// Returns the exact reflectance, per channel, of the dielectric that reflects `reflectance` (in [0, 1]) at normal
/// incidence; its index is (1 + √k)/(1 - √k). Where `reflectance` is 1 the result is up to 4·10⁻⁴ less than 1.
///
/// # Error of the f32 twin
///
/// That of [`fresnel_dielectric`](crate::fresnel_dielectric) with an index whose relative error is 20 u/(1 - √k).
pub fn fresnel_normal_reflectance(cos_incident: f64, reflectance: DVec3) -> DVec3 {
    let channel = |k: f64| {
        let root = k.max(0.0).sqrt().min(LARGEST_ROOT);
        fresnel_dielectric(cos_incident, (1.0 + root) / (1.0 - root))
    };
    DVec3::new(channel(reflectance.x), channel(reflectance.y), channel(reflectance.z))
}

/// Returns [`fresnel_normal_reflectance`], or `None` for a cosine outside [0, 1] or a reflectance outside [0,
/// .9996], above which the index is clamped to 10⁴ (a reflectance of 1 has none).
pub fn try_fresnel_normal_reflectance(cos_incident: f64, reflectance: DVec3) -> Option<DVec3> {
    let channels = reflectance.to_array();
    let usable = channels.iter().all(|k| (0.0..=LARGEST_ROOT * LARGEST_ROOT).contains(k));
    ((0.0..=1.0).contains(&cos_incident) && usable)
        .then(|| fresnel_normal_reflectance(cos_incident, reflectance))
}

/// Returns D G / (n·v) with any of the three distributions, in [0, 10⁴]; 0 unless both light and viewer are in
/// front. All directions are unit vectors.
///
/// In WGSL the feature `DISTRIBUTION_COSINE_POWER` or `DISTRIBUTION_GAUSSIAN` selects the distribution; without
/// either it is Trowbridge and Reitz's.
///
/// # Error of the f32 twin
///
/// That of [`torrance_sparrow_geometry`](crate::torrance_sparrow_geometry), with the error of the chosen
/// distribution.
pub fn microfacet_lobe(
    distribution: Distribution,
    normal: DVec3,
    light: DVec3,
    viewer: DVec3,
    shininess: f64,
) -> f64 {
    let (n_light, n_viewer) = (normal.dot(light), normal.dot(viewer));
    if n_light <= 0.0 || n_viewer <= 0.0 {
        return 0.0;
    }
    let sum = light + viewer;
    let half = safe_normalize(sum);
    let (cosine, sine_squared) = (normal.dot(half), normal.cross(half).length_squared());
    let density = match distribution {
        Distribution::CosinePower => distribution_cosine_power(cosine, sine_squared, shininess),
        Distribution::Gaussian => distribution_gaussian(cosine, sine_squared, shininess),
        Distribution::TrowbridgeReitz => distribution_trowbridge_reitz(sine_squared, shininess),
    };
    density * geometric_attenuation(n_light, n_viewer, cosine, half_cosine(sum))
}

/// Returns k_s D G F / (n·v), linear RGB, with a material's distribution and Fresnel reflectance. `ior` is only
/// used by [`Fresnel::Dielectric`].
///
/// ```
/// use glam::DVec3;
/// use lumbre_optics::{Distribution, Fresnel, microfacet_reflection};
///
/// // A glTF plastic, seen and lit straight on: 0.04, not 0.04 squared.
/// let (up, plastic) = (DVec3::Y, DVec3::splat(0.04));
/// let kind = (Distribution::default(), Fresnel::NormalReflectance);
/// let reflected = microfacet_reflection(kind, up, up, up, 50.0, plastic, 1.5);
/// assert!((reflected - plastic).length() < 1e-12);
/// ```
pub fn microfacet_reflection(
    kind: (Distribution, Fresnel),
    normal: DVec3,
    light: DVec3,
    viewer: DVec3,
    shininess: f64,
    specular: DVec3,
    ior: f64,
) -> DVec3 {
    let (distribution, fresnel) = kind;
    let v_half = half_cosine(light + viewer);
    let reflected = match fresnel {
        Fresnel::Dielectric => specular * fresnel_dielectric(v_half, ior),
        Fresnel::Conductor { eta, absorption } => {
            specular * fresnel_conductor(v_half, eta.as_dvec3(), absorption.as_dvec3())
        }
        Fresnel::NormalReflectance => fresnel_normal_reflectance(v_half, specular),
    };
    reflected * microfacet_lobe(distribution, normal, light, viewer, shininess)
}

/// Returns v·h = |l + v|/2, which avoids the cancellation of v·(l + v) near l = -v.
fn half_cosine(sum: DVec3) -> f64 {
    0.5 * sum.length_squared().max(TINY_LENGTH_SQUARED).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::torrance_sparrow;

    fn at(degrees: f64) -> DVec3 {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        DVec3::new(sine, cosine, 0.0)
    }

    #[test]
    fn the_default_choice_is_torrance_sparrow() {
        for (light, viewer) in [(10.0, -20.0), (60.0, -55.0), (0.0, 80.0)] {
            let (light, viewer) = (at(light), at(viewer));
            let kind = (Distribution::default(), Fresnel::default());
            let got = microfacet_reflection(kind, DVec3::Y, light, viewer, 30.0, DVec3::ONE, 1.5);
            let expected = torrance_sparrow(DVec3::Y, light, viewer, 30.0, 1.5);
            assert!((got.x - expected).abs() <= 1e-15 * expected.max(1.0), "{got} {expected}");
        }
    }

    #[test]
    fn reflectance_at_normal_incidence_is_what_was_asked_for() {
        for k in [0.0, 1e-6, 0.04, 0.5, 0.99] {
            let got = fresnel_normal_reflectance(1.0, DVec3::splat(k)).x;
            // (η - 1)/(η + 1) cancels near η = 1, but √k itself is exact, so its square loses little.
            assert!((got - k).abs() < 1e-12, "{k}: {got}");
        }
        assert!((1.0 - fresnel_normal_reflectance(1.0, DVec3::ONE).x) < 4.1e-4);
        // At 90 degrees everything is a mirror.
        assert!((fresnel_normal_reflectance(0.0, DVec3::splat(0.04)) - 1.0).length() < 1e-12);
    }

    #[test]
    fn reflectances_that_no_index_has() {
        assert!(try_fresnel_normal_reflectance(0.5, DVec3::new(0.0, 0.04, 0.999)).is_some());
        for k in [-0.1, 1.0, 1.5, f64::NAN] {
            assert_eq!(try_fresnel_normal_reflectance(0.5, DVec3::new(0.04, k, 0.04)), None, "{k}");
        }
        assert_eq!(try_fresnel_normal_reflectance(-0.5, DVec3::splat(0.04)), None);
    }

    #[test]
    fn the_dielectric_of_four_per_cent_is_glass() {
        for degrees in [0.0f64, 30.0, 56.3, 80.0, 89.0] {
            let cosine = degrees.to_radians().cos();
            let got = fresnel_normal_reflectance(cosine, DVec3::splat(0.04)).x;
            assert!((got - fresnel_dielectric(cosine, 1.5)).abs() < 1e-12, "{degrees}");
        }
    }

    #[test]
    fn gold_is_golden() {
        // Johnson and Christy's gold at 650, 550 and 450 nm: it reflects red and swallows blue.
        let gold =
            Fresnel::Conductor { eta: Vec3::new(0.17, 0.42, 1.38), absorption: Vec3::new(3.15, 2.35, 1.92) };
        let kind = (Distribution::default(), gold);
        let got = microfacet_reflection(kind, DVec3::Y, DVec3::Y, DVec3::Y, 50.0, DVec3::ONE, 1.5);
        assert!(got.x > 0.9 && got.z < 0.5 && got.x > got.y && got.y > got.z, "{got}");
    }

    #[test]
    fn every_name_leads_back() {
        for &choice in Distribution::ALL {
            assert_eq!(Distribution::from_name(choice.name()), Some(choice));
        }
        assert_eq!(Distribution::from_name("ggx"), None);
    }
}
