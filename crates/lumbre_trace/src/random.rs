//! Sample numbers: Owen-scrambled Sobol points, one sequence per pixel and pass.

use glam::DVec2;

/// The numbers of one sample in [0, 1), one dimension after the other.
#[derive(Clone, Debug)]
pub(crate) struct Numbers {
    index: u32,
    dimension: u32,
    seed: u32,
    /// The four dimensions that the next number is among.
    four: [f32; 4],
}

/// Number of dimensions of `sobol_burley`; beyond them its sequences begin again with another seed.
const DIMENSIONS: u32 = 256;
/// Number of points of `sobol_burley`.
const POINTS: u32 = 1 << 16;

impl Numbers {
    /// Starts the numbers of a sample of a pixel in a pass. Passes are independent of each other; the samples
    /// of one pass are distributed evenly between each other.
    pub fn new(pixel: u32, pass: u32, sample: u32) -> Self {
        Self {
            index: sample % POINTS,
            dimension: 0,
            seed: hash(hash(pixel) ^ pass.wrapping_mul(0x9e37_79b9)),
            four: [0.0; 4],
        }
    }

    /// Returns the next number.
    pub fn next(&mut self) -> f64 {
        let within = (self.dimension % 4) as usize;
        if within == 0 {
            let (round, dimension) = (self.dimension / DIMENSIONS, self.dimension % DIMENSIONS);
            let seed = if round == 0 { self.seed } else { hash(self.seed ^ round) };
            self.four = sobol_burley::sample_4d(self.index, dimension / 4, seed);
        }
        self.dimension += 1;
        f64::from(self.four[within])
    }

    /// Returns the next two numbers.
    pub fn pair(&mut self) -> DVec2 {
        let x = self.next();
        DVec2::new(x, self.next())
    }
}

/// A bijective hash of u32 ("lowbias32").
fn hash(value: u32) -> u32 {
    let mut value = value.wrapping_add(0x3c6e_f372);
    value ^= value >> 16;
    value = value.wrapping_mul(0x7feb_352d);
    value ^= value >> 15;
    value = value.wrapping_mul(0x846c_a68b);
    value ^ (value >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_at_once_are_the_same_as_one_by_one() {
        let mut numbers = Numbers::new(5, 3, 2);
        let seed = numbers.seed;
        for dimension in 0..2 * DIMENSIONS {
            let seed = if dimension < DIMENSIONS { seed } else { hash(seed ^ 1) };
            let one = sobol_burley::sample(2, dimension % DIMENSIONS, seed);
            assert_eq!(numbers.next(), f64::from(one), "{dimension}");
        }
    }
}
