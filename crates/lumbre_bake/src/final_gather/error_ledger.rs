//! Every term of a map's stated error in one place, and their sum. Not how each term is found: that is documented where
//! it is found (see the table). All are squared errors, mean of the channels, per covered texel.
//!
//! ```text
//!   term           what it is                                  found by                      over a whole map
//!   ─────────────  ──────────────────────────────────────────  ────────────────────────────  ─────────────────────────
//!   direct light   spread of batches of shadow samples;        sources::irradiance,          without its caution
//!                  differences of the texels from which       direct_light::shared_light,
//!                  one is interpolated                        direct_light::sparse_pass
//!   noise          spread of four replicates, after smoothing  denoise::replicates::spread   the neighbours' mean
//!   smoothing      smoothed half of the replicates against     denoise::smoothing_bias       the same
//!                  the raw other half
//!   form factors   half the difference of two half solutions,  radiosity::exchange and       the same
//!                  and the difference to patches twice as      size_error, read by rays:
//!                  large                                       GatherSums::patch_error
//!   texels read    noise of the texels that later rounds       gather                        the same
//!                  read, as far as it is correlated
//!   patches        patches against real bounces, at some hits  error_estimate::patch_bias    without chance's part
//!   solver         residual / (1 - rho) of light by bounces    radiosity::solver             the same
//!   reused gather  possible change of light that is kept from  rebake::indirect_change       the same
//!                  a former bake
//!   arithmetic     light through cracks as wide as coordinates error_ledger                  the same
//!                  are rounded
//! ```
//!
//! Where the constants of each term are, what they were measured on or follow from, and the tests of the term itself.
//! `honest_error` and `coverage` test the sum of all terms:
//!
//! ```text
//!   term           constants                                  measured on                   tests
//!   ─────────────  ─────────────────────────────────────────  ────────────────────────────  ───────────────────────────
//!   direct light   VARIANCE_FACTOR: sources::batches          rooms_0, rooms_1 (A)          of sources::share_variance
//!                  EDGE: sources::share_variance              derived: strata on an edge
//!   noise          CAUTION: denoise::replicates               two rooms, four seeds         of denoise::denoised
//!                  RELATIVE_VARIANCE: the same                derived: four replicates
//!   smoothing      BLOCK_RADIUS, BIAS_RADIUS:                 waves of 12, 24 and 48        of denoise::denoised
//!                  denoise::smoothing_bias                    texels: the error is 1.9, 1.4
//!                                                             and 1.0 times the stated one
//!                                                             where noise is low
//!   form factors   ORDER: radiosity::size_error               rooms                         of radiosity::exchange
//!   texels read    none
//!   patches        CHECK_RADIUS, SIGNIFICANT, WIDER_STEPS,    rooms_0, rooms_1 (A)          of error_estimate
//!                  WIDER_STEP: error_estimate
//!   solver         none                                                                     of radiosity::exchange
//!   reused gather  MAX_SHARE, MAX_TEXEL_SHARE: rebake::choice chosen, not measured          `rebake`
//!   arithmetic     ARITHMETIC: here                           derived: roundings            none by itself
//! ```
//!
//! (A): scenes of the tests, asked for 1 % at maps of 64 texels, against converged bakes (the example `honesty`). The
//! error of the whole map, stated and true, and the share of texels within twice their stated error, in per cent:
//!
//! ```text
//!                              rooms_0                  rooms_1
//!                        stated  true  within     stated  true  within
//!   as they are            1.07  0.82   98.41       2.82  2.53   99.48
//!   VARIANCE_FACTOR 1      1.05  0.82   98.29       2.74  2.38   99.50     it decides little beside the gather, and
//!   VARIANCE_FACTOR 4      1.07  0.84   98.34       2.71  2.32   99.51     rays move to where it is large
//!   SIGNIFICANT 2          1.01  0.83   97.76       2.70  2.36   99.60     chance is corrected for as if it were known
//!   SIGNIFICANT 4          1.08  0.82   98.46       2.88  2.43   99.45
//!   CHECK_RADIUS 2         1.32  0.83   98.58       2.98  2.57   99.54     few checks: more is stated than there is
//!   CHECK_RADIUS 5         0.89  0.82   97.88       2.92  2.48   99.41     what a place has of its own is averaged away
//!   WIDER_STEPS 1          1.09  0.82   98.16       2.82  2.53   99.45
//! ```
//!
//! Two later steps rewrite the errors of single texels in the finished map. They are not terms: no round can reduce
//! them, and the whole map's figure does not contain them. `finish::fill` moves values along their neighbours' slope to
//! the texels' centres, which changes their variance with the weights of the fit; `finish::seams` adds the square of by
//! how much a texel was moved.
//!
//! A cautious figure is stated for a single texel, the expected one for the whole map: the cautious figures of many
//! texels add up to far more than the map's error. The tests `honest_error` compare both with converged bakes, and
//! `coverage` compares the former with the tests' path tracer in scenes that no constant was chosen on.
//!
//! Not included: the map's own resolution, and penumbrae that all samples of a texel and of its neighbours missed.

