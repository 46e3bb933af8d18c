//! Compares one function on the GPU with its f64 twin: how much they differ, and how much they may.

use std::sync::Arc;

use lumbre_render::Gpu;
use lumbre_tests::device::gpu;
use lumbre_tests::kernel::{Kernel, Type};
use lumbre_tests::running_error::Program;
use rayon::prelude::*;

use crate::bounds::{Allowed, Numbers};
use crate::inputs::{RANDOM, Sequence, jittered};
use crate::verdict::{Part, Verdict, unit_in_the_last_place};

/// One of this many inputs is also checked against the running error of the shader, which takes longer.
const MACHINE_CHECKED: usize = 64;
/// Random inputs are made in pieces of this size, each with its own sequence.
const PIECE: usize = 10_000;
/// How many of a million random inputs may be within rounding of a condition.
const MAX_OPEN: usize = 2_000;
/// Number of inputs of any size.
const WILD: usize = 100_000;
/// Numbers at which results overflow, underflow or vanish.
const EXTREMES: [f32; 12] = [
    0.0,
    -0.0,
    f32::MAX,
    -f32::MAX,
    f32::MIN_POSITIVE,
    -f32::MIN_POSITIVE,
    f32::from_bits(1),
    1e-30,
    1e30,
    1.0,
    -1.0,
    0.5,
];

type Function<T> = Arc<dyn Fn(&[f64]) -> T + Send + Sync>;

/// Makes a random input.
type Maker = dyn Fn(&mut Sequence) -> Vec<f32> + Send + Sync;

/// A function and its twin.
#[derive(Clone)]
pub struct Twin {
    pub name: String,
    pub kernel: Kernel,
    expected: Function<Numbers>,
    allowed: Function<Allowed>,
    random: Arc<Maker>,
    corners: Vec<Vec<f32>>,
    /// The range of the results, and the largest component of an input for which it holds.
    range: Option<(f64, f64, f32)>,
    /// Whether results are also checked against the running error of the shader.
    machine_checked: bool,
}

impl Twin {
    /// Creates the twin of a function of `module` with its own name.
    pub fn new(module: &str, function: &str, features: &[&str], arguments: &[Type], result: Type) -> Self {
        Self::around(function, Kernel::of(module, function, features, arguments, result))
    }

    /// Creates the twin of a function that a given kernel calls.
    pub fn around(name: &str, kernel: Kernel) -> Self {
        Self {
            name: name.to_owned(),
            kernel,
            expected: Arc::new(|_| Numbers::new()),
            allowed: Arc::new(|_| Allowed::from(0.0)),
            random: Arc::new(|_| Vec::new()),
            corners: Vec::new(),
            range: None,
            machine_checked: true,
        }
    }

    /// Marks this as one of several cases of a function.
    pub fn named(mut self, suffix: &str) -> Self {
        self.name = format!("{} ({suffix})", self.name);
        self
    }

    /// Sets the f64 twin.
    pub fn expect<T: Results>(mut self, twin: impl Fn(&[f64]) -> T + Send + Sync + 'static) -> Self {
        self.expected = Arc::new(move |x| twin(x).numbers());
        self
    }

    /// Sets the bound that the twin's documentation states.
    pub fn within<T: Into<Allowed>>(mut self, bound: impl Fn(&[f64]) -> T + Send + Sync + 'static) -> Self {
        self.allowed = Arc::new(move |x| bound(x).into());
        self
    }

    /// Sets how a random input is made.
    pub fn random(mut self, input: impl Fn(&mut Sequence) -> Vec<f32> + Send + Sync + 'static) -> Self {
        self.random = Arc::new(input);
        self
    }

    /// Sets the hard inputs.
    pub fn corners(mut self, corners: Vec<Vec<f32>>) -> Self {
        self.corners = corners;
        self
    }

    /// Sets the range of the results for every finite input.
    pub fn range(self, low: f64, high: f64) -> Self {
        self.range_up_to(low, high, f32::MAX)
    }

    /// Sets the range of the results for inputs up to a size, for functions of directions, whose products overflow
    /// beyond it.
    pub fn range_up_to(mut self, low: f64, high: f64, largest: f32) -> Self {
        self.range = Some((low, high, largest));
        self
    }

