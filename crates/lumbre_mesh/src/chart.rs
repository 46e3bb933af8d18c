//! Cuts a surface into charts: connected patches that an orthographic projection maps to the plane without
//! overlaps or flipped triangles. Their place in the atlas is determined in `unwrap`.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::{DVec2, DVec3};

use crate::adjacency::Adjacency;
use crate::planar_overlap::OverlapGrid;

/// A chart before packing: its triangles and the plane they are projected to.
#[derive(Clone, Debug)]
pub(crate) struct FlatChart {
    /// In ascending order.
    pub triangles: Vec<u32>,
    pub normal: DVec3,
    pub tangent: DVec3,
    pub bitangent: DVec3,
}

impl FlatChart {
    pub fn project(&self, position: DVec3) -> DVec2 {
        DVec2::new(position.dot(self.tangent), position.dot(self.bitangent))
    }
}

/// A triangle that may join a chart. The queue prefers normals close to the seed's, then low triangle
/// indices.
struct Candidate {
    cosine: f64,
    triangle: u32,
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        self.cosine.total_cmp(&other.cosine).then(other.triangle.cmp(&self.triangle))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}

/// The surface to be cut, and the options.
pub(crate) struct Charting<'a> {
    pub corners: &'a [[DVec3; 3]],
    /// Unit face normals; zero for triangles that belong to no chart.
    pub normals: &'a [DVec3],
    pub areas: &'a [f64],
    pub adjacency: &'a Adjacency,
    /// Cosine of the largest angle between a triangle's normal and its chart's.
    pub least_cosine: f64,
}

/// Number of triangles between two calls of `go_on`.
const STEPS: usize = 1024;

impl Charting<'_> {
    /// Cuts the surface so that every triangle with a normal lies in exactly one chart.
    ///
    /// A region first grows from the first free triangle, guided by the region's own mean normal. Then it is
    /// grown again in the fixed plane of that mean, accepting only triangles that do not overlap there. The
    /// rejected ones stay free.
    ///
    /// Returns `None` if `go_on`, which is called now and then, returns false.
    pub fn charts(&self, go_on: &dyn Fn() -> bool) -> Option<Vec<FlatChart>> {
        let mut owner: Vec<u32> = vec![u32::MAX; self.corners.len()];
        // For each triangle, the number of the last search that visited it, and of the last that added it to
        // the region.
        let mut region_of = vec![0u32; self.corners.len()];
        let mut visited = vec![0u32; self.corners.len()];
        let mut round = 0;
        let mut charts: Vec<FlatChart> = Vec::new();
        let (mut steps, mut stopped) = (0usize, false);
        for seed in 0..self.corners.len() as u32 {
            if owner[seed as usize] != u32::MAX || self.normals[seed as usize] == DVec3::ZERO {
                continue;
            }
            steps += 1;
            stopped |= steps.is_multiple_of(STEPS) && !go_on();
            if stopped {
                return None;
            }
            round += 1;
            let mut mean = DVec3::ZERO;
            let mut region = Vec::new();
            let free = |triangle: u32| owner[triangle as usize] == u32::MAX;
            self.grow(seed, round, &mut visited, |triangle, index| {
                let normal = self.normals[index];
                let accepted = region.is_empty()
                    || free(triangle) && normal.dot(mean) >= self.least_cosine * mean.length();
                if accepted {
                    // The seed must contribute its normal even if its area underflows.
                    mean += normal * self.areas[index].max(f64::MIN_POSITIVE);
                    region.push(triangle);
                    region_of[index] = round;
                }
                accepted
            });
            let seed_normal = self.normals[seed as usize];
            let mean = mean.normalize_or(seed_normal);
            let normal = if mean.dot(seed_normal) >= self.least_cosine { mean } else { seed_normal };
            let (tangent, bitangent) = normal.any_orthonormal_pair();
            let mut chart = FlatChart { triangles: Vec::new(), normal, tangent, bitangent };
            let project = |triangle: u32| self.corners[triangle as usize].map(|corner| chart.project(corner));
            let (mut min, mut max) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
            for &triangle in &region {
                for point in project(triangle) {
                    (min, max) = (min.min(point), max.max(point));
                }
            }
            let mut grid = OverlapGrid::new(min, max, region.len());
            let mut taken = Vec::new();
            round += 1;
            self.grow(seed, round, &mut visited, |triangle, index| {
                steps += 1;
                stopped |= steps.is_multiple_of(STEPS) && !go_on();
                let accepted = !stopped
                    && region_of[index] == round - 1
                    && self.normals[index].dot(normal) >= self.least_cosine
                    && grid.insert(project(triangle));
                if accepted {
                    taken.push(triangle);
                }
                accepted
            });
            if taken.is_empty() {
                // Unreachable for valid normals; a chart of its own keeps every triangle in a chart all the
                // same.
                taken.push(seed);
            }
            taken.sort_unstable();
            for &triangle in &taken {
                owner[triangle as usize] = charts.len() as u32;
            }
            chart.triangles = taken;
            charts.push(chart);
        }
        (!stopped).then_some(charts)
    }

    /// Visits triangles from the seed outwards, across edges with exactly two triangles.
    fn grow(&self, seed: u32, round: u32, visited: &mut [u32], mut accept: impl FnMut(u32, usize) -> bool) {
        let mut waiting = BinaryHeap::from([Candidate { cosine: 1.0, triangle: seed }]);
        visited[seed as usize] = round;
        let seed_normal = self.normals[seed as usize];
        while let Some(Candidate { triangle, .. }) = waiting.pop() {
            if !accept(triangle, triangle as usize) {
                continue;
            }
            for corner in 0..3 {
                // Surfaces cannot be flattened across an edge with more than two triangles.
                let &[first, second] = self.adjacency.across(triangle, corner) else { continue };
                let neighbour = if first == triangle { second } else { first };
                let index = neighbour as usize;
                if visited[index] != round && self.normals[index] != DVec3::ZERO {
                    visited[index] = round;
                    let cosine = self.normals[index].dot(seed_normal);
                    waiting.push(Candidate { cosine, triangle: neighbour });
                }
            }
        }
    }
}
