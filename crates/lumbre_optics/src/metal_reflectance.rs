//! How much light a metal reflects, as one number: the diffuse reflectance that stands for its highlight where light
//! is known only as irradiance, which is in lightmaps, irradiance volumes, and the light that a bake bounces. It is
//! not the highlight of a lamp, which has a direction ([`energy_conserving`](crate::gltf_reflection)).
//!
//! Under light that is the same from everywhere, a highlight with Fresnel reflectance 1 sends back its albedo: the
//! hemispherical-hemispherical reflectance ρ_hh of the lobe (Pharr, Jakob and Humphreys, *Physically Based Rendering*,
//! 4th edition, section 9.1.1; called white-sky albedo elsewhere). Smooth metals send back all of it; rough ones lose
//! what is scattered between microfacets. Where light is uneven, a smooth metal shows an image of its surroundings and
//! this shows their mean.
//!
//! **Only what exceeds a dielectric's 4 % counts.** Paint has a highlight as well, of at most 9 % of even light. But
//! that light does not reach the pigment below, for which k_d makes no allowance: together they reflect at most
//! 9 % of 1 - k_d more than k_d, and k_d alone can never send back more light than came in. For the same reason the
//! share of a metal is at most 1 - k_d, which matters for dielectrics of more than 4 %.

use glam::{DVec3, Vec3};

use crate::{Lobe, Material, SurfaceSample};

/// Reflectance of a dielectric at normal incidence: an index of refraction of 1.5.
const DIELECTRIC: f64 = 0.04;
/// Coefficients of α to α⁴ in the albedo of a lobe.
const ALBEDO: [f64; 4] = [-0.123, -1.8719, 2.2542, -0.852];

/// Returns the fraction of even light that glTF's lobe ([`gltf_reflection`](crate::gltf_reflection)) reflects if its
/// Fresnel reflectance is 1: from 1 for smooth surfaces to .41 for an exponent of 0.
///
/// It is a polynomial in α = √(2/(n + 2)), within .002 of the integral. The lobes of Phong and Blinn with the same
/// peak are within .1 of it.
///
/// # Error of the f32 twin
///
/// 20 u: α is off by 12 u, where the slope of the polynomial is at most .75; the rest is its own rounding.
pub fn lobe_albedo(shininess: f64) -> f64 {
    let alpha = (2.0 / (shininess.max(0.0) + 2.0)).sqrt();
    let [first, second, third, fourth] = ALBEDO;
    1.0 + alpha * (first + alpha * (second + alpha * (third + alpha * fourth)))
}

/// Returns the diffuse reflectance that stands for an energy-conserving highlight, linear RGB: what of k_s exceeds
/// that of a dielectric, (k_s - .04)/.96, times [`lobe_albedo`].
///
/// It is at most 1 - k_d, so that both together reflect no more light than arrives. For a metal whose reflectance is at
/// least .3, it is at most 12 % below the reflectance under even light, because Schlick's rise at grazing angles is left
/// out.
///
/// ```
/// use glam::DVec3;
/// use lumbre_optics::metal_reflectance;
///
/// // Plastic reflects diffusely, and a smooth white metal all light.
/// assert_eq!(metal_reflectance(DVec3::splat(0.8), DVec3::splat(0.04), 30.0), DVec3::ZERO);
/// assert!(metal_reflectance(DVec3::ZERO, DVec3::ONE, 1e6).x > 0.999);
/// ```
///
/// # Error of the f32 twin
///
/// That of the albedo, 5 u of k_s, and u where 1 - k_d is less.
pub fn metal_reflectance(diffuse: DVec3, specular: DVec3, shininess: f64) -> DVec3 {
    let metal = (specular - DIELECTRIC).max(DVec3::ZERO) * (lobe_albedo(shininess) / (1.0 - DIELECTRIC));
    metal.min((1.0 - diffuse).max(DVec3::ZERO))
}

impl Material {
    /// Returns true if its highlight may stand for a metal's: the lobe conserves energy, and no rays follow what it
    /// mirrors and transmits, which would count that light twice.
    pub fn reflects_as_metal(&self) -> bool {
        self.lobe == Lobe::EnergyConserving && self.mirror == Vec3::ZERO && self.transmission == Vec3::ZERO
    }
}

