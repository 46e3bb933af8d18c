//! Which parts of emissive textures shine at all: most of such a texture is usually black, and what is black need not be
//! sampled. How bright the rest is, `material` says.

use std::collections::HashMap;
use std::sync::Arc;

use glam::Vec2;
use lumbre_scene::{Image, Sampler, Wrap};

use super::mean_of_points::SubTriangle;
use super::{Side, SurfaceMaterial};

/// Texels along a block's side.
const BLOCK: usize = 16;
/// Texture coordinates from which on nothing is left out.
const LARGEST: f32 = 16.0;

/// For each block of texels of each emissive texture, whether one of them is not black; by the addresses of the images.
#[derive(Default)]
pub(crate) struct LitTexels(HashMap<usize, LitBlocks>);

/// The blocks of an image, row by row.
struct LitBlocks {
    columns: usize,
    lit: Vec<bool>,
}

impl LitTexels {
    /// Looks through the emissive textures of some materials.
    pub fn of(surfaces: &[SurfaceMaterial]) -> Self {
        let mut images = HashMap::new();
        let emits = |surface: &&SurfaceMaterial| {
            [Side::Front, Side::Back].into_iter().any(|side| surface.emits(side))
        };
        let images_of =
            surfaces.iter().filter(emits).filter_map(|surface| Some(&surface.emissive_texture()?.image));
        for image in images_of {
            let is_whole = image.rgba.len() as u64 == 4 * u64::from(image.width) * u64::from(image.height);
            if is_whole && image.width > 0 {
                images.entry(Arc::as_ptr(image).addr()).or_insert_with(|| LitBlocks::of(image));
            }
        }
        Self(images)
    }

    /// Whether a piece of a triangle may emit light, as far as its texture is concerned. True where that is not known: where
    /// the piece shows parts of several copies of the texture, for example.
    pub fn may_shine(&self, surface: &SurfaceMaterial, vertices: [u32; 3], piece: SubTriangle) -> bool {
        let Some(texture) = surface.emissive_texture() else { return true };
        let Some(blocks) = self.0.get(&Arc::as_ptr(&texture.image).addr()) else { return true };
        let size = Vec2::new(texture.image.width as f32, texture.image.height as f32);
        let corner = |(u, v): (f32, f32)| {
            let uv = surface.texture_coordinates(texture, vertices, [1.0 - u - v, u, v])?;
            // Of larger coordinates, rounding may be by more than the margin below.
            (uv.abs().max_element() < LARGEST).then(|| texture.transformed(uv) * size)
        };
        let [Some(a), Some(b), Some(c)] = piece.map(corner) else { return true };
        // Bilinear filtering reads half a texel beyond a point; the rest of the margin is for rounding.
        let (mut low, mut high) = (a.min(b).min(c) - 1.0, a.max(b).max(c) + 1.0);
        let Sampler { wrap_u, wrap_v, .. } = texture.sampler;
        for (axis, wrap) in [wrap_u, wrap_v].into_iter().enumerate() {
            if wrap == Wrap::Repeat {
                let first_copy = (low[axis] / size[axis]).floor() * size[axis];
                (low[axis], high[axis]) = (low[axis] - first_copy, high[axis] - first_copy);
            }
        }
        let is_inside = low.cmpge(Vec2::ZERO).all() && high.cmplt(size).all();
        !is_inside || blocks.any([low.x as usize, low.y as usize], [high.x as usize, high.y as usize])
    }
}

impl LitBlocks {
    fn of(image: &Image) -> Self {
        let (width, height) = (image.width as usize, image.height as usize);
        let columns = width.div_ceil(BLOCK).max(1);
        let mut lit = vec![false; columns * height.div_ceil(BLOCK)];
        for (place, texel) in image.rgba.chunks_exact(4).enumerate() {
            if texel[..3] != [0; 3]
                && let Some(block) = lit.get_mut(place / width / BLOCK * columns + place % width / BLOCK)
            {
                *block = true;
            }
        }
        Self { columns, lit }
    }

