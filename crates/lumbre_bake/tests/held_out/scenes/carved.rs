//! Rooms carved out of a solid: the surface of a union of boxes, seen from inside. Walls with a thickness are in
//! `wall`.

use glam::DVec3;
use lumbre_mesh::TriangleMesh;

use super::builder::{Builder, NONE, matt};

/// Adds the surfaces of the carved-out boxes as three objects: all floors, all walls, and all ceilings. Ceilings at the
/// height `open` are left out.
pub fn carve(b: &mut Builder, voids: &[[[f64; 3]; 2]], colors: [[f32; 3]; 3], open: Option<f64>) {
    let grid: [Vec<f64>; 3] = std::array::from_fn(|axis| {
        let mut lines: Vec<f64> = voids.iter().flat_map(|ends| ends.map(|end| end[axis])).collect();
        lines.sort_by(f64::total_cmp);
        lines.dedup();
        lines
    });
    let empty = |cell: [usize; 3]| {
        let middle = |axis: usize| {
            // Before the first and behind the last grid line everything is solid.
            let (at, lines) = (cell[axis], &grid[axis]);
            (at > 0 && at < lines.len()).then(|| (lines[at - 1] + lines[at]) / 2.0)
        };
        let [Some(x), Some(y), Some(z)] = [middle(0), middle(1), middle(2)] else { return false };
        voids.iter().any(|[low, high]| {
            [x, y, z].iter().zip(low.iter().zip(high)).all(|(at, (low, high))| low < at && at < high)
        })
    };
    let mut meshes: [TriangleMesh; 3] = Default::default();
    for axis in 0..3 {
        let (right, up) = ((axis + 1) % 3, (axis + 2) % 3);
        for line in 0..grid[axis].len() {
            for facing in [1.0, -1.0] {
                if axis == 1 && facing < 0.0 && open == Some(grid[1][line]) {
                    continue;
                }
                let shows = |i: usize, j: usize| {
                    let mut cell = [0; 3];
                    (cell[right], cell[up]) = (i, j);
                    let mut at = |depth: usize| {
                        cell[axis] = depth;
                        empty(cell)
                    };
                    let (before, behind) = (at(line), at(line + 1));
                    if facing > 0.0 { behind && !before } else { before && !behind }
                };
                let mesh = match (axis, facing > 0.0) {
                    (1, true) => &mut meshes[0],
                    (1, false) => &mut meshes[2],
                    _ => &mut meshes[1],
                };
                for [i, j, k, l] in rectangles(grid[right].len(), grid[up].len(), shows) {
                    let corner = |i: usize, j: usize| {
                        let mut point = DVec3::ZERO;
                        point[axis] = grid[axis][line];
                        (point[right], point[up]) = (grid[right][i], grid[up][j]);
                        (point * b.scale).as_vec3()
                    };
                    let first = mesh.positions.len() as u32;
                    mesh.positions.extend([corner(i, j), corner(k, j), corner(k, l), corner(i, l)]);
                    mesh.normals.extend([(DVec3::AXES[axis] * facing).as_vec3(); 4]);
                    let order = if facing > 0.0 { [0, 1, 2, 0, 2, 3] } else { [0, 2, 1, 0, 3, 2] };
                    mesh.indices.extend(order.map(|vertex| first + vertex));
                }
            }
        }
    }
    for ((mesh, name), color) in meshes.into_iter().zip(["floor", "walls", "ceiling"]).zip(colors) {
        b.mesh(name, mesh, matt(color, NONE), DVec3::ZERO, 0.0);
    }
}

/// Covers the cells for which `shows` is true (their indices begin at 1) with rectangles, each as long as possible and
/// then as wide as possible. A rectangle is given by its first and last grid lines: column, row, column, row.
fn rectangles(columns: usize, rows: usize, shows: impl Fn(usize, usize) -> bool) -> Vec<[usize; 4]> {
    let mut uncovered: Vec<Vec<bool>> =
        (0..=rows).map(|j| (0..=columns).map(|i| i > 0 && j > 0 && shows(i, j)).collect()).collect();
    let mut rectangles = Vec::new();
    for j in 1..=rows {
        for i in 1..=columns {
            if !uncovered[j][i] {
                continue;
            }
            let end = (i..=columns).find(|&k| !uncovered[j][k]).unwrap_or(columns + 1);
            let whole = |row: &Vec<bool>| row[i..end].iter().all(|&cell| cell);
            let last = (j..=rows).find(|&l| !whole(&uncovered[l])).unwrap_or(rows + 1);
            uncovered[j..last].iter_mut().for_each(|row| row[i..end].fill(false));
            rectangles.push([i - 1, j - 1, end - 1, last - 1]);
        }
    }
    rectangles
}
