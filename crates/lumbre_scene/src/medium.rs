//! The medium behind a transmissive surface: thin or solid, Fresnel reflection and absorption. Read by the
//! ray tracer and by frames. The coefficient of transmission and the index of refraction are in the material;
//! refraction itself is `lumbre_optics::transmitted_direction`.

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};

/// How an entity whose material transmits light (k_t above 0) passes that light on. Without this component
/// the entity is a solid that does not absorb and does not split light by the Fresnel equations, which is the
/// model of the documents.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// True: the surface is a thin sheet, and light passes straight through. False: it bounds a solid and
    /// refracts light.
    pub thin: bool,
    /// True: the Fresnel equations decide which part of the light that k_t passes is reflected instead.
    /// False: all of it passes, except under total internal reflection.
    pub fresnel: bool,
    /// The fraction of white light that remains after [`attenuation_distance`](Self::attenuation_distance)
    /// inside, linear RGB in [0, 1].
    pub attenuation_color: Vec3,
    /// In metres, greater than 0; infinite if nothing is absorbed.
    pub attenuation_distance: f32,
}

impl Default for Medium {
    fn default() -> Self {
        Self {
            thin: false,
            fresnel: false,
            attenuation_color: Vec3::ONE,
            attenuation_distance: f32::INFINITY,
        }
    }
}

/// Smallest remaining fraction of a channel, so that a black attenuation colour still gives a finite
/// coefficient in the Beer-Lambert law.
const DARKEST: f64 = 1e-30;

impl Medium {
    /// The absorption coefficient σ per channel, 1/m: exp(-σ x) of the light remains after x metres
    /// (Beer-Lambert law).
    pub fn absorption(&self) -> DVec3 {
        let distance = f64::from(self.attenuation_distance);
        if !(distance > 0.0 && distance.is_finite()) {
            return DVec3::ZERO;
        }
        let channel = |left: f32| -f64::from(left).clamp(DARKEST, 1.0).ln() / distance;
        let color = self.attenuation_color;
        DVec3::new(channel(color.x), channel(color.y), channel(color.z))
    }

    /// The first invalid field as (field name, value, remedy), or `None` if the medium is valid.
    pub fn fault(&self) -> Option<(&'static str, String, &'static str)> {
        let color = self.attenuation_color;
        if !(color.min_element() >= 0.0 && color.max_element() <= 1.0) {
            return Some(("attenuationColor", color.to_string(), "use numbers from 0 to 1"));
        }
        let distance = self.attenuation_distance;
        (distance.is_nan() || distance <= 0.0)
            .then(|| ("attenuationDistance", distance.to_string(), "use metres greater than 0"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn after_the_stated_distance_the_stated_color_is_left() {
        let medium = Medium {
            attenuation_color: Vec3::new(0.5, 0.25, 1.0),
            attenuation_distance: 2.0,
            ..Medium::default()
        };
        let left = (-medium.absorption() * 2.0).exp();
        assert!((left - DVec3::new(0.5, 0.25, 1.0)).length() < 1e-12, "{left}");
        assert_eq!(Medium::default().absorption(), DVec3::ZERO);
        assert!(Medium { attenuation_color: Vec3::ZERO, ..medium }.absorption().is_finite());
    }

    #[test]
    fn faults_are_named() {
        assert_eq!(Medium::default().fault(), None);
        for (medium, field) in [
            (Medium { attenuation_color: Vec3::splat(1.5), ..Medium::default() }, "attenuationColor"),
            (Medium { attenuation_color: Vec3::NAN, ..Medium::default() }, "attenuationColor"),
            (Medium { attenuation_distance: 0.0, ..Medium::default() }, "attenuationDistance"),
            (Medium { attenuation_distance: f32::NAN, ..Medium::default() }, "attenuationDistance"),
        ] {
            assert_eq!(medium.fault().map(|fault| fault.0), Some(field));
        }
    }
}
