//! The least-squares problem behind closed seams, solved channel by channel with preconditioned conjugate gradients:
//!
//! ```text
//!   minimise  Σ over samples (A - B)² / (λ (variance of A + variance of B))  +  Σ over texels change² / variance
//!   with      |change| <= 2 √variance,  value >= 0
//! ```
//!
//! A and B are the values that filtering reads on both sides. A texel's variance is that of its stated error plus the
//! uncertainty of its position: half a texel of the light's slope around it. So texels that are well known, in even
//! light, stay as they are. Not the choice of the samples: that is `samples`.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::MapValues;
use super::samples::{Reading, Sample};
use crate::bounds::Bounds;
use crate::cancel_token::CancelToken;
use crate::conjugate_gradients::{self, System};
use crate::coverage::CoveredTexels;
use crate::report::SeamReport;
use crate::texel_index::MapTexel;

/// λ: a jump between two equally uncertain texels shrinks to a fiftieth or less.
const STIFFNESS: f64 = 0.02;
/// An error added to that of every texel, relative to the mean: keeps the sums finite where a texel states none. It
/// moves nothing, as the limit of the change does not contain it.
const ERROR_FLOOR: f64 = 1e-4;
/// Half a texel of the light's slope, as a share of the range over the 3 x 3 texels around, which is two texels wide.
const HALF_A_TEXEL: f64 = 0.25;
/// How many standard errors a texel may be moved by.
const MAX_CHANGE: f64 = 2.0;
/// Variance of a texel beside a chart, which shows no surface of its own, relative to that of its neighbours.
const BESIDE_CHART: f64 = 4.0;
/// Residual at which conjugate gradients stop, and the most steps they take. It is relative to that before any change,
/// so that those that follow, without the texels that have reached their limit, do not polish what is solved already.
const RESIDUAL: f64 = 1e-4;
const MAX_STEPS: usize = 400;
/// How many times the system is solved, each time without the texels that have reached their limit.
const ACTIVE_SETS: u32 = 6;

/// How much work the solution may take.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patience {
    steps: usize,
    active_sets: u32,
}

impl Patience {
    pub const WHOLE: Self = Self { steps: MAX_STEPS, active_sets: ACTIVE_SETS };
    /// For when the time is up: a few steps close most of a jump, as it is only between neighbouring texels.
    pub const LATE: Self = Self { steps: 12, active_sets: 2 };
}

/// The texels that may move.
pub(crate) struct Unknowns {
    /// Ascending.
    texels: Vec<MapTexel>,
    /// Per texel and channel, the variance of the stated error and of the texel's position together.
    variances: Vec<DVec3>,
}

/// A sample as a linear equation: A - B as a combination of unknowns.
struct Equation {
    unknowns: [u32; 8],
    coefficients: [f64; 8],
    length: f64,
}

impl Unknowns {
    pub fn new(covered: &CoveredTexels<'_>, shown: &MapValues<'_>, samples: &[Sample]) -> Self {
        let read = |side: &Reading| {
            let texels = side.texels.into_iter().zip(side.weights);
            texels.filter(|(_, weight)| *weight > 0.0).map(|(texel, _)| texel)
        };
        let mut texels: Vec<MapTexel> =
            samples.iter().flat_map(|sample| sample.sides.iter().flat_map(read)).collect();
        texels.sort_unstable();
        texels.dedup();
        let variances = texels.iter().map(|&texel| variance(covered, shown, texel)).collect();
        Self { texels, variances }
    }

    /// Moves the texels, and adds the squares of their changes to their errors: on average that is the most by which
    /// they can become worse, as what moves them is the light on the other side and not their own error. The number of
    /// edges in the report is left to the caller.
    pub fn solve(
        &self,
        samples: &[Sample],
        shown: MapValues<'_>,
        mean: f64,
        patience: Patience,
        stop: &CancelToken,
    ) -> SeamReport {
        let MapValues { light: filled, variances } = shown;
        let equations: Vec<Equation> = samples.iter().map(|sample| self.equation(sample)).collect();
        let channels: Vec<(Vec<f64>, [f64; 2])> = (0..3usize)
            .into_par_iter()
            .map(|channel| {
                let values: Vec<f64> =
                    self.texels.iter().map(|&texel| f64::from(filled[texel.place()][channel])).collect();
                let variances: Vec<f64> = self.variances.iter().map(|variance| variance[channel]).collect();
                let changes = Channel::new(&equations, &values, &variances, mean, stop).solve(patience);
                let moved: Vec<f64> = values
                    .iter()
                    .zip(&changes)
                    .map(|(value, change)| f64::from((value + change).max(0.0) as f32))
                    .collect();
                let jumps = [&values, &moved].map(|values| squared_jump(&equations, values));
                // Clamping the changes might leave a larger jump than before; then nothing is moved.
                let is_better = jumps[1] <= jumps[0] && moved.iter().all(|value| value.is_finite());
                if is_better { (moved, jumps) } else { (values, [jumps[0]; 2]) }
            })
            .collect();
        let mut report = SeamReport::default();
        let mut sum = 0.0;
        for (place, &texel) in self.texels.iter().enumerate() {
            let before = filled[texel.place()];
            let after =
                DVec3::from_array(std::array::from_fn(|channel| channels[channel].0[place])).as_vec3();
            let change = (after - before).abs().as_dvec3();
            sum += change.element_sum() / 3.0;
            report.largest_change = report.largest_change.max(change.max_element() / mean);
            filled[texel.place()] = after;
            variances[texel.place()] += (change.length_squared() / 3.0) as f32;
        }
        report.mean_change = sum / self.texels.len().max(1) as f64 / mean;
        let jump =
            |which: usize| (channels.iter().map(|(_, jumps)| jumps[which]).sum::<f64>() / 3.0).sqrt() / mean;
        (report.jump_before, report.jump_after) = (jump(0), jump(1));
        report
    }

