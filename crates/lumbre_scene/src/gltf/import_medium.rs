//! Imports the medium of a transmissive material from `KHR_materials_transmission`, `KHR_materials_volume`
//! and `LUMBRE_materials_phong`. The coefficient of transmission and the index of refraction are read in
//! `import_material`.

use super::document::{self, extension};
use super::error::{LoadProblem, Notes};
use super::extensions::{PhongMaterial, Transmission, Volume};
use super::value::{color, number};
use crate::Medium;

/// The medium of a material, or `None` if it equals the default.
pub(crate) fn medium(
    source: &document::Material,
    place: &str,
    notes: &mut Notes,
) -> Result<Option<Medium>, LoadProblem> {
    let transmission =
        extension::<Transmission>(&source.extensions, "KHR_materials_transmission", place)?.is_some();
    let volume = extension::<Volume>(&source.extensions, "KHR_materials_volume", place)?;
    let phong = extension::<PhongMaterial>(&source.extensions, "LUMBRE_materials_phong", place)?;
    let defaults = Medium::default();
    let mut medium = defaults;
    if transmission {
        // In glTF a transmissive surface without a volume, or with thickness 0, is thin. Its transmission
        // follows Fresnel.
        let solid = volume.as_ref().is_some_and(|volume| number(volume.thickness_factor, 0.0) > 0.0);
        (medium.thin, medium.fresnel) = (!solid, true);
    }
    if let Some(volume) = &volume {
        medium.attenuation_color = volume.attenuation_color.map_or(defaults.attenuation_color, color);
        medium.attenuation_distance = number(volume.attenuation_distance, defaults.attenuation_distance);
        if volume.thickness_texture.is_some() {
            let remark = "KHR_materials_volume.thicknessTexture is not read; rays find how thick the mesh is";
            notes.add(place, remark);
        }
    }
    if let Some(phong) = &phong {
        medium.thin = phong.thin.unwrap_or(medium.thin);
        medium.fresnel = phong.fresnel_split.unwrap_or(medium.fresnel);
        medium.attenuation_color = phong.attenuation_color.map_or(medium.attenuation_color, color);
        medium.attenuation_distance = number(phong.attenuation_distance, medium.attenuation_distance);
    }
    if let Some((field, value, expected)) = medium.fault() {
        let (place, field) = (place.to_owned(), field.to_owned());
        return Err(LoadProblem::Value { place, field, value, expected: expected.to_owned() });
    }
    Ok((medium != defaults).then_some(medium))
}
