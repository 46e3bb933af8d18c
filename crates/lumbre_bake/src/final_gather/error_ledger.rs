//! Every term of a map's stated error, in one place, and their sum. Not how each of them is found: that is told where it is found, and
//! `error_estimate` has those of the gather. All are squared, mean of the channels, per covered texel.
//!
//! ```text
//!   term           what it is                                               found by                       in a whole map
//!   ─────────────  ───────────────────────────────────────────────────────  ─────────────────────────────  ──────────────────────────
//!   direct light   spread of batches of shadow samples                      transport::direct, shared_light without its caution
//!   noise          spread of four replicates, after smoothing               error_estimate::spread         the neighbours' mean
//!   smoothing      half of the replicates smoothed against the other raw    smoothing_bias                 as it is
//!   form factors   half the difference of two half solutions, and to one    exchange and size_error        as it is
//!                  with patches twice as large, read by the texel's rays    GatherSums::patch_error
//!   texels read    what noise leaves in the texels that later rounds read,  gather                         as it is
//!                  as far as it is correlated
//!   patches        patches against real bounces, at some of the hits        error_estimate::patch_bias     without what chance added
//!   solver         residual / (1 - rho) of the light by bounces             transport::solver              as it is
//!   kept           by how much light kept of a former bake has changed      rebake::choice                 as it is
//!   arithmetic     what cracks as wide as rounded coordinates let through   here                           as it is
//! ```
//!
//! The finished map states two things more, texel by texel, which no round can make smaller and the whole map's figure does not have: `fill` tells
//! what the sum above leaves at a texel's centre, where its neighbours' slope brings it, and `seams` adds by how much a texel was moved.
//!
//! Of a single texel a cautious figure is stated, of the whole map the expected one: cautious figures of many texels add up to far more than the map's
//! error. The tests `honest_error` hold both against converged bakes.
//!
//! Not in it: the map's own resolution, and what a penumbra hides that all samples of a texel and of its neighbours missed.

use crate::squared_errors::SquaredErrors;
use rayon::prelude::*;

use super::error_estimate::PatchBias;
use crate::ErrorPart;
use crate::coverage::footprint::Texel;
use crate::denoise::replicates::{Estimates, mean};
use crate::direct_light::DirectLight;
use crate::direct_light::local_light::LocalLight;
use crate::final_gather::gather_sums::GatherSums;
use crate::sources::direct::Direct;

/// What the gather leaves.
pub(crate) struct GatherErrors<'a> {
    pub gathered: &'a [GatherSums],
    pub estimates: &'a [Estimates],
    /// Variance of the mean of each.
    pub noise: &'a SquaredErrors,
    pub smoothing: &'a [f32],
    pub patches: &'a [PatchBias],
    /// Relative, of the solver.
    pub residual_bound: f64,
    /// By how much the light may have changed since it was gathered; empty where none is kept.
    pub kept: &'a [f32],
}

/// Everything that may be wrong with a map.
pub(crate) struct ErrorLedger<'a> {
    pub direct: &'a [Direct],
    /// None where nothing bounces.
    pub gather: Option<GatherErrors<'a>>,
    /// Mean irradiance, W/m², of which cracks may let through.
    pub light: f32,
}

/// A kind of error.
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

/// Share of the mean light that is within the rounding of coordinates: sixteen of it, as where segments end.
const ARITHMETIC: f32 = 16.0 / (1 << 24) as f32;

impl Term {
    const ALL: [Self; 9] = [
        Self::DirectLight,
        Self::Noise,
        Self::Smoothing,
        Self::FormFactors,
        Self::TexelsRead,
        Self::Patches,
        Self::Solver,
        Self::ReusedGather,
        Self::Arithmetic,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::DirectLight => "noise of direct light",
            Self::Noise => "noise of the final gather",
            Self::Smoothing => "smoothing",
            Self::FormFactors => "form factors and patches' size",
            Self::TexelsRead => "noise of texels that rays read",
            Self::Patches => "patches beside real bounces",
            Self::Solver => "solver",
            Self::ReusedGather => "light kept of a former bake",
            Self::Arithmetic => "arithmetic",
        }
    }
}

impl<'a> ErrorLedger<'a> {
    /// Of a map without bounces.
    pub fn of_direct_light(direct: &'a DirectLight) -> Self {
        Self { direct: &direct.texels, gather: None, light: 0.0 }
    }
}

