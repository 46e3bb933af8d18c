//! Preconditioned conjugate gradients (Hestenes and Stiefel, 1952; Shewchuk, "An Introduction to the Conjugate Gradient Method Without the Agonizing
//! Pain", 1994, B3): the patches' radiosity and closed seams are solved by it. Not their systems, nor when they are solved well enough.

/// A symmetric positive definite system.
pub(crate) trait System {
    /// Its product with a vector.
    fn multiply(&self, x: &[f64]) -> Vec<f64>;

    /// A residual by the inverse of something like the system: its diagonal.
    fn precondition(&self, residual: &[f64]) -> Vec<f64>;

    /// Whether one step more is wanted after so many, by the preconditioned residual and its product with the residual.
    fn goes_on(&self, steps: usize, preconditioned: &[f64], energy: f64) -> bool;
}

/// Improves `x`, whose residual that is, as long as the system goes on; the steps that were taken, and the preconditioned residual that is left.
pub(crate) fn solve(system: &impl System, x: &mut [f64], mut residual: Vec<f64>) -> (usize, Vec<f64>) {
    let mut preconditioned = system.precondition(&residual);
    let mut direction = preconditioned.clone();
    let mut energy = dot(&residual, &preconditioned);
    let mut steps = 0;
    while system.goes_on(steps, &preconditioned, energy) {
        let product = system.multiply(&direction);
        let curvature = dot(&direction, &product);
        // Not so for any system as it should be; rounding alone gets here.
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
        for (direction, own) in direction.iter_mut().zip(&preconditioned) {
            *direction = own + ratio * *direction;
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

    /// The second difference with 2 + shift on its diagonal, solved for a number of steps.
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

        fn goes_on(&self, steps: usize, _: &[f64], energy: f64) -> bool {
            steps < self.steps && energy > 0.0
        }
    }

    #[test]
    fn as_many_steps_as_unknowns_are_exact() {
        let expected: Vec<f64> = (0..12).map(|i| f64::from(i * i) - 7.0).collect();
        let right = Chain { shift: 0.0, steps: 0 }.multiply(&expected);
        let mut x = vec![0.0; 12];
        let (steps, left) = solve(&Chain { shift: 0.0, steps: 12 }, &mut x, right);
        assert_eq!(steps, 12);
        assert!(x.iter().zip(&expected).all(|(x, e)| (x - e).abs() < 1e-9), "{x:?}");
        assert!(left.iter().all(|left| left.abs() < 1e-9));
    }

    #[test]
    fn what_is_not_positive_definite_ends_without_nonsense() {
        let mut x = vec![0.0; 4];
        let (steps, _) = solve(&Chain { shift: -9.0, steps: 100 }, &mut x, vec![1.0, -2.0, 0.5, 3.0]);
        assert!(steps < 100 && x.iter().all(|x| x.is_finite()), "{steps} {x:?}");
        let (steps, _) = solve(&Chain { shift: 0.0, steps: 100 }, &mut x, vec![f64::NAN; 4]);
        assert_eq!(steps, 0);
    }
}
