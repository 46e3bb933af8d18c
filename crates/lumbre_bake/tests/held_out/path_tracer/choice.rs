//! Random choice among many entries by weights, and a grid of such choices whose weights depend on the place.

use glam::DVec3;

/// A discrete distribution, as the cumulative sums of its weights.
pub struct Choice(Vec<f64>);

impl Choice {
    pub fn new(weights: impl Iterator<Item = f64>) -> Self {
        let mut sum = 0.0;
        let add = |weight: f64| {
            sum += weight;
            sum
        };
        Self(weights.map(add).collect())
    }

    /// Chooses an entry by a uniform number in [0, 1). Returns its index, its probability, and the position of the
    /// number within the entry's interval, which is again uniform in [0, 1] and can be used for another choice.
    pub fn pick(&self, number: f64) -> Option<(usize, f64, f64)> {
        let total = *self.0.last().filter(|total| **total > 0.0)?;
        let chosen = number * total;
        let index = self.0.partition_point(|&sum| sum <= chosen).min(self.0.len() - 1);
        let before = if index == 0 { 0.0 } else { self.0[index - 1] };
        let weight = self.0[index] - before;
        Some((index, weight / total, ((chosen - before) / weight).clamp(0.0, 1.0)))
    }
}

/// A grid over a box with a distribution for each cell.
pub struct ChoiceGrid {
    low: DVec3,
    cell: DVec3,
    side: usize,
    choices: Vec<Choice>,
}

/// The approximate upper limit on the number of weights in all cells together.
const MAX_WEIGHTS: f64 = 4e6;

impl ChoiceGrid {
    /// Builds a grid over sources, each given by its place, size and power. The weight of a source in a cell is its
    /// power over the squared distance, which is at least that given by the sizes of the cell and the source. A
    /// twentieth of the probability goes by power alone, so that no source is left out.
    pub fn new([low, high]: [DVec3; 2], sources: &[(DVec3, f64, f64)]) -> Self {
        let side = (MAX_WEIGHTS / sources.len().max(1) as f64).cbrt().clamp(1.0, 16.0) as usize;
        let cell = ((high - low) / side as f64).max(DVec3::splat(1e-9));
        let total: f64 = sources.iter().map(|(.., power)| power).sum();
        let choice = |index: usize| {
            let at = [index % side, index / side % side, index / side / side].map(|i| i as f64 + 0.5);
            let middle = low + cell * DVec3::from(at);
            let least = cell.length_squared() / 4.0;
            let weight = |(place, size, power): &(DVec3, f64, f64)| {
                power / (middle.distance_squared(*place)).max(least + size * size)
            };
            let sum: f64 = sources.iter().map(weight).sum();
            Choice::new(sources.iter().map(|source| 0.95 * weight(source) / sum + 0.05 * source.2 / total))
        };
        let cells = if sources.is_empty() { 0 } else { side.pow(3) };
        Self { low, cell, side, choices: (0..cells).map(choice).collect() }
    }

    pub fn at(&self, place: DVec3) -> Option<&Choice> {
        let cell = ((place - self.low) / self.cell).clamp(DVec3::ZERO, DVec3::splat(self.side as f64 - 0.5));
        let [x, y, z] = cell.to_array().map(|at| at as usize);
        self.choices.get(x + self.side * (y + self.side * z))
    }
}
