//! One mip level of a texture in memory, and the box filter that computes the next one.

/// Texels of four bytes each.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct MipLevel {
    pub width: u32,
    pub height: u32,
    pub rgba: Vec<u8>,
}

/// Returns the texels of a row or column of `size` texels that texel `index` of the next level covers, each
/// with its weight. The next level of an odd size has half of it, rounded down, so three texels contribute to
/// each of its texels and none is lost.
pub(crate) fn box_filter(size: u32, index: u32) -> impl Iterator<Item = (u32, f32)> + Clone {
    let half = size / 2;
    let taps = match (half, size % 2) {
        (0, _) => [(0, 1.0), (0, 0.0), (0, 0.0)],
        (_, 0) => [(2 * index, 0.5), (2 * index + 1, 0.5), (0, 0.0)],
        _ => {
            let part = |texels: u32| texels as f32 / size as f32;
            [(2 * index, part(half - index)), (2 * index + 1, part(half)), (2 * index + 2, part(index + 1))]
        }
    };
    taps.into_iter().filter(|(_, part)| *part > 0.0)
}

/// Returns the texels that texel (`x`, `y`) of the next level covers in two dimensions, with their weights.
pub(crate) fn box_filter_2d(
    [width, height]: [u32; 2],
    [x, y]: [u32; 2],
) -> impl Iterator<Item = ([u32; 2], f32)> {
    box_filter(height, y).flat_map(move |(row, of_rows)| {
        box_filter(width, x).map(move |(column, of_columns)| ([column, row], of_rows * of_columns))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_texel_counts_the_same() {
        for size in 1..40 {
            let mut parts = vec![0.0; size as usize];
            for index in 0..(size / 2).max(1) {
                let taps = box_filter(size, index);
                assert!((taps.clone().map(|(_, part)| part).sum::<f32>() - 1.0).abs() < 1e-6);
                taps.for_each(|(texel, part)| parts[texel as usize] += part);
            }
            let expected = (size / 2).max(1) as f32 / size as f32;
            assert!(parts.iter().all(|part| (part - expected).abs() < 1e-6), "{size}: {parts:?}");
        }
        assert_eq!(box_filter(4, 1).collect::<Vec<_>>(), [(2, 0.5), (3, 0.5)]);
    }
}
