//! Preconditioned conjugate gradients (Hestenes and Stiefel, 1952; Shewchuk, "An Introduction to the Conjugate Gradient
//! Method Without the Agonizing Pain", 1994, B3), for the radiosity of patches and for seams. Their systems, and when
//! these are solved well enough, are defined by the callers.

/// A symmetric positive definite system of equations.
pub(crate) trait System {
    /// The product of its matrix with a vector.
    fn multiply(&self, x: &[f64]) -> Vec<f64>;

    /// The product of the preconditioner, such as the inverse of the matrix's diagonal, with a residual.
    fn precondition(&self, residual: &[f64]) -> Vec<f64>;

    /// Whether to take another step after `steps`; `energy` is the dot product of the residual and the preconditioned
    /// residual.
    fn should_continue(&self, steps: usize, preconditioned: &[f64], energy: f64) -> bool;
}

/// Improves the solution `x`, whose residual is given, as long as [`System::should_continue`]. Returns the number of
/// steps and the remaining preconditioned residual.
pub(crate) fn solve(system: &impl System, x: &mut [f64], mut residual: Vec<f64>) -> (usize, Vec<f64>) {
    let mut preconditioned = system.precondition(&residual);
    let mut direction = preconditioned.clone();
    let mut energy = dot(&residual, &preconditioned);
    let mut steps = 0;
    while system.should_continue(steps, &preconditioned, energy) {
        let product = system.multiply(&direction);
        let curvature = dot(&direction, &product);
        // A positive definite system gets here by rounding only.
        if curvature.is_nan() || curvature <= 0.0 {
            break;
        }
        let step = energy / curvature;
        for place in 0..x.len() {
            x[place] += step * direction[place];
            residual[place] -= step * product[place];
        }
        preconditioned = system.precondition(&residual);
        let next = dot(&residual, &preconditioned);
        let ratio = next / energy;
        energy = next;
        for (direction, gradient) in direction.iter_mut().zip(&preconditioned) {
            *direction = gradient + ratio * *direction;
        }
        steps += 1;
    }
    (steps, preconditioned)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The second-difference matrix with 2 + shift on its diagonal, solved for a number of steps.
    struct Chain {
        shift: f64,
        steps: usize,
    }

    impl System for Chain {
        fn multiply(&self, x: &[f64]) -> Vec<f64> {
            let at = |i: usize| x.get(i).copied().unwrap_or(0.0);
            (0..x.len()).map(|i| (2.0 + self.shift) * x[i] - at(i + 1) - at(i.wrapping_sub(1))).collect()
        }

        fn precondition(&self, residual: &[f64]) -> Vec<f64> {
            residual.iter().map(|r| r / (2.0 + self.shift)).collect()
        }

        fn should_continue(&self, steps: usize, _: &[f64], energy: f64) -> bool {
            steps < self.steps && energy > 0.0
        }
    }

    #[test]
    fn as_many_steps_as_unknowns_give_the_exact_solution() {
        let expected: Vec<f64> = (0..12).map(|i| f64::from(i * i) - 7.0).collect();
        let right = Chain { shift: 0.0, steps: 0 }.multiply(&expected);
        let mut x = vec![0.0; 12];
        let (steps, left) = solve(&Chain { shift: 0.0, steps: 12 }, &mut x, right);
        assert_eq!(steps, 12);
        assert!(x.iter().zip(&expected).all(|(x, e)| (x - e).abs() < 1e-9), "{x:?}");
        assert!(left.iter().all(|left| left.abs() < 1e-9));
    }

    #[test]
    fn systems_that_are_not_positive_definite_end_with_finite_values() {
        let mut x = vec![0.0; 4];
        let (steps, _) = solve(&Chain { shift: -9.0, steps: 100 }, &mut x, vec![1.0, -2.0, 0.5, 3.0]);
        assert!(steps < 100 && x.iter().all(|x| x.is_finite()), "{steps} {x:?}");
        let (steps, _) = solve(&Chain { shift: 0.0, steps: 100 }, &mut x, vec![f64::NAN; 4]);
        assert_eq!(steps, 0);
    }
}
