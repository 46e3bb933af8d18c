//! Sample points that the texels of a tile share: each texel takes its own run of one sequence, in Morton order, so that the
//! points of every aligned 2 x 2, 4 x 4 and 8 x 8 block together are as evenly spread as one texel's. What smoothing then adds
//! up has the error of one long low-discrepancy sequence, not of many short independent ones (Ahmed and Wonka,
//! "Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering of Pixels", 2020).
//! Not the points themselves: that is `sampling`.

use super::footprint::Texel;
use crate::sampling::{Sequence, SequenceSet, Stream};

/// Texels along a tile's side, and in it.
const SIDE: u32 = 8;
const TEXELS: u32 = SIDE * SIDE;

/// One texel's part of its tile's sequence.
#[derive(Clone, Copy)]
pub(crate) struct TileSequence {
    sequence: Sequence,
    /// Its first dimension set, of which every sample has a point.
    first_set: SequenceSet,
    /// The texel's place in its tile.
    place: u32,
    /// Points of a texel's first run.
    run: u32,
}

impl TileSequence {
    /// One scramble for every stream and tile; every texel takes `run` points at first, and later as many again as it has.
    pub fn new(seed: u32, stream: Stream, texel: &Texel, run: u32) -> Self {
        // Maps are at most 8192 texels wide: 10 bits of tiles.
        let tile = ((texel.y / SIDE) << 10) | (texel.x / SIDE);
        let sequence = Sequence::new(seed, stream, tile).of(texel.object);
        let place = morton(texel.x % SIDE, texel.y % SIDE);
        Self { sequence, first_set: sequence.set(0), place, run: run.max(1) }
    }

    /// The texel's point `sample`, of dimension set 0.
    pub fn first(&self, sample: u32) -> [f32; 4] {
        self.first_set.point(self.index(sample))
    }

    /// The texel's point `sample`, of dimension set `set`.
    pub fn point(&self, sample: u32, set: u32) -> [f32; 4] {
        self.sequence.point(self.index(sample), set)
    }

    /// Runs of all texels lie one after the other; then the second runs, and so on, each as long as those before together.
    fn index(&self, sample: u32) -> u32 {
        let mut before = 0;
        let mut run = self.run;
        while sample >= before + run {
            before += run;
            run = before;
        }
        TEXELS * before + self.place * run + (sample - before)
    }
}

/// Bits of two numbers below 8, interleaved.
fn morton(x: u32, y: u32) -> u32 {
    let spread = |v: u32| (v & 1) | ((v & 2) << 1) | ((v & 4) << 2);
    spread(x) | (spread(y) << 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coverage::footprint::Footprint;
    use crate::texel_index::MapTexel;

    fn texel(x: u32, y: u32) -> Texel {
        Texel { index: MapTexel(0), object: 0, x, y, triangle: 0, footprint: Footprint::Hidden }
    }

    #[test]
    fn every_point_belongs_to_one_texel_of_a_tile() {
        let mut taken = vec![false; 64 * 32];
        for (x, y) in (0..8).flat_map(|y| (0..8).map(move |x| (x, y))) {
            let own = TileSequence::new(0, Stream::Test(0), &texel(x, y), 8);
            for sample in 0..32 {
                let index = own.index(sample) as usize;
                assert!(!std::mem::replace(&mut taken[index], true), "{x} {y} {sample}");
            }
        }
        assert!(taken.iter().all(|taken| *taken));
    }

    #[test]
    fn a_block_of_texels_is_as_evenly_spread_as_one_of_them() {
        // 4 x 4 texels with 4 points each: 64 points, one in each of 8 x 8 squares of any two of the first two dimensions.
        let mut cells = [0u32; 64];
        for (x, y) in (0..4).flat_map(|y| (0..4).map(move |x| (x + 4, y))) {
            let own = TileSequence::new(5, Stream::Test(1), &texel(x, y), 4);
            for sample in 0..4 {
                let [u, v, ..] = own.first(sample);
                cells[(u * 8.0) as usize + 8 * (v * 8.0) as usize] += 1;
            }
        }
        assert!(cells.iter().all(|&count| count == 1), "{cells:?}");
    }
}
