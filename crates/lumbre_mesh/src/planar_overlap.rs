//! Tests whether triangles in the plane overlap, for pairs and against a grid of many. Used to keep charts
//! injective; the check by texels is in `uv_validation`.

use glam::DVec2;

/// Relative tolerance for separating lines, for coordinates rounded in f64.
const SLACK: f64 = 1e-12;

/// Returns true if the interiors of two counter-clockwise triangles intersect. Triangles that only share an
/// edge or a corner do not overlap.
pub(crate) fn triangles_overlap(a: &[DVec2; 3], b: &[DVec2; 3]) -> bool {
    !separated_by_an_edge_of(a, b) && !separated_by_an_edge_of(b, a)
}

fn separated_by_an_edge_of(a: &[DVec2; 3], b: &[DVec2; 3]) -> bool {
    (0..3).any(|i| {
        let (start, along) = (a[i], a[(i + 1) % 3] - a[i]);
        b.iter().all(|&point| {
            let to = point - start;
            along.perp_dot(to) <= SLACK * along.length() * to.length()
        })
    })
}

/// The accepted triangles in a uniform grid, so that a new one is compared only with those nearby.
pub(crate) struct OverlapGrid {
    min: DVec2,
    cells_per_unit: DVec2,
    columns: usize,
    rows: usize,
    cells: Vec<Vec<u32>>,
    triangles: Vec<[DVec2; 3]>,
    /// For each triangle, the last candidate it was compared with, so that no pair is tested twice.
    seen: Vec<u32>,
    candidate: u32,
}

impl OverlapGrid {
    /// An empty grid for about `count` triangles within a box.
    pub fn new(min: DVec2, max: DVec2, count: usize) -> Self {
        let size = (max - min).max(DVec2::splat(f64::MIN_POSITIVE));
        // About one cell per triangle, with nearly square cells.
        let cells = count.clamp(1, 1 << 22) as f64;
        let columns = (cells * size.x / size.y).sqrt().clamp(1.0, cells).ceil() as usize;
        let rows = (cells / columns as f64).ceil().max(1.0) as usize;
        Self {
            min,
            cells_per_unit: DVec2::new(columns as f64, rows as f64) / size,
            columns,
            rows,
            cells: vec![Vec::new(); columns * rows],
            triangles: Vec::new(),
            seen: Vec::new(),
            candidate: 0,
        }
    }

    /// Adds a counter-clockwise triangle unless it overlaps one in the grid. Returns true if it was added.
    pub fn insert(&mut self, triangle: [DVec2; 3]) -> bool {
        let cells = self.cells_of(&triangle);
        self.candidate += 1;
        for &cell in &cells {
            for &other in &self.cells[cell] {
                let other = other as usize;
                if self.seen[other] != self.candidate {
                    self.seen[other] = self.candidate;
                    if triangles_overlap(&triangle, &self.triangles[other]) {
                        return false;
                    }
                }
            }
        }
        let index = self.triangles.len() as u32;
        for cell in cells {
            self.cells[cell].push(index);
        }
        self.triangles.push(triangle);
        self.seen.push(0);
        true
    }

    /// The cells that a triangle touches, found row by row, so that a long sliver does not take its whole
    /// bounding box.
    fn cells_of(&self, triangle: &[DVec2; 3]) -> Vec<usize> {
        let local = triangle.map(|point| (point - self.min) * self.cells_per_unit);
        let clamp = |value: f64, count: usize| value.floor().clamp(0.0, (count - 1) as f64) as usize;
        let low = local[0].y.min(local[1].y).min(local[2].y);
        let high = local[0].y.max(local[1].y).max(local[2].y);
        let mut cells = Vec::new();
        for row in clamp(low, self.rows)..=clamp(high, self.rows) {
            // The margin covers the rounding of `local`.
            let margin = 1e-6 * (1.0 + self.rows as f64);
            let (bottom, top) = (row as f64 - margin, row as f64 + 1.0 + margin);
            let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
            for i in 0..3 {
                let (p, q) = (local[i], local[(i + 1) % 3]);
                let (p, q) = if p.y <= q.y { (p, q) } else { (q, p) };
                if q.y < bottom || p.y > top {
                    continue;
                }
                let at = |y: f64| p.x + (q.x - p.x) * ((y - p.y) / (q.y - p.y)).clamp(0.0, 1.0);
                let ends = if q.y > p.y { [at(bottom), at(top)] } else { [p.x, q.x] };
                left = left.min(ends[0]).min(ends[1]);
                right = right.max(ends[0]).max(ends[1]);
            }
            if left <= right {
                let margin = 1e-6 * (1.0 + self.columns as f64);
                let columns = clamp(left - margin, self.columns)..=clamp(right + margin, self.columns);
                cells.extend(columns.map(|column| row * self.columns + column));
            }
        }
        cells
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(points: [(f64, f64); 3]) -> [DVec2; 3] {
        points.map(|(x, y)| DVec2::new(x, y))
    }

    #[test]
    fn touching_is_not_overlapping() {
        let a = triangle([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]);
        let across_the_edge = triangle([(1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]);
        let at_the_corner = triangle([(1.0, 0.0), (2.0, -1.0), (2.0, 1.0)]);
        let inside = triangle([(0.1, 0.1), (0.2, 0.1), (0.1, 0.2)]);
        let crossing = triangle([(-1.0, 0.4), (2.0, 0.4), (2.0, 0.5)]);
        assert!(!triangles_overlap(&a, &across_the_edge));
        assert!(!triangles_overlap(&a, &at_the_corner));
        assert!(triangles_overlap(&a, &inside) && triangles_overlap(&inside, &a));
        assert!(triangles_overlap(&a, &crossing));
        assert!(triangles_overlap(&a, &a));
    }

    #[test]
    fn the_grid_finds_what_brute_force_finds() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as f64 / (1u64 << 24) as f64
        };
        let mut grid = OverlapGrid::new(DVec2::ZERO, DVec2::ONE, 300);
        let mut kept: Vec<[DVec2; 3]> = Vec::new();
        for i in 0..2000 {
            // Slivers across the square, and small triangles.
            let size = if i % 10 == 0 { 1.0 } else { 0.05 };
            let at = DVec2::new(random(), random());
            let mut t = [(); 3].map(|()| (at + size * DVec2::new(random(), random())).min(DVec2::ONE));
            if (t[1] - t[0]).perp_dot(t[2] - t[0]) < 0.0 {
                t.swap(1, 2);
            }
            let free = !kept.iter().any(|k| triangles_overlap(&t, k));
            assert_eq!(grid.insert(t), free);
            if free {
                kept.push(t);
            }
        }
        assert!(kept.len() > 50 && kept.len() < 1900);
    }
}