    /// The equation of a sample.
    fn equation(&self, sample: &Sample) -> Equation {
        let (mut unknowns, mut coefficients) = ([0; 8], [0.0; 8]);
        for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
            for corner in 0..4 {
                let weight = sample.sides[side].weights[corner];
                if weight > 0.0 {
                    let texel = sample.sides[side].texels[corner];
                    let place = self.texels.binary_search(&texel);
                    unknowns[side * 4 + corner] =
                        place.expect("every texel that is read is among the unknowns") as u32;
                    coefficients[side * 4 + corner] = sign * f64::from(weight);
                }
            }
        }
        Equation { unknowns, coefficients, length: sample.length }
    }
}

impl Equation {
    /// A - B for given values of the unknowns.
    fn apply(&self, values: &[f64]) -> f64 {
        self.unknowns.iter().zip(self.coefficients).map(|(&i, c)| c * values[i as usize]).sum()
    }

    /// Adds `factor` times the coefficients to the entries of the unknowns.
    fn add_transposed(&self, factor: f64, sums: &mut [f64]) {
        for (&unknown, coefficient) in self.unknowns.iter().zip(self.coefficients) {
            sums[unknown as usize] += factor * coefficient;
        }
    }
}

/// The mean squared jump over the length of the seams.
fn squared_jump(equations: &[Equation], values: &[f64]) -> f64 {
    let (mut sum, mut length) = (0.0, 0.0);
    for equation in equations {
        sum += equation.length * equation.apply(values).powi(2);
        length += equation.length;
    }
    if length > 0.0 { sum / length } else { 0.0 }
}

/// The variance of each channel of a texel: how far it may be off, squared.
fn variance(texels: &CoveredTexels<'_>, shown: &MapValues<'_>, texel: MapTexel) -> DVec3 {
    let MapValues { light: filled, variances } = shown;
    let Some(map) = texels.layout.maps.iter().rev().find(|map| map.first <= texel.place()) else {
        return DVec3::ZERO;
    };
    let local = texel.0 - map.first as u32;
    let (x, y) = (local % map.width, local / map.width);
    let chart = texels.chart_at(texel);
    let (mut values, mut stated) = (Bounds::<Vec3>::default(), 0.0f32);
    for other in map.neighbourhood(x, y, 1) {
        // A texel beside a chart has the range and the error of whatever charts lie around it.
        let other_chart = texels.chart_at(other);
        let is_same_chart = other_chart.is_some() && (chart.is_none() || other_chart == chart);
        let other = other.place();
        if is_same_chart && filled[other].is_finite() {
            values.extend([filled[other]]);
            // The error of a texel that shows no surface is NaN, which `max` ignores.
            stated = stated.max(variances[other]);
        }
    }
    if chart.is_some() {
        stated = variances[texel.place()].max(0.0);
    }
    let Bounds { low, high } = values;
    let range = if low.x <= high.x { (high - low).as_dvec3() } else { DVec3::ZERO };
    let slope = range * HALF_A_TEXEL;
    let variance = slope * slope + f64::from(stated);
    let variance = if variance.is_finite() { variance } else { DVec3::ZERO };
    if chart.is_none() { variance * BESIDE_CHART } else { variance }
}

/// The linear system for the changes of one channel.
struct Channel<'a> {
    equations: &'a [Equation],
    /// Weight of each equation, and its jump before any change.
    weights: Vec<f64>,
    jumps: Vec<f64>,
    /// Smallest and largest change of each texel.
    bounds: Vec<[f64; 2]>,
    /// Per texel, 1 / variance.
    stiffness: Vec<f64>,
    /// Per texel, the reciprocal of the system's diagonal.
    preconditioner: Vec<f64>,
    stop: &'a CancelToken,
}

