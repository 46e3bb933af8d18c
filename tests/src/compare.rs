//! Comparison of frames: how much two differ. How much they may differ is stated in each test, with the reason.

use glam::DVec3;

/// How much two frames differ, over the pixels that both have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Largest difference of any channel. NaN counts as infinite.
    pub largest: f64,
    /// Index of the pixel with the largest difference.
    pub pixel: usize,
    /// |a - b| / |b| over all channels.
    pub relative_l2: f64,
    /// Mean absolute difference of the channels.
    pub mean: f64,
    /// Number of pixels compared.
    pub pixels: usize,
}

/// Compares `got` with `expected`; pixels that are `None` in either are left out.
///
/// # Panics
/// If the frames differ in size.
pub fn compare(got: &[Option<DVec3>], expected: &[Option<DVec3>]) -> Difference {
    assert_eq!(got.len(), expected.len(), "frames of different sizes");
    let mut result = Difference { largest: 0.0, pixel: 0, relative_l2: 0.0, mean: 0.0, pixels: 0 };
    let (mut squares, mut reference) = (0.0, 0.0);
    for (pixel, (got, expected)) in got.iter().zip(expected).enumerate() {
        let (Some(got), Some(expected)) = (got, expected) else { continue };
        let apart = (*got - *expected).abs();
        let largest = if apart.is_nan() { f64::INFINITY } else { apart.max_element() };
        if largest > result.largest {
            (result.largest, result.pixel) = (largest, pixel);
        }
        squares += apart.length_squared();
        reference += expected.length_squared();
        result.mean += apart.element_sum() / 3.0;
        result.pixels += 1;
    }
    result.mean /= result.pixels.max(1) as f64;
    result.relative_l2 = (squares / reference.max(f64::MIN_POSITIVE)).sqrt();
    result
}
