//! One function on the GPU against its f64 twin: how far apart, and how far it may be.

use std::fmt;

use lumbre_render::Gpu;
use lumbre_tests::kernel::Kernel;
use lumbre_tests::running_error::Program;
use rayon::prelude::*;

use crate::inputs::{RANDOM, Sequence, jittered};

/// Bounds above this say nothing of a value that is 1 at most: the input is so badly conditioned that f32 cannot tell.
const LOOSE: f64 = 1e-2;

/// A kind of argument or result.
#[derive(Clone, Copy, PartialEq)]
pub enum Kind {
    Number,
    Vector,
    /// Given and taken as 0 or 1.
    Flag,
}

impl Kind {
    pub fn size(self) -> usize {
        if self == Self::Vector { 3 } else { 1 }
    }
}

type Expected = Box<dyn Fn(&[f64]) -> Vec<f64> + Sync>;
type Method = Box<dyn Fn(&[f64], &[f64]) -> f64 + Sync>;

/// A function and its twin.
pub struct Twin {
    pub name: String,
    pub kernel: Kernel,
    pub inputs: usize,
    pub outputs: usize,
    pub expected: Expected,
    /// Appends one random input.
    pub random: Box<dyn Fn(&mut Sequence) -> Vec<f32> + Sync>,
    pub corners: Vec<Vec<f32>>,
    /// What the program's exact value may differ from the twin's: series that are cut off, lengths that one of them ignores.
    pub method: Method,
    /// Where results lie, for every finite input.
    pub range: (f64, f64),
}

impl Twin {
    /// A function of `module` by its own name, called with `arguments`.
    pub fn new(module: &str, function: &str, features: &[&str], arguments: &[Kind], result: Kind) -> Self {
        let mut at = 0;
        let passed = arguments.iter().map(|kind| {
            let start = at;
            at += kind.size();
            match kind {
                Kind::Number => format!("x[{start}]"),
                Kind::Vector => format!("vec3<f32>(x[{start}], x[{}], x[{}])", start + 1, start + 2),
                Kind::Flag => format!("x[{start}] > 0.5"),
            }
        });
        let call = format!("let r = {function}({});", passed.collect::<Vec<_>>().join(", "));
        let taken = match result {
            Kind::Number => "r",
            Kind::Vector => "r.x, r.y, r.z",
            Kind::Flag => "select(0.0, 1.0, r)",
        };
        let call = format!("{call} return array<f32, {}>({taken});", result.size());
        Self::with_call(function, module, &[function], features, (at, result.size()), &call)
    }

    /// As [`Kernel::new`].
    pub fn with_call(
        name: &str,
        module: &str,
        imports: &[&str],
        features: &[&str],
        (inputs, outputs): (usize, usize),
        call: &str,
    ) -> Self {
        let kernel = Kernel::new(module, imports, features, inputs, outputs, call);
        Self {
            name: name.to_owned(),
            kernel,
            inputs,
            outputs,
            expected: Box::new(|_| Vec::new()),
            random: Box::new(|_| Vec::new()),
            corners: Vec::new(),
            method: Box::new(|_, _| 0.0),
            range: (f64::NEG_INFINITY, f64::INFINITY),
        }
    }

    pub fn named(mut self, suffix: &str) -> Self {
        self.name = format!("{} ({suffix})", self.name);
        self
    }

    pub fn expect(mut self, twin: impl Fn(&[f64]) -> Vec<f64> + Sync + 'static) -> Self {
        self.expected = Box::new(twin);
        self
    }

    pub fn random(mut self, input: impl Fn(&mut Sequence) -> Vec<f32> + Sync + 'static) -> Self {
        self.random = Box::new(input);
        self
    }

    pub fn corners(mut self, corners: Vec<Vec<f32>>) -> Self {
        self.corners = corners;
        self
    }

    pub fn method(mut self, allowed: impl Fn(&[f64], &[f64]) -> f64 + Sync + 'static) -> Self {
        self.method = Box::new(allowed);
        self
    }

    pub fn range(mut self, low: f64, high: f64) -> Self {
        self.range = (low, high);
        self
    }

    fn random_inputs(&self) -> Vec<f32> {
        let mut sequence = Sequence(17);
        let mut all = Vec::with_capacity(RANDOM * self.inputs);
        for _ in 0..RANDOM {
            all.extend((self.random)(&mut sequence));
        }
        assert_eq!(all.len(), RANDOM * self.inputs, "{}: random inputs of another size", self.name);
        all
    }

    /// Runs everything and compares.
    pub fn judge(&self, gpu: &Gpu) -> Verdict {
        let random = self.random_inputs();
        let hard = jittered(&self.corners);
        assert_eq!(hard.len() % self.inputs, 0, "{}: corners of another size", self.name);
        let mut verdict = self.compare(&[random.as_slice(), &hard].concat(), gpu);
        verdict.random = RANDOM;
        verdict.hard = hard.len() / self.inputs;
        verdict.wild = self.wild(gpu);
        verdict
    }

