//! Reads and writes `LUMBRE_scene.frame`, the frame settings of a level.

use serde::{Deserialize, Serialize};

use super::error::LoadProblem;
use super::export::SaveError;
use super::import_scene::unknown;
use crate::{FrameSettings, LightmapEncoding, ShadowFilter};

/// `LUMBRE_scene.frame`.
#[derive(Deserialize, Serialize, Clone, Debug, Default)]
#[serde(rename_all = "camelCase")]
pub(crate) struct FrameExtension {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub multisample: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub light_threshold: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shadows: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shadow_resolution: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shadow_filter: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lightmap_format: Option<String>,
}

/// The settings in a file, with defaults for missing keys.
pub(crate) fn read(source: &FrameExtension, place: &str) -> Result<FrameSettings, LoadProblem> {
    let usual = FrameSettings::default();
    let number = |field: &str, value: Option<f64>, usual: f32, range: [f32; 2], expected: &str| {
        let value = value.map_or(usual, |value| value as f32);
        match (range[0]..=range[1]).contains(&value) {
            true => Ok(value),
            false => Err(LoadProblem::Value {
                place: place.to_owned(),
                field: format!("LUMBRE_scene.frame.{field}"),
                value: value.to_string(),
                expected: expected.to_owned(),
            }),
        }
    };
    let [least, most] = FrameSettings::SHADOW_RESOLUTIONS;
    let light_threshold = number(
        "lightThreshold",
        source.light_threshold,
        usual.light_threshold,
        [0.0, f32::MAX],
        "use a finite radiance of at least 0",
    )?;
    let shadow_resolution = number(
        "shadowResolution",
        source.shadow_resolution,
        usual.shadow_resolution,
        [least, most],
        &format!("use a factor from {least} to {most}"),
    )?;
    let shadow_filter = match &source.shadow_filter {
        Some(name) => ShadowFilter::from_name(name).ok_or_else(|| {
            let names = ShadowFilter::ALL.iter().map(|filter| filter.name());
            unknown(place, "LUMBRE_scene.frame.shadowFilter", name, names)
        })?,
        None => usual.shadow_filter,
    };
    let lightmap_format = match &source.lightmap_format {
        Some(name) => LightmapEncoding::from_name(name).ok_or_else(|| {
            let names = LightmapEncoding::ALL.iter().map(|format| format.name());
            unknown(place, "LUMBRE_scene.frame.lightmapFormat", name, names)
        })?,
        None => usual.lightmap_format,
    };
    Ok(FrameSettings {
        multisample: source.multisample,
        light_threshold,
        shadows: source.shadows.unwrap_or(usual.shadows),
        shadow_resolution,
        shadow_filter,
        lightmap_format,
    })
}

/// The settings as JSON, without those equal to the defaults; `None` if all are.
///
/// # Errors
/// [`SaveError::NotFinite`] if a number is NaN or infinite.
pub(crate) fn written(settings: &FrameSettings) -> Result<Option<FrameExtension>, SaveError> {
    let usual = FrameSettings::default();
    if *settings == usual {
        return Ok(None);
    }
    for (field, value) in
        [("light_threshold", settings.light_threshold), ("shadow_resolution", settings.shadow_resolution)]
    {
        if !value.is_finite() {
            let (place, field) = ("scene".to_owned(), format!("frame.{field}"));
            return Err(SaveError::NotFinite { place, field });
        }
    }
    let unless = |value: f32, usual: f32| (value != usual).then(|| f64::from(value));
    let resolution = settings.shadow_resolution();
    let filter = Some(settings.shadow_filter).filter(|filter| *filter != usual.shadow_filter);
    let format = Some(settings.lightmap_format).filter(|format| *format != usual.lightmap_format);
    Ok(Some(FrameExtension {
        multisample: settings.multisample,
        light_threshold: unless(settings.light_threshold.max(0.0), usual.light_threshold),
        shadows: Some(settings.shadows).filter(|shadows| *shadows != usual.shadows),
        shadow_resolution: unless(resolution, usual.shadow_resolution),
        shadow_filter: filter.map(|filter| filter.name().to_owned()),
        lightmap_format: format.map(|format| format.name().to_owned()),
    }))
}