impl SurfaceSample {
    /// Returns the diffuse reflectance that stands for the surface's highlight under baked light: zero for a bare lobe,
    /// whose k_s is no fraction of the light. It is only for materials that [reflect as a
    /// metal](Material::reflects_as_metal).
    pub fn reflectance_as_metal(&self) -> DVec3 {
        match self.lobe {
            Lobe::Bare => DVec3::ZERO,
            Lobe::EnergyConserving => metal_reflectance(self.diffuse, self.specular, self.shininess),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gltf_reflection;

    /// The albedo by the midpoint rule: over half vectors that are distributed as the microfacets are, for each of
    /// several viewers.
    fn integrated(shininess: f64) -> f64 {
        let alpha_squared = 2.0 / (shininess + 2.0);
        let (viewers, steps) = (40, 300);
        let middle = |index: u32, of: u32| (f64::from(index) + 0.5) / f64::from(of);
        let mut sum = 0.0;
        for viewer in 0..viewers {
            // Uniform in the square of its cosine.
            let cosine = middle(viewer, viewers).sqrt();
            let viewer = DVec3::new((1.0 - cosine * cosine).sqrt(), cosine, 0.0);
            for row in 0..steps {
                let part = middle(row, steps);
                let cosine = ((1.0 - part) / (1.0 - part + alpha_squared * part)).sqrt();
                let sine = (1.0 - cosine * cosine).sqrt();
                for column in 0..steps {
                    let azimuth = middle(column, steps) * std::f64::consts::PI;
                    let half = DVec3::new(sine * azimuth.cos(), cosine, sine * azimuth.sin());
                    let v_half = viewer.dot(half);
                    let light = 2.0 * v_half * half - viewer;
                    if v_half <= 0.0 || light.y <= 0.0 {
                        continue;
                    }
                    let density = (alpha_squared / (alpha_squared + sine * sine * (1.0 - alpha_squared)))
                        .powi(2)
                        * cosine
                        / alpha_squared;
                    // Per solid angle of the light, times π, because the factor multiplies irradiance/π.
                    let lobe = gltf_reflection(DVec3::Y, light, viewer, shininess, DVec3::ONE).x;
                    sum += lobe * 4.0 * v_half / density;
                }
            }
        }
        sum / f64::from(viewers * steps * steps)
    }

    #[test]
    fn the_albedo_is_that_of_the_lobe() {
        for shininess in [0.0, 1.0, 5.0, 30.0, 200.0, 5000.0] {
            let (fitted, exact) = (lobe_albedo(shininess), integrated(shininess));
            assert!((fitted - exact).abs() < 0.0025, "{shininess}: {fitted}, {exact}");
        }
    }

    #[test]
    fn it_falls_with_roughness_and_stays_within_its_range() {
        let mut last = lobe_albedo(f64::from(crate::MAX_SHININESS));
        assert!(last > 0.999 && last <= 1.0);
        for step in (0..400).rev() {
            let albedo = lobe_albedo(10.0_f64.powf(f64::from(step) * 0.02 - 2.0));
            assert!(albedo < last && albedo > 0.4, "{step}: {albedo}");
            last = albedo;
        }
        assert!((0.4..last).contains(&lobe_albedo(-1.0)));
    }

    #[test]
    fn dielectrics_have_none_and_a_metal_keeps_its_colour() {
        assert_eq!(metal_reflectance(DVec3::splat(0.5), DVec3::splat(f64::from(0.04_f32)), 0.0), DVec3::ZERO);
        let gold = metal_reflectance(DVec3::ZERO, DVec3::new(1.0, 0.77, 0.34), 0.0) / lobe_albedo(0.0);
        assert!((gold - DVec3::new(1.0, 0.7604, 0.3125)).abs().max_element() < 1e-4, "{gold}");
        // Diamond, white: k_d and its highlight together reflect no more than all light.
        let diamond = metal_reflectance(DVec3::splat(0.95), DVec3::splat(0.17), 1e6);
        assert!((diamond - 0.05).abs().max_element() < 1e-12, "{diamond}");
    }
}
