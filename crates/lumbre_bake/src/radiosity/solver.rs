//! Solves the radiosity system B_i = E_i + ρ_i Σ_j F_ij B_j of one colour channel, by default with conjugate gradients.
//! The two stationary methods that check these are in `stationary`; the form factors are in `form_factors`.

use rayon::prelude::*;

use super::components::levels;
use super::form_factors::FormFactors;
use super::solution::{MAX_ITERATIONS, RadiosityEquation, Solution, exchanged, gather, norm};
use super::stationary;
use crate::conjugate_gradients::{self, System};
use crate::options::Solver;

impl Solver {
    /// Iterates until the residual is at most `tolerance`, relative to the emission as [`Solution::residual`] is.
    pub(crate) fn solve(
        self,
        factors: &FormFactors,
        reflectance: &[f64],
        emission: &[f64],
        tolerance: f64,
    ) -> Solution {
        let size = norm(factors, emission);
        if size == 0.0 || !size.is_finite() {
            return Solution { radiosity: vec![0.0; emission.len()], ..Solution::default() };
        }
        // Components that exchange no light are scaled to be equally bright, so that dim ones are solved as accurately.
        // The residual of any one, relative to its own emission, is then at most √components times that of the whole.
        let (levels, components) = levels(factors, emission);
        let leveled: Vec<f64> = emission.iter().zip(&levels).map(|(e, level)| e * level).collect();
        let (emission, residual_factor) = (&leveled, (components as f64).sqrt());
        let size = norm(factors, emission);
        let tolerance = tolerance / residual_factor;
        let equation = RadiosityEquation { factors, reflectance, emission, size, tolerance };
        let mut solution = match self {
            Self::Jacobi => stationary::jacobi(&equation),
            Self::GaussSeidel => stationary::gauss_seidel(&equation),
            Self::ConjugateGradients => by_conjugate_gradients(&equation),
        };
        // A bound for the component with the largest residual.
        solution.residual *= residual_factor;
        // Values by conjugate gradients may be negative within the residual.
        for (value, level) in solution.radiosity.iter_mut().zip(&levels) {
            *value = value.max(0.0) / level;
        }
        solution
    }
}

fn by_conjugate_gradients(equation: &RadiosityEquation<'_>) -> Solution {
    let RadiosityEquation { factors, reflectance, emission, size, tolerance } = *equation;
    // Patches that reflect nothing have B = E: as known values they move to the right-hand side.
    let known: Vec<f64> =
        emission.iter().zip(reflectance).map(|(&e, &r)| if r > 0.0 { 0.0 } else { e }).collect();
    let from_known = gather(factors, &known);
    let diagonal: Vec<f64> = factors
        .areas
        .iter()
        .zip(reflectance)
        .map(|(&a, &r)| if r > 0.0 { f64::from(a) / r } else { 1.0 })
        .collect();
    let system =
        RadiositySystem { factors, reflectance, diagonal: &diagonal, max_residual: tolerance * size };
    let mut x: Vec<f64> =
        emission.iter().zip(reflectance).map(|(&e, &r)| if r > 0.0 { e } else { 0.0 }).collect();
    let applied = system.multiply(&x);
    // The right-hand side is A (E/ρ + F known).
    let residual: Vec<f64> = (0..x.len())
        .map(|i| {
            if reflectance[i] > 0.0 {
                diagonal[i] * (emission[i] + reflectance[i] * from_known[i]) - applied[i]
            } else {
                0.0
            }
        })
        .collect();
    let (iterations, left) = conjugate_gradients::solve(&system, &mut x, residual);
    let (iterations, residual) = (iterations as u32, norm(factors, &left) / size);
    for (x, known) in x.iter_mut().zip(&known) {
        *x += known;
    }
    Solution { radiosity: x, iterations, residual }
}

/// The symmetric system [diag(A/ρ) - G] B = A E/ρ of the patches that reflect.
struct RadiositySystem<'a> {
    factors: &'a FormFactors,
    reflectance: &'a [f64],
    /// A/ρ; 1 for patches that reflect nothing.
    diagonal: &'a [f64],
    /// Norm of the residual at which to stop.
    max_residual: f64,
}

