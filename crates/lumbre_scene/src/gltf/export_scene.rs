//! Exports scene settings and cameras as JSON.

use bevy_ecs::prelude::*;
use glam::Vec3;
use lumbre_optics::{FlatRule, FogMode};
use serde_json::{Value, json};

use super::export::SaveError;
use super::export_material::color;
use super::extensions::{FogExtension, SceneExtension};
use super::frame_settings;
use crate::{Camera, Projection, SceneSettings};

/// The LUMBRE_scene object, or `None` if all settings are the defaults.
pub(crate) fn settings(world: &World) -> Result<Option<Value>, SaveError> {
    let settings = world.get_resource::<SceneSettings>().copied().unwrap_or_default();
    if settings == SceneSettings::default() {
        return Ok(None);
    }
    if ![settings.ambient, settings.background, settings.sky].iter().all(|color| color.is_finite()) {
        let (place, field) = ("scene".to_owned(), "ambient, background or sky".to_owned());
        return Err(SaveError::NotFinite { place, field });
    }
    let fog = match &settings.fog {
        Some(fog) => {
            fog.validate("scene").map_err(|source| SaveError::Fog { source })?;
            let mut written = FogExtension { color: Some(color(fog.color)), ..FogExtension::default() };
            let mode = match fog.mode {
                FogMode::Linear { start, end } => {
                    (written.start, written.end) = (Some(start.into()), Some(end.into()));
                    "linear"
                }
                FogMode::Exponential { density } => {
                    written.density = Some(density.into());
                    "exp"
                }
                FogMode::ExponentialSquared { density } => {
                    written.density = Some(density.into());
                    "exp2"
                }
                FogMode::DepthCue { start, end, near_weight, far_weight } => {
                    (written.start, written.end) = (Some(start.into()), Some(end.into()));
                    (written.near_weight, written.far_weight) =
                        (Some(near_weight.into()), Some(far_weight.into()));
                    "depth-cue"
                }
            };
            written.mode = Some(mode.to_owned());
            Some(written)
        }
        None => None,
    };
    let written = SceneExtension {
        ambient: Some(color(settings.ambient)),
        background: Some(color(settings.background)),
        sky: (settings.sky != Vec3::ZERO).then(|| color(settings.sky)),
        local_viewer: Some(settings.local_viewer),
        two_sided: Some(settings.two_sided),
        reflection: Some(settings.reflection.name().to_owned()),
        shading: Some(settings.shading.to_string()),
        flat_rule: (settings.flat_rule != FlatRule::default()).then(|| settings.flat_rule.name().to_owned()),
        specular_antialiasing: settings.specular_antialiasing.then_some(true),
        fog,
        frame: frame_settings::written(&settings.frame)?,
    };
    serde_json::to_value(written).map(Some).map_err(|source| SaveError::Json { source })
}

/// The JSON of a camera.
pub(crate) fn camera(camera: &Camera, place: &str) -> Result<Value, SaveError> {
    let (written, numbers) = match camera.projection {
        Projection::Perspective { vertical_fov, aspect, near, far } => {
            let mut lens = json!({"yfov": vertical_fov, "znear": near});
            if let Some(aspect) = aspect {
                lens["aspectRatio"] = json!(aspect);
            }
            if let Some(far) = far {
                lens["zfar"] = json!(far);
            }
            let numbers = [vertical_fov, near, aspect.unwrap_or(1.0), far.unwrap_or(1.0)];
            (json!({"type": "perspective", "perspective": lens}), numbers)
        }
        Projection::Orthographic { half_width, half_height, near, far } => {
            let lens = json!({"xmag": half_width, "ymag": half_height, "znear": near, "zfar": far});
            (json!({"type": "orthographic", "orthographic": lens}), [half_width, half_height, near, far])
        }
    };
    if numbers.iter().all(|number| number.is_finite()) && camera.exposure.is_finite() {
        Ok(written)
    } else {
        Err(SaveError::NotFinite { place: place.to_owned(), field: "Camera".to_owned() })
    }
}
