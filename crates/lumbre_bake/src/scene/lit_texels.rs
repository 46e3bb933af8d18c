//! Which parts of emissive textures shine at all: most of such a texture is usually black, and what is black need not be
//! sampled. How bright the rest is, `material` says.

use std::collections::HashMap;
use std::sync::Arc;

use glam::Vec2;
use lumbre_scene::Image;

use super::SurfaceMaterial;
use super::mean_of_points::SubTriangle;

/// Texels along a block's side.
const BLOCK: usize = 16;

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
        for image in surfaces.iter().filter_map(|surface| Some(&surface.emissive_texture()?.image)) {
            images.entry(Arc::as_ptr(image).addr()).or_insert_with(|| LitBlocks::of(image));
        }
        Self(images)
    }

    /// Whether a piece of a triangle may emit light, as far as its texture is concerned. True where that is not known: for
    /// coordinates outside of the texture, for example.
    pub fn may_shine(&self, surface: &SurfaceMaterial, vertices: [u32; 3], piece: SubTriangle) -> bool {
        let Some(texture) = surface.emissive_texture() else { return true };
        let Some(blocks) = self.0.get(&Arc::as_ptr(&texture.image).addr()) else { return true };
        let size = Vec2::new(texture.image.width as f32, texture.image.height as f32);
        let corner = |(u, v): (f32, f32)| {
            let uv = surface.texture_coordinates(texture, vertices, [1.0 - u - v, u, v])?;
            Some(texture.transformed(uv) * size)
        };
        let [Some(a), Some(b), Some(c)] = piece.map(corner) else { return true };
        // Bilinear filtering reads half a texel beyond a point; the rest of the margin is for rounding.
        let (low, high) = (a.min(b).min(c) - 1.0, a.max(b).max(c) + 1.0);
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
    use crate::scene::Side;
    use crate::scene::mean_of_points::pieces;

    /// A plane under a picture of 100 x 60 texels of which one shines, at coordinates that are scaled.
    fn surface(lit: usize, scale: Vec2) -> SurfaceMaterial {
        let mut rgba = vec![0; 4 * 100 * 60];
        rgba[4 * lit] = 255;
        let image = Image { name: "lit".into(), width: 100, height: 60, rgba };
        let mut plane: TriangleMesh = shapes::plane(1.0, 1.0, 1, 1);
        plane.uv0.iter_mut().for_each(|uv| *uv *= scale);
        let emissive = Some(TextureReference::new(Arc::new(image)));
        let front = Surface { emission: Vec3::ONE, ..Surface::default() };
        SurfaceMaterial {
            material: Material { front, ..Material::matt(Vec3::ZERO) },
            textures: Some(MaterialTextures { emissive, ..MaterialTextures::default() }),
            mesh: Arc::new(plane),
        }
    }

    #[test]
    fn what_emits_light_is_found_and_most_of_the_rest_left_out() {
        for (lit, scale) in
            [(0, Vec2::ONE), (2_345, Vec2::ONE), (5_999, Vec2::new(0.7, 0.9)), (47, Vec2::splat(3.0))]
        {
            let surface = surface(lit, scale);
            let texels = LitTexels::of(std::slice::from_ref(&surface));
            let (mut may_shine, mut count) = (0, 0);
            for triangle in surface.mesh.indices.chunks_exact(3) {
                let vertices = [triangle[0], triangle[1], triangle[2]];
                pieces(24, |piece| {
                    let [p, q, r] = piece;
                    let found = texels.may_shine(&surface, vertices, piece);
                    let mut emits = false;
                    pieces(12, |[(a, b), ..]| {
                        let u = p.0 + (q.0 - p.0) * a + (r.0 - p.0) * b;
                        let v = p.1 + (q.1 - p.1) * a + (r.1 - p.1) * b;
                        emits |= surface.emission(Side::Front, vertices, [1.0 - u - v, u, v]) != Vec3::ZERO;
                    });
                    assert!(found || !emits, "{lit}: {piece:?}");
                    (may_shine, count) = (may_shine + usize::from(found), count + 1);
                });
            }
            // A picture that is repeated is looked at everywhere beyond its first copy.
            assert!(scale.x > 1.0 || may_shine < count / 3, "{lit}: {may_shine} of {count}");
        }
    }
}