    /// The same twin for a changed shader, checked against the stated bound alone.
    pub fn mutated(&self, module: &str, from: &str, to: &str) -> Self {
        let kernel = self.kernel.mutated(module, from, to);
        let name = format!("{}: {from:?} -> {to:?}", self.name);
        Self { kernel, name, machine_checked: false, ..self.clone() }
    }

    /// Returns the twin's results and how much the device may differ, for one input.
    pub fn asked(&self, x: &[f32]) -> (Numbers, Allowed) {
        let numbers: Numbers = x.iter().map(|x| f64::from(*x)).collect();
        ((self.expected)(&numbers), (self.allowed)(&numbers))
    }

    fn random_inputs(&self, count: usize) -> Vec<f32> {
        let piece = |first: usize| {
            let mut sequence = Sequence(first as u64);
            (first..(first + PIECE).min(count))
                .flat_map(|_| (self.random)(&mut sequence))
                .collect::<Vec<f32>>()
        };
        let pieces: Vec<usize> = (0..count).step_by(PIECE).collect();
        let all: Vec<f32> = pieces.into_par_iter().flat_map_iter(piece).collect();
        assert_eq!(all.len(), count * self.kernel.inputs(), "{}: random inputs of another size", self.name);
        all
    }

    /// Runs all inputs and compares.
    pub fn judge(&self, gpu: &Gpu) -> Verdict {
        self.judge_some(gpu, RANDOM)
    }

    /// Runs with fewer random inputs, for tests of the tests.
    pub fn judge_some(&self, gpu: &Gpu, count: usize) -> Verdict {
        let hard = jittered(&self.corners);
        let random = self.compare(&self.random_inputs(count), gpu);
        let verdict = Verdict {
            name: self.name.clone(),
            most_open: MAX_OPEN,
            hard: self.compare(&hard, gpu),
            random,
            wild: self.wild(gpu),
        };
        assert_eq!(verdict.hard.count, hard.len() / self.kernel.inputs(), "{}", self.name);
        verdict
    }

    /// Returns how many inputs of any size give results that are not finite or out of range, and one of these
    /// inputs.
    fn wild(&self, gpu: &Gpu) -> (usize, Vec<f32>) {
        let Some((low, high, largest)) = self.range else { return (0, Vec::new()) };
        let mut sequence = Sequence(19);
        let mut number = || {
            let number = match sequence.bits() % 3 {
                0 => EXTREMES[(sequence.bits() % EXTREMES.len() as u64) as usize],
                1 => sequence.any(),
                _ => sequence.between(-1.5, 1.5),
            };
            number.clamp(-largest, largest)
        };
        let input: Vec<f32> = (0..WILD * self.kernel.inputs()).map(|_| number()).collect();
        let strange = |x: &f32| !(x.is_finite() && f64::from(*x) >= low && f64::from(*x) <= high);
        let results = self.kernel.run(gpu, &input);
        let strange: Vec<usize> = results
            .chunks(self.kernel.outputs())
            .enumerate()
            .filter(|(_, results)| results.iter().any(strange))
            .map(|(at, _)| at)
            .collect();
        let first =
            strange.first().map(|at| input[at * self.kernel.inputs()..][..self.kernel.inputs()].to_vec());
        (strange.len(), first.unwrap_or_default())
    }

    /// Compares results for given inputs.
    pub fn compare(&self, input: &[f32], gpu: &Gpu) -> Part {
        let got = self.kernel.run(gpu, input);
        let program = self.machine_checked.then(|| Program::new(&self.kernel.wgsl));
        let one = |(at, (x, got)): (usize, (&[f32], &[f32]))| {
            let machine = program.as_ref().filter(|_| at % MACHINE_CHECKED == 0);
            self.compare_one(machine, x, got)
        };
        let (inputs, outputs) = (self.kernel.inputs(), self.kernel.outputs());
        let each = input.par_chunks(inputs).zip(got.par_chunks(outputs)).enumerate();
        each.map(one).reduce(Part::default, Part::join)
    }