    /// How many of 100,000 inputs of any finite bits give what is not finite or out of range.
    fn wild(&self, gpu: &Gpu) -> usize {
        let mut sequence = Sequence(19);
        let input: Vec<f32> = (0..100_000 * self.inputs).map(|_| sequence.any()).collect();
        let (low, high) = self.range;
        let strange = |x: &&f32| !(x.is_finite() && f64::from(**x) >= low && f64::from(**x) <= high);
        if self.range == (f64::NEG_INFINITY, f64::INFINITY) {
            return 0;
        }
        self.kernel.run(gpu, &input).iter().filter(strange).count()
    }

    /// Compares on given inputs.
    pub fn compare(&self, input: &[f32], gpu: &Gpu) -> Verdict {
        let got = self.kernel.run(gpu, input);
        let program = Program::new(&self.kernel.wgsl);
        let one = |(x, got): (&[f32], &[f32])| self.compare_one(&program, x, got);
        let parts = input.par_chunks(self.inputs).zip(got.par_chunks(self.outputs)).map(one);
        let mut verdict = parts.reduce(Verdict::default, Verdict::worse);
        verdict.name.clone_from(&self.name);
        verdict
    }

    fn compare_one(&self, program: &Program, x: &[f32], got: &[f32]) -> Verdict {
        let numbers: Vec<f64> = x.iter().map(|x| f64::from(*x)).collect();
        let expected = (self.expected)(&numbers);
        let mut verdict = Verdict::default();
        let error_of = |got: f32, expected: f64| {
            let error = (f64::from(got) - expected).abs();
            if error.is_nan() { f64::INFINITY } else { error }
        };
        let errors = || got.iter().zip(&expected).map(|(got, expected)| error_of(*got, *expected));
        for (error, expected) in errors().zip(&expected) {
            let ulp = unit_in_the_last_place(*expected);
            verdict.absolute = verdict.absolute.max(error);
            verdict.ulp = verdict.ulp.max(error / ulp);
        }
        // Every bound holds one rounding at least: what is that near needs no bound.
        let near = |(error, expected): (f64, &f64)| error <= 0.25 * unit_in_the_last_place(*expected);
        if errors().zip(&expected).all(near) && expected.len() == got.len() {
            return verdict;
        }
        let bounds = program.bounds(x);
        let allowed = (self.method)(&numbers, &expected);
        verdict.open = usize::from(bounds.open_ways > 0);
        for ((error, expected), bound) in errors().zip(&expected).zip(&bounds.results) {
            let method = (bound.value - expected).abs();
            // The interpreter's own f64, and the twin's, round too.
            let own = 1e-12 * expected.abs().max(1e-3);
            let bound = bound.error + allowed + own;
            verdict.loose += usize::from(bound > LOOSE * expected.abs().max(1.0));
            // An open condition takes the other way in the twin: then the hull covers both.
            let strange_method = bounds.open_ways == 0 && method > allowed + own;
            let ratio = if strange_method { f64::INFINITY } else { error / bound };
            if ratio > verdict.ratio || verdict.input.is_empty() {
                verdict.ratio = ratio;
                verdict.input = x.to_vec();
                verdict.got = got.to_vec();
                verdict.expected.clone_from(&vec![*expected]);
                verdict.bound = bound;
            }
        }
        verdict
    }
}

/// The distance between neighbouring f32 at a value.
pub fn unit_in_the_last_place(value: f64) -> f64 {
    let magnitude = (value.abs() as f32).clamp(f32::MIN_POSITIVE, f32::MAX / 2.0);
    f64::from(magnitude.next_up()) - f64::from(magnitude)
}

/// What a comparison found.
#[derive(Clone, Debug, Default)]
pub struct Verdict {
    pub name: String,
    pub random: usize,
    pub hard: usize,
    /// Largest difference.
    pub absolute: f64,
    /// Largest difference in units of the last place of the expected value.
    pub ulp: f64,
    /// Largest difference in terms of its bound, and where.
    pub ratio: f64,
    pub bound: f64,
    pub input: Vec<f32>,
    pub got: Vec<f32>,
    pub expected: Vec<f64>,
    /// Inputs where rounding may decide a condition, among those that needed a bound.
    pub open: usize,
    /// Results whose bound says little.
    pub loose: usize,
    /// Inputs of any bits whose results are not finite or out of range.
    pub wild: usize,
}

impl Verdict {
    fn worse(self, other: Self) -> Self {
        let (absolute, ulp) = (self.absolute.max(other.absolute), self.ulp.max(other.ulp));
        let (open, loose) = (self.open + other.open, self.loose + other.loose);
        let at = if other.ratio > self.ratio || self.input.is_empty() { other } else { self };
        Self { absolute, ulp, open, loose, ..at }
    }

    pub fn passes(&self) -> bool {
        self.ratio <= 1.0 && self.wild == 0
    }
}

/// The heading of the table.
pub const HEADING: &str = "function                                  random     hard  abs error       ULP  error/bound     open    loose  wild  pass  worst input";

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:<38} {:>9} {:>8}  {:>9.2e} {:>9.2e}  {:>11.3}  {:>7}  {:>7} {:>5}  {:<4}  {:?}",
            self.name,
            self.random,
            self.hard,
            self.absolute,
            self.ulp,
            self.ratio,
            self.open,
            self.loose,
            self.wild,
            if self.passes() { "yes" } else { "NO" },
            self.input,
        )
    }
}
