//! Exports a `Light` as KHR_lights_punctual, plus LUMBRE_lights_phong for what that cannot express.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::Vec3;
use lumbre_optics::{BakeMode, Light, LightKind, SpotCone};
use serde_json::{Value, json};

use super::document::PunctualLight;
use super::export::SaveError;
use super::export_material::color;
use super::extensions::{PhongLight, PhongSpot};
use super::import_light;

/// The JSON of a light. The KHR keys approximate it for other programs; LUMBRE_lights_phong states it
/// exactly.
pub(crate) fn light(light: &Light, name: Option<&str>, place: &str) -> Result<Value, SaveError> {
    light
        .validate(name.unwrap_or(place))
        .map_err(|source| SaveError::Light { place: place.to_owned(), source })?;
    let strongest = light.diffuse.max_element();
    let hue = if strongest > 0.0 { light.diffuse / strongest } else { Vec3::ONE };
    let mut written = json!({"color": color(hue.min(Vec3::ONE)), "intensity": f64::from(strongest * PI)});
    if let Some(name) = name {
        written["name"] = name.into();
    }
    written["type"] = match (light.kind, light.spot) {
        (LightKind::Directional, _) => "directional",
        (LightKind::Point, Some(_)) => "spot",
        // glTF has no ambient light. Other programs see a black point light instead, which does no harm.
        (LightKind::Point | LightKind::Ambient, _) => "point",
    }
    .into();
    if light.attenuation.range.is_finite() {
        written["range"] = json!(f64::from(light.attenuation.range));
    }
    if let (LightKind::Point, Some(cone)) = (light.kind, light.spot) {
        // KHR requires an outer angle in (0, π/2] and an inner angle less than that.
        let outer = cone.outer_angle().clamp(1e-3, FRAC_PI_2);
        let inner = match cone {
            SpotCone::Smooth { inner, .. } => inner.min(outer.next_down()),
            SpotCone::Exponent { exponent: 0.0, .. } => outer.next_down(),
            SpotCone::Exponent { .. } => 0.0,
        };
        written["spot"] = json!({"innerConeAngle": f64::from(inner), "outerConeAngle": f64::from(outer)});
    }
    let reread = PunctualLight::deserialize_value(&written)
        .and_then(|source| import_light::light(&source, place).ok());
    // A static light is always marked explicitly, since a baked file states by this what its lightmaps
    // contain.
    if reread.as_ref() != Some(light) || light.bake == BakeMode::Static {
        let phong = serde_json::to_value(phong(light, reread.and_then(|light| light.spot)));
        let phong = phong.map_err(|source| SaveError::Json { source })?;
        written["extensions"] = json!({"LUMBRE_lights_phong": phong});
    }
    Ok(written)
}

/// The LUMBRE_lights_phong object. The cone is left out if KHR_lights_punctual expresses it exactly.
pub(crate) fn phong(light: &Light, khr_spot: Option<SpotCone>) -> PhongLight {
    let attenuation = &light.attenuation;
    let spot = light.spot.filter(|cone| Some(*cone) != khr_spot).map(|cone| match cone {
        SpotCone::Exponent { cutoff, exponent } => PhongSpot {
            cutoff: Some(f64::from(cutoff)),
            exponent: Some(f64::from(exponent)),
            ..PhongSpot::default()
        },
        SpotCone::Smooth { inner, outer } => {
            PhongSpot { inner: Some(f64::from(inner)), outer: Some(f64::from(outer)), ..PhongSpot::default() }
        }
    });
    PhongLight {
        kind: (light.kind == LightKind::Ambient).then(|| "ambient".to_owned()),
        ambient: Some(color(light.ambient)),
        diffuse: Some(color(light.diffuse)),
        specular: Some(color(light.specular)),
        attenuation: Some(color(attenuation.coefficients())),
        attenuation_clamp: Some(attenuation.clamp),
        spot,
        enabled: Some(light.enabled),
        shadow: Some(light.shadow),
        bake: Some(
            match light.bake {
                BakeMode::Dynamic => "dynamic",
                BakeMode::Mixed => "mixed",
                BakeMode::Static => "static",
            }
            .to_owned(),
        ),
        radius: (light.radius != 0.0).then_some(f64::from(light.radius)),
        angle: (light.angle != 0.0).then_some(f64::from(light.angle)),
    }
}

impl PunctualLight {
    fn deserialize_value(value: &Value) -> Option<Self> {
        serde::Deserialize::deserialize(value).ok()
    }
}
