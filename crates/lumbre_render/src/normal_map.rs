//! The mip levels of a normal map: means of unit normals, with the spread of the normals in the alpha
//! channel. How a fragment reads them is in shaders/normal_map.wesl.

use glam::Vec3;
use lumbre_optics::normal_map_spread;
use lumbre_scene::Image;

use crate::mip_level::{MipLevel, box_filter_2d};

/// Returns the levels of a normal map. The first one has the original texels and no spread.
pub(crate) fn normal_levels(image: &Image) -> Vec<MipLevel> {
    let mut rgba = image.rgba.clone();
    rgba.chunks_exact_mut(4).for_each(|texel| texel[3] = 0);
    let mut levels = vec![MipLevel { width: image.width, height: image.height, rgba }];
    if image.width.max(image.height) == 1 {
        return levels;
    }
    // The means of the second level are computed directly from bytes, because the decoded vectors of the
    // first level would take three times its bytes.
    let first = |x: u32, y: u32| {
        let at = 4 * (y as usize * image.width as usize + x as usize);
        decode(&image.rgba[at..at + 3])
    };
    let mut means = Means::halved(image.width, image.height, first);
    loop {
        levels.push(means.level());
        if means.width.max(means.height) == 1 {
            return levels;
        }
        let (width, height) = (means.width, means.height);
        means = Means::halved(width, height, |x, y| means.vectors[y as usize * width as usize + x as usize]);
    }
}

/// Returns the unit vector of a texel; the surface's own normal if the texel has no direction.
fn decode(texel: &[u8]) -> Vec3 {
    let number = |byte: u8| f32::from(byte) / 127.5 - 1.0;
    let vector = Vec3::new(number(texel[0]), number(texel[1]), number(texel[2]));
    if vector.length_squared() > lumbre_optics::SHORTEST_BENT_SQUARED as f32 {
        vector.normalize()
    } else {
        Vec3::Z
    }
}

/// Means of unit normals.
struct Means {
    width: u32,
    height: u32,
    vectors: Vec<Vec3>,
}

impl Means {
    /// Averages the vectors of a level that contribute to each texel of the next level.
    fn halved(width: u32, height: u32, vector: impl Fn(u32, u32) -> Vec3) -> Self {
        let (half_width, half_height) = ((width / 2).max(1), (height / 2).max(1));
        let mean = |x: u32, y: u32| {
            let parts = box_filter_2d([width, height], [x, y]);
            parts.map(|([column, row], part)| part * vector(column, row)).sum::<Vec3>()
        };
        let vectors = (0..half_height).flat_map(|y| (0..half_width).map(move |x| (x, y)));
        let vectors = vectors.map(|(x, y)| mean(x, y)).collect();
        Self { width: half_width, height: half_height, vectors }
    }

    fn level(&self) -> MipLevel {
        let byte = |number: f32| (number * 255.0).round() as u8;
        let texel = |mean: &Vec3| {
            // Normalized, because eight bits would lose the direction of a short mean.
            let [x, y, z] =
                mean.try_normalize().unwrap_or(Vec3::Z).to_array().map(|number| byte(0.5 * number + 0.5));
            [x, y, z, byte(normal_map_spread(f64::from(mean.length())) as f32)]
        };
        let rgba = self.vectors.iter().flat_map(texel).collect();
        MipLevel { width: self.width, height: self.height, rgba }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, texels: &[[u8; 4]]) -> Image {
        let height = texels.len() as u32 / width;
        Image { name: String::new(), width, height, rgba: texels.concat() }
    }

    #[test]
    fn a_flat_map_has_no_spread_at_any_level() {
        let levels = normal_levels(&image(4, &[[128, 128, 255, 255]; 8]));
        let sizes: Vec<_> = levels.iter().map(|level| (level.width, level.height)).collect();
        assert_eq!(sizes, [(4, 2), (2, 1), (1, 1)]);
        for level in &levels {
            // The mean of equal unit vectors has length 1 up to one or two roundings; the square root of that
            // error is 3e-4, which is 0 in eight bits.
            assert!(level.rgba.chunks_exact(4).all(|texel| texel == [128, 128, 255, 0]), "{level:?}");
        }
    }

    #[test]
    fn a_ridge_averages_to_its_middle_and_remembers_its_slopes() {
        // Slopes of -45 and 45 degrees along x: the mean has length 1/sqrt(2), so 2 (1 - L)/L = 0.83.
        let slope = |side: f64| {
            let byte = |number: f64| ((0.5 * number + 0.5) * 255.0).round() as u8;
            [byte(side * 0.5f64.sqrt()), 128, byte(0.5f64.sqrt()), 255]
        };
        let levels = normal_levels(&image(2, &[slope(-1.0), slope(1.0)]));
        let [x, y, z, spread] = [0, 1, 2, 3].map(|channel| f64::from(levels[1].rgba[channel]) / 255.0);
        assert!((x - 0.5).abs() < 0.005 && (y - 0.5).abs() < 0.005 && z > 0.99, "{:?}", levels[1]);
        let expected = (2.0 * (2.0f64.sqrt() - 1.0)).sqrt();
        assert!((spread - expected).abs() < 0.006, "{spread} {expected}");
        // Opposite vectors have no mean: the result is the surface's own normal with the largest spread.
        let opposite = normal_levels(&image(2, &[[255, 128, 128, 255], [0, 127, 127, 255]]));
        assert_eq!(opposite[1].rgba[3], 255);
    }
}
