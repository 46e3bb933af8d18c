//! Sample points that the texels of a tile share: each texel takes its own section of one sequence, in Morton order, so
//! that the points of every aligned 2 x 2, 4 x 4 and 8 x 8 block together are as evenly spread as those of one texel.
//! The sums over neighbours that the denoiser takes then have the error of one long low-discrepancy sequence instead of
//! many short independent ones (Ahmed and Wonka, "Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error via
//! Hierarchical Ordering of Pixels", 2020). The sequences themselves are in `sampling`.

use super::footprint::Texel;
use crate::sampling::{Sequence, SequenceSet, Stream};

/// Texels along a tile's side, and in a tile.
const SIDE: u32 = 8;
const TEXELS: u32 = SIDE * SIDE;

/// One texel's part of its tile's sequence.
#[derive(Clone, Copy)]
pub(crate) struct TileSequence {
    sequence: Sequence,
    /// Dimension set 0, prepared once because every sample uses it.
    first_set: SequenceSet,
    /// The texel's position in its tile, in Morton order.
    morton_index: u32,
    /// Points in a texel's first section.
    first_section: u32,
}

impl TileSequence {
    /// Every stream and tile has a scramble of its own. Each texel takes `first_section` points at first; each
    /// later section is as long as all sections before it together.
    pub fn new(seed: u32, stream: Stream, texel: &Texel, first_section: u32) -> Self {
        // Maps are at most 8192 texels wide: 10 bits of tiles.
        let tile = ((texel.y / SIDE) << 10) | (texel.x / SIDE);
        let sequence = Sequence::new(seed, stream, tile).of(texel.map.0);
        let morton_index = morton(texel.x % SIDE, texel.y % SIDE);
        Self { sequence, first_set: sequence.set(0), morton_index, first_section: first_section.max(1) }
    }

    /// The texel's point `sample` in dimension set 0.
    pub fn first(&self, sample: u32) -> [f32; 4] {
        self.first_set.point(self.index(sample))
    }

    /// The texel's point `sample` in dimension set `set`.
    pub fn point(&self, sample: u32, set: u32) -> [f32; 4] {
        self.sequence.point(self.index(sample), set)
    }

    /// The index in the tile's sequence: first come the first sections of all texels, then their second ones, and so on.
    fn index(&self, sample: u32) -> u32 {
        let mut before = 0;
        let mut section = self.first_section;
        while sample >= before + section {
            before += section;
            section = before;
        }
        TEXELS * before + self.morton_index * section + (sample - before)
    }
}

/// The Morton code of two numbers below 8: their bits interleaved.
fn morton(x: u32, y: u32) -> u32 {
    let spread = |v: u32| (v & 1) | ((v & 2) << 1) | ((v & 4) << 2);
    spread(x) | (spread(y) << 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coverage::footprint::Footprint;
    use crate::texel_index::{MapIndex, MapTexel};

    fn texel(x: u32, y: u32) -> Texel {
        Texel { index: MapTexel(0), map: MapIndex(0), x, y, triangle: 0, footprint: Footprint::Hidden }
    }

    #[test]
    fn every_point_belongs_to_one_texel_of_a_tile() {
        let mut taken = vec![false; 64 * 32];
        for (x, y) in (0..8).flat_map(|y| (0..8).map(move |x| (x, y))) {
            let sequence = TileSequence::new(0, Stream::Test(0), &texel(x, y), 8);
            for sample in 0..32 {
                let index = sequence.index(sample) as usize;
                assert!(!std::mem::replace(&mut taken[index], true), "{x} {y} {sample}");
            }
        }
        assert!(taken.iter().all(|taken| *taken));
    }

    #[test]
    fn a_block_of_texels_is_as_evenly_spread_as_one_of_them() {
        // 4 x 4 texels with 4 points each make 64 points: one in each of 8 x 8 squares of the first two dimensions.
        let mut cells = [0u32; 64];
        for (x, y) in (0..4).flat_map(|y| (0..4).map(move |x| (x + 4, y))) {
            let sequence = TileSequence::new(5, Stream::Test(1), &texel(x, y), 4);
            for sample in 0..4 {
                let [u, v, ..] = sequence.first(sample);
                cells[(u * 8.0) as usize + 8 * (v * 8.0) as usize] += 1;
            }
        }
        assert!(cells.iter().all(|&count| count == 1), "{cells:?}");
    }
}
