//! The procedural textures of the level. The materials that use them are in `paint`.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use lumbre_scene::{Image, Sampler, TextureReference, Wrap};

use super::noise::{hash, layered_noise, value_noise};

/// A pattern that tiles over the unit square: returns linear colour and coverage at (u, v).
type Pattern = fn(f64, f64) -> (DVec3, f64);

/// A rendered texture, and the colour that multiplies it. The brightest value of each channel is stored as 1,
/// so that all eight bits are used; the tint restores the reflectance.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// The image with its sampler.
    pub texture: TextureReference,
    /// The brightest reflectance of each channel, linear.
    pub tint: Vec3,
}

/// Renders a pattern into an sRGB-encoded image of `size` by `size` texels, with four samples per texel.
fn draw(name: &str, size: u32, pattern: Pattern) -> Drawn {
    let mut texels = Vec::with_capacity((size * size) as usize);
    let mut tint = DVec3::ZERO;
    for y in 0..size {
        for x in 0..size {
            let (mut color, mut alpha) = (DVec3::ZERO, 0.0);
            for (dx, dy) in [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)] {
                let at = |texel: u32, part: f64| (f64::from(texel) + part) / f64::from(size);
                let (sample, coverage) = pattern(at(x, dx), at(y, dy));
                color += 0.25 * sample;
                alpha += 0.25 * coverage;
            }
            tint = tint.max(color);
            texels.push((color, alpha));
        }
    }
    let mut rgba = Vec::with_capacity(4 * texels.len());
    for (color, alpha) in texels {
        rgba.extend((color / tint).to_array().map(srgb_byte));
        rgba.push((alpha * 255.0f64).round() as u8);
    }
    let texture = TextureReference {
        sampler: Sampler { wrap_u: Wrap::Repeat, wrap_v: Wrap::Repeat, ..Sampler::default() },
        ..TextureReference::new(Arc::new(Image { name: name.to_owned(), width: size, height: size, rgba }))
    };
    Drawn { texture, tint: tint.as_vec3() }
}

/// Encodes a linear value in [0, 1] as a byte of sRGB.
fn srgb_byte(linear: f64) -> u8 {
    (lumbre_optics::encode_srgb(linear.clamp(0.0, 1.0)) * 255.0).round() as u8
}

/// Locates a point in a wall of blocks laid in rows, every other row shifted by half a block if `shifted`.
/// Returns the block's column and row, and the distance to the nearest joint as a fraction of the row's
/// height.
fn bond(u: f64, v: f64, columns: u32, rows: u32, shifted: bool) -> (u32, u32, f64) {
    let y = v * f64::from(rows);
    let row = y.floor() as u32 % rows;
    let shift = if shifted && row % 2 == 1 { 0.5 } else { 0.0 };
    let x = u * f64::from(columns) + shift;
    let aspect = f64::from(rows) / f64::from(columns);
    let edge = |part: f64| part.min(1.0 - part);
    let joint = (edge(x.fract()) * aspect).min(edge(y.fract()));
    (x.floor() as u32 % columns, row, joint)
}

fn brick_pattern(u: f64, v: f64) -> (DVec3, f64) {
    let (column, row, joint) = bond(u, v, 3, 8, true);
    let grain = layered_noise(u, v, 16, 3);
    if joint < 0.07 {
        return (DVec3::new(0.46, 0.42, 0.37) * (0.75 + 0.35 * grain), 1.0);
    }
    let tone = hash(column, row, 11);
    let color = DVec3::new(0.42, 0.145, 0.085).lerp(DVec3::new(0.55, 0.25, 0.14), tone);
    (color * (0.7 + 0.5 * grain), 1.0)
}

fn tile_pattern(u: f64, v: f64) -> (DVec3, f64) {
    let (column, row, joint) = bond(u, v, 4, 4, false);
    if joint < 0.025 {
        return (DVec3::splat(0.16), 1.0);
    }
    let veins = (layered_noise(u, v, 6, 21) - 0.5).abs() * 2.0;
    let dark = (column + row) % 2 == 1;
    let color = if dark { DVec3::new(0.13, 0.15, 0.17) } else { DVec3::new(0.66, 0.62, 0.55) };
    (color * (0.82 + 0.3 * veins), 1.0)
}

fn plank_pattern(u: f64, v: f64) -> (DVec3, f64) {
    let plank = (v * 5.0).floor() as u32;
    let across = (v * 5.0).fract();
    let along = (u + hash(plank, 0, 31)).fract();
    let joint = across.min(1.0 - across) < 0.03 || along < 0.006;
    let grain = value_noise(u, v, 4, 33) * 6.0 + v * 60.0;
    let rings = 0.5 + 0.5 * (grain + 2.0 * value_noise(u, v, 8, 35)).sin();
    let tone = 0.75 + 0.35 * hash(plank, 1, 37);
    let color = DVec3::new(0.34, 0.19, 0.095).lerp(DVec3::new(0.48, 0.30, 0.16), rings) * tone;
    (if joint { color * 0.25 } else { color }, 1.0)
}