impl System for RadiositySystem<'_> {
    fn multiply(&self, x: &[f64]) -> Vec<f64> {
        let Self { factors, reflectance, diagonal, .. } = self;
        let row = |i: usize| {
            if reflectance[i] > 0.0 { diagonal[i] * x[i] - exchanged(factors, i, x) } else { 0.0 }
        };
        (0..x.len()).into_par_iter().map(row).collect()
    }

    /// Dividing by the diagonal gives the residual of the equation B = E + ρ F B itself.
    fn precondition(&self, residual: &[f64]) -> Vec<f64> {
        residual.iter().zip(self.diagonal).map(|(r, d)| r / d).collect()
    }

    fn should_continue(&self, steps: usize, left: &[f64], energy: f64) -> bool {
        norm(self.factors, left) > self.max_residual
            && energy > 0.0
            && steps < MAX_ITERATIONS as usize
            && !self.factors.stop.is_cancelled()
    }
}

#[cfg(test)]
mod tests {
    use super::super::patch_index::PatchIndex;
    use super::*;

    const SOLVERS: [Solver; 3] = [Solver::Jacobi, Solver::GaussSeidel, Solver::ConjugateGradients];

    /// The matrix of patches of equal areas with the given form factors.
    fn dense(f: &[Vec<f64>]) -> FormFactors {
        let mut factors =
            FormFactors { starts: vec![0], areas: vec![1.0; f.len()], ..FormFactors::default() };
        for row in f {
            for (j, &f) in row.iter().enumerate().filter(|(_, f)| **f > 0.0) {
                factors.columns.push(PatchIndex::new(j));
                factors.exchange.push(f as f32);
            }
            factors.starts.push(factors.columns.len());
        }
        factors
    }

    /// Form factors between opposite and between adjacent squares of a cube.
    const OPPOSITE: f64 = 0.199824895698387;
    const ADJACENT: f64 = 0.200043776075403;

    fn cube() -> FormFactors {
        let row = |i: usize| {
            (0..6)
                .map(|j| {
                    if i == j {
                        0.0
                    } else if i / 2 == j / 2 {
                        OPPOSITE
                    } else {
                        ADJACENT
                    }
                })
                .collect()
        };
        dense(&(0..6).map(row).collect::<Vec<_>>())
    }

