//! The cells that a triangle is divided into: n² equal ones, so that the cell at a ray's hit is found by arithmetic. Cells
//! that other surfaces stand on or pass through are cut further along those contact lines; `bsp` finds the piece at a
//! point. What a cell or a piece reflects is in `patches`.

use glam::{DMat2, DVec2};

use super::bsp::{BspTrees, CutCell};
use crate::scene::mean_of_points::SubTriangle;
use crate::scene::{BakeScene, SceneTriangle};
use crate::visibility::PlaneFrame;
use crate::visibility::contacts::contacts;

/// The corners of a cell, or a piece of one, in barycentric weights of its own.
pub(crate) const CORNERS: SubTriangle = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)];

/// The cells of a triangle, and how contact lines cut some of them.
pub(crate) struct TriangleCells {
    /// Cells along each edge.
    pub divisions: u32,
    /// The numbers of the cells that are cut, ascending, and their pieces.
    pub cut: Vec<(u32, CutCell)>,
}

impl TriangleCells {
    /// Adds the trees of cut cells to `trees`.
    pub fn new(scene: &BakeScene, index: usize, side: f32, trees: &mut BspTrees) -> Self {
        let divisions = divisions(&scene.triangles[index], side);
        Self { divisions, cut: cut_cells(scene, index, divisions, side, trees) }
    }

    /// Number of cells, cut or not.
    pub fn count(&self) -> u32 {
        self.divisions * self.divisions
    }

    /// Number of patches on one side of the triangle.
    pub fn patches_per_side(&self) -> u64 {
        u64::from(self.divisions).pow(2) + self.added_by_cuts()
    }

    /// How many of these there are because cells are cut.
    pub fn added_by_cuts(&self) -> u64 {
        self.cut.iter().map(|(_, cut)| u64::from(cut.count - 1)).sum()
    }
}

/// The area of a cell that is as large as a patch of this side may be.
pub(crate) fn cell_area(side: f32) -> f32 {
    0.5 * side * side
}

/// The length of a triangle's longest edge, canonical units.
pub(crate) fn longest_edge(triangle: &SceneTriangle) -> f32 {
    let [a, b, c] = triangle.corners;
    a.distance(b).max(b.distance(c)).max(c.distance(a))
}

/// Cells along each edge of a triangle.
fn divisions(triangle: &SceneTriangle, side: f32) -> u32 {
    let longest = longest_edge(triangle);
    // As many as its area calls for; a sliver gets more, until its cells are at most four sides long.
    let by_area = (triangle.area / cell_area(side)).sqrt();
    by_area.max(longest / (4.0 * side)).ceil().clamp(1.0, 1024.0) as u32
}

/// Cells are cut only if their area is at least this share of that of a patch of the requested size.
const MIN_CUT_CELL: f32 = 0.125;

/// Whether the cells of a triangle are large enough to be cut.
pub(crate) fn may_be_cut(triangle: &SceneTriangle, divisions: u32, side: f32) -> bool {
    triangle.area >= MIN_CUT_CELL * cell_area(side) * (divisions * divisions) as f32
}

/// Cuts the cells of a triangle along the contact lines of what stands on it; returns the cells that were cut,
/// ascending.
fn cut_cells(
    scene: &BakeScene,
    index: usize,
    divisions: u32,
    side: f32,
    trees: &mut BspTrees,
) -> Vec<(u32, CutCell)> {
    let triangle = &scene.triangles[index];
    let cells = divisions * divisions;
    if !may_be_cut(triangle, divisions, side) {
        return Vec::new();
    }
    let frame = PlaneFrame::new(triangle);
    let segments: Vec<[DVec2; 2]> =
        contacts(scene, index as u32, &frame, side).into_iter().map(|contact| contact.line).collect();
    let [a, b, c] = triangle.corners.map(|corner| frame.flat(corner.as_dvec3()));
    let weights = DMat2::from_cols(b - a, c - a).inverse();
    if segments.is_empty() || !weights.is_finite() {
        return Vec::new();
    }
    // Pairs of a cell and a segment that may cross it.
    let mut crossed: Vec<(u32, u32)> = Vec::new();
    for (number, segment) in segments.iter().enumerate() {
        cells_along(divisions, segment.map(|p| weights * (p - a)), |cell| {
            crossed.push((cell, number as u32))
        });
    }
    crossed.sort_unstable();
    // The slots after those of the cells are for the pieces that cutting adds.
    let mut free_slot = cells;
    crossed
        .chunk_by(|x, y| x.0 == y.0)
        .filter_map(|crossings| {
            let cell = crossings[0].0;
            let corners = CORNERS.map(|(u, v)| {
                let (u, v) = point_of_cell(divisions, cell, u, v);
                a + (b - a) * f64::from(u) + (c - a) * f64::from(v)
            });
            let segments: Vec<[DVec2; 2]> =
                crossings.iter().map(|&(_, number)| segments[number as usize]).collect();
            let cut = trees.cut(corners, &segments, weights, (cell, free_slot))?;
            free_slot += cut.count - 1;
            Some((cell, cut))
        })
        .collect()
}