use crate::squared_errors::SquaredErrors;
use rayon::prelude::*;

use super::error_estimate::PatchBias;
use super::gather_sums::GatherSums;
use crate::ErrorPart;
use crate::coverage::{CoveredTexels, Texel};
use crate::denoise::Denoised;
use crate::denoise::replicates::mean;
use crate::direct_light::DirectLight;

/// The gather's results and errors, per covered texel.
pub(crate) struct GatherErrors<'a> {
    pub gathered: &'a [GatherSums],
    pub denoised: &'a Denoised,
    pub patches: &'a [PatchBias],
    /// Bound of the solver's error, relative to the light by bounces.
    pub residual_bound: f64,
    /// By how much light kept from a former bake may have changed since, W/m²; empty where none is kept.
    pub kept: &'a [f32],
}

/// What all terms of a map's error are computed from.
pub(crate) struct ErrorLedger<'a> {
    pub texels: &'a CoveredTexels<'a>,
    pub direct: &'a DirectLight,
    /// `None` where nothing bounces.
    pub gather: Option<GatherErrors<'a>>,
    /// Mean irradiance, W/m²: the light that cracks may let through.
    pub light: f32,
}

/// A term of the error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Term {
    DirectLight,
    Noise,
    Smoothing,
    FormFactors,
    TexelsRead,
    Patches,
    Solver,
    ReusedGather,
    Arithmetic,
}

/// Share of the mean light that cracks may let through: sixteen roundings of a coordinate, as many as a segment's end
/// is moved by.
const ARITHMETIC: f32 = 16.0 / (1 << 24) as f32;

impl Term {
    /// All terms, with their names in reports.
    const ALL: [(Self, &'static str); 9] = [
        (Self::DirectLight, "noise of direct light"),
        (Self::Noise, "noise of the final gather"),
        (Self::Smoothing, "smoothing"),
        (Self::FormFactors, "form factors and patches' size"),
        (Self::TexelsRead, "noise of texels that rays read"),
        (Self::Patches, "patches beside real bounces"),
        (Self::Solver, "solver"),
        (Self::ReusedGather, "light kept of a former bake"),
        (Self::Arithmetic, "arithmetic"),
    ];
}

impl<'a> ErrorLedger<'a> {
    /// The ledger of a map without bounces.
    pub fn of_direct_light(texels: &'a CoveredTexels<'a>, direct: &'a DirectLight) -> Self {
        Self { texels, direct, gather: None, light: 0.0 }
    }
}

impl ErrorLedger<'_> {
    /// The sum of all terms, per covered texel.
    pub fn total(&self) -> SquaredErrors {
        let of_texel = |index: usize| {
            let stated = |term| self.stated(term, index);
            let read = stated(Term::FormFactors) + stated(Term::TexelsRead);
            let [smoothing, solver, patches, reused] =
                [Term::Smoothing, Term::Solver, Term::Patches, Term::ReusedGather].map(stated);
            let systematic = smoothing + read + solver + patches + reused;
            let rest = stated(Term::DirectLight) + systematic + stated(Term::Arithmetic);
            let expected = self.expected(Term::Noise, index) + (rest - self.direct.texels[index].caution);
            (stated(Term::Noise) + rest, expected)
        };
        let (cautious, expected) = (0..self.direct.texels.len()).into_par_iter().map(of_texel).unzip();
        SquaredErrors { cautious, expected }
    }

    /// By how much the sum over texels of the expected total, relative to the light around them, exceeds what is
    /// expected of the whole map: the patches' error of a single texel contains the effect of chance, which cancels in
    /// the mean of many.
    pub fn by_chance(&self) -> f64 {
        let Some(gather) = &self.gather else { return 0.0 };
        let sum_of = |square: fn(&PatchBias) -> f32| -> f64 {
            let squares: Vec<f32> = gather.patches.iter().map(square).collect();
            self.relative_sum(&squares)
        };
        sum_of(|bias| bias.rest) - sum_of(|bias| bias.expected).max(0.0)
    }

