//! Imports glTF materials as Phong materials, with their textures. The equations of the conversion are in
//! `lumbre_optics`.

use std::sync::Arc;

use glam::Vec3;
use lumbre_optics::{AlphaMode, Distribution, Fresnel, Lobe, Material, Surface};

use super::document::{self, extension, shortened};
use super::error::{LoadProblem, Notes};
use super::extensions::{
    EmissiveStrength, IndexOfRefraction, PhongMaterial, PhongSurface, Specular, Transmission,
};
use super::import_image::{Images, white};
use super::import_scene::unknown;
use super::value::{color, number};
use crate::{MaterialTextures, MetallicRoughnessTexture, NormalTexture, OcclusionTexture, TextureReference};

/// Reads one material.
pub(crate) fn material(
    source: &document::Material,
    place: &str,
    images: &mut Images<'_>,
    notes: &mut Notes,
) -> Result<(Material, MaterialTextures), LoadProblem> {
    let pbr = &source.pbr_metallic_roughness;
    let [red, green, blue, alpha] = pbr.base_color_factor.unwrap_or([1.0; 4]);
    let base = color([red, green, blue]);
    let (metallic, roughness) = (number(pbr.metallic_factor, 1.0), number(pbr.roughness_factor, 1.0));
    for (field, value) in [("metallicFactor", metallic), ("roughnessFactor", roughness)] {
        if !(0.0..=1.0).contains(&value) {
            let expected = "use a number from 0 to 1".to_owned();
            let (field, value) = (format!("pbrMetallicRoughness.{field}"), value.to_string());
            return Err(LoadProblem::Value { place: place.to_owned(), field, value, expected });
        }
    }
    let dielectric = dielectric(source, place, notes)?;
    let strength =
        extension::<EmissiveStrength>(&source.extensions, "KHR_materials_emissive_strength", place)?;
    let strength = number(strength.and_then(|strength| strength.emissive_strength), 1.0);
    let emission = source.emissive_factor.map_or(Vec3::ZERO, color) * strength;
    let phong = extension::<PhongMaterial>(&source.extensions, "LUMBRE_materials_phong", place)?;

    let mut textures = MaterialTextures::default();
    if let Some(info) = &pbr.base_color_texture {
        textures.base_color = images.texture(info, &format!("{place}.baseColorTexture"), notes)?;
    }
    if let Some(info) = &source.emissive_texture {
        textures.emissive = images.texture(info, &format!("{place}.emissiveTexture"), notes)?;
    }
    if let Some(info) = &pbr.metallic_roughness_texture
        && phong.as_ref().is_none_or(|phong| !phong.front.states_reflection())
    {
        let texture = images.texture(info, &format!("{place}.metallicRoughnessTexture"), notes)?;
        textures.metallic_roughness = texture.map(|texture| MetallicRoughnessTexture {
            texture,
            base_color: base,
            metallic,
            roughness,
            dielectric: dielectric.specular,
        });
    }
    // The highlight of a metal has the colour of its base texture. That needs the per-texel conversion, here
    // with the factors alone.
    if textures.metallic_roughness.is_none()
        && metallic > 0.0
        && phong.is_none()
        && let Some(base_texture) = &textures.base_color
    {
        let texture = TextureReference { image: Arc::new(white()), ..base_texture.clone() };
        textures.metallic_roughness = Some(MetallicRoughnessTexture {
            texture,
            base_color: base,
            metallic,
            roughness,
            dielectric: dielectric.specular,
        });
    }
    textures.normal = normal_texture(source, place, images, notes)?;
    textures.occlusion = occlusion_texture(source, place, images, notes)?;

    let unlit = source.extensions.contains_key("KHR_materials_unlit");
    let mut front = front_from_metallic_roughness(base, metallic, roughness, emission, unlit);
    if let Some(specular) = dielectric.stated() {
        front.specular = specular.lerp(base, metallic);
    }
    // In the metallic-roughness model k_s is the reflectance at normal incidence.
    let replaced = phong.is_some() && textures.metallic_roughness.is_none();
    let fresnel = if replaced { Fresnel::Dielectric } else { Fresnel::NormalReflectance };
    let mut material = Material { front, unlit, fresnel, ..Material::default() };
    material.ior = dielectric.ior;
    let transmitted = transmission(source, place, notes)?;
    material.transmission = transmitted * base * (1.0 - metallic);
    // glTF blends transmission with diffuse reflection, so the diffuse part keeps the remaining fraction.
    material.front.diffuse *= 1.0 - transmitted;
    material.front.ambient *= 1.0 - transmitted;
    material.lobe = default_lobe(phong.as_ref(), textures.metallic_roughness.is_some());
    if let Some(phong) = phong {
        if textures.metallic_roughness.is_none() {
            let default = Surface { ambient: base, diffuse: base, emission, ..Surface::default() };
            material.front = surface(&phong.front, &default);
        } else {
            material.front.emission = phong.front.emission.map_or(emission, color);
        }
        material.back = phong.back.as_ref().map(|back| surface(back, &material.front));
        material.mirror = phong.mirror.map_or(material.mirror, color);
        material.transmission = phong.transmission.map_or(material.transmission, color);
        material.ior = number(phong.ior, material.ior);
        if let Some(name) = &phong.distribution {
            material.distribution = Distribution::from_name(name).ok_or_else(|| {
                let names = Distribution::ALL.iter().map(|choice| choice.name());
                unknown(place, "LUMBRE_materials_phong.distribution", name, names)
            })?;
        }
        material.fresnel = fresnel_of(&phong, material.fresnel, place)?;
        if let Some(name) = &phong.lobe {
            material.lobe = Lobe::from_name(name).ok_or_else(|| {
                let names = Lobe::ALL.iter().map(|choice| choice.name());
                unknown(place, "LUMBRE_materials_phong.lobe", name, names)
            })?;
        }
    }
    material.alpha = alpha as f32;
    material.alpha_mode = match source.alpha_mode.as_deref() {
        None | Some("OPAQUE") => AlphaMode::Opaque,
        Some("MASK") => AlphaMode::Mask { cutoff: number(source.alpha_cutoff, 0.5) },
        Some("BLEND") => AlphaMode::Blend,
        Some(other) => {
            let (field, value) = ("alphaMode".to_owned(), format!("{:?}", shortened(other)));
            let expected = "use OPAQUE, MASK or BLEND".to_owned();
            return Err(LoadProblem::Value { place: place.to_owned(), field, value, expected });
        }
    };
    material.double_sided = source.double_sided;
    let name = source.name.as_deref().map_or(place, shortened);
    material.validate(name).map_err(|source| LoadProblem::Material { place: place.to_owned(), source })?;
    Ok((material, textures))
}

