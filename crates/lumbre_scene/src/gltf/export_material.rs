//! Exports a `Material` and its textures as a glTF material, plus LUMBRE_materials_phong for what
//! metallic-roughness cannot express.

use glam::Vec3;
use lumbre_optics::{AlphaMode, Fresnel, Lobe, Material, Surface, shininess_from_roughness};
use serde_json::{Map, Value, json};

use super::export::SaveError;
use super::export_data::Data;
use super::extensions::{PhongMaterial, PhongSurface};
use super::import_material::{default_lobe, front_from_metallic_roughness};
use crate::{MaterialTextures, Medium};

/// The JSON of a material. LUMBRE_materials_phong is written only if the material would not be read back
/// identically without it.
pub(crate) fn material(
    (material, medium): (&Material, Option<Medium>),
    textures: &MaterialTextures,
    name: &str,
    place: &str,
    data: &mut Data,
) -> Result<Value, SaveError> {
    let label = if name.is_empty() { place } else { name };
    material.validate(label).map_err(|source| SaveError::Material { place: place.to_owned(), source })?;
    if let Some((field, ..)) = medium.and_then(|medium| medium.fault()) {
        return Err(SaveError::NotFinite { place: place.to_owned(), field: format!("Medium.{field}") });
    }
    let mut extensions = Map::new();
    let emission = material.front.emission;
    // A power of two, so that multiplying factor and strength restores the same f32.
    let strength =
        if emission.max_element() > 1.0 { emission.max_element().log2().ceil().exp2() } else { 1.0 };
    let (factor, strength) =
        if strength.is_finite() { (emission / strength, strength) } else { (emission, 1.0) };
    if strength != 1.0 {
        let strength = json!({"emissiveStrength": f64::from(strength)});
        extensions.insert("KHR_materials_emissive_strength".to_owned(), strength);
    }
    if let Some(slot) =
        textures.metallic_roughness.as_ref().filter(|slot| slot.dielectric != Vec3::splat(0.04))
    {
        let tint = json!({"specularColorFactor": color(slot.dielectric / 0.04)});
        extensions.insert("KHR_materials_specular".to_owned(), tint);
    }
    if material.unlit {
        extensions.insert("KHR_materials_unlit".to_owned(), json!({}));
    }
    let (base, metallic, roughness) = match &textures.metallic_roughness {
        Some(slot) => (slot.base_color, slot.metallic, slot.roughness),
        None => metallic_roughness(&material.front, material.unlit),
    };
    let plain = front_from_metallic_roughness(base, metallic, roughness, emission, material.unlit);
    let exact = textures.metallic_roughness.is_some() || plain == material.front;
    let defaults = Material::default();
    // The default of a reader for a material without the extension, as in `import_material`.
    let textured = textures.metallic_roughness.is_some();
    let plain_fresnel = material.fresnel == Fresnel::NormalReflectance;
    let beyond = material.back.is_some()
        || material.mirror != defaults.mirror
        || material.transmission != defaults.transmission
        || material.ior != defaults.ior
        || medium.is_some_and(|medium| medium != Medium::default())
        || material.distribution != defaults.distribution
        || material.lobe != Lobe::EnergyConserving
        || !plain_fresnel;
    if !exact || beyond {
        let front = if textures.metallic_roughness.is_some() {
            // Stating coefficients would replace the metallic-roughness texture on import.
            PhongSurface::default()
        } else {
            surface(&material.front)
        };
        let conductor = match material.fresnel {
            Fresnel::Conductor { eta, absorption } => Some((eta, absorption)),
            Fresnel::Dielectric | Fresnel::NormalReflectance => None,
        };
        let mut phong = PhongMaterial {
            front,
            back: material.back.as_ref().map(surface),
            mirror: (material.mirror != defaults.mirror).then(|| color(material.mirror)),
            transmission: (material.transmission != defaults.transmission)
                .then(|| color(material.transmission)),
            ior: (material.ior != defaults.ior).then(|| f64::from(material.ior)),
            distribution: (material.distribution != defaults.distribution)
                .then(|| material.distribution.name().to_owned()),
            fresnel: (material.fresnel
                != if textured { Fresnel::NormalReflectance } else { Fresnel::Dielectric })
            .then(|| material.fresnel.name().to_owned()),
            eta: conductor.map(|(eta, _)| color(eta)),
            absorption: conductor.map(|(_, absorption)| color(absorption)),
            lobe: None,
            thin: medium.filter(|medium| medium.thin).map(|_| true),
            fresnel_split: medium.filter(|medium| medium.fresnel).map(|_| true),
            attenuation_color: medium
                .filter(|medium| medium.attenuation_color != Vec3::ONE)
                .map(|medium| color(medium.attenuation_color)),
            attenuation_distance: medium
                .filter(|medium| medium.attenuation_distance.is_finite())
                .map(|medium| f64::from(medium.attenuation_distance)),
        };
        if material.lobe != default_lobe(Some(&phong), textured) {
            phong.lobe = Some(material.lobe.name().to_owned());
        }
        let phong = serde_json::to_value(phong).map_err(|source| SaveError::Json { source })?;
        extensions.insert("LUMBRE_materials_phong".to_owned(), phong);
    }
    let [red, green, blue] = color(base.clamp(Vec3::ZERO, Vec3::ONE));
    let mut pbr = json!({
        "baseColorFactor": [red, green, blue, f64::from(material.alpha)],
        "metallicFactor": f64::from(metallic),
        "roughnessFactor": f64::from(roughness),
    });
    if let Some(texture) = &textures.base_color {
        pbr["baseColorTexture"] = data.texture(texture, place)?;
    }
    if let Some(slot) = &textures.metallic_roughness {
        pbr["metallicRoughnessTexture"] = data.texture(&slot.texture, place)?;
    }
    let mut written = json!({"pbrMetallicRoughness": pbr});
    if !name.is_empty() {
        written["name"] = name.into();
    }
    if emission != Vec3::ZERO {
        written["emissiveFactor"] = json!(color(factor));
    }
    if let Some(texture) = &textures.emissive {
        written["emissiveTexture"] = data.texture(texture, place)?;
    }
    if let Some(normal) = &textures.normal {
        let mut info = data.texture(&normal.texture, place)?;
        info["scale"] = json!(f64::from(normal.scale));
        written["normalTexture"] = info;
    }
    if let Some(occlusion) = &textures.occlusion {
        let mut info = data.texture(&occlusion.texture, place)?;
        info["strength"] = json!(f64::from(occlusion.strength));
        written["occlusionTexture"] = info;
    }
    match material.alpha_mode {
        AlphaMode::Opaque => {}
        AlphaMode::Mask { cutoff } => {
            written["alphaMode"] = "MASK".into();
            written["alphaCutoff"] = json!(f64::from(cutoff));
        }
        AlphaMode::Blend => written["alphaMode"] = "BLEND".into(),
    }
    if material.double_sided {
        written["doubleSided"] = true.into();
    }
    if !extensions.is_empty() {
        written["extensions"] = extensions.into();
    }
    Ok(written)
}