impl ErrorLedger<'_> {
    /// The sum of all terms, per covered texel.
    pub fn total(&self) -> SquaredErrors {
        let of_texel = |index: usize| {
            let cautious = |term| self.of(term, index);
            let read = cautious(Term::FormFactors) + cautious(Term::TexelsRead);
            let [smoothing, solver, patches, kept] =
                [Term::Smoothing, Term::Solver, Term::Patches, Term::ReusedGather].map(cautious);
            let systematic = smoothing + read + solver + patches + kept;
            let rest = cautious(Term::DirectLight) + systematic + cautious(Term::Arithmetic);
            let expected = self.expected(Term::Noise, index) + (rest - self.direct[index].caution);
            (cautious(Term::Noise) + rest, expected)
        };
        let (cautious, expected) = (0..self.direct.len()).into_par_iter().map(of_texel).unzip();
        SquaredErrors { cautious, expected }
    }

    /// The part of each texel's error that more rays make smaller.
    pub fn by_rays(&self) -> SquaredErrors {
        self.gather.as_ref().map_or_else(SquaredErrors::default, |gather| gather.noise.with(gather.smoothing))
    }

    /// By how much the sum over texels of the expected total, relative to the light around them, is more than is expected of the map: in single texels
    /// the patches' error has in it what chance adds, which falls out of their mean.
    pub fn by_chance(&self, texels: &[Texel], local: &LocalLight) -> f64 {
        let Some(gather) = &self.gather else { return 0.0 };
        let of_patches = |part: fn(&PatchBias) -> f32| -> f64 {
            let parts: Vec<f32> = gather.patches.iter().map(part).collect();
            open_sum(texels, &local.relative(&parts))
        };
        of_patches(|bias| bias.rest) - of_patches(|bias| bias.expected).max(0.0)
    }

    /// What the map's error is made of, the largest part first: their squares add up to that of the whole.
    pub fn parts(&self, texels: &[Texel], local: &LocalLight) -> Vec<ErrorPart> {
        let open = texels.iter().filter(|texel| !texel.is_hidden()).count().max(1) as f64;
        let by_chance = self.by_chance(texels, local);
        let part = |term: Term| {
            let squares: Vec<f32> = (0..texels.len()).map(|index| self.expected(term, index)).collect();
            let sum = open_sum(texels, &local.relative(&squares));
            let sum = if term == Term::Patches { sum - by_chance } else { sum };
            ErrorPart { what: term.name().to_owned(), error: (sum / open).max(0.0).sqrt() }
        };
        let mut parts: Vec<ErrorPart> =
            Term::ALL.into_iter().map(part).filter(|part| part.error > 0.0).collect();
        parts.sort_by(|a, b| b.error.total_cmp(&a.error));
        parts
    }

    /// As it is stated of one texel.
    fn of(&self, term: Term, index: usize) -> f32 {
        match (term, &self.gather) {
            (Term::DirectLight, _) => self.direct[index].variance,
            (Term::Arithmetic, _) => (ARITHMETIC * self.light).powi(2),
            (_, None) => 0.0,
            (Term::Noise, Some(gather)) => gather.noise.cautious[index],
            (Term::Smoothing, Some(gather)) => gather.smoothing[index],
            (Term::FormFactors, Some(gather)) => gather.gathered[index].patch_error().length_squared(),
            (Term::TexelsRead, Some(gather)) => gather.gathered[index].texel_variance(),
            (Term::Patches, Some(gather)) => gather.patches[index].rest,
            (Term::Solver, Some(gather)) => {
                let unsolved =
                    gather.residual_bound as f32 * mean(&gather.estimates[index]).element_sum() / 3.0;
                unsolved * unsolved
            }
            (Term::ReusedGather, Some(gather)) => gather.kept.get(index).map_or(0.0, |kept| kept * kept),
        }
    }

    /// As it is expected of one among many.
    fn expected(&self, term: Term, index: usize) -> f32 {
        match (term, &self.gather) {
            (Term::DirectLight, _) => self.direct[index].variance - self.direct[index].caution,
            (Term::Noise, Some(gather)) => gather.noise.expected[index],
            _ => self.of(term, index),
        }
    }
}

/// The sum over texels that show a surface.
pub(crate) fn open_sum(texels: &[Texel], numbers: &[f32]) -> f64 {
    let open = texels.iter().zip(numbers).filter(|(texel, _)| !texel.is_hidden());
    open.map(|(_, number)| f64::from(*number)).sum()
}

/// The root of a squared error. Of what is no number nothing is known: that is no error of 0.
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
    fn what_is_no_number_is_no_error_of_zero() {
        assert_eq!((root(f64::NAN), root(-1e-30), root(4.0)), (f64::INFINITY, 0.0, 2.0));
        assert_eq!((relative_to(2.0, f64::NAN), relative_to(2.0, 16.0)), (f64::INFINITY, 2.0));
        assert_eq!(relative_to(0.0, 16.0), 0.0);
    }
}
