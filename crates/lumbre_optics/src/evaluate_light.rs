//! A light as it reaches one point of a surface: its direction and its two factors. The reflection by the surface
//! is in `shade`. Visibility is not included; shadows are a separate factor.

use glam::DVec3;

use thiserror::Error;

use crate::normalization::{safe_length, safe_normalize, try_normalize};
use crate::spot::{SpotCosines, spot_factor};
use crate::{Light, LightKind};

/// One light as it reaches one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// L_a, linear RGB.
    pub ambient: DVec3,
    /// L_d, linear RGB.
    pub diffuse: DVec3,
    /// L_s, linear RGB.
    pub specular: DVec3,
    /// l: unit, from the point to the light; zero for an ambient light and at a point light's own position.
    pub direction: DVec3,
    /// Distance factor; 1 for directional and ambient lights.
    pub attenuation: f64,
    /// Spot factor in [0, 1].
    pub spot: f64,
}

impl LightSample {
    /// No light.
    pub const DARK: Self = Self {
        ambient: DVec3::ZERO,
        diffuse: DVec3::ZERO,
        specular: DVec3::ZERO,
        direction: DVec3::ZERO,
        attenuation: 0.0,
        spot: 0.0,
    };
}

/// Returns the light as it arrives at `point`, in metres and world space like `light_position`. `light_axis` is the
/// unit direction in which the light shines, the -Z axis of its entity; only directional lights and spotlights use
/// it.
///
/// The rules are OpenGL's: a directional light is not attenuated, but a spot cone applies to it too, and the
/// ambient colour gets both factors. At the light's own position there is no direction, so only the ambient part is
/// left there (and with a cone narrower than π, not even that).
///
/// # Error of the f32 twin
///
/// Direction: 9 u of each component, for a normalized difference; 7 u for a directional light. Attenuation: that of
/// [`attenuate`](crate::attenuate), with 37 u and 76 u in place of its 13 u and 28 u, because the distance is off
/// by 12 u (difference, square and a root of 9 u) under a law of at most the second power. Spot: that of
/// [`spot_factor`] for a cosine that is off by 12 u Σ|l axis|; within that of the edge it may be the value of
/// either side. Colours are copied.
pub fn evaluate_light(light: &Light, light_position: DVec3, light_axis: DVec3, point: DVec3) -> LightSample {
    if !light.enabled {
        return LightSample::DARK;
    }
    let ambient = light.ambient.as_dvec3();
    if light.kind == LightKind::Ambient {
        return LightSample { ambient, attenuation: 1.0, spot: 1.0, ..LightSample::DARK };
    }
    let (direction, attenuation) = if light.kind == LightKind::Directional {
        (safe_normalize(-light_axis), 1.0)
    } else {
        // The halves are subtracted, as their difference is finite for any two finite positions.
        let half_way = light_position * 0.5 - point * 0.5;
        (safe_normalize(half_way), light.attenuation.factor(2.0 * safe_length(half_way)))
    };
    let spot = light.spot.map_or(1.0, |cone| {
        let SpotCosines { smooth_cone, outer, inner_or_exponent } = cone.cosines();
        spot_factor(smooth_cone, outer, inner_or_exponent, -direction.dot(light_axis))
    });
    LightSample {
        ambient,
        diffuse: light.diffuse.as_dvec3(),
        specular: light.specular.as_dvec3(),
        direction,
        attenuation,
        spot,
    }
}

/// Why a light has no value at a point. [`evaluate_light`] returns a finite substitute there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum NoLight {
    /// The light is off.
    #[error("the light is off")]
    Off,
    /// A directional light or a spotlight without an axis: its node is scaled to nothing.
    #[error("the light has no direction to shine in: give its node a scale that is not 0")]
    NoAxis,
    /// The point is the light's own position.
    #[error("the point is the light's own position, from which no direction leads to it")]
    AtTheLight,
    /// The attenuation has no value: see [`try_attenuate`](crate::try_attenuate).
    #[error("the attenuation has no value there: give coefficients that are at least 0 and not all 0")]
    NoAttenuation,
    /// The spot cone has no value: see [`SpotCone::try_factor`](crate::SpotCone::try_factor).
    #[error("the cone has no value: give angles from 0 to π/2 and an exponent of at least 0")]
    NoCone,
}

