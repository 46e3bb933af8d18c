//! Where the probes are: at the centres of the cells of a box around the scene. Their light is computed in `light`.

use glam::{DVec3, UVec3, Vec3};
use lumbre_scene::Transform;

use crate::bounds::Bounds;
use crate::scene::{BakeScene, Canonical};

/// Most probes if no spacing is requested.
const DEFAULT_MAX_PROBES: u64 = 4096;

/// Most probes if a spacing is requested: with six colours each they take 25 MB.
const MAX_PROBES: u64 = 1 << 18;

/// Most cells along an axis: the texture has three times as many along z, and every GPU supports 2048.
const MAX_CELLS: f64 = 682.0;

/// Least thickness of the box as a share of its longest side: above a flat floor there must be probes too.
const MIN_THICKNESS: f64 = 1.0 / 16.0;

/// A box of cells, canonical units.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid {
    pub resolution: UVec3,
    low: DVec3,
    size: DVec3,
}

impl Grid {
    /// A grid around the scene and the points of moving objects (world space), with cells of at most `spacing` metres,
    /// or as small as the number of probes allows.
    pub fn new(
        scene: &BakeScene,
        moving: &[DVec3],
        spacing: Option<f64>,
        warnings: &mut Vec<String>,
    ) -> Self {
        let solid = scene.triangles.iter().filter(|triangle| !triangle.is_hidden_duplicate);
        let corners = solid.flat_map(|triangle| triangle.corners).map(|corner| corner.as_dvec3());
        let moving = moving.iter().map(|&point| (point - scene.space.center) * scene.space.scale);
        let bounds: Bounds<DVec3> = corners.chain(moving).filter(|point| point.is_finite()).collect();
        let (low, high) =
            if bounds.is_empty() { (DVec3::ZERO, DVec3::ZERO) } else { (bounds.low, bounds.high) };
        let mut size = high - low;
        let least = if size.max_element() > 0.0 { MIN_THICKNESS * size.max_element() } else { 1.0 };
        let middle = 0.5 * low + 0.5 * high;
        size = size.max(DVec3::splat(least));
        let low = middle - 0.5 * size;
        let requested = spacing.map(|spacing| spacing * scene.space.scale);
        let max_probes = if requested.is_some() { MAX_PROBES } else { DEFAULT_MAX_PROBES };
        // No side can be shorter than that of a cube whose volume is the box's divided by the most probes.
        let least =
            (size.x * (size.y * size.z) / max_probes as f64).cbrt().max(size.max_element() / MAX_CELLS);
        let mut side = requested.map_or(least, |requested| requested.max(least));
        let mut cells = resolution(size, side);
        while count(cells) > max_probes {
            side *= 1.01;
            cells = resolution(size, side);
        }
        if let Some(requested) = requested.filter(|requested| *requested < side) {
            warnings.push(format!(
                "the probe spacing of {:.3} m was raised to {:.3} m: at most {MAX_PROBES} probes are baked, and {MAX_CELLS} along an axis",
                requested / scene.space.scale,
                side / scene.space.scale
            ));
        }
        Self { resolution: cells, low, size }
    }

    /// Number of probes.
    pub fn count(&self) -> usize {
        count(self.resolution) as usize
    }

    /// Position of a probe, canonical units. Probes are numbered along x first, then y, then z.
    pub fn position(&self, index: usize) -> Vec3 {
        let [width, height, _] = self.resolution.to_array().map(|side| side as usize);
        let cell = [index % width, index / width % height, index / (width * height)];
        let cell = DVec3::from_array(cell.map(|cell| cell as f64 + 0.5));
        (self.low + cell / self.resolution.as_dvec3() * self.size).as_vec3()
    }

    /// Lengths of a cell's sides, metres.
    pub fn spacing(&self, space: Canonical) -> DVec3 {
        self.size / self.resolution.as_dvec3() / space.scale
    }

    /// Maps the unit cube around the origin to the grid in the world.
    pub fn transform(&self, space: Canonical) -> Transform {
        let middle = (self.low + 0.5 * self.size) / space.scale + space.center;
        Transform::from_translation(middle).with_scale(self.size / space.scale)
    }
}

/// The fewest cells per axis that are at most `side` long, and at least one.
fn resolution(size: DVec3, side: f64) -> UVec3 {
    // Rounding must not add a cell where the box is a whole number of cells long.
    (size / side * (1.0 - 1e-9)).ceil().clamp(DVec3::ONE, DVec3::splat(MAX_CELLS)).as_uvec3()
}

fn count(resolution: UVec3) -> u64 {
    resolution.to_array().into_iter().map(u64::from).product()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_as_few_as_the_longest_side_allows() {
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
