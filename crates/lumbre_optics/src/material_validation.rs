//! Which materials are rejected, and why. This is checked when materials are loaded; the equations themselves stay
//! finite for any finite input.

use glam::Vec3;
use thiserror::Error;

use crate::fresnel::LARGEST_CONSTANT;
use crate::validation::{color_fault, fault};
use crate::{AlphaMode, Fresnel, LARGEST_INTENSITY, Material, Surface};

/// Largest reflection coefficient and largest vertex colour. The strongest light ([`LARGEST_INTENSITY`]) times a
/// coefficient and either a vertex colour (ambient and diffuse) or the factor of 10⁴ that a bare highlight reaches
/// (see `torrance_sparrow`) is at most 10³⁷, and thirty such lamps still add up in f32. Energy-conserving
/// highlights reach a factor of 1.3·10⁵ (see `gltf_reflection`): there a single lamp may give 1.3·10³⁸, and the
/// sum of two is the largest that f32 is sure to hold.
pub const LARGEST_COEFFICIENT: f32 = 1e3;

/// Why a material is rejected.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MaterialError {
    /// A number that has to be finite and at least 0 is not.
    #[error(
        "material \"{material}\": {field} is {value}, which is {reason}; give a finite number that is at least 0"
    )]
    Number {
        /// The material's name.
        material: String,
        /// The field, as in `Material`.
        field: String,
        /// Its value.
        value: f32,
        /// What is wrong with the value.
        reason: &'static str,
    },
    /// A number is out of its range.
    #[error("material \"{material}\": {field} is {value}; give a number {allowed}")]
    Range {
        /// The material's name.
        material: String,
        /// The field, as in `Material`.
        field: String,
        /// Its value.
        value: f32,
        /// Which values are accepted.
        allowed: &'static str,
    },
}

impl Material {
    /// Checks that the material can be lit. The error names the material, the field, the value and the remedy.
    ///
    /// Coefficients above 1 pass: they occur in files, OpenGL accepts them, and the baker clamps them with a
    /// warning. Above [`LARGEST_COEFFICIENT`], or with an emission above [`LARGEST_INTENSITY`], light would
    /// overflow f32.
    ///
    /// # Errors
    /// [`MaterialError`] with the first fault found.
    pub fn validate(&self, name: &str) -> Result<(), MaterialError> {
        if let Fresnel::Conductor { eta, absorption } = self.fresnel {
            validate_index(eta, absorption, name)?;
        }
        validate_surface(&self.front, name, "front")?;
        if let Some(back) = &self.back {
            validate_surface(back, name, "back")?;
        }
        let range = |field: &str, value: f32, lowest: f32, highest: f32, allowed| {
            if (lowest..=highest).contains(&value) {
                Ok(())
            } else {
                Err(MaterialError::Range {
                    material: name.to_owned(),
                    field: field.to_owned(),
                    value,
                    allowed,
                })
            }
        };
        range("alpha", self.alpha, 0.0, 1.0, "from 0 to 1")?;
        if let AlphaMode::Mask { cutoff } = self.alpha_mode {
            range("alpha_mode.cutoff", cutoff, 0.0, f32::MAX, "that is finite and at least 0")?;
        }
        for (field, color) in [("mirror", self.mirror), ("transmission", self.transmission)] {
            if let Some((value, reason)) = color_fault(color) {
                return Err(MaterialError::Number {
                    material: name.to_owned(),
                    field: field.to_owned(),
                    value,
                    reason,
                });
            }
        }
        range("ior", self.ior, 1.0, f32::MAX, "that is finite and at least 1 (1.5 is glass)")
    }
}

/// Checks the complex index of refraction of a conductor.
fn validate_index(eta: Vec3, absorption: Vec3, name: &str) -> Result<(), MaterialError> {
    for (field, constants) in [("fresnel.eta", eta), ("fresnel.absorption", absorption)] {
        let (material, field) = (name.to_owned(), field.to_owned());
        if let Some((value, reason)) = color_fault(constants) {
            return Err(MaterialError::Number { material, field, value, reason });
        }
        let value = constants.max_element();
        if value > LARGEST_CONSTANT as f32 {
            return Err(MaterialError::Range { material, field, value, allowed: "from 0 to 10000" });
        }
    }
    if (eta + absorption).min_element() > 0.0 {
        return Ok(());
    }
    let (material, field) = (name.to_owned(), "fresnel.eta".to_owned());
    let allowed = "above 0 in every channel whose absorption is 0 (1 is air's)";
    Err(MaterialError::Range { material, field, value: 0.0, allowed })
}

