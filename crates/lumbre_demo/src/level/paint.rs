//! The materials of the level. Which surfaces have them is decided by the rooms.

use glam::Vec3;
use lumbre_optics::{AlphaMode, Material, Surface};
use lumbre_scene::Medium;

use super::textures::Texture;

/// A material of the level, by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Paint {
    /// White plaster.
    White,
    /// Red plaster, on the wall whose colour bleeds.
    Red,
    /// Teal plaster, on the wall facing the red one.
    Teal,
    /// Warm plaster.
    Ochre,
    /// Blue plaster.
    Blue,
    /// Polished tiles.
    Tiles,
    /// Bare brick.
    Brick,
    /// Waxed planks.
    Planks,
    /// Hewn stone.
    Stone,
    /// Dark timber.
    Timber,
    /// Polished stone for pillars and plinths.
    Marble,
    /// The sides of crates.
    Crate,
    /// Iron with a dull highlight.
    Iron,
    /// Shiny gold.
    Gold,
    /// Red lacquer with a broad highlight, exponent 10.
    Broad,
    /// Green lacquer, exponent 100.
    Medium,
    /// Blue lacquer with a narrow highlight, exponent 500.
    Narrow,
    /// Cloth with a sun on its front and a plain dark back.
    Banner,
    /// Iron bars, by alpha mask.
    Grille,
    /// A greenish pane, by alpha blending.
    Glass,
    /// A mirror.
    Mirror,
    /// Clear crystal with the default index of refraction.
    Crystal,
    /// Water.
    Water,
    /// The daylight behind the windows of the hall.
    Daylight,
    /// The light panels in the gallery's ceiling.
    Panel,
    /// The shades of the corridor's lamps.
    Shade,
    /// The embers of the vault.
    Embers,
}

fn rgb(red: f32, green: f32, blue: f32) -> Vec3 {
    Vec3::new(red, green, blue)
}

/// A diffuse colour with a highlight.
fn polished(color: Vec3, specular: Vec3, shininess: f32) -> Material {
    let front = Surface { ambient: color, diffuse: color, specular, shininess, ..Surface::default() };
    Material { front, ..Material::default() }
}

fn luminous(emission: Vec3) -> Material {
    let front = Surface { emission, ..Material::matt(Vec3::splat(0.2)).front };
    Material { front, ..Material::default() }
}

impl Paint {
    /// Returns the name of the material in the file.
    pub fn name(self) -> String {
        format!("{self:?}").to_lowercase()
    }

    /// Returns the material. If it has a texture, the texture and its tint multiply the diffuse colour.
    pub fn material(self) -> Material {
        match self {
            Self::White => Material::matt(rgb(0.74, 0.72, 0.68)),
            Self::Red => Material::matt(rgb(0.62, 0.09, 0.06)),
            Self::Teal => Material::matt(rgb(0.07, 0.33, 0.34)),
            Self::Ochre => Material::matt(rgb(0.66, 0.46, 0.20)),
            Self::Blue => Material::matt(rgb(0.11, 0.17, 0.47)),
            Self::Tiles => polished(Vec3::ONE, Vec3::splat(0.22), 60.0),
            Self::Brick | Self::Crate => Material::matt(Vec3::ONE),
            Self::Planks => polished(Vec3::ONE, Vec3::splat(0.10), 24.0),
            Self::Stone => polished(Vec3::ONE, Vec3::splat(0.04), 12.0),
            Self::Timber => polished(rgb(0.20, 0.11, 0.055), Vec3::splat(0.05), 16.0),
            Self::Marble => polished(rgb(0.70, 0.68, 0.66), Vec3::splat(0.18), 40.0),
            Self::Iron => polished(rgb(0.10, 0.10, 0.11), Vec3::splat(0.35), 30.0),
            Self::Gold => polished(rgb(0.34, 0.22, 0.05), rgb(0.62, 0.46, 0.17), 80.0),
            Self::Broad => polished(rgb(0.45, 0.06, 0.05), Vec3::splat(0.4), 10.0),
            Self::Medium => polished(rgb(0.06, 0.36, 0.10), Vec3::splat(0.5), 100.0),
            Self::Narrow => polished(rgb(0.05, 0.10, 0.42), Vec3::splat(0.6), 500.0),
            Self::Banner => {
                let back = Material::matt(rgb(0.20, 0.03, 0.05)).front;
                Material { back: Some(back), double_sided: true, ..Material::matt(Vec3::ONE) }
            }
            Self::Grille => Material {
                alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
                double_sided: true,
                ..polished(Vec3::ONE, Vec3::splat(0.2), 20.0)
            },
            Self::Glass => Material {
                alpha: 0.28,
                alpha_mode: AlphaMode::Blend,
                double_sided: true,
                ..polished(rgb(0.20, 0.38, 0.34), Vec3::splat(0.7), 200.0)
            },
            Self::Mirror => {
                Material { mirror: rgb(0.86, 0.88, 0.87), ..polished(rgb(0.02, 0.02, 0.02), Vec3::ZERO, 1.0) }
            }
            Self::Crystal => {
                Material { transmission: Vec3::splat(0.97), ..polished(Vec3::ZERO, Vec3::splat(0.5), 300.0) }
            }
            Self::Water => Material {
                transmission: Vec3::ONE,
                ior: 1.33,
                ..polished(Vec3::ZERO, Vec3::splat(0.3), 200.0)
            },
            Self::Daylight => luminous(rgb(3.3, 3.9, 4.8)),
            Self::Panel => luminous(rgb(4.4, 3.9, 3.1)),
            Self::Shade => luminous(rgb(2.4, 1.35, 0.55)),
            Self::Embers => luminous(rgb(2.2, 0.55, 0.10)),
        }
    }

    /// Returns the medium behind the surface, for transmissive materials.
    pub fn medium(self) -> Option<Medium> {
        let clear = Medium { fresnel: true, ..Medium::default() };
        match self {
            Self::Crystal => Some(clear),
            // Transmittance over one metre.
            Self::Water => {
                Some(Medium { attenuation_color: rgb(0.35, 0.70, 0.72), attenuation_distance: 1.0, ..clear })
            }
            _ => None,
        }
    }

    /// Returns the texture of the material, if it has one.
    pub fn texture(self) -> Option<Texture> {
        match self {
            Self::Tiles => Some(Texture::Tiles),
            Self::Brick => Some(Texture::Brick),
            Self::Planks => Some(Texture::Planks),
            Self::Stone => Some(Texture::Stone),
            Self::Crate => Some(Texture::Crate),
            Self::Banner => Some(Texture::Banner),
            Self::Grille => Some(Texture::Grille),
            _ => None,
        }
    }

    /// Returns the length in metres that one copy of the texture covers on walls and floors.
    pub fn tile(self) -> f64 {
        match self {
            Self::Tiles => 2.0,
            Self::Brick => 0.8,
            Self::Stone => 1.6,
            _ => 1.0,
        }
    }
}
