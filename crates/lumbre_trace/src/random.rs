//! Numbers that look random and are not: Owen-scrambled Sobol points, one sequence a pixel and pass. Not what they choose.

use glam::DVec2;

/// A sample's numbers in [0, 1), one after another.
#[derive(Clone, Debug)]
pub(crate) struct Numbers {
    index: u32,
    dimension: u32,
    seed: u32,
}

/// Dimensions of `sobol_burley`; beyond them its sequences begin again with another seed.
const DIMENSIONS: u32 = 256;
/// Points of `sobol_burley`.
const POINTS: u32 = 1 << 16;

impl Numbers {
    /// Of a sample of a pixel in a pass. Passes are independent of each other, samples of one pass fill the space between them.
    pub fn new(pixel: u32, pass: u32, sample: u32) -> Self {
        Self {
            index: sample % POINTS,
            dimension: 0,
            seed: hash(hash(pixel) ^ pass.wrapping_mul(0x9e37_79b9)),
        }
    }

    /// The next number.
    pub fn next(&mut self) -> f64 {
        let (round, dimension) = (self.dimension / DIMENSIONS, self.dimension % DIMENSIONS);
        self.dimension += 1;
        let seed = if round == 0 { self.seed } else { hash(self.seed ^ round) };
        f64::from(sobol_burley::sample(self.index, dimension, seed))
    }

    /// The next two.
    pub fn pair(&mut self) -> DVec2 {
        let x = self.next();
        DVec2::new(x, self.next())
    }
}

/// A bijection of u32 without visible order ("lowbias32").
fn hash(value: u32) -> u32 {
    let mut value = value.wrapping_add(0x3c6e_f372);
    value ^= value >> 16;
    value = value.wrapping_mul(0x7feb_352d);
    value ^= value >> 15;
    value = value.wrapping_mul(0x846c_a68b);
    value ^ (value >> 16)
}
