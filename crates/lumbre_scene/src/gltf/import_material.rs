//! glTF materials into Phong ones, with their textures. Not the mapping's equations: those are in `lumbre_optics`.

use std::sync::Arc;

use glam::Vec3;
use lumbre_optics::{AlphaMode, Distribution, Fresnel, Material, Surface};

use super::document::{self, extension, shortened};
use super::error::{LoadProblem, Notes};
use super::extensions::{EmissiveStrength, PhongMaterial, PhongSurface};
use super::import_image::{Images, white};
use super::import_scene::unknown;
use super::value::{color, number};
use crate::{MaterialTextures, MetallicRoughnessTexture, TextureReference};

/// Reads one material. Textures that only other renderings use (normal, occlusion) are left out with a note.
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
        });
    }
    // A metal's highlight has the colour of its base texture: that takes the per-texel mapping, here with factors alone.
    if textures.metallic_roughness.is_none()
        && metallic > 0.0
        && phong.is_none()
        && let Some(base_texture) = &textures.base_color
    {
        let texture = TextureReference { image: Arc::new(white()), ..base_texture.clone() };
        textures.metallic_roughness =
            Some(MetallicRoughnessTexture { texture, base_color: base, metallic, roughness });
    }
    for (unused, what) in [(&source.normal_texture, "normal"), (&source.occlusion_texture, "occlusion")] {
        if unused.is_some() {
            notes.add(place, format!("{what} textures are not supported; left out"));
        }
    }

    let unlit = source.extensions.contains_key("KHR_materials_unlit");
    let front = front_from_metallic_roughness(base, metallic, roughness, emission, unlit);
    // Of a metallic-roughness material k_s is the reflectance at normal incidence.
    let replaced = phong.is_some() && textures.metallic_roughness.is_none();
    let fresnel = if replaced { Fresnel::Dielectric } else { Fresnel::NormalReflectance };
    let mut material = Material { front, unlit, fresnel, ..Material::default() };
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
        // What an unlit surface shows is its base colour, whatever its metalness.
        front.diffuse = base;
    }
    front
}

/// A conductor where either part of its index is given, unless it says otherwise. The other part is then that of air: 1, and 0.
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
    /// Whether it says how light is reflected, and so replaces the metallic-roughness mapping and its texture.
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