    /// The mean over the view from each block of squared errors relative to local light, without the effect of chance on
    /// the patches' error that is known to cancel there.
    pub fn in_views(&self, relative: &[f32]) -> Vec<f64> {
        let views = &self.direct.local.views;
        let mut in_views = views.means(relative);
        let Some(gather) = &self.gather else { return in_views };
        let means_of = |square: fn(&PatchBias) -> f32| {
            let squares: Vec<f32> = gather.patches.iter().map(square).collect();
            views.means(&self.direct.local.relative(&squares))
        };
        let (rest, expected) = (means_of(|bias| bias.rest), means_of(|bias| bias.expected));
        for ((mean, rest), expected) in in_views.iter_mut().zip(rest).zip(expected) {
            *mean = (*mean - (rest - expected.max(0.0))).max(0.0);
        }
        in_views
    }

    /// What the map's error is made of, the largest part first: the parts' squares add up to that of the whole.
    pub fn parts(&self) -> Vec<ErrorPart> {
        let (open, by_chance) = (self.open_texels(), self.by_chance());
        let part = |(term, name): (Term, &str)| {
            let all = 0..self.texels.list.len();
            let squares: Vec<f32> = all.map(|index| self.expected(term, index)).collect();
            let sum = self.relative_sum(&squares);
            let sum = if term == Term::Patches { sum - by_chance } else { sum };
            ErrorPart { what: name.to_owned(), error: (sum / open).max(0.0).sqrt() }
        };
        let mut parts: Vec<ErrorPart> =
            Term::ALL.into_iter().map(part).filter(|part| part.error > 0.0).collect();
        parts.sort_by(|a, b| b.error.total_cmp(&a.error));
        parts
    }

    /// Number of texels that are not hidden; at least one, as it is divided by.
    pub fn open_texels(&self) -> f64 {
        self.texels.list.iter().filter(|texel| !texel.is_hidden()).count().max(1) as f64
    }

    /// The sum of squared errors over the texels that are not hidden, each relative to the light around its texel.
    pub fn relative_sum(&self, squares: &[f32]) -> f64 {
        open_sum(&self.texels.list, &self.direct.local.relative(squares))
    }

    /// The squared error that is stated for a single texel.
    fn stated(&self, term: Term, index: usize) -> f32 {
        match (term, &self.gather) {
            (Term::DirectLight, _) => self.direct.texels[index].variance,
            (Term::Arithmetic, _) => (ARITHMETIC * self.light).powi(2),
            (_, None) => 0.0,
            (Term::Noise, Some(gather)) => gather.denoised.noise.cautious[index],
            (Term::Smoothing, Some(gather)) => gather.denoised.smoothing[index],
            (Term::FormFactors, Some(gather)) => gather.gathered[index].patch_error().length_squared(),
            (Term::TexelsRead, Some(gather)) => gather.gathered[index].texel_variance(),
            (Term::Patches, Some(gather)) => gather.patches[index].rest,
            (Term::Solver, Some(gather)) => {
                let unsolved = gather.residual_bound as f32
                    * mean(&gather.denoised.estimates[index]).element_sum()
                    / 3.0;
                unsolved * unsolved
            }
            (Term::ReusedGather, Some(gather)) => {
                gather.kept.get(index).map_or(0.0, |change| change * change)
            }
        }
    }

    /// The squared error that is expected of a texel as one among many.
    fn expected(&self, term: Term, index: usize) -> f32 {
        match (term, &self.gather) {
            (Term::DirectLight, _) => self.direct.texels[index].variance - self.direct.texels[index].caution,
            (Term::Noise, Some(gather)) => gather.denoised.noise.expected[index],
            _ => self.stated(term, index),
        }
    }
}

/// The sum over the texels that are not hidden.
pub(crate) fn open_sum(texels: &[Texel], numbers: &[f32]) -> f64 {
    let open = texels.iter().zip(numbers).filter(|(texel, _)| !texel.is_hidden());
    open.map(|(_, number)| f64::from(*number)).sum()
}

/// The root of a squared error. Infinity for NaN: then nothing is known, which must not look like an error of 0.
pub(crate) fn root(squared: f64) -> f64 {
    if squared.is_nan() { f64::INFINITY } else { squared.max(0.0).sqrt() }
}

/// The root of a squared error, relative to a mean; 0 where there is no light.
pub(crate) fn relative_to(mean: f64, squared: f64) -> f64 {
    if mean > 0.0 { root(squared) / mean } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nan_is_not_an_error_of_zero() {
        assert_eq!((root(f64::NAN), root(-1e-30), root(4.0)), (f64::INFINITY, 0.0, 2.0));
        assert_eq!((relative_to(2.0, f64::NAN), relative_to(2.0, 16.0)), (f64::INFINITY, 2.0));
        assert_eq!(relative_to(0.0, 16.0), 0.0);
    }
}