fn stone_pattern(u: f64, v: f64) -> (DVec3, f64) {
    let (column, row, joint) = bond(u, v, 2, 4, true);
    let rough = layered_noise(u, v, 10, 41);
    let edge = (joint / 0.09).min(1.0);
    let tone = 0.8 + 0.3 * hash(column, row, 43);
    (DVec3::new(0.37, 0.36, 0.34) * tone * (0.55 + 0.65 * rough) * (0.35 + 0.65 * edge), 1.0)
}

fn crate_pattern(u: f64, v: f64) -> (DVec3, f64) {
    let edge = u.min(1.0 - u).min(v.min(1.0 - v));
    let diagonal = (u - v).abs() < 0.1;
    let frame = edge < 0.12;
    let grain = if frame || diagonal { value_noise(u, v, 24, 51) } else { 0.5 + 0.5 * (v * 70.0).sin() };
    let gap = !frame && !diagonal && (v * 6.0).fract() < 0.08;
    let lip = (edge - 0.12).abs() < 0.012 || (!frame && ((u - v).abs() - 0.1).abs() < 0.012);
    let color =
        DVec3::new(0.46, 0.31, 0.15) * (0.8 + 0.25 * grain) * if frame || diagonal { 1.1 } else { 0.85 };
    (if gap || lip { color * 0.3 } else { color }, 1.0)
}

fn grille_pattern(u: f64, v: f64) -> (DVec3, f64) {
    let bar = |t: f64| ((t * 4.0).fract() - 0.5).abs() < 0.14;
    let rust = 0.8 + 0.4 * value_noise(u, v, 8, 61);
    let iron = DVec3::new(0.17, 0.15, 0.14) * rust;
    (iron, if bar(u) || bar(v) { 1.0 } else { 0.0 })
}

fn banner_pattern(u: f64, v: f64) -> (DVec3, f64) {
    // A sun with twelve rays over two stripes.
    let (x, y) = ((u - 0.5) * 2.0, (v - 0.4) * 2.0);
    let distance = x.hypot(y);
    let ray = (y.atan2(x) * 6.0).cos() > 0.2;
    let sun = distance < 0.32 || (ray && (0.4..0.62).contains(&distance));
    let border = u.min(1.0 - u) < 0.07 || v.min(1.0 - v) < 0.05;
    let weave = 0.9 + 0.1 * (v * 32.0).floor().rem_euclid(2.0);
    let color = if sun || border { DVec3::new(0.83, 0.58, 0.10) } else { DVec3::new(0.38, 0.035, 0.06) };
    (color * weave, 1.0)
}

/// A texture of the level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Texture {
    /// Eight rows of brick.
    Brick,
    /// Four by four tiles, alternately dark and light.
    Tiles,
    /// Five planks.
    Planks,
    /// Four rows of large stones.
    Stone,
    /// One side of a crate.
    Crate,
    /// Iron bars with holes between them.
    Grille,
    /// A sun on red cloth.
    Banner,
}

impl Texture {
    /// Renders the texture.
    pub fn draw(self) -> Drawn {
        match self {
            Self::Brick => draw("brick", 128, brick_pattern),
            Self::Tiles => draw("tiles", 128, tile_pattern),
            Self::Planks => draw("planks", 128, plank_pattern),
            Self::Stone => draw("stone", 128, stone_pattern),
            Self::Crate => draw("crate", 64, crate_pattern),
            Self::Grille => draw("grille", 64, grille_pattern),
            Self::Banner => draw("banner", 128, banner_pattern),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Texture; 7] = [
        Texture::Brick,
        Texture::Tiles,
        Texture::Planks,
        Texture::Stone,
        Texture::Crate,
        Texture::Grille,
        Texture::Banner,
    ];

    #[test]
    fn every_texture_has_relief_and_no_reflectance_near_one() {
        for texture in ALL {
            let Drawn { texture: TextureReference { image, .. }, tint } = texture.draw();
            assert_eq!(image.rgba.len(), 4 * (image.width * image.height) as usize);
            let reds: Vec<u8> = image.rgba.chunks_exact(4).map(|texel| texel[0]).collect();
            let (least, most) = (*reds.iter().min().unwrap(), *reds.iter().max().unwrap());
            assert!(most == 255 && least < 235, "{texture:?}: {least} to {most}");
            // With reflectances above 0.9, light would hardly decrease over many bounces.
            assert!(tint.max_element() < 0.9 && tint.min_element() > 0.03, "{texture:?}: {tint}");
        }
    }

    #[test]
    fn only_the_grille_has_holes() {
        for texture in ALL {
            let image = texture.draw().texture.image;
            let holes = image.rgba.chunks_exact(4).filter(|texel| texel[3] < 128).count();
            let part = holes as f64 / f64::from(image.width * image.height);
            // Bars that cover 0.28 in each direction leave (1 - 0.28)² open.
            let expected = if texture == Texture::Grille { 0.72 * 0.72 } else { 0.0 };
            assert!((part - expected).abs() < 0.06, "{texture:?}: {part}");
        }
    }

    #[test]
    fn srgb_encoding_at_known_points() {
        assert_eq!([0.0, 1.0, 0.5, 0.216].map(srgb_byte), [0, 255, 188, 128]);
    }
}
