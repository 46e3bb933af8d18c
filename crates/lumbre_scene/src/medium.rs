//! What is behind a surface that lets light through, beside its coefficient of transmission and its index of refraction. Read by the
//! tracer and by frames. Not the refraction itself: that is `lumbre_optics::transmitted_direction`.

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};

/// How an entity whose material has a coefficient of transmission (k_t above 0) passes light on. Without this component it is solid, absorbs
/// nothing inside, and divides no light by Fresnel's equations: the documents' model.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// The surface is a sheet without an inside: light goes straight on. Else its front is the outside of a solid, and light is refracted.
    pub thin: bool,
    /// Of the light that k_t lets through, the part that Fresnel's equations say is reflected is reflected. Without it all of it passes,
    /// unless total reflection forbids it.
    pub fresnel: bool,
    /// What is left of white light after [`attenuation_distance`](Self::attenuation_distance) inside, linear RGB in [0, 1].
    pub attenuation_color: Vec3,
    /// Metres, greater than 0; infinite where nothing is absorbed.
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

/// A channel that would be black after the stated distance keeps this part, so that the law of Beer and Lambert has a coefficient.
const DARKEST: f64 = 1e-30;

impl Medium {
    /// The coefficient of absorption σ per channel, 1/m: after x metres exp(-σ x) of the light is left (Beer and Lambert).
    pub fn absorption(&self) -> DVec3 {
        let distance = f64::from(self.attenuation_distance);
        if !(distance > 0.0 && distance.is_finite()) {
            return DVec3::ZERO;
        }
        let channel = |left: f32| -f64::from(left).clamp(DARKEST, 1.0).ln() / distance;
        let color = self.attenuation_color;
        DVec3::new(channel(color.x), channel(color.y), channel(color.z))
    }

    /// What is wrong with it, as field, value and remedy.
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