/// Calls `visit` for every cell that a segment, given in barycentric weights, may cross.
fn cells_along(divisions: u32, [p, q]: [DVec2; 2], mut visit: impl FnMut(u32)) {
    let n = f64::from(divisions);
    let (p, q) = if p.x <= q.x { (p * n, q * n) } else { (q * n, p * n) };
    let row = |x: f64| (x.max(0.0) as u32).min(divisions - 1);
    for a in row(p.x)..=row(q.x) {
        let [from, to] = [f64::from(a), f64::from(a + 1)].map(|x| {
            let along = if q.x > p.x { ((x - p.x) / (q.x - p.x)).clamp(0.0, 1.0) } else { 0.0 };
            p.y + (q.y - p.y) * along
        });
        let (from, to) = if q.x > p.x { (from.min(to), from.max(to)) } else { (p.y.min(q.y), p.y.max(q.y)) };
        let last = divisions - 1 - a;
        for b in (from.max(0.0) as u32).min(last)..=(to.max(0.0) as u32).min(last) {
            let cell = a * (2 * divisions - a) + 2 * b;
            visit(cell);
            if b < last {
                visit(cell + 1);
            }
        }
    }
}

/// The number of the cell at a point. Row `a` holds 2(n - a) - 1 cells, so the rows before it hold a(2n - a).
pub(crate) fn cell_at(divisions: u32, u: f32, v: f32) -> u32 {
    let n = divisions as f32;
    let (x, y) = (u.clamp(0.0, 1.0) * n, v.clamp(0.0, 1.0) * n);
    let a = (x as u32).min(divisions - 1);
    let b = (y as u32).min(divisions - 1 - a);
    let beyond = (x - a as f32) + (y - b as f32) > 1.0 && b + a + 1 < divisions;
    a * (2 * divisions - a) + 2 * b + u32::from(beyond)
}

/// The row of a cell, and the cell's place in it.
pub(crate) fn row_of_cell(divisions: u32, cell: u32) -> (u32, u32) {
    let n = f64::from(divisions);
    // The largest a with a(2n - a) <= cell.
    let mut a = (n - (n * n - f64::from(cell)).max(0.0).sqrt()) as u32;
    while a > 0 && a * (2 * divisions - a) > cell {
        a -= 1;
    }
    while (a + 1) * (2 * divisions - a - 1) <= cell && a + 1 < divisions {
        a += 1;
    }
    (a, cell - a * (2 * divisions - a))
}

/// Converts barycentric weights in a cell to those in its triangle.
fn point_of_cell(divisions: u32, cell: u32, u: f32, v: f32) -> (f32, f32) {
    let (row, place) = row_of_cell(divisions, cell);
    point_in_row(divisions, row, place, u, v)
}

/// As [`point_of_cell`], for the cell at a place of row `a`.
pub(crate) fn point_in_row(divisions: u32, a: u32, place: u32, u: f32, v: f32) -> (f32, f32) {
    let b = place / 2;
    let (x, y) = if place.is_multiple_of(2) {
        (a as f32 + u, b as f32 + v)
    } else {
        // The upside-down cell between (a+1, b), (a+1, b+1) and (a, b+1).
        (a as f32 + 1.0 - u, b as f32 + 1.0 - v)
    };
    (x / divisions as f32, y / divisions as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_in_a_cell_is_found_in_that_cell() {
        for divisions in [1, 2, 3, 7, 64] {
            for cell in 0..divisions * divisions {
                for at in [(1.0 / 3.0, 1.0 / 3.0), (0.1, 0.1), (0.8, 0.1), (0.1, 0.8)] {
                    let (u, v) = point_of_cell(divisions, cell, at.0, at.1);
                    assert!(u >= 0.0 && v >= 0.0 && u + v <= 1.0 + 1e-6);
                    assert_eq!(cell_at(divisions, u, v), cell, "{divisions} {cell} {at:?}");
                }
            }
        }
    }

    #[test]
    fn corners_and_edges_belong_to_a_cell() {
        for divisions in [1, 2, 5] {
            for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (1.0, 1.0)] {
                assert!(cell_at(divisions, u, v) < divisions * divisions);
            }
        }
    }
}
