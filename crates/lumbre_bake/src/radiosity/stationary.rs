//! The radiosity system by sweeps over all patches, each reading what those before have found: Jacobi's method, which is one bounce more per
//! sweep, as the documents have it, and Gauss and Seidel's (Cohen and Wallace, "Radiosity and Realistic Image Synthesis", 1993, chapter 5).
//! They check the default, which is in `solver` and takes fewer steps.

use super::form_factors::FormFactors;
use super::solution::{MAX_ITERATIONS, Solution, exchanged, gather, norm};

/// B ← E + ρ F B, of all patches at once; until the residual is at most `tolerance` of the emission's `size`.
pub(crate) fn jacobi(
    factors: &FormFactors,
    reflectance: &[f64],
    emission: &[f64],
    tolerance: f64,
    size: f64,
) -> Solution {
    iterated(factors, emission, tolerance, size, |x| {
        let gathered = gather(factors, x);
        for (i, value) in x.iter_mut().enumerate() {
            *value = emission[i] + reflectance[i] * gathered[i];
        }
    })
}

/// The same, each patch reading what the sweep has found before it.
pub(crate) fn gauss_seidel(
    factors: &FormFactors,
    reflectance: &[f64],
    emission: &[f64],
    tolerance: f64,
    size: f64,
) -> Solution {
    iterated(factors, emission, tolerance, size, |x| {
        for i in 0..x.len() {
            let gathered = exchanged(factors, i, x) / f64::from(factors.areas[i]);
            x[i] = emission[i] + reflectance[i] * gathered;
        }
    })
}

fn iterated(
    factors: &FormFactors,
    emission: &[f64],
    tolerance: f64,
    size: f64,
    sweep: impl Fn(&mut [f64]),
) -> Solution {
    let mut solution = Solution { radiosity: emission.to_vec(), iterations: 0, residual: f64::INFINITY };
    while solution.iterations < MAX_ITERATIONS && !factors.stop.is_cancelled() {
        let before = solution.radiosity.clone();
        sweep(&mut solution.radiosity);
        solution.iterations += 1;
        // What Jacobi changes is the residual of what was before; Gauss-Seidel's change is a bound of its kind.
        let change: Vec<f64> = solution.radiosity.iter().zip(&before).map(|(new, old)| new - old).collect();
        solution.residual = norm(factors, &change) / size;
        if solution.residual <= tolerance {
            break;
        }
    }
    solution
}
