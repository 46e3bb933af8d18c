//! Solves the radiosity system B_i = E_i + ρ_i Σ_j F_ij B_j of one colour channel, by conjugate gradients. Not the form factors, not the
//! colours (channels do not mix), and not the two iterative methods that check it: those are `stationary`.

use rayon::prelude::*;

use super::components::levels;
use super::form_factors::FormFactors;
use super::solution::{MAX_ITERATIONS, Solution, exchanged, gather, norm};
use super::stationary;
use crate::conjugate_gradients::{self, System};
use crate::options::Solver;

impl Solver {
    /// Iterates until the relative residual is at most `tolerance`.
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
        // Parts that exchange nothing are solved as if equally bright.
        let (levels, parts) = levels(factors, emission);
        let leveled: Vec<f64> = emission.iter().zip(&levels).map(|(e, level)| e * level).collect();
        let (emission, parts) = (&leveled, (parts as f64).sqrt());
        let size = norm(factors, emission);
        let tolerance = tolerance / parts;
        let mut solution = match self {
            Self::Jacobi => stationary::jacobi(factors, reflectance, emission, tolerance, size),
            Self::GaussSeidel => stationary::gauss_seidel(factors, reflectance, emission, tolerance, size),
            Self::ConjugateGradients => {
                by_conjugate_gradients(factors, reflectance, emission, tolerance, size)
            }
        };
        // Of the part that is solved worst, at most.
        solution.residual *= parts;
        // Conjugate gradients may dip below zero by the residual.
        for (value, level) in solution.radiosity.iter_mut().zip(&levels) {
            *value = value.max(0.0) / level;
        }
        solution
    }
}

fn by_conjugate_gradients(
    factors: &FormFactors,
    reflectance: &[f64],
    emission: &[f64],
    tolerance: f64,
    size: f64,
) -> Solution {
    // Patches that reflect nothing are known: B = E. They move to the right-hand side.
    let known: Vec<f64> =
        emission.iter().zip(reflectance).map(|(&e, &r)| if r > 0.0 { 0.0 } else { e }).collect();
    let from_known = gather(factors, &known);
    let diagonal: Vec<f64> = factors
        .areas
        .iter()
        .zip(reflectance)
        .map(|(&a, &r)| if r > 0.0 { f64::from(a) / r } else { 1.0 })
        .collect();
    let system = Radiosity { factors, reflectance, diagonal: &diagonal, enough: tolerance * size };
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

/// The system [diag(A/ρ) - G] B = A E/ρ of patches that reflect.
struct Radiosity<'a> {
    factors: &'a FormFactors,
    reflectance: &'a [f64],
    /// A/ρ; 1 where nothing is reflected.
    diagonal: &'a [f64],
    /// Norm of the residual that is small enough.
    enough: f64,
}

impl System for Radiosity<'_> {
    fn multiply(&self, x: &[f64]) -> Vec<f64> {
        let Self { factors, reflectance, diagonal, .. } = self;
        let row = |i: usize| {
            if reflectance[i] > 0.0 { diagonal[i] * x[i] - exchanged(factors, i, x) } else { 0.0 }
        };
        (0..x.len()).into_par_iter().map(row).collect()
    }

    /// The residual of the equation B = E + ρ F B itself.
    fn precondition(&self, residual: &[f64]) -> Vec<f64> {
        residual.iter().zip(self.diagonal).map(|(r, d)| r / d).collect()
    }

    fn should_continue(&self, steps: usize, left: &[f64], energy: f64) -> bool {
        norm(self.factors, left) > self.enough
            && energy > 0.0
            && steps < MAX_ITERATIONS as usize
            && !self.factors.stop.is_cancelled()
    }
}

#[cfg(test)]
mod tests {
    use super::super::patch_index::PatchIndex;
    use super::*;

    const ALL: [Solver; 3] = [Solver::Jacobi, Solver::GaussSeidel, Solver::ConjugateGradients];

    /// A dense system of equal areas from its form factors.
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