/// Returns [`evaluate_light`], or the reason why it is undefined.
///
/// # Errors
/// [`NoLight`], the first reason that applies.
pub fn try_evaluate_light(
    light: &Light,
    light_position: DVec3,
    light_axis: DVec3,
    point: DVec3,
) -> Result<LightSample, NoLight> {
    if !light.enabled {
        return Err(NoLight::Off);
    }
    let directional = light.kind == LightKind::Directional;
    if light.kind != LightKind::Ambient {
        if (directional || light.spot.is_some()) && try_normalize(light_axis).is_none() {
            return Err(NoLight::NoAxis);
        }
        let half_way = light_position * 0.5 - point * 0.5;
        if !directional {
            let direction = try_normalize(half_way).ok_or(NoLight::AtTheLight)?;
            let distance = 2.0 * safe_length(half_way);
            light.attenuation.try_factor(distance).ok_or(NoLight::NoAttenuation)?;
            if let Some(cone) = light.spot {
                cone.try_factor(light_axis, -direction).ok_or(NoLight::NoCone)?;
            }
        } else if let Some(cone) = light.spot {
            cone.try_factor(light_axis, light_axis).ok_or(NoLight::NoCone)?;
        }
    }
    Ok(evaluate_light(light, light_position, light_axis, point))
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::{Attenuation, SpotCone};

    #[test]
    fn a_point_light_by_the_inverse_square() {
        let sample =
            evaluate_light(&Light::point(Vec3::ONE), DVec3::new(0.0, 5.0, 0.0), DVec3::ZERO, DVec3::Y);
        assert_eq!(sample.direction, DVec3::Y);
        assert_eq!(sample.attenuation, 1.0 / 16.0);
        assert_eq!(sample.spot, 1.0);
        assert_eq!(sample.diffuse, DVec3::ONE);
    }

    #[test]
    fn a_directional_light_is_the_same_everywhere() {
        let mut light = Light::directional(Vec3::ONE);
        light.attenuation = Attenuation::INVERSE_SQUARE;
        for point in [DVec3::ZERO, DVec3::splat(1e300)] {
            let sample = evaluate_light(&light, DVec3::ONE, -DVec3::Y, point);
            assert_eq!((sample.direction, sample.attenuation, sample.spot), (DVec3::Y, 1.0, 1.0));
        }
        // A spot cone applies to it too: at its own axis the factor is 1, or 0 with a cutoff of 0.
        light.spot = Some(SpotCone::Exponent { cutoff: 0.0, exponent: 0.0 });
        assert_eq!(evaluate_light(&light, DVec3::ONE, -DVec3::Y, DVec3::ZERO).spot, 0.0);
    }

    #[test]
    fn a_spotlight_shines_along_its_axis() {
        let light = Light::spot(Vec3::ONE, SpotCone::Exponent { cutoff: 1.0, exponent: 2.0 });
        let (position, axis) = (DVec3::new(0.0, 4.0, 0.0), -DVec3::Y);
        // 3-4-5: the cosine is 0.8.
        let sample = evaluate_light(&light, position, axis, DVec3::new(3.0, 0.0, 0.0));
        assert!((sample.spot - 0.64).abs() < 1e-15);
        assert_eq!(sample.attenuation, 0.04);
        assert_eq!(evaluate_light(&light, position, axis, DVec3::new(0.0, 8.0, 0.0)).spot, 0.0);
        assert_eq!(evaluate_light(&light, position, DVec3::ZERO, DVec3::ZERO).spot, 0.0);
    }

    #[test]
    fn at_the_lights_own_position() {
        let sample = evaluate_light(&Light::point(Vec3::ONE), DVec3::ONE, -DVec3::Y, DVec3::ONE);
        assert_eq!(sample.direction, DVec3::ZERO);
        assert!((sample.attenuation / 1e4 - 1.0).abs() < 1e-15);
    }

    #[test]
    fn every_reason_for_no_light() {
        let tried = |light: &Light, axis: DVec3, point: DVec3| {
            try_evaluate_light(light, DVec3::Y, axis, point).map(|sample| sample.spot)
        };
        let lamp = Light::point(Vec3::ONE);
        let cone = SpotCone::Exponent { cutoff: 1.0, exponent: 0.0 };
        let spot = Light::spot(Vec3::ONE, cone);
        assert_eq!(tried(&lamp, DVec3::ZERO, DVec3::ZERO), Ok(1.0));
        assert_eq!(tried(&lamp, DVec3::ZERO, DVec3::Y), Err(NoLight::AtTheLight));
        assert_eq!(
            tried(&Light { enabled: false, ..lamp.clone() }, -DVec3::Y, DVec3::ZERO),
            Err(NoLight::Off)
        );
        assert_eq!(tried(&spot, -DVec3::Y, DVec3::ZERO), Ok(1.0));
        assert_eq!(tried(&spot, DVec3::ZERO, DVec3::ZERO), Err(NoLight::NoAxis));
        assert_eq!(tried(&Light::directional(Vec3::ONE), DVec3::ZERO, DVec3::ZERO), Err(NoLight::NoAxis));
        let none = Attenuation { constant: 0.0, ..Attenuation::NONE };
        let nowhere = Light { attenuation: none, ..lamp };
        assert_eq!(tried(&nowhere, -DVec3::Y, DVec3::ZERO), Err(NoLight::NoAttenuation));
        let turned = Light { spot: Some(SpotCone::Smooth { inner: 1.0, outer: 0.1 }), ..spot };
        assert_eq!(tried(&turned, -DVec3::Y, DVec3::ZERO), Err(NoLight::NoCone));
        let sun = Light { spot: turned.spot, ..Light::directional(Vec3::ONE) };
        assert_eq!(tried(&sun, -DVec3::Y, DVec3::ZERO), Err(NoLight::NoCone));
        assert_eq!(tried(&Light::ambient(Vec3::ONE), DVec3::ZERO, DVec3::Y), Ok(1.0));
        // `evaluate_light` itself is guarded and gives no light there.
        assert_eq!(evaluate_light(&spot, DVec3::Y, DVec3::ZERO, DVec3::ZERO).spot, 0.0);
    }

    #[test]
    fn the_ends_of_f64() {
        let far = DVec3::splat(f64::MAX);
        let sample = evaluate_light(&Light::point(Vec3::ONE), far, -DVec3::Y, -far);
        assert!((sample.direction - DVec3::splat(1.0 / 3f64.sqrt())).length() < 1e-15, "{sample:?}");
        assert!(sample.attenuation >= 0.0 && sample.attenuation < 1e-35);
    }

    #[test]
    fn ambient_and_off() {
        let ambient = evaluate_light(&Light::ambient(Vec3::ONE), DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        assert_eq!(
            ambient,
            LightSample { ambient: DVec3::ONE, attenuation: 1.0, spot: 1.0, ..LightSample::DARK }
        );
        let off = Light { enabled: false, ..Light::point(Vec3::ONE) };
        assert_eq!(evaluate_light(&off, DVec3::ZERO, DVec3::ZERO, DVec3::Y), LightSample::DARK);
    }
}
