//! Stationary iterative solvers of the radiosity system, by sweeps over all patches: Jacobi's method, in which each
//! sweep adds one bounce, and Gauss and Seidel's (Cohen and Wallace, "Radiosity and Realistic Image Synthesis", 1993,
//! chapter 5). They serve to check the default solver, conjugate gradients in `solver`, which takes fewer steps.

use super::solution::{MAX_ITERATIONS, RadiosityEquation, Solution, exchanged, gather, norm};

/// B ← E + ρ F B for all patches at once.
pub(crate) fn jacobi(equation: &RadiosityEquation<'_>) -> Solution {
    let RadiosityEquation { factors, reflectance, emission, .. } = *equation;
    iterate(equation, |x| {
        let gathered = gather(factors, x);
        for (i, value) in x.iter_mut().enumerate() {
            *value = emission[i] + reflectance[i] * gathered[i];
        }
    })
}

/// As [`jacobi`], but each patch reads the values that the same sweep has already updated.
pub(crate) fn gauss_seidel(equation: &RadiosityEquation<'_>) -> Solution {
    let RadiosityEquation { factors, reflectance, emission, .. } = *equation;
    iterate(equation, |x| {
        for i in 0..x.len() {
            let gathered = exchanged(factors, i, x) / f64::from(factors.areas[i]);
            x[i] = emission[i] + reflectance[i] * gathered;
        }
    })
}

/// Repeats a sweep until the residual is small enough.
fn iterate(equation: &RadiosityEquation<'_>, sweep: impl Fn(&mut [f64])) -> Solution {
    let RadiosityEquation { factors, emission, size, tolerance, .. } = *equation;
    let mut solution = Solution { radiosity: emission.to_vec(), iterations: 0, residual: f64::INFINITY };
    while solution.iterations < MAX_ITERATIONS && !factors.stop.is_cancelled() {
        let before = solution.radiosity.clone();
        sweep(&mut solution.radiosity);
        solution.iterations += 1;
        // The change by a Jacobi sweep is the residual before the sweep; the change by Gauss-Seidel serves as a similar
        // measure.
        let change: Vec<f64> = solution.radiosity.iter().zip(&before).map(|(new, old)| new - old).collect();
        solution.residual = norm(factors, &change) / size;
        if solution.residual <= tolerance {
            break;
        }
    }
    solution
}