/// The reflectance of a material's non-metallic part.
struct Dielectric {
    ior: f32,
    specular: Vec3,
}

impl Dielectric {
    /// k_s, if it differs from the default of glTF materials.
    fn stated(&self) -> Option<Vec3> {
        (self.specular != Vec3::splat(PLAIN_DIELECTRIC)).then_some(self.specular)
    }
}

/// Reflectance at normal incidence for the index of refraction 1.5.
const PLAIN_DIELECTRIC: f32 = 0.04;

/// `KHR_materials_ior` and `KHR_materials_specular`: k_s = min(((ior - 1)/(ior + 1))^2 specularColor, 1)
/// specular. An index of 0 reflects all light, as the extension defines; the material then gets the largest
/// index allowed.
fn dielectric(
    source: &document::Material,
    place: &str,
    notes: &mut Notes,
) -> Result<Dielectric, LoadProblem> {
    let default = Material::default().ior;
    let index = extension::<IndexOfRefraction>(&source.extensions, "KHR_materials_ior", place)?;
    let ior = number(index.and_then(|index| index.ior), default);
    let refused = |field: &str, value: String, expected: &str| LoadProblem::Value {
        place: place.to_owned(),
        field: field.to_owned(),
        value,
        expected: expected.to_owned(),
    };
    if !(ior == 0.0 || (1.0..=LARGEST_INDEX).contains(&ior)) {
        let expected = "use 0 (reflects all) or a number from 1 to 10000";
        return Err(refused("KHR_materials_ior.ior", ior.to_string(), expected));
    }
    let (ior, along_normal) = match ior {
        0.0 => (LARGEST_INDEX, 1.0),
        ior if ior == default => (ior, PLAIN_DIELECTRIC),
        ior => (ior, ((ior - 1.0) / (ior + 1.0)).powi(2)),
    };
    let name = "KHR_materials_specular";
    let Some(stated) = extension::<Specular>(&source.extensions, name, place)? else {
        return Ok(Dielectric { ior, specular: Vec3::splat(along_normal) });
    };
    let (factor, tint) =
        (number(stated.specular_factor, 1.0), stated.specular_color_factor.map_or(Vec3::ONE, color));
    if !(0.0..=1.0).contains(&factor) {
        let field = format!("{name}.specularFactor");
        return Err(refused(&field, factor.to_string(), "use a number from 0 to 1"));
    }
    if !(tint.is_finite() && tint.min_element() >= 0.0) {
        let field = format!("{name}.specularColorFactor");
        return Err(refused(&field, tint.to_string(), "use numbers that are finite and at least 0"));
    }
    for (texture, field) in [
        (&stated.specular_texture, "specularTexture"),
        (&stated.specular_color_texture, "specularColorTexture"),
    ] {
        if texture.is_some() {
            notes.add(place, format!("{name}.{field} is not read; its factor holds everywhere"));
        }
    }
    Ok(Dielectric { ior, specular: (along_normal * tint).min(Vec3::ONE) * factor })
}