fn validate_surface(surface: &Surface, name: &str, side: &str) -> Result<(), MaterialError> {
    let colors = [
        ("ambient", surface.ambient),
        ("diffuse", surface.diffuse),
        ("specular", surface.specular),
        ("emission", surface.emission),
    ];
    for (field, color) in colors {
        let largest = if field == "emission" { LARGEST_INTENSITY as f32 } else { LARGEST_COEFFICIENT };
        let value = color.max_element();
        if value > largest && value.is_finite() {
            let allowed = if field == "emission" { "up to 1e30" } else { "up to 1000" };
            let (material, field) = (name.to_owned(), format!("{side}.{field}"));
            return Err(MaterialError::Range { material, field, value, allowed });
        }
    }
    let color = colors.into_iter().find_map(|(field, color)| color_fault(color).map(|fault| (field, fault)));
    let number = fault(surface.shininess).map(|reason| ("shininess", (surface.shininess, reason)));
    match color.or(number) {
        None => Ok(()),
        Some((field, (value, reason))) => Err(MaterialError::Number {
            material: name.to_owned(),
            field: format!("{side}.{field}"),
            value,
            reason,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(material: &Material) -> String {
        material.validate("brass").expect_err("has to be refused").to_string()
    }

    fn with_front(front: Surface) -> Material {
        Material { front, ..Material::default() }
    }

    #[test]
    fn ordinary_materials_are_accepted() {
        assert_eq!(Material::default().validate("plain"), Ok(()));
        assert_eq!(Material::matt(Vec3::splat(1.2)).validate("bright"), Ok(()));
        for roughness in [0.0, 0.5, 1.0] {
            assert_eq!(
                Material::from_metallic_roughness(Vec3::ONE, 1.0, roughness).validate("metal"),
                Ok(())
            );
        }
    }

    #[test]
    fn surfaces() {
        let shininess = |shininess| with_front(Surface { shininess, ..Surface::default() });
        assert!(message(&shininess(-1.0)).contains("\"brass\": front.shininess is -1, which is negative"));
        assert!(message(&shininess(f32::NAN)).contains("front.shininess"));
        assert!(message(&shininess(f32::INFINITY)).contains("infinite"));
        let emission = Vec3::new(0.0, f32::INFINITY, 0.0);
        assert!(
            message(&with_front(Surface { emission, ..Surface::default() }))
                .contains("front.emission is inf")
        );
        let back = Some(Surface { diffuse: Vec3::new(-1.0, 0.0, 0.0), ..Surface::default() });
        assert!(message(&Material { back, ..Material::default() }).contains("back.diffuse is -1"));
    }

    #[test]
    fn indices_of_conductors() {
        let conductor = |eta: f32, absorption: f32| Material {
            fresnel: Fresnel::Conductor {
                eta: Vec3::new(0.2, eta, 1.4),
                absorption: Vec3::new(3.0, absorption, 2.0),
            },
            ..Material::default()
        };
        for (eta, absorption) in [(0.4, 2.4), (0.0, 2.4), (1.5, 0.0), (1e4, 1e4)] {
            assert_eq!(conductor(eta, absorption).validate("gold"), Ok(()), "{eta} {absorption}");
        }
        assert!(message(&conductor(-0.5, 1.0)).contains("fresnel.eta is -0.5, which is negative"));
        assert!(message(&conductor(1.0, f32::NAN)).contains("fresnel.absorption"));
        assert!(
            message(&conductor(2e4, 1.0)).contains("fresnel.eta is 20000; give a number from 0 to 10000")
        );
        assert!(message(&conductor(0.0, 0.0)).contains("fresnel.eta is 0; give a number above 0"));
    }

    #[test]
    fn the_rest() {
        for alpha in [-0.1, 1.1, f32::NAN] {
            assert!(message(&Material { alpha, ..Material::default() }).contains("alpha"));
        }
        for ior in [0.9, 0.0, f32::NAN, f32::INFINITY] {
            assert!(message(&Material { ior, ..Material::default() }).contains("ior"));
        }
        let alpha_mode = AlphaMode::Mask { cutoff: f32::NAN };
        assert!(message(&Material { alpha_mode, ..Material::default() }).contains("alpha_mode.cutoff"));
        assert!(message(&Material { mirror: Vec3::NAN, ..Material::default() }).contains("mirror"));
        assert!(
            message(&Material { transmission: -Vec3::ONE, ..Material::default() }).contains("transmission")
        );
    }
}