    #[test]
    fn cube_of_six_patches_one_of_which_emits() {
        for (rho, expected) in [
            (0.5, [1.0909090981077, 0.181745826107788, 0.181836268946129]),
            (0.99, [17.3622704725973, 16.5274251277217, 16.5275760999203]),
        ] {
            for solver in SOLVERS {
                let solution = solver.solve(&cube(), &[rho; 6], &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0], 1e-10);
                for (patch, value) in [(0, expected[0]), (1, expected[1]), (2, expected[2]), (5, expected[2])]
                {
                    // f32 form factors: 6e-8 of relative error each, amplified by 1/(1 - ρ).
                    let bound = value * 1.2e-7 / (1.0 - rho);
                    assert!(
                        (solution.radiosity[patch] - value).abs() < bound,
                        "{solver:?} {rho} {patch}: {solution:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn two_squares_and_infinite_plates() {
        let squares = dense(&[vec![0.0, OPPOSITE], vec![OPPOSITE, 0.0]]);
        let plates = dense(&[vec![0.0, 1.0], vec![1.0, 0.0]]);
        for solver in SOLVERS {
            let b = solver.solve(&squares, &[0.8; 2], &[1.0, 0.0], 1e-12).radiosity;
            assert!((b[0] - 1.02622538776598).abs() < 1e-7 && (b[1] - 0.164052304858699).abs() < 1e-7);
            let b = solver.solve(&plates, &[0.5, 0.8], &[1.0, 0.0], 1e-12).radiosity;
            assert!((b[0] - 5.0 / 3.0).abs() < 1e-9 && (b[1] - 4.0 / 3.0).abs() < 1e-9);
        }
    }

    #[test]
    fn in_a_furnace_every_patch_has_the_same_radiosity() {
        for rho in [0.0, 0.5, 0.9, 0.999] {
            for solver in SOLVERS {
                let solution = solver.solve(&cube(), &[rho; 6], &[1.0; 6], 1e-9);
                for b in &solution.radiosity {
                    // The errors by the residual and by f32 factors, amplified by 1/(1 - ρ).
                    assert!((b * (1.0 - rho) - 1.0).abs() < 2e-7 / (1.0 - rho), "{solver:?} {rho}: {b}");
                }
            }
        }
    }

    #[test]
    fn iterations_stay_within_their_bounds() {
        // In a closed scene of one reflectance the largest eigenvalue of ρF is ρ. Jacobi's method takes ln(1e-6) /
        // ln(ρ) sweeps to 1e-6 (less here, since the start already is one bounce), conjugate gradients at most their
        // bound for this condition number.
        for (rho, jacobi, conjugate) in [(0.5, 20, 12), (0.9, 132, 32), (0.99, 1375, 103)] {
            let emission = [1.0, 0.3, 0.0, 0.0, 2.0, 0.0];
            let by_jacobi = Solver::Jacobi.solve(&cube(), &[rho; 6], &emission, 1e-6);
            let by_gauss_seidel = Solver::GaussSeidel.solve(&cube(), &[rho; 6], &emission, 1e-6);
            let by_conjugate_gradients =
                Solver::ConjugateGradients.solve(&cube(), &[rho; 6], &emission, 1e-6);
            assert!(by_jacobi.iterations <= jacobi, "{by_jacobi:?}");
            assert!(by_gauss_seidel.iterations <= by_jacobi.iterations, "{by_gauss_seidel:?}");
            assert!(by_conjugate_gradients.iterations <= conjugate, "{by_conjugate_gradients:?}");
        }
    }

    #[test]
    fn black_patches_keep_their_emission_and_no_light_takes_no_iterations() {
        let rho = [0.0, 0.5, 0.0, 0.7, 0.2, 0.9];
        let emission = [3.0, 0.0, 1.0, 0.0, 0.0, 0.5];
        let reference = Solver::Jacobi.solve(&cube(), &rho, &emission, 1e-13).radiosity;
        assert_eq!((reference[0], reference[2]), (3.0, 1.0));
        for solver in SOLVERS {
            let radiosity = solver.solve(&cube(), &rho, &emission, 1e-12).radiosity;
            for (a, b) in radiosity.iter().zip(&reference) {
                assert!((a - b).abs() < 1e-10, "{solver:?}");
            }
            assert_eq!(solver.solve(&cube(), &rho, &[0.0; 6], 1e-6).iterations, 0);
        }
    }

    #[test]
    fn a_component_that_is_a_hundred_million_times_dimmer_is_solved_as_accurately() {
        // Two cubes that do not see each other: each must have the light that it has alone.
        let cube = cube();
        let mut two = cube.clone();
        two.columns.extend(cube.columns.iter().map(|column| PatchIndex(column.0 + 6)));
        two.exchange.extend_from_slice(&cube.exchange);
        two.areas.extend_from_slice(&cube.areas);
        two.starts.extend(cube.starts[1..].iter().map(|start| start + cube.columns.len()));
        let alone = [1.0, 0.0, 0.5, 0.0, 0.0, 0.0];
        let both: Vec<f64> = alone.iter().map(|e| e * 1e8).chain(alone).collect();
        for solver in SOLVERS {
            let expected = solver.solve(&cube, &[0.8; 6], &alone, 1e-12).radiosity;
            let radiosity = solver.solve(&two, &[0.8; 12], &both, 1e-6).radiosity;
            for (b, expected) in radiosity[6..].iter().zip(&expected) {
                // The residual, amplified by 1/(1 - ρ).
                assert!((b / expected - 1.0).abs() < 2e-5, "{solver:?}: {b} {expected}");
            }
        }
    }
}