/// Largest index of refraction of a material.
const LARGEST_INDEX: f32 = 1e4;

/// `KHR_materials_transmission`: the fraction of the light not reflected at the surface that is transmitted.
fn transmission(source: &document::Material, place: &str, notes: &mut Notes) -> Result<f32, LoadProblem> {
    let name = "KHR_materials_transmission";
    let Some(stated) = extension::<Transmission>(&source.extensions, name, place)? else {
        return Ok(0.0);
    };
    let factor = number(stated.transmission_factor, 0.0);
    if !(0.0..=1.0).contains(&factor) {
        return Err(LoadProblem::Value {
            place: place.to_owned(),
            field: format!("{name}.transmissionFactor"),
            value: factor.to_string(),
            expected: "use a number from 0 to 1".to_owned(),
        });
    }
    if stated.transmission_texture.is_some() {
        notes.add(place, format!("{name}.transmissionTexture is not read; its factor holds everywhere"));
    }
    if factor > 0.0 {
        notes.add(
            place,
            format!(
                "{name} is kept as the coefficient of transmission; bakes let no light through the surface"
            ),
        );
    }
    Ok(factor)
}

fn normal_texture(
    source: &document::Material,
    place: &str,
    images: &mut Images<'_>,
    notes: &mut Notes,
) -> Result<Option<NormalTexture>, LoadProblem> {
    let Some(info) = &source.normal_texture else { return Ok(None) };
    let scale = number(info.scale, 1.0);
    if !scale.is_finite() {
        let (field, value) = ("normalTexture.scale".to_owned(), format!("{:?}", info.scale));
        let expected = "use a number that f32 can hold".to_owned();
        return Err(LoadProblem::Value { place: place.to_owned(), field, value, expected });
    }
    let slot = format!("{place}.normalTexture");
    let texture = images.texture_without_stand_in(&info.texture, &slot, notes)?;
    Ok(texture.map(|texture| NormalTexture { texture, scale }))
}

