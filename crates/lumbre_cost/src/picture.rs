//! Pictures of radiance, and their comparison with references.

use glam::DVec3;
use lumbre_trace::{Displayed, Metering, compare_displayed, shown};
use rayon::prelude::*;

use crate::{ErrorOf, ErrorOver};

/// Radiance of every pixel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Width in pixels.
    pub width: usize,
    /// Linear RGB, W/(m² sr), top row first.
    pub radiance: Vec<DVec3>,
}

/// The result of comparing a picture with its reference.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared {
    /// The differences of the whole picture.
    pub error: ErrorOf,
    /// FLIP of every pixel, top row first.
    pub heat: Vec<f64>,
}

/// Fraction of the lit pixels that has to be clipped to white before an exposure is metered.
const CLIPPED: f64 = 0.02;

impl Picture {
    /// Returns the height in pixels.
    pub fn height(&self) -> usize {
        self.radiance.len() / self.width.max(1)
    }

    /// Returns the factor on radiance with which it is displayed: 1, unless too many pixels would be clipped.
    pub fn exposure(&self) -> f64 {
        let metering = Metering::of(&self.radiance).filter(|found| found.clipped > CLIPPED);
        metering.map_or(1.0, |found| f64::from(found.exposure))
    }

    /// Returns the displayed colours with an exposure: tone curve and sRGB encoding, with each channel in [0,
    /// 1].
    pub fn shown(&self, exposure: f64) -> Vec<DVec3> {
        self.radiance.par_iter().map(|pixel| shown(*pixel * exposure)).collect()
    }
}

/// A reference as it is displayed, for any number of comparisons.
#[derive(Clone, Debug)]
pub struct ShownReference {
    exposure: f64,
    displayed: Displayed,
}

impl ShownReference {
    /// Displays a reference with this exposure.
    pub fn at(reference: &Picture, exposure: f64) -> Self {
        Self { exposure, displayed: Displayed::new(reference.width, reference.shown(exposure)) }
    }

    /// Displays a reference with its own exposure.
    pub fn of(reference: &Picture) -> Self {
        Self::at(reference, reference.exposure())
    }
}

/// Compares a picture with its reference, both displayed with the reference's exposure. `None` if the sizes
/// differ.
pub fn compared(reference: &Picture, picture: &Picture, over: ErrorOver) -> Option<Compared> {
    compared_with((reference, &ShownReference::of(reference)), picture, over)
}

/// Compares a picture with its reference, both displayed with this exposure. `None` if the sizes differ.
pub fn compared_at(
    reference: &Picture,
    picture: &Picture,
    over: ErrorOver,
    exposure: f64,
) -> Option<Compared> {
    compared_with((reference, &ShownReference::at(reference, exposure)), picture, over)
}

/// Compares a picture with a reference that is displayed already. `None` if the sizes differ.
pub fn compared_with(
    (reference, shown): (&Picture, &ShownReference),
    picture: &Picture,
    over: ErrorOver,
) -> Option<Compared> {
    let same = reference.width == picture.width && reference.radiance.len() == picture.radiance.len();
    if !same || picture.radiance.is_empty() {
        return None;
    }
    let pairs = reference.radiance.iter().zip(&picture.radiance);
    let counts = |(a, b): &(&DVec3, &DVec3)| {
        over != ErrorOver::WhereBothAreLit || (**a != DVec3::ZERO && **b != DVec3::ZERO)
    };
    let (wanted, found): (Vec<DVec3>, Vec<DVec3>) = pairs.filter(counts).map(|(a, b)| (*a, *b)).unzip();
    // A picture that is the reference itself looks the same.
    let own = (reference != picture).then(|| Displayed::new(picture.width, picture.shown(shown.exposure)));
    let found =
        compare_displayed([&wanted, &found], [&shown.displayed, own.as_ref().unwrap_or(&shown.displayed)]);
    let error = ErrorOf {
        relative_rmse: found.relative_error,
        largest: found.largest,
        flip: Some(found.flip),
        uncertainty: 0.0,
    };
    Some(Compared { error, heat: found.map })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(values: &[f64]) -> Picture {
        Picture { width: 2, radiance: values.iter().map(|value| DVec3::splat(*value)).collect() }
    }

    #[test]
    fn black_pixels_count_only_where_they_are_asked_for() {
        let (reference, picture) = (grey(&[0.5, 0.5, 0.5, 0.0]), grey(&[0.5, 0.4, 0.0, 0.0]));
        let lit = compared(&reference, &picture, ErrorOver::WhereBothAreLit).expect("the sizes agree").error;
        // Two pixels are lit in both; one of them is off by a fifth.
        assert!((lit.relative_rmse - (0.01f64 / 0.5).sqrt()).abs() < 1e-12, "{lit:?}");
        assert!((lit.largest - 0.1).abs() < 1e-12);
        let all = compared(&reference, &picture, ErrorOver::Picture).expect("the sizes agree").error;
        assert!((all.relative_rmse - (0.26f64 / 0.75).sqrt()).abs() < 1e-12, "{all:?}");
        assert_eq!(
            compared(&reference, &reference, ErrorOver::Picture).map(|same| same.error.relative_rmse),
            Some(0.0)
        );
        assert_eq!(compared(&reference, &grey(&[1.0, 1.0]), ErrorOver::Picture), None);
    }
}
