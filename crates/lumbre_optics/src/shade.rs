//! The lighting equation: the light that a surface sends to the viewer due to one light, and due to all. Visibility
//! is decided elsewhere, and so is how often the equation is evaluated: Gouraud and Phong shading call the same
//! function.

use glam::DVec3;

use crate::blinn_phong::{blinn_phong, blinn_phong_4n, blinn_phong_matched};
use crate::energy_conserving::{gltf_reflection, lobe_peak};
use crate::lambert::lambert;
use crate::microfacet_reflection::{Distribution, Fresnel, microfacet_reflection};
use crate::phong::phong;
use crate::torrance_sparrow::torrance_sparrow;
use crate::{LightSample, Lobe, Material, ReflectionModel, Surface};

/// Index of refraction of a surface that does not specify one: glTF's default, that of window glass.
pub const DEFAULT_IOR: f64 = 1.5;

/// The reflection properties of a surface at one point, with textures already multiplied in (they modulate ambient
/// and diffuse, document \[M\]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceSample {
    /// k_a, linear RGB.
    pub ambient: DVec3,
    /// k_d, linear RGB.
    pub diffuse: DVec3,
    /// k_s, linear RGB.
    pub specular: DVec3,
    /// Exponent n, at least 0.
    pub shininess: f64,
    /// Index of refraction, read by the Torrance-Sparrow model only.
    pub ior: f64,
    /// How the brightness of the highlight is defined.
    pub lobe: Lobe,
    /// Distribution of the microfacets, read by the Torrance-Sparrow model only.
    pub distribution: Distribution,
    /// Fresnel reflectance of the microfacets, read by the Torrance-Sparrow model only.
    pub fresnel: Fresnel,
    /// Factor on the highlight: 1, or less where it is filtered ([`filtered_lobe`](crate::filtered_lobe)).
    pub peak: f64,
}

impl SurfaceSample {
    /// Creates the sample of the side of a material that is seen.
    pub fn new(material: &Material, front_facing: bool) -> Self {
        Self {
            ior: f64::from(material.ior),
            lobe: material.lobe,
            distribution: material.distribution,
            fresnel: material.fresnel,
            ..Self::from(material.surface(front_facing))
        }
    }
}

impl From<&Surface> for SurfaceSample {
    /// Uses [`DEFAULT_IOR`], a bare lobe and the default microfacets, as a surface has none of these;
    /// [`SurfaceSample::new`] takes them from the material.
    fn from(surface: &Surface) -> Self {
        Self {
            ambient: surface.ambient.as_dvec3(),
            diffuse: surface.diffuse.as_dvec3(),
            specular: surface.specular.as_dvec3(),
            shininess: f64::from(surface.shininess_in_range()),
            ior: DEFAULT_IOR,
            lobe: Lobe::Bare,
            distribution: Distribution::default(),
            fresnel: Fresnel::default(),
            peak: 1.0,
        }
    }
}

/// The light that one light source adds, in three parts, so that a baked light can leave out the diffuse one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contribution {
    /// k_a L_a times attenuation and spot factor. It does not depend on n·l.
    pub ambient: DVec3,
    /// k_d L_d (n·l) times attenuation and spot factor.
    pub diffuse: DVec3,
    /// k_s L_s times the model's factor, attenuation and spot factor; 0 where n·l is not positive.
    pub specular: DVec3,
}

impl Contribution {
    /// No light.
    pub const ZERO: Self = Self { ambient: DVec3::ZERO, diffuse: DVec3::ZERO, specular: DVec3::ZERO };

    /// The sum of the three parts.
    pub fn total(&self) -> DVec3 {
        self.ambient + self.diffuse + self.specular
    }
}

impl std::ops::Add for Contribution {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            ambient: self.ambient + other.ambient,
            diffuse: self.diffuse + other.diffuse,
            specular: self.specular + other.specular,
        }
    }
}