impl<'a> Channel<'a> {
    fn new(
        equations: &'a [Equation],
        values: &[f64],
        variances: &[f64],
        mean: f64,
        stop: &'a CancelToken,
    ) -> Self {
        let floor = (ERROR_FLOOR * mean).powi(2);
        let stiffness: Vec<f64> = variances.iter().map(|variance| 1.0 / (variance + floor)).collect();
        let mut diagonal = stiffness.clone();
        let (mut weights, mut jumps) = (Vec::new(), Vec::new());
        for equation in equations {
            let variance_of_both: f64 = equation
                .unknowns
                .iter()
                .zip(equation.coefficients)
                .map(|(&unknown, c)| c.abs() / stiffness[unknown as usize])
                .sum();
            let weight = 1.0 / (STIFFNESS * variance_of_both);
            for (&unknown, coefficient) in equation.unknowns.iter().zip(equation.coefficients) {
                diagonal[unknown as usize] += weight * coefficient * coefficient;
            }
            weights.push(weight);
            jumps.push(equation.apply(values));
        }
        let bound = |(value, variance): (&f64, &f64)| {
            let limit = MAX_CHANGE * variance.sqrt();
            [-limit.min(*value), limit]
        };
        Self {
            equations,
            weights,
            jumps,
            bounds: values.iter().zip(variances).map(bound).collect(),
            stiffness,
            preconditioner: diagonal.into_iter().map(|d| 1.0 / d).collect(),
            stop,
        }
    }

    /// The changes within their bounds. Changes that exceed a bound are held at it, and the others are solved for
    /// again.
    fn solve(&self, patience: Patience) -> Vec<f64> {
        let count = self.stiffness.len();
        // Texels without any error may not move, and would only add to the residual.
        let mut held: Vec<bool> = self.bounds.iter().map(|[low, high]| low == high).collect();
        let mut changes = vec![0.0; count];
        let mut small_energy = None;
        for _ in 0..patience.active_sets {
            let residual = self.residual(&held, &changes);
            let small_energy =
                *small_energy.get_or_insert_with(|| RESIDUAL * RESIDUAL * self.energy(&residual));
            let free = Free { channel: self, held: &held, most_steps: patience.steps, small_energy };
            conjugate_gradients::solve(&free, &mut changes, residual);
            let mut any_clamped = false;
            for ((change, [low, high]), held) in changes.iter_mut().zip(&self.bounds).zip(&mut held) {
                let within = change.clamp(*low, *high);
                if within != *change {
                    (*change, *held, any_clamped) = (within, true, true);
                }
            }
            if !any_clamped {
                break;
            }
        }
        changes
    }

    /// What the changes that are not held leave of the system.
    fn residual(&self, held: &[bool], changes: &[f64]) -> Vec<f64> {
        let gradient = self.gradient(changes, Some(&self.jumps));
        let mut residual: Vec<f64> = gradient.into_iter().map(|value| -value).collect();
        zero_held(held, &mut residual);
        residual
    }

    /// The dot product of a residual and the preconditioned residual.
    fn energy(&self, residual: &[f64]) -> f64 {
        residual.iter().zip(&self.preconditioner).map(|(r, p)| r * (r * p)).sum()
    }

    /// The system's matrix times the changes `x`; with the jumps before any change, half the gradient of what is
    /// minimised.
    fn gradient(&self, x: &[f64], jumps: Option<&[f64]>) -> Vec<f64> {
        let mut product: Vec<f64> = x.iter().zip(&self.stiffness).map(|(x, s)| x * s).collect();
        for (index, equation) in self.equations.iter().enumerate() {
            let jump = jumps.map_or(0.0, |jumps| jumps[index]);
            equation.add_transposed(self.weights[index] * (equation.apply(x) + jump), &mut product);
        }
        product
    }
}

/// The system restricted to the changes that are not held.
struct Free<'a> {
    channel: &'a Channel<'a>,
    held: &'a [bool],
    most_steps: usize,
    /// Energy of the residual at which the solution is good enough.
    small_energy: f64,
}

impl System for Free<'_> {
    fn multiply(&self, x: &[f64]) -> Vec<f64> {
        let mut product = self.channel.gradient(x, None);
        zero_held(self.held, &mut product);
        product
    }

    fn precondition(&self, residual: &[f64]) -> Vec<f64> {
        residual.iter().zip(&self.channel.preconditioner).map(|(r, p)| r * p).collect()
    }

    fn should_continue(&self, steps: usize, _: &[f64], energy: f64) -> bool {
        let is_enough = energy <= self.small_energy || !energy.is_finite();
        steps < self.most_steps && !is_enough && !self.channel.stop.is_cancelled()
    }
}

/// Sets the entries of a vector that are held to zero.
fn zero_held(held: &[bool], vector: &mut [f64]) {
    for (value, _) in vector.iter_mut().zip(held).filter(|(_, held)| **held) {
        *value = 0.0;
    }
}