    /// Opposite and adjacent squares of a cube.
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
            for solver in ALL {
                let found = solver.solve(&cube(), &[rho; 6], &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0], 1e-10);
                for (patch, value) in [(0, expected[0]), (1, expected[1]), (2, expected[2]), (5, expected[2])]
                {
                    // f32 form factors: 6e-8 of relative error each, amplified by 1/(1 - ρ).
                    let bound = value * 1.2e-7 / (1.0 - rho);
                    assert!(
                        (found.radiosity[patch] - value).abs() < bound,
                        "{solver:?} {rho} {patch}: {found:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn two_squares_and_infinite_plates() {
        let squares = dense(&[vec![0.0, OPPOSITE], vec![OPPOSITE, 0.0]]);
        let plates = dense(&[vec![0.0, 1.0], vec![1.0, 0.0]]);
        for solver in ALL {
            let found = solver.solve(&squares, &[0.8; 2], &[1.0, 0.0], 1e-12).radiosity;
            assert!(
                (found[0] - 1.02622538776598).abs() < 1e-7 && (found[1] - 0.164052304858699).abs() < 1e-7
            );
            let found = solver.solve(&plates, &[0.5, 0.8], &[1.0, 0.0], 1e-12).radiosity;
            assert!((found[0] - 5.0 / 3.0).abs() < 1e-9 && (found[1] - 4.0 / 3.0).abs() < 1e-9);
        }
    }

    #[test]
    fn furnace() {
        for rho in [0.0, 0.5, 0.9, 0.999] {
            for solver in ALL {
                let found = solver.solve(&cube(), &[rho; 6], &[1.0; 6], 1e-9);
                for b in &found.radiosity {
                    // Residual and f32 factors, amplified by 1/(1 - ρ).
                    assert!((b * (1.0 - rho) - 1.0).abs() < 2e-7 / (1.0 - rho), "{solver:?} {rho}: {b}");
                }
            }
        }
    }

    #[test]
    fn iterations_stay_within_their_bounds() {
        // Closed and uniform: the largest eigenvalue of ρF is ρ. Jacobi to 1e-6 takes ln(1e-6) / ln(ρ) sweeps
        // (less here, since the start is one bounce), conjugate gradients at most their bound for this condition.
        for (rho, jacobi, conjugate) in [(0.5, 20, 12), (0.9, 132, 32), (0.99, 1375, 103)] {
            let emission = [1.0, 0.3, 0.0, 0.0, 2.0, 0.0];
            let slow = Solver::Jacobi.solve(&cube(), &[rho; 6], &emission, 1e-6);
            let seidel = Solver::GaussSeidel.solve(&cube(), &[rho; 6], &emission, 1e-6);
            let fast = Solver::ConjugateGradients.solve(&cube(), &[rho; 6], &emission, 1e-6);
            assert!(slow.iterations <= jacobi, "{slow:?}");
            assert!(seidel.iterations <= slow.iterations, "{seidel:?}");
            assert!(fast.iterations <= conjugate, "{fast:?}");
        }
    }

    #[test]
    fn black_patches_keep_their_emission_and_no_light_is_no_work() {
        let rho = [0.0, 0.5, 0.0, 0.7, 0.2, 0.9];
        let emission = [3.0, 0.0, 1.0, 0.0, 0.0, 0.5];
        let reference = Solver::Jacobi.solve(&cube(), &rho, &emission, 1e-13).radiosity;
        assert_eq!((reference[0], reference[2]), (3.0, 1.0));
        for solver in ALL {
            let found = solver.solve(&cube(), &rho, &emission, 1e-12).radiosity;
            for (a, b) in found.iter().zip(&reference) {
                assert!((a - b).abs() < 1e-10, "{solver:?}");
            }
            assert_eq!(solver.solve(&cube(), &rho, &[0.0; 6], 1e-6).iterations, 0);
        }
    }

    #[test]
    fn a_part_that_is_a_hundred_million_times_dimmer_is_solved_as_well() {
        // Two cubes that do not see each other: what each has is what it has alone.
        let cube = cube();
        let mut two = cube.clone();
        two.columns.extend(cube.columns.iter().map(|column| PatchIndex(column.0 + 6)));
        two.exchange.extend_from_slice(&cube.exchange);
        two.areas.extend_from_slice(&cube.areas);
        two.starts.extend(cube.starts[1..].iter().map(|start| start + cube.columns.len()));
        let alone = [1.0, 0.0, 0.5, 0.0, 0.0, 0.0];
        let both: Vec<f64> = alone.iter().map(|e| e * 1e8).chain(alone).collect();
        for solver in ALL {
            let expected = solver.solve(&cube, &[0.8; 6], &alone, 1e-12).radiosity;
            let found = solver.solve(&two, &[0.8; 12], &both, 1e-6).radiosity;
            for (found, expected) in found[6..].iter().zip(&expected) {
                // The residual, amplified by 1/(1 - ρ).
                assert!((found / expected - 1.0).abs() < 2e-5, "{solver:?}: {found} {expected}");
            }
        }
    }
}