/// Returns the specular factor of the chosen model, without k_s and the light's colour; 0 where n·l is not
/// positive. Directions are unit vectors or zero.
///
/// In WGSL one of the features `REFLECTION_PHONG`, `REFLECTION_BLINN`, `REFLECTION_BLINN_4N`,
/// `REFLECTION_BLINN_MATCHED` and `REFLECTION_TORRANCE_SPARROW` selects the model, and the others are not compiled.
///
/// # Error of the f32 twin
///
/// That of the model's function.
pub fn specular_factor(
    model: ReflectionModel,
    normal: DVec3,
    light: DVec3,
    viewer: DVec3,
    shininess: f64,
    ior: f64,
) -> f64 {
    match model {
        ReflectionModel::Phong => phong(normal, light, viewer, shininess),
        ReflectionModel::Blinn => blinn_phong(normal, light, viewer, shininess),
        ReflectionModel::Blinn4n => blinn_phong_4n(normal, light, viewer, shininess),
        ReflectionModel::BlinnMatched => blinn_phong_matched(normal, light, viewer, shininess),
        ReflectionModel::TorranceSparrow => torrance_sparrow(normal, light, viewer, shininess, ior),
    }
}

/// Returns the exponent that a model's own equation takes for `shininess`. With an energy-conserving lobe `shininess`
/// is the exponent of n·h, and the models that take Phong's exponent get a quarter of it.
///
/// # Error of the f32 twin
///
/// None: the factor is a power of two.
pub fn model_exponent(model: ReflectionModel, lobe: Lobe, shininess: f64) -> f64 {
    match (lobe, model) {
        (Lobe::Bare, _) | (_, ReflectionModel::Blinn | ReflectionModel::TorranceSparrow) => shininess,
        (Lobe::EnergyConserving, _) => 0.25 * shininess,
    }
}

/// Returns k_s times the chosen model's factor, linear RGB, times the peak of a filtered highlight. The
/// Torrance-Sparrow model uses the material's distribution and Fresnel reflectance.
///
/// In WGSL a material that chooses other than the defaults of these sets the feature `MICROFACETS`, and an
/// energy-conserving lobe `ENERGY_CONSERVING`.
///
/// # Error of the f32 twin
///
/// That of the model's function, plus 2 u.
pub fn specular_reflection(
    model: ReflectionModel,
    surface: &SurfaceSample,
    normal: DVec3,
    light: DVec3,
    viewer: DVec3,
) -> DVec3 {
    let (shininess, ior) = (surface.shininess, surface.ior);
    let reflected = if surface.lobe == Lobe::EnergyConserving {
        if model == ReflectionModel::TorranceSparrow {
            gltf_reflection(normal, light, viewer, shininess, surface.specular)
        } else {
            let exponent = model_exponent(model, surface.lobe, shininess);
            let factor = specular_factor(model, normal, light, viewer, exponent, ior);
            surface.specular * (factor * (lobe_peak(shininess) * lambert(normal, light)))
        }
    } else if model == ReflectionModel::TorranceSparrow {
        let kind = (surface.distribution, surface.fresnel);
        microfacet_reflection(kind, normal, light, viewer, shininess, surface.specular, ior)
    } else {
        surface.specular * specular_factor(model, normal, light, viewer, shininess, ior)
    };
    reflected * surface.peak
}

