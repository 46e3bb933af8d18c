//! Imports lights: KHR_lights_punctual, with LUMBRE_lights_phong, to `Light`. Their positions are in the
//! nodes.

use std::f32::consts::{FRAC_PI_4, PI};

use glam::Vec3;
use lumbre_optics::{Attenuation, BakeMode, Light, LightKind, SpotCone};

use super::document::{PunctualLight, PunctualSpot, extension, shortened};
use super::error::LoadProblem;
use super::extensions::{PhongLight, PhongSpot};
use super::value::{color, number};

/// Reads one light.
///
/// Without LUMBRE_lights_phong its colour is `color * intensity / π`, as k_d is multiplied by irradiance / π,
/// with the inverse-square law and the specification's window at `range`. With LUMBRE_lights_phong the
/// numbers are used unchanged.
pub(crate) fn light(source: &PunctualLight, place: &str) -> Result<Light, LoadProblem> {
    let wrong = |field: &str, value: &str, expected: &str| LoadProblem::Value {
        place: place.to_owned(),
        field: field.to_owned(),
        value: format!("{:?}", shortened(value)),
        expected: expected.to_owned(),
    };
    let strength = source.color.map_or(Vec3::ONE, color) * number(source.intensity, 1.0);
    let range = number(source.range, f32::INFINITY);
    let mut light = match source.kind.as_str() {
        "directional" => Light::directional(strength / PI),
        "point" => Light::point(strength / PI),
        "spot" => Light::spot(strength / PI, smooth_cone(source.spot.as_ref())),
        other => return Err(wrong("type", other, "use directional, point or spot")),
    };
    light.attenuation.range = range;
    light.bake = BakeMode::Static;
    if let Some(phong) = extension::<PhongLight>(&source.extensions, "LUMBRE_lights_phong", place)? {
        match phong.kind.as_deref() {
            None => {}
            Some("ambient") => light.kind = LightKind::Ambient,
            Some(other) => {
                return Err(wrong("LUMBRE_lights_phong.kind", other, "use ambient, or leave it out"));
            }
        }
        light.ambient = phong.ambient.map_or(Vec3::ZERO, color);
        light.diffuse = phong.diffuse.map_or(strength, color);
        light.specular = phong.specular.map_or(strength, color);
        let [constant, linear, quadratic] =
            phong.attenuation.unwrap_or([1.0, 0.0, 0.0]).map(|value| value as f32);
        let clamp = phong.attenuation_clamp.unwrap_or(false);
        light.attenuation = Attenuation { constant, linear, quadratic, clamp, range };
        if let Some(spot) = &phong.spot {
            light.spot = Some(cone(spot, source.spot.as_ref()));
        }
        (light.radius, light.angle) = (number(phong.radius, 0.0), number(phong.angle, 0.0));
        light.enabled = phong.enabled.unwrap_or(true);
        light.shadow = phong.shadow.unwrap_or(false);
        light.bake = match phong.bake.as_deref() {
            None | Some("static") => BakeMode::Static,
            Some("mixed") => BakeMode::Mixed,
            Some("dynamic") => BakeMode::Dynamic,
            Some(other) => {
                return Err(wrong("LUMBRE_lights_phong.bake", other, "use dynamic, mixed or static"));
            }
        };
    }
    let name = source.name.as_deref().map_or(place, shortened);
    light.validate(name).map_err(|source| LoadProblem::Light { place: place.to_owned(), source })?;
    Ok(light)
}

fn smooth_cone(spot: Option<&PunctualSpot>) -> SpotCone {
    let inner = number(spot.and_then(|spot| spot.inner_cone_angle), 0.0);
    let outer = number(spot.and_then(|spot| spot.outer_cone_angle), FRAC_PI_4);
    SpotCone::Smooth { inner, outer }
}

fn cone(spot: &PhongSpot, beside: Option<&PunctualSpot>) -> SpotCone {
    if spot.inner.is_some() || spot.outer.is_some() {
        return SpotCone::Smooth { inner: number(spot.inner, 0.0), outer: number(spot.outer, FRAC_PI_4) };
    }
    let outer = number(beside.and_then(|beside| beside.outer_cone_angle), FRAC_PI_4);
    SpotCone::Exponent { cutoff: number(spot.cutoff, outer), exponent: number(spot.exponent, 0.0) }
}
