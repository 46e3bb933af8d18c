//! A uniform grid over the spheres that lights reach, for finding the lights near a box without testing all
//! of them. The grid may return lights that do not reach the box; the caller has to test them.

use std::collections::HashMap;

use glam::{DVec3, I64Vec3};

use crate::extract::LightReach;

/// A light whose sphere covers more cells than this is returned for every box.
const MAX_CELLS: f64 = 64.0;

/// The lights of a frame by their position.
#[derive(Debug, Default)]
pub(crate) struct LightGrid {
    /// Side of a cell in metres.
    side: f64,
    cells: HashMap<I64Vec3, Vec<u32>>,
    /// Lights that are in no cell, because their range is large or infinite.
    far_reaching: Vec<u32>,
    /// For each light, the last query that returned it.
    asked: Vec<u32>,
    question: u32,
}

impl LightGrid {
    /// Creates the grid of a frame's lights. The side of its cells is the geometric mean of their diameters.
    pub fn new(reaches: &[LightReach]) -> Self {
        let bounded = |reach: &&LightReach| reach.radius.is_finite() && reach.polygon.is_none();
        let (mut sum, mut count) = (0.0, 0.0);
        for reach in reaches.iter().filter(bounded) {
            // The mean of the logarithms, so that one sphere of a kilometre does not make the cells useless
            // for a thousand spheres of a metre.
            sum += reach.radius.max(1e-9).ln();
            count += 1.0;
        }
        let side = if count > 0.0 { 2.0 * f64::exp(sum / count) } else { 1.0 };
        let mut grid = Self { side, asked: vec![0; reaches.len()], ..Self::default() };
        for (reach, light) in reaches.iter().zip(0..) {
            match grid.cells_of(reach.center, DVec3::splat(reach.radius)) {
                Some(cells) if bounded(&reach) => {
                    cells.for_each(|cell| grid.cells.entry(cell).or_default().push(light));
                }
                _ => grid.far_reaching.push(light),
            }
        }
        grid
    }

    /// Returns the cells that a box covers, if they are few.
    fn cells_of(&self, center: DVec3, half_size: DVec3) -> Option<impl Iterator<Item = I64Vec3> + use<>> {
        let [least, most] =
            [center - half_size, center + half_size].map(|corner| (corner / self.side).floor());
        let sizes = most - least + 1.0;
        let within = least.abs().max(most.abs()).max_element() < 1e15;
        // Both comparisons are false for NaN.
        let few = within && sizes.element_product() <= MAX_CELLS;
        let [least, most] = [least, most].map(|cell| cell.as_i64vec3());
        few.then(|| {
            (least.z..=most.z).flat_map(move |z| {
                (least.y..=most.y).flat_map(move |y| (least.x..=most.x).map(move |x| I64Vec3::new(x, y, z)))
            })
        })
    }

    /// Collects every light that may reach a box, and some that do not, in ascending order.
    pub fn near(&mut self, center: DVec3, half_size: DVec3, lights: &mut Vec<u32>) {
        lights.clear();
        let Some(cells) = self.cells_of(center, half_size) else {
            let all = u32::try_from(self.asked.len()).unwrap_or(u32::MAX);
            lights.extend(0..all);
            return;
        };
        self.question += 1;
        lights.extend_from_slice(&self.far_reaching);
        for cell in cells {
            for &light in self.cells.get(&cell).into_iter().flatten() {
                let asked = &mut self.asked[light as usize];
                if *asked != self.question {
                    *asked = self.question;
                    lights.push(light);
                }
            }
        }
        lights.sort_unstable();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extract::LightClass;

    #[test]
    fn every_light_that_touches_a_box_is_near_it_and_few_others_are() {
        let mut state = 7_u64;
        let mut random = |scale: f64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5) * scale
        };
        let mut reaches: Vec<LightReach> = (0..2000)
            .map(|number| LightReach {
                class: LightClass::Ranged,
                center: DVec3::new(random(100.0), random(10.0), random(100.0)),
                radius: match number % 100 {
                    0 => 500.0,
                    1 => f64::INFINITY,
                    2 => 1e-6,
                    _ => 1.0 + random(1.0),
                },
                cone: None,
                baked: false,
                polygon: None,
            })
            .collect();
        reaches[5].center = DVec3::splat(1e30);
        let mut grid = LightGrid::new(&reaches);
        let (mut near, mut given, mut touching) = (Vec::new(), 0, 0);
        for number in 0..500 {
            let center = DVec3::new(random(110.0), random(12.0), random(110.0));
            let half = DVec3::new(random(2.0), random(2.0), random(2.0)).abs();
            let half = if number == 0 { DVec3::splat(1e3) } else { half };
            grid.near(center, half, &mut near);
            assert!(near.is_sorted_by(|a, b| a < b), "each once, in order");
            for (reach, light) in reaches.iter().zip(0..) {
                let outside = ((reach.center - center).abs() - half).max(DVec3::ZERO).length();
                if outside < reach.radius {
                    assert!(near.contains(&light), "light {light} touches box {number}");
                    touching += 1;
                }
            }
            given += near.len();
        }
        assert!(given < 4 * touching, "{given} are given where {touching} touch");
    }
}