/// Linear RGB as JSON numbers.
pub(crate) fn color(value: Vec3) -> [f64; 3] {
    value.to_array().map(f64::from)
}

fn surface(surface: &Surface) -> PhongSurface {
    PhongSurface {
        ambient: Some(color(surface.ambient)),
        diffuse: Some(color(surface.diffuse)),
        specular: Some(color(surface.specular)),
        emission: Some(color(surface.emission)),
        shininess: Some(f64::from(surface.shininess)),
    }
}

/// Base colour, metallic and roughness that import maps to exactly this surface. If there are none, a
/// dielectric with the surface's diffuse colour and exponent.
fn metallic_roughness(front: &Surface, unlit: bool) -> (Vec3, f32, f32) {
    let base = front.ambient;
    let strongest = base.max_position();
    let metallic = if unlit || base[strongest] == 0.0 {
        let contrast = base[strongest] - 0.04;
        if contrast == 0.0 { 0.0 } else { (front.specular[strongest] - 0.04) / contrast }
    } else {
        1.0 - front.diffuse[strongest] / base[strongest]
    };
    let metallic = nearest(metallic, |metallic| {
        let mapped = front_from_metallic_roughness(base, metallic, 1.0, Vec3::ZERO, unlit);
        mapped.diffuse == front.diffuse && mapped.specular == front.specular
    });
    let alpha = (2.0 / (f64::from(front.shininess) + 2.0)).sqrt();
    let roughness =
        nearest(alpha.sqrt() as f32, |roughness| shininess_from_roughness(roughness) == front.shininess);
    let fits = base.max_element() <= 1.0 && metallic.1 && roughness.1;
    if fits { (base, metallic.0, roughness.0) } else { (front.diffuse, 0.0, roughness.0) }
}

/// Searches for a number in [0, 1], within a few roundings of `start`, for which `matches` is true. Returns
/// it with true, or `start` with false if there is none.
fn nearest(start: f32, matches: impl Fn(f32) -> bool) -> (f32, bool) {
    let start = if start.is_nan() { 0.0 } else { start.clamp(0.0, 1.0) };
    let (mut below, mut above) = (start, start);
    for _ in 0..16 {
        for candidate in [below, above] {
            if (0.0..=1.0).contains(&candidate) && matches(candidate) {
                return (candidate, true);
            }
        }
        (below, above) = (below.next_down(), above.next_up());
    }
    (start, false)
}
