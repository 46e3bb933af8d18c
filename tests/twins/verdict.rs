//! The results of comparisons, and the table of them.

use std::fmt;

/// The results of comparing some inputs. Joining two takes the worst of each.
#[derive(Clone, Debug, Default)]
pub struct Part {
    pub count: usize,
    /// Largest difference.
    pub absolute: f64,
    /// Largest difference in units of the last place of the expected value.
    pub ulp: f64,
    /// Largest difference relative to its bound.
    pub ratio: f64,
    /// Largest difference from the program's exact value relative to its running error.
    pub machine: f64,
    /// Largest error that the running error admits, relative to the stated bound.
    pub reach: f64,
    /// Number of inputs within rounding of a condition.
    pub open: usize,
    /// Number of those for which the device took the other side.
    pub crossed: usize,
    /// The input with the largest ratio.
    pub input: Vec<f32>,
    pub got: Vec<f32>,
    pub expected: Vec<f64>,
    pub bound: Vec<f64>,
}

impl Part {
    pub fn join(self, other: Self) -> Self {
        let joined = Self {
            count: self.count + other.count,
            absolute: self.absolute.max(other.absolute),
            ulp: self.ulp.max(other.ulp),
            machine: self.machine.max(other.machine),
            reach: self.reach.max(other.reach),
            open: self.open + other.open,
            crossed: self.crossed + other.crossed,
            ..Self::default()
        };
        let worst = if other.ratio > self.ratio || self.input.is_empty() { other } else { self };
        let Self { ratio, input, got, expected, bound, .. } = worst;
        Self { ratio, input, got, expected, bound, ..joined }
    }
}

/// The results of all comparisons of a function.
#[derive(Clone, Debug)]
pub struct Verdict {
    pub name: String,
    pub random: Part,
    pub hard: Part,
    /// How many random inputs may be within rounding of a condition.
    pub most_open: usize,
    /// Number of inputs of any size whose results are not finite or out of range, and one of them.
    pub wild: (usize, Vec<f32>),
}

impl Verdict {
    /// Returns the part with the larger ratio.
    pub fn worst(&self) -> &Part {
        if self.hard.ratio > self.random.ratio { &self.hard } else { &self.random }
    }

    pub fn passes(&self) -> bool {
        self.worst().ratio <= 1.0
            && self.random.machine.max(self.hard.machine) <= 1.0
            && self.wild.0 == 0
            && self.random.open * 1_000_000 <= self.most_open * self.random.count
            && self.hard.open * 4 <= self.hard.count * 3
    }
}

impl Verdict {
    /// Formats the worst input as a line of `worst_inputs.rs`.
    pub fn regression(&self) -> String {
        let slug: String = self
            .name
            .chars()
            .map(|c| if c.is_alphanumeric() { c.to_ascii_lowercase() } else { ' ' })
            .collect();
        let slug = slug.split_whitespace().collect::<Vec<_>>().join("_");
        let worst = self.worst();
        let bits: Vec<String> = worst.input.iter().map(|x| format!("{:x}", x.to_bits())).collect();
        let numbers =
            |numbers: &[f64]| numbers.iter().map(|x| format!("{x:e}")).collect::<Vec<_>>().join(", ");
        let (expected, bound) = (numbers(&worst.expected), numbers(&worst.bound));
        format!("worst!({slug}, {:?}, {:?}, [{expected}], [{bound}]);", self.name, bits.join(" "))
    }
}

/// Returns the distance between neighbouring f32 at a value.
pub fn unit_in_the_last_place(value: f64) -> f64 {
    let magnitude = (value.abs() as f32).clamp(f32::MIN_POSITIVE, f32::MAX / 2.0);
    f64::from(magnitude.next_up()) - f64::from(magnitude)
}

/// What the columns of the table mean.
pub const LEGEND: &str = "\
abs, ULP: largest error, the latter in f32 units of the expected value where that is 1e-6 or more; random / hard.
bound: largest error over the bound that the twin's documentation states. machine: largest error over the running error found from the
shader itself, on one input of 64. reach: largest error that any WGSL device may make, by that running error, over the stated bound;
at most 1 where the machine proves the bound, more where the bound uses that errors cancel. open: inputs within rounding of a
condition (n.l > 0, a cutoff, total reflection), where either side's value is accepted, random / hard; crossed: how many inputs the
device put there, or answered as if their subnormal numbers were 0. wild: inputs of any size with a result that is not finite or out of range. Nothing is left out.";

/// The heading of the table.
pub const HEADING: &str = "function                                     random    hard      abs random/hard       ULP random/hard  \
     bound machine    reach          open     crossed wild pass  worst input (bits)";

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (random, hard) = (&self.random, &self.hard);
        let bits: Vec<String> = self.worst().input.iter().map(|x| format!("{:x}", x.to_bits())).collect();
        write!(
            f,
            "{:<42} {:>8} {:>7} {:>9.2e}/{:<9.2e} {:>8.3}/{:<8.3} {:>7.3} {:>7.3} {:>8.2} {:>6}/{:<6} {:>5}/{:<5} {:>4} {:<4}  {}",
            self.name,
            random.count,
            hard.count,
            random.absolute,
            hard.absolute,
            random.ulp,
            hard.ulp,
            self.worst().ratio,
            random.machine.max(hard.machine),
            random.reach.max(hard.reach),
            random.open,
            hard.open,
            random.crossed,
            hard.crossed,
            self.wild.0,
            if self.passes() { "yes" } else { "NO" },
            bits.join(" "),
        )
    }
}
