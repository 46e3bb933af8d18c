//! A solution of the radiosity system, and the sums over patches that all solvers need. The solvers are in `solver` and
//! `stationary`.

use rayon::prelude::*;

use super::form_factors::FormFactors;
use super::patch_index::PatchIndex;

/// A solution, and how it was reached.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Solution {
    /// B_i, in the units of E_i.
    pub radiosity: Vec<f64>,
    pub iterations: u32,
    /// |E + ρ F B - B| / |E|, in the norm weighted by area.
    pub residual: f64,
}

/// The radiosity system B = E + ρ F B of one channel, and how exactly to solve it.
#[derive(Clone, Copy)]
pub(crate) struct RadiosityEquation<'a> {
    pub factors: &'a FormFactors,
    pub reflectance: &'a [f64],
    pub emission: &'a [f64],
    /// Norm of the emission.
    pub size: f64,
    /// Residual at which to stop, relative to `size`.
    pub tolerance: f64,
}

/// Relative residual at which the solver stops: well below the error of the form factors.
pub(crate) const TOLERANCE: f64 = 1e-5;

/// Limit of the iterations: more than any ρ <= 0.999 needs for a residual of 1e-12.
pub(crate) const MAX_ITERATIONS: u32 = 30_000;

/// Σ_j F_ij x_j for every patch i.
pub(crate) fn gather(factors: &FormFactors, x: &[f64]) -> Vec<f64> {
    (0..factors.len())
        .into_par_iter()
        .map(|i| exchanged(factors, i, x) / f64::from(factors.areas[i]))
        .collect()
}

/// Σ_j G_ij x_j for the patch at place i.
pub(crate) fn exchanged(factors: &FormFactors, i: usize, x: &[f64]) -> f64 {
    factors.row(PatchIndex::new(i)).map(|(j, g)| g * x[j.place()]).sum()
}

/// The Euclidean norm, weighted by area.
pub(crate) fn norm(factors: &FormFactors, x: &[f64]) -> f64 {
    x.iter().zip(&factors.areas).map(|(x, &area)| x * x * f64::from(area)).sum::<f64>().sqrt()
}