/// Returns `attenuation spot (k_a L_a + k_d L_d (n·l) + k_s L_s specular)` for one light, in its three parts:
/// OpenGL 2.1 §2.14.1 and document \[I\].
///
/// `normal` is unit or zero (a zero normal receives the ambient part only); `viewer` is the unit direction to the
/// viewer.
///
/// ```
/// use glam::DVec3;
/// use lumbre_optics::{LightSample, ReflectionModel, Surface, light_contribution};
///
/// let surface = Surface { diffuse: glam::Vec3::splat(0.5), ..Surface::default() };
/// let sun = LightSample { diffuse: DVec3::ONE, direction: DVec3::Y, attenuation: 1.0, spot: 1.0, ..LightSample::DARK };
/// let lit = light_contribution(ReflectionModel::Phong, &surface, &sun, DVec3::Y, DVec3::Y);
/// assert_eq!(lit.diffuse, DVec3::splat(0.5));
/// ```
///
/// In WGSL the feature `MATT`, for surfaces with k_s = 0, omits the highlight.
///
/// # Error of the f32 twin
///
/// Ambient: 3 u. Diffuse: 4 u of itself and 3 u Σ|n l| of the factor on the cosine. Specular: 4 u of itself and the
/// model's error times the factor on it; where one of the model's tests is within rounding, the result may be that
/// of either side.
pub fn light_contribution(
    model: ReflectionModel,
    surface: impl Into<SurfaceSample>,
    light: &LightSample,
    normal: DVec3,
    viewer: DVec3,
) -> Contribution {
    let surface = surface.into();
    let factor = light.attenuation * light.spot;
    let specular = specular_reflection(model, &surface, normal, light.direction, viewer);
    Contribution {
        ambient: surface.ambient * light.ambient * factor,
        diffuse: surface.diffuse * light.diffuse * (factor * lambert(normal, light.direction)),
        specular: specular * light.specular * factor,
    }
}

