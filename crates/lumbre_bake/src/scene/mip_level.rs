//! A mip level of an image's colour, in linear light: each texel is the mean of the part of the image that it covers.
//! The mean over an area of many texels then takes a few reads. Reading at a point is `texture`'s.

use std::ops::Range;

use glam::Vec3;
use lumbre_scene::Image;
use rayon::prelude::*;

use super::texture::texel;
use crate::CancelToken;

/// One level of an image.
pub(crate) struct MipLevel {
    /// How many times the image's sides are halved.
    pub level: u32,
    pub width: u32,
    pub height: u32,
    /// Linear light, row by row.
    texels: Vec<Vec3>,
}

impl MipLevel {
    /// The level at which a texel is the mean of 2^`level` texels of an sRGB image along each side, or of slightly fewer
    /// where its sides are not multiples of that. Black where `stop` cancels the work.
    pub fn new(image: &Image, level: u32, stop: &CancelToken) -> Self {
        let reduced = |side: u32| side.max(1).div_ceil(1 << level.min(31));
        let (width, height) = (reduced(image.width), reduced(image.height));
        let columns: Vec<Vec<(usize, f32)>> = (0..width).map(|x| covered(x, width, image.width)).collect();
        let row = |y: u32| -> Vec<Vec3> {
            let rows = covered(y, height, image.height);
            let mean = |columns: &Vec<(usize, f32)>| {
                if stop.is_cancelled() {
                    return Vec3::ZERO;
                }
                let of_row = |&(y, weight): &(usize, f32)| {
                    let colors =
                        columns.iter().map(|&(x, weight)| weight * texel(image, x, y, true).truncate());
                    weight * colors.sum::<Vec3>()
                };
                rows.iter().map(of_row).sum()
            };
            columns.iter().map(mean).collect()
        };
        let rows: Vec<Vec<Vec3>> = (0..height).into_par_iter().map(row).collect();
        Self { level, width, height, texels: rows.concat() }
    }

    /// The texel in a column and row.
    pub fn texel(&self, x: usize, y: usize) -> Vec3 {
        self.texels[y * self.width as usize + x]
    }
}

/// The texels of a side of `source` that the texel `index` of a side of `reduced` covers, and their weights, which add
/// up to 1.
fn covered(index: u32, reduced: u32, source: u32) -> Vec<(usize, f32)> {
    let ratio = f64::from(source) / f64::from(reduced);
    let Range { start, end } = f64::from(index) * ratio..f64::from(index + 1) * ratio;
    let last = (end.ceil() as usize).min(source as usize);
    (start as usize..last)
        .map(|place| {
            let inside = end.min(place as f64 + 1.0) - start.max(place as f64);
            (place, (inside / ratio) as f32)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_keeps_the_mean_of_the_image() {
        let (width, height) = (5, 3);
        let rgba: Vec<u8> =
            (0..width * height).flat_map(|at| [if at % 4 == 0 { 255 } else { 0 }; 4]).collect();
        let image = Image { name: "dots".into(), width, height, rgba };
        for (level, size) in [(0, (5, 3)), (1, (3, 2)), (2, (2, 1)), (3, (1, 1)), (40, (1, 1))] {
            let level = MipLevel::new(&image, level, &CancelToken::default());
            assert_eq!((level.width, level.height), size);
            let mean = level.texels.iter().sum::<Vec3>() / level.texels.len() as f32;
            // 4 of 15 texels are white.
            assert!((mean - 4.0 / 15.0).abs().max_element() < 1e-6, "{size:?}: {mean}");
        }
    }

    #[test]
    fn a_texel_of_a_level_is_the_mean_of_what_it_covers() {
        let rgba = [[255u8; 4], [0; 4], [0; 4], [255; 4], [255; 4], [255; 4]].concat();
        let image = Image { name: "row".into(), width: 6, height: 1, rgba };
        let level = MipLevel::new(&image, 1, &CancelToken::default());
        assert_eq!([0, 1, 2].map(|x| level.texel(x, 0).x), [0.5, 0.5, 1.0]);
    }
}
