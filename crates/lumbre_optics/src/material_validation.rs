//! What a material may not be. Checked when materials are loaded; the equations themselves stay finite
//! whatever they are given.

use thiserror::Error;

use crate::validation::{color_fault, fault};
use crate::{AlphaMode, Fresnel, Material, Surface};

/// Why a material is refused.
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
        /// What is wrong with it.
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
        /// What would be right.
        allowed: &'static str,
    },
}

impl Material {
    /// Checks that the material can be lit, and names it, the field, the value and the remedy if it cannot.
    ///
    /// Coefficients above 1 pass: files have them, OpenGL takes them, and the baker clamps and says so.
    ///
    /// # Errors
    /// [`MaterialError`], the first fault in the order of the fields.
    pub fn validate(&self, name: &str) -> Result<(), MaterialError> {
        if let Fresnel::Conductor { eta, absorption } = self.fresnel {
            for (field, value) in [("eta", eta), ("absorption", absorption)] {
                if let Some((value, reason)) = color_fault(value) {
                    let (material, field) = (name.to_owned(), format!("fresnel.{field}"));
                    return Err(MaterialError::Number { material, field, value, reason });
                }
            }
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

fn validate_surface(surface: &Surface, name: &str, side: &str) -> Result<(), MaterialError> {
    let colors = [
        ("ambient", surface.ambient),
        ("diffuse", surface.diffuse),
        ("specular", surface.specular),
        ("emission", surface.emission),
    ];
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
    use glam::Vec3;

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
