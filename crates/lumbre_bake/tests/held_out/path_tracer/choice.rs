//! Choosing one of many by weights, and weights that depend on the place. Not what is chosen.

use glam::DVec3;

/// Sums of weights up to each.
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

    /// Which one, its probability, and what is left of the number: as good as one of its own, with its stratum.
    pub fn pick(&self, number: f64) -> Option<(usize, f64, f64)> {
        let total = *self.0.last().filter(|total| **total > 0.0)?;
        let chosen = number * total;
        let index = self.0.partition_point(|&sum| sum <= chosen).min(self.0.len() - 1);
        let before = if index == 0 { 0.0 } else { self.0[index - 1] };
        let own = self.0[index] - before;
        Some((index, own / total, ((chosen - before) / own).clamp(0.0, 1.0)))
    }
}

/// A choice for each cell of a box.
pub struct ChoiceGrid {
    low: DVec3,
    cell: DVec3,
    side: usize,
    choices: Vec<Choice>,
}

/// Weights of all cells together, at most about.
const MAX_WEIGHTS: f64 = 4e6;

impl ChoiceGrid {
    /// For things of a place, a size and a power: power over squared distance, but nowhere nearer than the cell and the thing are large; a
    /// twentieth by power alone, so that nothing is left out.
    pub fn new([low, high]: [DVec3; 2], things: &[(DVec3, f64, f64)]) -> Self {
        let side = (MAX_WEIGHTS / things.len().max(1) as f64).cbrt().clamp(1.0, 16.0) as usize;
        let cell = ((high - low) / side as f64).max(DVec3::splat(1e-9));
        let total: f64 = things.iter().map(|(.., power)| power).sum();
        let choice = |index: usize| {
            let at = [index % side, index / side % side, index / side / side].map(|i| i as f64 + 0.5);
            let middle = low + cell * DVec3::from(at);
            let least = cell.length_squared() / 4.0;
            let near = |(place, size, power): &(DVec3, f64, f64)| {
                power / (middle.distance_squared(*place)).max(least + size * size)
            };
            let sum: f64 = things.iter().map(near).sum();
            Choice::new(things.iter().map(|thing| 0.95 * near(thing) / sum + 0.05 * thing.2 / total))
        };
        let cells = if things.is_empty() { 0 } else { side.pow(3) };
        Self { low, cell, side, choices: (0..cells).map(choice).collect() }
    }

    pub fn at(&self, place: DVec3) -> Option<&Choice> {
        let cell = ((place - self.low) / self.cell).clamp(DVec3::ZERO, DVec3::splat(self.side as f64 - 0.5));
        let [x, y, z] = cell.to_array().map(|at| at as usize);
        self.choices.get(x + self.side * (y + self.side * z))
    }
}