/// Returns `k_a I_a + Σ light_contribution` for the scene's global ambient light I_a and all lights: everything but
/// emission and fog.
pub fn shade(
    model: ReflectionModel,
    surface: impl Into<SurfaceSample>,
    scene_ambient: DVec3,
    lights: impl IntoIterator<Item = LightSample>,
    normal: DVec3,
    viewer: DVec3,
) -> Contribution {
    let surface = surface.into();
    let start = Contribution { ambient: surface.ambient * scene_ambient, ..Contribution::ZERO };
    lights
        .into_iter()
        .fold(start, |sum, light| sum + light_contribution(model, surface, &light, normal, viewer))
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::{Light, evaluate_light};

    fn surface() -> Surface {
        Surface {
            ambient: Vec3::new(0.25, 0.5, 0.75),
            diffuse: Vec3::new(0.5, 0.25, 0.125),
            specular: Vec3::splat(0.5),
            emission: Vec3::ZERO,
            shininess: 2.0,
        }
    }

    fn sample() -> LightSample {
        LightSample {
            ambient: DVec3::new(1.0, 2.0, 4.0),
            diffuse: DVec3::new(8.0, 4.0, 2.0),
            specular: DVec3::new(1.0, 0.5, 0.25),
            direction: DVec3::new(0.6, 0.8, 0.0),
            attenuation: 0.5,
            spot: 0.5,
        }
    }

    #[test]
    fn the_three_parts_by_hand() {
        // The viewer is 3-4-5 on the mirror side, so Phong's factor is 1; n·l = 0.8; attenuation times spot is 1/4.
        let lit = light_contribution(
            ReflectionModel::Phong,
            &surface(),
            &sample(),
            DVec3::Y,
            DVec3::new(-0.6, 0.8, 0.0),
        );
        let expected = Contribution {
            ambient: DVec3::new(0.0625, 0.25, 0.75),
            diffuse: DVec3::new(0.8, 0.2, 0.05),
            specular: DVec3::new(0.125, 0.0625, 0.03125),
        };
        // The coefficients are exact binary fractions; .6 and .8 are rounded to 2⁻⁵³.
        assert!((lit.total() - expected.total()).abs().max_element() < 1e-15, "{lit:?}");
        assert_eq!(lit.ambient, expected.ambient);
        assert!((lit.diffuse - expected.diffuse).abs().max_element() < 1e-16 * 8.0);
    }

    #[test]
    fn away_from_the_light_only_the_ambient_part_is_left() {
        for &model in ReflectionModel::ALL {
            for normal in [-DVec3::Y, DVec3::ZERO] {
                let lit = light_contribution(model, &surface(), &sample(), normal, DVec3::Y);
                assert_eq!((lit.diffuse, lit.specular), (DVec3::ZERO, DVec3::ZERO), "{model:?}");
                assert_eq!(lit.ambient, DVec3::new(0.0625, 0.25, 0.75));
            }
        }
    }

    #[test]
    fn the_specular_part_is_not_multiplied_by_the_cosine() {
        // Document [M]'s vertex program multiplies it by n·l; the equation does not.
        let light =
            LightSample { direction: DVec3::new(0.8, 0.6, 0.0), attenuation: 1.0, spot: 1.0, ..sample() };
        let lit = light_contribution(
            ReflectionModel::Phong,
            &surface(),
            &light,
            DVec3::Y,
            DVec3::new(-0.8, 0.6, 0.0),
        );
        assert!((lit.specular.x - 0.5).abs() < 1e-15);
    }

    #[test]
    fn each_model_is_its_own_function() {
        let (normal, light, viewer) = (DVec3::Y, DVec3::new(0.6, 0.8, 0.0), DVec3::new(0.0, 0.6, 0.8));
        let factor = |model| specular_factor(model, normal, light, viewer, 5.0, 1.5);
        // r = (-.6, .8, 0): r·v = .48. l + v = (.6, 1.4, .8): n·h = 1.4/sqrt(2.96).
        let half = 1.4 / 2.96f64.sqrt();
        let expected = [
            (ReflectionModel::Phong, 0.48f64.powi(5)),
            (ReflectionModel::Blinn, half.powi(5)),
            (ReflectionModel::Blinn4n, half.powi(20)),
            (ReflectionModel::BlinnMatched, half.powi(16)),
        ];
        for (model, value) in expected {
            // A few times 2⁻⁵³, times the exponent.
            assert!((factor(model) - value).abs() < 1e-14, "{model:?}");
        }
        assert_eq!(
            factor(ReflectionModel::TorranceSparrow),
            torrance_sparrow(normal, light, viewer, 5.0, 1.5)
        );
    }

    #[test]
    fn a_material_brings_its_index_of_refraction() {
        let material =
            Material { ior: 2.42, back: Some(Surface::default()), front: surface(), ..Material::default() };
        assert_eq!(SurfaceSample::new(&material, true).ior, f64::from(2.42f32));
        assert_eq!(SurfaceSample::new(&material, true).shininess, 2.0);
        assert_eq!(SurfaceSample::new(&material, false).shininess, 1.0);
    }

    #[test]
    fn the_scenes_ambient_light_is_added_once() {
        let lights = [sample(), sample()];
        let lit = shade(ReflectionModel::Phong, &surface(), DVec3::ONE, lights, DVec3::Y, DVec3::Y);
        assert_eq!(lit.ambient, DVec3::new(0.25, 0.5, 0.75) + 2.0 * DVec3::new(0.0625, 0.25, 0.75));
    }

    #[test]
    fn a_lambert_sphere_under_a_point_light_closed_form() {
        // k_d = 1, L_d = 1 at height h over a plane: k_d h/(h² + x²)^(3/2).
        let light = Light::point(Vec3::ONE);
        let plane = Surface { diffuse: Vec3::ONE, ..Surface::default() };
        for (x, h) in [(0.0f64, 1.0f64), (1.0, 1.0), (3.0, 4.0), (100.0, 0.5)] {
            let sample =
                evaluate_light(&light, DVec3::new(0.0, h, 0.0), DVec3::ZERO, DVec3::new(x, 0.0, 0.0));
            let lit = light_contribution(ReflectionModel::Phong, &plane, &sample, DVec3::Y, DVec3::Y);
            let expected = h / (h * h + x * x).powf(1.5);
            assert!((lit.diffuse.x / expected - 1.0).abs() < 1e-14, "{x} {h}");
        }
    }
}
