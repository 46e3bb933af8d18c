//! Where probes stand: the centres of the cells of a box around everything. Not what they see.

use glam::{DVec3, UVec3, Vec3};
use lumbre_scene::Transform;

use crate::scene::{BakeScene, Canonical};

/// Most probes that are placed without a spacing.
const BUDGET: u64 = 4096;

/// Most probes with one: six colours each make 25 MB.
const LIMIT: u64 = 1 << 18;

/// Most cells along an axis: the texture has three times as many along z, and 2048 is what every GPU takes.
const MAX_CELLS: f64 = 682.0;

/// Least thickness of the box, of its longest side: above a floor there is room too.
const THINNEST: f64 = 1.0 / 16.0;

/// A box of cells, canonical units.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid {
    pub resolution: UVec3,
    low: DVec3,
    size: DVec3,
}

impl Grid {
    /// Around the scene and the points of what moves (world space): cells of at most `spacing` metres, or as small as the budget allows.
    pub fn new(
        scene: &BakeScene,
        moving: &[DVec3],
        spacing: Option<f64>,
        warnings: &mut Vec<String>,
    ) -> Self {
        let solid = scene.triangles.iter().filter(|triangle| !triangle.is_hidden_duplicate);
        let corners = solid.flat_map(|triangle| triangle.corners).map(|corner| corner.as_dvec3());
        let moving = moving.iter().map(|&point| (point - scene.space.center) * scene.space.scale);
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for point in corners.chain(moving).filter(|point| point.is_finite()) {
            (low, high) = (low.min(point), high.max(point));
        }
        if !low.cmple(high).all() {
            (low, high) = (DVec3::ZERO, DVec3::ZERO);
        }
        let mut size = high - low;
        let least = if size.max_element() > 0.0 { THINNEST * size.max_element() } else { 1.0 };
        let middle = 0.5 * low + 0.5 * high;
        size = size.max(DVec3::splat(least));
        let low = middle - 0.5 * size;
        let asked = spacing.map(|spacing| spacing * scene.space.scale);
        let budget = if asked.is_some() { LIMIT } else { BUDGET };
        // The volume of a cell if all of the budget were used: the least that can be.
        let least = (size.x * (size.y * size.z) / budget as f64).cbrt().max(size.max_element() / MAX_CELLS);
        let mut side = asked.map_or(least, |asked| asked.max(least));
        let mut cells = resolution(size, side);
        while count(cells) > budget {
            side *= 1.01;
            cells = resolution(size, side);
        }
        if let Some(asked) = asked.filter(|asked| *asked < side) {
            warnings.push(format!(
                "the probe spacing of {:.3} m was raised to {:.3} m: at most {LIMIT} probes are baked, and {MAX_CELLS} along an axis",
                asked / scene.space.scale,
                side / scene.space.scale
            ));
        }
        Self { resolution: cells, low, size }
    }

    /// How many probes there are.
    pub fn count(&self) -> usize {
        count(self.resolution) as usize
    }

    /// Of a probe: along x first, then y, then z.
    pub fn position(&self, index: usize) -> Vec3 {
        let [width, height, _] = self.resolution.to_array().map(|side| side as usize);
        let cell = [index % width, index / width % height, index / (width * height)];
        let cell = DVec3::from_array(cell.map(|cell| cell as f64 + 0.5));
        (self.low + cell / self.resolution.as_dvec3() * self.size).as_vec3()
    }

    /// Sides of a cell, metres.
    pub fn spacing(&self, space: Canonical) -> DVec3 {
        self.size / self.resolution.as_dvec3() / space.scale
    }

    /// Maps the unit cube around the origin to the grid.
    pub fn transform(&self, space: Canonical) -> Transform {
        let middle = (self.low + 0.5 * self.size) / space.scale + space.center;
        Transform::from_translation(middle).with_scale(self.size / space.scale)
    }
}

/// At least one cell per axis, each at most `side` long.
fn resolution(size: DVec3, side: f64) -> UVec3 {
    // Rounding must not add a cell to a side that is a whole number of them.
    (size / side * (1.0 - 1e-9)).ceil().clamp(DVec3::ONE, DVec3::splat(MAX_CELLS)).as_uvec3()
}

fn count(resolution: UVec3) -> u64 {
    resolution.to_array().into_iter().map(u64::from).product()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_at_most_as_long_as_asked() {
        for size in [DVec3::new(4.0, 2.0, 1.0), DVec3::new(1.0, 0.0625, 0.3), DVec3::splat(0.7)] {
            for side in [0.01, 0.1, 0.25, 2.0, 9.0] {
                let cells = resolution(size, side);
                assert!((size / cells.as_dvec3()).cmple(DVec3::splat(side * (1.0 + 1e-6))).all(), "{cells}");
                let fewer = (cells - UVec3::ONE).as_dvec3() * side;
                assert!(fewer.cmplt(size).all(), "{cells} for {size} and {side}");
            }
        }
        assert_eq!(resolution(DVec3::new(4.0, 2.0, 1.0), 0.25), UVec3::new(16, 8, 4));
    }
}