    /// Whether there is light between two texels, both included.
    fn any(&self, low: [usize; 2], high: [usize; 2]) -> bool {
        let [columns, mut rows] = [0, 1].map(|axis| low[axis] / BLOCK..=high[axis] / BLOCK);
        rows.any(|row| {
            columns.clone().any(|column| self.lit.get(row * self.columns + column).is_none_or(|lit| *lit))
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use lumbre_mesh::{TriangleMesh, shapes};
    use lumbre_optics::{Material, Surface};
    use lumbre_scene::{MaterialTextures, TextureReference};

    use super::*;
    use crate::scene::mean_of_points::pieces;

    /// A plane under a picture of 100 x 60 texels of which one shines, at coordinates that are scaled and moved.
    fn surface(lit: usize, scale: Vec2, offset: Vec2, wrap: Wrap) -> SurfaceMaterial {
        let mut rgba = vec![0; 4 * 100 * 60];
        rgba[4 * lit] = 255;
        let image = Image { name: "lit".into(), width: 100, height: 60, rgba };
        let mut plane: TriangleMesh = shapes::plane(1.0, 1.0, 1, 1);
        plane.uv0.iter_mut().for_each(|uv| *uv = *uv * scale + offset);
        let mut texture = TextureReference::new(Arc::new(image));
        (texture.sampler.wrap_u, texture.sampler.wrap_v) = (wrap, wrap);
        let front = Surface { emission: Vec3::ONE, ..Surface::default() };
        SurfaceMaterial {
            material: Material { front, ..Material::matt(Vec3::ZERO) },
            textures: Some(MaterialTextures { emissive: Some(texture), ..MaterialTextures::default() }),
            mesh: Arc::new(plane),
        }
    }

    #[test]
    fn what_emits_light_is_found_and_most_of_the_rest_left_out() {
        let (one, zero) = (Vec2::ONE, Vec2::ZERO);
        // Also texels at the corners of the picture and of its blocks, and coordinates in other copies of it.
        for (lit, scale, offset, wrap) in [
            (0, one, zero, Wrap::Repeat),
            (3_248, one, zero, Wrap::ClampToEdge),
            (3_147, one, zero, Wrap::Repeat),
            (5_999, Vec2::new(0.9, 1.0), Vec2::new(0.1, 0.0), Wrap::ClampToEdge),
            (2_345, Vec2::new(0.9, 0.7), Vec2::new(0.0, 1.1), Wrap::Repeat),
            (2_345, Vec2::new(1.0, -1.0), zero, Wrap::Repeat),
            (2_345, Vec2::splat(3.0), zero, Wrap::MirroredRepeat),
        ] {
            let surface = surface(lit, scale, offset, wrap);
            let texels = LitTexels::of(std::slice::from_ref(&surface));
            let (mut may_shine, mut shining, mut count) = (0, 0, 0);
            for triangle in surface.mesh.indices.chunks_exact(3) {
                let vertices = [triangle[0], triangle[1], triangle[2]];
                pieces(24, |piece| {
                    let [p, q, r] = piece;
                    let found = texels.may_shine(&surface, vertices, piece);
                    let mut emits = false;
                    pieces(12, |corners| {
                        for (a, b) in corners {
                            let u = p.0 + (q.0 - p.0) * a + (r.0 - p.0) * b;
                            let v = p.1 + (q.1 - p.1) * a + (r.1 - p.1) * b;
                            let weights = [1.0 - u - v, u, v];
                            emits |= surface.emission(Side::Front, vertices, weights) != Vec3::ZERO;
                        }
                    });
                    assert!(found || !emits, "{lit}: {piece:?}");
                    (may_shine, shining) = (may_shine + u32::from(found), shining + u32::from(emits));
                    count += 1;
                });
            }
            assert!(shining > 0, "{lit}");
            assert!(wrap == Wrap::MirroredRepeat || may_shine < count / 3, "{lit}: {may_shine} of {count}");
        }
    }

    #[test]
    fn of_a_picture_that_lacks_pixels_nothing_is_left_out() {
        for (width, height, bytes) in [(0, 0, 4), (8, 8, 16), (0, 4, 0)] {
            let mut surface = surface(0, Vec2::ONE, Vec2::ZERO, Wrap::Repeat);
            let image = Image { name: "short".into(), width, height, rgba: vec![0; bytes] };
            let emissive = Some(TextureReference::new(Arc::new(image)));
            surface.textures = Some(MaterialTextures { emissive, ..MaterialTextures::default() });
            let texels = LitTexels::of(std::slice::from_ref(&surface));
            assert!(texels.may_shine(&surface, [0, 1, 2], [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]));
        }
    }
}
