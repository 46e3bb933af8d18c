//! Imports the scene settings (LUMBRE_scene) and the projections of cameras.

use std::f64::consts::PI;

use glam::Vec3;
use lumbre_optics::{FlatRule, Fog, FogMode, NoShading, ReflectionModel, Shading};

use super::document::{Document, extension, shortened};
use super::error::LoadProblem;
use super::extensions::{FogExtension, SceneExtension};
use super::frame_settings;
use super::value::{color, number};
use crate::{Projection, SceneSettings};

/// The settings of a scene, with defaults for missing keys.
pub(crate) fn settings(document: &Document, scene: usize) -> Result<SceneSettings, LoadProblem> {
    let place = format!("scenes[{scene}]");
    let mut settings = SceneSettings::default();
    let Some(source) = document.scenes.get(scene) else { return Ok(settings) };
    let Some(found) = extension::<SceneExtension>(&source.extensions, "LUMBRE_scene", &place)? else {
        return Ok(settings);
    };
    for (field, source, target) in [
        ("ambient", found.ambient, &mut settings.ambient),
        ("background", found.background, &mut settings.background),
        ("sky", found.sky, &mut settings.sky),
    ] {
        let value = source.map_or(*target, color);
        if !value.is_finite() || value.min_element() < 0.0 {
            return Err(LoadProblem::Value {
                place,
                field: format!("LUMBRE_scene.{field}"),
                value: value.to_string(),
                expected: "use finite numbers that are at least 0".to_owned(),
            });
        }
        *target = value;
    }
    settings.local_viewer = found.local_viewer.unwrap_or(settings.local_viewer);
    settings.two_sided = found.two_sided.unwrap_or(settings.two_sided);
    if let Some(name) = &found.reflection {
        settings.reflection = reflection(name, &place, "LUMBRE_scene.reflection")?;
    }
    if let Some(name) = &found.shading {
        settings.shading = shading(name, &place, "LUMBRE_scene.shading")?;
    }
    if let Some(name) = &found.flat_rule {
        settings.flat_rule = FlatRule::from_name(name).ok_or_else(|| {
            let names = FlatRule::ALL.iter().map(|rule| rule.name());
            unknown(&place, "LUMBRE_scene.flatRule", name, names)
        })?;
    }
    settings.specular_antialiasing = found.specular_antialiasing.unwrap_or(settings.specular_antialiasing);
    if let Some(source) = &found.fog {
        let fog = fog(source, &place)?;
        fog.validate(&place).map_err(|source| LoadProblem::Fog { place: place.clone(), source })?;
        settings.fog = Some(fog);
    }
    if let Some(source) = &found.frame {
        settings.frame = frame_settings::read(source, &place)?;
    }
    Ok(settings)
}

/// The shading with this name. Shading by need has its error bound appended, as in `auto:0.01`.
pub(crate) fn shading(name: &str, place: &str, field: &str) -> Result<Shading, LoadProblem> {
    name.parse().map_err(|unknown: NoShading| LoadProblem::Value {
        place: place.to_owned(),
        field: field.to_owned(),
        value: format!("{:?}", shortened(name)),
        expected: unknown.to_string(),
    })
}

/// The reflection model with this name.
pub(crate) fn reflection(name: &str, place: &str, field: &str) -> Result<ReflectionModel, LoadProblem> {
    let names = ReflectionModel::ALL.iter().map(|model| model.name());
    ReflectionModel::from_name(name).ok_or_else(|| unknown(place, field, name, names))
}

/// The error for a name that is not one of the allowed `names`.
pub(crate) fn unknown(
    place: &str,
    field: &str,
    value: &str,
    names: impl Iterator<Item = &'static str>,
) -> LoadProblem {
    LoadProblem::Value {
        place: place.to_owned(),
        field: field.to_owned(),
        value: format!("{:?}", shortened(value)),
        expected: format!("use one of {}", names.collect::<Vec<_>>().join(", ")),
    }
}

/// Reads fog, with OpenGL's defaults (start 0, end 1, density 1) for missing keys.
fn fog(source: &FogExtension, place: &str) -> Result<Fog, LoadProblem> {
    let (start, end) = (number(source.start, 0.0), number(source.end, 1.0));
    let density = number(source.density, 1.0);
    let mode = match source.mode.as_deref() {
        Some("linear") => FogMode::Linear { start, end },
        Some("exp") | None => FogMode::Exponential { density },
        Some("exp2") => FogMode::ExponentialSquared { density },
        Some("depth-cue") => {
            let (near_weight, far_weight) = (number(source.near_weight, 1.0), number(source.far_weight, 0.0));
            FogMode::DepthCue { start, end, near_weight, far_weight }
        }
        Some(other) => {
            let names = ["linear", "exp", "exp2", "depth-cue"].into_iter();
            return Err(unknown(place, "LUMBRE_scene.fog.mode", other, names));
        }
    };
    Ok(Fog { mode, color: source.color.map_or(Vec3::ZERO, color) })
}

/// The projection of `cameras[index]`, which must exist.
pub(crate) fn projection(document: &Document, index: usize) -> Result<Projection, LoadProblem> {
    let camera = &document.cameras[index];
    let place = match &camera.name {
        Some(name) => format!("cameras[{index}] ({})", shortened(name)),
        None => format!("cameras[{index}]"),
    };
    let check = |good: bool, field: &str, value: f64, expected: &str| {
        if good && value.is_finite() {
            return Ok(());
        }
        let (field, value, expected) = (field.to_owned(), value.to_string(), expected.to_owned());
        Err(LoadProblem::Value { place: place.clone(), field, value, expected })
    };
    match (camera.kind.as_str(), &camera.perspective, &camera.orthographic) {
        ("perspective", Some(lens), _) => {
            check(lens.yfov > 0.0 && lens.yfov < PI, "yfov", lens.yfov, "use radians above 0 and below π")?;
            check(lens.znear > 0.0, "znear", lens.znear, "use a distance above 0")?;
            if let Some(aspect) = lens.aspect_ratio {
                check(aspect > 0.0, "aspectRatio", aspect, "use a ratio above 0, or leave it out")?;
            }
            if let Some(far) = lens.zfar {
                check(far > lens.znear, "zfar", far, "use a distance beyond znear, or leave it out")?;
            }
            let (vertical_fov, aspect) = (lens.yfov, lens.aspect_ratio);
            Ok(Projection::Perspective { vertical_fov, aspect, near: lens.znear, far: lens.zfar })
        }
        ("orthographic", _, Some(lens)) => {
            check(lens.xmag != 0.0, "xmag", lens.xmag, "use half the width that is seen")?;
            check(lens.ymag != 0.0, "ymag", lens.ymag, "use half the height that is seen")?;
            check(lens.znear >= 0.0, "znear", lens.znear, "use a distance of at least 0")?;
            check(lens.zfar > lens.znear, "zfar", lens.zfar, "use a distance beyond znear")?;
            // Negative magnitudes would mirror the picture; the specification only advises against them.
            let (half_width, half_height) = (lens.xmag.abs(), lens.ymag.abs());
            Ok(Projection::Orthographic { half_width, half_height, near: lens.znear, far: lens.zfar })
        }
        (kind, _, _) => Err(LoadProblem::Value {
            place,
            field: "type".to_owned(),
            value: format!("{:?}", shortened(kind)),
            expected: "use perspective or orthographic, with an object of that name beside it".to_owned(),
        }),
    }
}