fn occlusion_texture(
    source: &document::Material,
    place: &str,
    images: &mut Images<'_>,
    notes: &mut Notes,
) -> Result<Option<OcclusionTexture>, LoadProblem> {
    let Some(info) = &source.occlusion_texture else { return Ok(None) };
    let strength = number(info.strength, 1.0);
    if !(0.0..=1.0).contains(&strength) {
        let (field, value) = ("occlusionTexture.strength".to_owned(), strength.to_string());
        let expected = "use a number from 0 to 1".to_owned();
        return Err(LoadProblem::Value { place: place.to_owned(), field, value, expected });
    }
    let slot = format!("{place}.occlusionTexture");
    let texture = images.texture(&info.texture, &slot, notes)?;
    Ok(texture.map(|texture| OcclusionTexture { texture, strength }))
}

/// The front of a material without LUMBRE_materials_phong.
pub(crate) fn front_from_metallic_roughness(
    base: Vec3,
    metallic: f32,
    roughness: f32,
    emission: Vec3,
    unlit: bool,
) -> Surface {
    let mut front = Material::from_metallic_roughness(base, metallic, roughness).front;
    front.emission = emission;
    if unlit {
        // An unlit surface shows its base colour, whatever its metallic factor.
        front.diffuse = base;
    }
    front
}

/// The lobe of a material that does not state one: bare if it has LUMBRE_materials_phong and either no
/// metallic-roughness texture or microfacet parameters of its own, otherwise energy-conserving.
pub(crate) fn default_lobe(phong: Option<&PhongMaterial>, textured: bool) -> Lobe {
    let bare = phong.is_some_and(|phong| {
        let chooses = phong.distribution.is_some()
            || phong.fresnel.is_some()
            || phong.eta.is_some()
            || phong.absorption.is_some();
        !textured || chooses
    });
    if bare { Lobe::Bare } else { Lobe::EnergyConserving }
}

/// The Fresnel model: a conductor if `eta` or `absorption` is given, unless the material states another. The
/// missing one of the two is then that of air: 1 or 0.
fn fresnel_of(phong: &PhongMaterial, default: Fresnel, place: &str) -> Result<Fresnel, LoadProblem> {
    let given = phong.eta.is_some() || phong.absorption.is_some();
    let conductor = Fresnel::Conductor {
        eta: phong.eta.map_or(Vec3::ONE, color),
        absorption: phong.absorption.map_or(Vec3::ZERO, color),
    };
    match phong.fresnel.as_deref() {
        None if given => Ok(conductor),
        None => Ok(default),
        Some("dielectric") => Ok(Fresnel::Dielectric),
        Some("conductor") if given => Ok(conductor),
        Some("conductor") => Err(LoadProblem::Value {
            place: place.to_owned(),
            field: "LUMBRE_materials_phong.fresnel".to_owned(),
            value: "\"conductor\"".to_owned(),
            expected: "give its index of refraction beside it: eta, absorption or both".to_owned(),
        }),
        Some("normal-reflectance") => Ok(Fresnel::NormalReflectance),
        Some(other) => {
            let names = ["dielectric", "conductor", "normal-reflectance"].into_iter();
            Err(unknown(place, "LUMBRE_materials_phong.fresnel", other, names))
        }
    }
}

impl PhongSurface {
    /// Returns true if it states coefficients of reflection, which replace the metallic-roughness conversion
    /// and texture.
    fn states_reflection(&self) -> bool {
        self.ambient.is_some()
            || self.diffuse.is_some()
            || self.specular.is_some()
            || self.shininess.is_some()
    }
}

fn surface(source: &PhongSurface, default: &Surface) -> Surface {
    Surface {
        ambient: source.ambient.map_or(default.ambient, color),
        diffuse: source.diffuse.map_or(default.diffuse, color),
        specular: source.specular.map_or(default.specular, color),
        emission: source.emission.map_or(default.emission, color),
        shininess: number(source.shininess, default.shininess),
    }
}
