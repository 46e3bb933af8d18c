//! Tileable, deterministic noise.

/// Hashes a lattice point to a number in [0, 1).
pub fn hash(x: u32, y: u32, seed: u32) -> f64 {
    // Murmur3's finalizer over a mix of the three.
    let mut h = x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA77) ^ seed.wrapping_mul(0xC2B2_AE3D);
    h ^= h >> 16;
    h = h.wrapping_mul(0x7FEB_352D);
    h ^= h >> 15;
    h = h.wrapping_mul(0x846C_A68B);
    h ^= h >> 16;
    f64::from(h) / 4_294_967_296.0
}

/// Smooth noise in [0, 1] on a grid of `cells` by `cells` over the unit square, periodic at its borders.
pub fn value_noise(u: f64, v: f64, cells: u32, seed: u32) -> f64 {
    let cells = cells.max(1);
    let (x, y) = (u.rem_euclid(1.0) * f64::from(cells), v.rem_euclid(1.0) * f64::from(cells));
    let (column, row) = (x.floor() as u32, y.floor() as u32);
    let smooth = |t: f64| t * t * (3.0 - 2.0 * t);
    let (s, t) = (smooth(x.fract()), smooth(y.fract()));
    let at = |dx: u32, dy: u32| hash((column + dx) % cells, (row + dy) % cells, seed);
    let lower = at(0, 0) + (at(1, 0) - at(0, 0)) * s;
    let upper = at(0, 1) + (at(1, 1) - at(0, 1)) * s;
    lower + (upper - lower) * t
}

/// Three octaves of [`value_noise`], in [0, 1].
pub fn layered_noise(u: f64, v: f64, cells: u32, seed: u32) -> f64 {
    let octave = |power: u32| value_noise(u, v, cells << power, seed + power) / f64::from(1 << power);
    (octave(0) + octave(1) + octave(2)) / 1.75
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_tiles_and_stays_in_range() {
        let mut sum = 0.0;
        for i in 0..400 {
            let v = f64::from(i) / 400.0;
            let value = layered_noise(0.37 * v, v, 4, 7);
            assert!((0.0..=1.0).contains(&value));
            assert!((layered_noise(0.0, v, 4, 7) - layered_noise(1.0, v, 4, 7)).abs() < 1e-12);
            sum += value;
        }
        // Uniform values have a mean of 1/2; 400 samples of low-frequency noise come within 0.2 of it.
        assert!((sum / 400.0 - 0.5).abs() < 0.2);
        assert_ne!(hash(1, 2, 3), hash(2, 1, 3));
    }
}