    fn compare_one(&self, machine: Option<&Program>, x: &[f32], got: &[f32]) -> Part {
        let (expected, allowed) = self.asked(x);
        assert_eq!(expected.len(), got.len(), "{}: results of another size", self.name);
        assert_eq!(allowed.error.len(), got.len(), "{}: bounds of another size", self.name);
        let side = |expected: &[f64]| Side::new(got, expected, &allowed.error);
        let mut best = side(&expected);
        let mut accepted = &expected;
        let mut crossed = false;
        if let Some(other) = allowed.other.as_ref().filter(|_| best.ratio > 1.0) {
            let there = side(other);
            if there.ratio <= 1.0 {
                (best, accepted, crossed) = (there, other, true);
            }
        }
        // WGSL lets devices take subnormal numbers for 0 (section 15.7.2), which graphics processors do and llvmpipe
        // does not.
        let flushed: Vec<f32> = x.iter().map(|x| if x.is_subnormal() { 0.0 } else { *x }).collect();
        let may_flush = !gpu().is_software() && best.ratio > 1.0 && flushed != x;
        let of_flushed = may_flush.then(|| self.asked(&flushed));
        if let Some((expected, allowed)) = &of_flushed {
            let there = Side::new(got, expected, &allowed.error);
            if there.ratio <= 1.0 {
                (best, accepted, crossed) = (there, expected, true);
            }
        }
        let mut part = Part {
            count: 1,
            absolute: best.absolute,
            ulp: best.ulp,
            ratio: best.ratio,
            open: usize::from(allowed.other.is_some()),
            crossed: usize::from(crossed),
            input: x.to_vec(),
            got: got.to_vec(),
            expected: accepted.to_vec(),
            bound: allowed.error.to_vec(),
            ..Part::default()
        };
        if let Some(program) = machine {
            let bounds = program.bounds(x);
            for (at, (result, got)) in bounds.results.iter().zip(got).enumerate() {
                // The program's own exact value, independent of the twin. The interpreter's f64 is rounded too.
                let own = 1e-13 * result.value.abs().max(1e-20);
                part.machine =
                    part.machine.max(ratio((f64::from(*got) - result.value).abs(), result.error + own));
                let closed = bounds.open_ways == 0 && !bounds.open_selects && allowed.other.is_none();
                if closed && result.error.is_finite() {
                    let reach = (result.value - expected[at]).abs() + result.error;
                    part.reach = part.reach.max(ratio(reach, allowed.error[at] + own));
                }
            }
        }
        part
    }
}

/// The comparison with the results on one side of a condition.
struct Side {
    absolute: f64,
    ulp: f64,
    ratio: f64,
}

/// Below this, errors in units in the last place are meaningless, and only absolute errors count.
const SMALLEST_IN_UNITS: f64 = 1e-6;

impl Side {
    fn new(got: &[f32], expected: &[f64], bounds: &[f64]) -> Self {
        let mut side = Self { absolute: 0.0, ulp: 0.0, ratio: 0.0 };
        for ((got, expected), bound) in got.iter().zip(expected).zip(bounds) {
            let error = (f64::from(*got) - expected).abs();
            let error = if error.is_nan() { f64::INFINITY } else { error };
            side.absolute = side.absolute.max(error);
            if expected.abs() >= SMALLEST_IN_UNITS {
                side.ulp = side.ulp.max(error / unit_in_the_last_place(*expected));
            }
            side.ratio = side.ratio.max(ratio(error, *bound));
        }
        side
    }
}

fn ratio(error: f64, bound: f64) -> f64 {
    match error == 0.0 {
        true => 0.0,
        false if error.is_nan() || bound.is_nan() => f64::INFINITY,
        false if bound == f64::INFINITY => 0.0,
        false => error / bound,
    }
}

/// What a twin returns, convertible to numbers.
pub trait Results {
    /// The numbers one after the other.
    fn numbers(self) -> Numbers;
}

impl Results for f64 {
    fn numbers(self) -> Numbers {
        Numbers::from_slice(&[self])
    }
}

impl Results for bool {
    fn numbers(self) -> Numbers {
        f64::from(u8::from(self)).numbers()
    }
}

impl Results for glam::DVec3 {
    fn numbers(self) -> Numbers {
        Numbers::from_slice(&self.to_array())
    }
}

impl<const N: usize> Results for [f64; N] {
    fn numbers(self) -> Numbers {
        Numbers::from_slice(&self)
    }
}
