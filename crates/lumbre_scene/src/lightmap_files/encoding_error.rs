//! The error that encoding light in fewer bits introduces. The encoders are elsewhere, and the error of the
//! bake is not included.

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// The difference between an image of light and what its file stores.
///
/// Errors are relative to the mean absolute channel over the texels that are not black, so that unused texels
/// of an atlas do not dilute them. All fields are 0 for an image without light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EncodingError {
    /// Root mean square error of the channels of texels that are not black, divided by their mean.
    pub relative_rmse: f64,
    /// Largest error of a channel, divided by the same mean.
    pub largest: f64,
    /// Texels with a channel outside of the format's range, which was clamped; without those counted in
    /// `negative`.
    pub saturated: u64,
    /// Texels with a channel below zero in a format without a sign, which was written as 0.
    pub negative: u64,
}

impl EncodingError {
    /// Compares texels with their decoded values in the same order. The last argument is the smallest and the
    /// largest number of the format, by channel.
    pub(crate) fn between(
        texels: &[Vec3],
        decoded: impl Iterator<Item = Vec3>,
        [least, most]: [Vec3; 2],
    ) -> Self {
        let (mut squares, mut sum, mut lit) = (0.0, 0.0, 0u64);
        let mut result = Self::default();
        for (texel, decoded) in texels.iter().zip(decoded) {
            let difference = (texel.as_dvec3() - decoded.as_dvec3()).abs();
            if *texel != Vec3::ZERO {
                squares += difference.length_squared();
                sum += texel.as_dvec3().abs().dot(DVec3::ONE);
                lit += 3;
            }
            result.largest = result.largest.max(difference.max_element());
            result.saturated += u64::from(texel.cmpgt(most).any());
            let below = texel.cmplt(least).any();
            if least == Vec3::ZERO {
                result.negative += u64::from(below);
            } else {
                result.saturated += u64::from(below && !texel.cmpgt(most).any());
            }
        }
        if lit > 0 {
            let mean = sum / lit as f64;
            result.relative_rmse = (squares / lit as f64).sqrt() / mean;
            result.largest /= mean;
        }
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn against_the_definition() {
        let texels = [Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0), Vec3::new(9.0, -1.0, 4.0)];
        let decoded = [Vec3::ZERO, Vec3::new(1.5, 2.0, 3.0), Vec3::new(8.0, 0.0, 4.0)];
        let range = [Vec3::ZERO, Vec3::splat(8.0)];
        let error = EncodingError::between(&texels, decoded.into_iter(), range);
        let mean = 20.0 / 6.0;
        assert!((error.relative_rmse - ((0.25f64 + 1.0 + 1.0) / 6.0).sqrt() / mean).abs() < 1e-15);
        assert!((error.largest - 1.0 / mean).abs() < 1e-15);
        assert_eq!((error.saturated, error.negative), (1, 1));

        let signed = [Vec3::splat(-8.0), Vec3::splat(8.0)];
        let far = [Vec3::new(9.0, -9.0, 0.0), Vec3::new(0.0, 0.0, -9.0)];
        let error = EncodingError::between(&far, far.into_iter(), signed);
        assert_eq!((error.saturated, error.negative), (2, 0), "a texel counts once, a sign is no loss");
        assert_eq!(
            EncodingError::between(&texels[..1], decoded.into_iter(), range),
            EncodingError::default()
        );
    }
}
