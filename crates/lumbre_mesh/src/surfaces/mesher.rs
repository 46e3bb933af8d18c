//! Meshes parametric surfaces with a grid over their parameters. Implicit surfaces
//! are meshed in `marching_tetrahedra`.

use glam::{DVec2, DVec3};

use super::{ParametricSurface, SurfaceError};
use crate::TriangleMesh;
use crate::grid::{GridVertex, MAX_SEGMENTS};

/// Meshes a parametric surface with `columns` cells along u and `rows` along v, two triangles each. Normals
/// are the surface's own, and (u, v) are the texture coordinates: u to the right, v upwards.
///
/// Positions on both sides of a seam of a closed parameter are bitwise equal. Triangles that degenerate at a
/// pole are left out. A pole has one vertex per column, with the texture coordinate of the column's middle.
/// Where the surface has no normal, a pole's vertex takes the normal of the column's middle just inside (e.g.
/// at a cone's apex), and any other vertex gets zero.
///
/// # Errors
/// [`SurfaceError::Grid`] for 0 or more than [`MAX_SEGMENTS`] cells; [`SurfaceError::NotFinite`] if a point
/// is not finite or does not fit into f32.
pub fn parametric_mesh<S>(surface: &S, columns: u32, rows: u32) -> Result<TriangleMesh, SurfaceError>
where
    S: ParametricSurface + ?Sized,
{
    let count = 1..=MAX_SEGMENTS;
    if !(count.contains(&columns) && count.contains(&rows)) {
        return Err(SurfaceError::Grid { columns, rows, largest: MAX_SEGMENTS });
    }
    let mut mesh = TriangleMesh::default();
    push_surface(&mut mesh, surface, columns, rows);
    match mesh.positions.iter().find(|position| !position.is_finite()) {
        Some(place) => Err(SurfaceError::NotFinite { place: place.as_dvec3() }),
        None => Ok(mesh),
    }
}

/// As [`parametric_mesh`], but appends to a mesh, requires counts in range, and does not check for finite
/// points.
pub(crate) fn push_surface<S>(mesh: &mut TriangleMesh, surface: &S, columns: u32, rows: u32)
where
    S: ParametricSurface + ?Sized,
{
    let [low, high] = surface.domain();
    let closed = surface.closed();
    // The last step of a closed parameter equals its first exactly, and that of an open one the end of the
    // domain.
    let parameter = |axis: usize, step: f64, steps: u32| {
        let steps = f64::from(steps);
        let step = if closed[axis] { step % steps } else { step };
        if step == steps { high[axis] } else { low[axis] + (high[axis] - low[axis]) * step / steps }
    };
    let u = |step: f64| parameter(0, step, columns);
    let v = |step: f64| parameter(1, step, rows);
    let point = |column: u32, row: u32| surface.point(u(column.into()), v(row.into()));
    let is_pole = |row: u32| {
        let first = point(0, row).as_vec3();
        !closed[1] && (1..=columns).all(|column| point(column, row).as_vec3() == first)
    };
    let poles = [is_pole(0), is_pole(rows)];
    let vertex = |column: u32, row: u32| {
        // The only triangle that uses a pole's vertex is in the cell to its right in the first row, and to
        // its left in the last.
        let middle = match row {
            0 if poles[0] => 0.5,
            _ if row == rows && poles[1] => -0.5,
            _ => 0.0,
        };
        let step = (f64::from(column) + middle).max(0.0);
        let normal = surface.normal(u(step), v(row.into())).or_else(|error| {
            let inside = if row == 0 { INSIDE } else { f64::from(rows) - INSIDE };
            if middle == 0.0 { Err(error) } else { surface.normal(u(step), v(inside)) }
        });
        let uv0 = DVec2::new(step / f64::from(columns), 1.0 - f64::from(row) / f64::from(rows));
        GridVertex {
            position: point(column, row),
            normal: normal.unwrap_or(DVec3::ZERO),
            uv0: uv0.to_array(),
        }
    };
    let mut grid = TriangleMesh::default();
    grid.push_grid(columns, rows, vertex);
    mesh.append(if poles == [false; 2] { grid } else { grid.without_unused_vertices() });
}

/// Distance from a pole, as a fraction of a row, at which the normal of a column's middle is taken.
const INSIDE: f64 = 1e-6;
