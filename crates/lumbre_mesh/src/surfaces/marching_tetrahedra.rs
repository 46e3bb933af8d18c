//! Meshes implicit surfaces within a box: a grid of cubes, six tetrahedra each, in which the surface is cut by
//! planes (Doi and Koide 1991). Parametric surfaces are meshed in `mesher`.

use std::collections::HashMap;

use glam::DVec3;

use super::{ImplicitSurface, SurfaceError, implicit_normal};
use crate::TriangleMesh;

/// Largest number of cells along the longest side of the box.
pub const MAX_CELLS: u32 = 256;

/// Halvings of an edge until the surface's crossing is found to the last bit.
const HALVINGS: u32 = 54;

/// The corners of the six tetrahedra of a cube around its diagonal, as bits: 1 for x, 2 for y, 4 for z. The
/// faces of neighbouring cubes are divided alike, so that the mesh has no cracks.
const TETRAHEDRA: [[usize; 4]; 6] =
    [[0, 1, 3, 7], [0, 1, 5, 7], [0, 2, 3, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 4, 6, 7]];

/// Meshes the part of an implicit surface inside a box, in metres, with `cells` cubic cells along its longest side
/// (1 to [`MAX_CELLS`]). Vertices lie on the surface, with its gradient as their normal (zero where it has
/// none), and those of the rim lie in the sides of the box. Fronts are where the function is positive.
///
/// The distance from the surface falls with the square of the cells' size. Parts that are thinner than a cell are
/// missed.
///
/// # Errors
/// [`SurfaceError::Grid`] for a number of cells out of range, [`SurfaceError::NotFinite`] for a box without a
/// finite size.
pub fn implicit_mesh<S: ImplicitSurface + ?Sized>(
    surface: &S,
    [low, high]: [DVec3; 2],
    cells: u32,
) -> Result<TriangleMesh, SurfaceError> {
    if !(1..=MAX_CELLS).contains(&cells) {
        return Err(SurfaceError::Grid { columns: cells, rows: cells, largest: MAX_CELLS });
    }
    let size = high - low;
    if !(size.is_finite() && size.min_element() > 0.0) {
        return Err(SurfaceError::NotFinite { place: size });
    }
    let step = size.max_element() / f64::from(cells);
    let counts = (size / step).map(|count| count.ceil().clamp(1.0, f64::from(cells))).as_usizevec3();
    let stride = [1, counts.x + 1, (counts.x + 1) * (counts.y + 1)];
    let point = |index: usize| {
        let along = |axis: usize| index / stride[axis] % (counts[axis] + 1);
        // The last point of an axis is on the side of the box exactly.
        let at = |axis: usize| match along(axis) == counts[axis] {
            true => high[axis],
            false => low[axis] + size[axis] * along(axis) as f64 / counts[axis] as f64,
        };
        DVec3::new(at(0), at(1), at(2))
    };
    let values: Vec<f64> = (0..stride[2] * (counts.z + 1)).map(|index| surface.value(point(index))).collect();
    let mut made = Crossings { surface, mesh: TriangleMesh::default(), known: HashMap::new() };
    for (z, y, x) in (0..counts.z)
        .flat_map(|z| (0..counts.y).map(move |y| (z, y)))
        .flat_map(|(z, y)| (0..counts.x).map(move |x| (z, y, x)))
    {
        let first = x * stride[0] + y * stride[1] + z * stride[2];
        for corners in TETRAHEDRA {
            let corners = corners.map(|corner| {
                first + (0..3).filter(|axis| corner >> axis & 1 == 1).map(|axis| stride[axis]).sum::<usize>()
            });
            let (inside, outside): (Vec<usize>, Vec<usize>) =
                corners.iter().partition(|&&corner| values[corner] < 0.0);
            let mut edge = |a: usize, b: usize| made.vertex([a, b], &point);
            match (&inside[..], &outside[..]) {
                (&[own], &[a, b, c]) | (&[a, b, c], &[own]) => {
                    let corners = [edge(own, a), edge(own, b), edge(own, c)];
                    made.push(corners);
                }
                (&[a, b], &[c, d]) => {
                    let [p, q, r, s] = [edge(a, c), edge(a, d), edge(b, d), edge(b, c)];
                    made.push([p, q, r]);
                    made.push([p, r, s]);
                }
                _ => {}
            }
        }
    }
    Ok(made.mesh)
}

/// The mesh while it is made, and the vertex of each edge of the grid that crosses the surface.
struct Crossings<'a, S: ?Sized> {
    surface: &'a S,
    mesh: TriangleMesh,
    known: HashMap<[usize; 2], u32>,
}

impl<S: ImplicitSurface + ?Sized> Crossings<'_, S> {
    /// Returns the vertex where the surface crosses an edge.
    fn vertex(&mut self, mut edge: [usize; 2], point: &impl Fn(usize) -> DVec3) -> u32 {
        edge.sort_unstable();
        if let Some(&known) = self.known.get(&edge) {
            return known;
        }
        let [mut a, mut b] = edge.map(point);
        let starts_inside = self.surface.value(a) < 0.0;
        for _ in 0..HALVINGS {
            let middle = 0.5 * (a + b);
            if (self.surface.value(middle) < 0.0) == starts_inside { a = middle } else { b = middle }
        }
        let normal = implicit_normal(self.surface, b).unwrap_or(DVec3::ZERO);
        let number = self.mesh.positions.len() as u32;
        self.mesh.positions.push(b.as_vec3() + 0.0);
        self.mesh.normals.push(normal.as_vec3());
        self.known.insert(edge, number);
        number
    }

    /// Adds a triangle with its front towards the normals of its corners, unless two corners coincide.
    fn push(&mut self, [a, b, c]: [u32; 3]) {
        let [p, q, r] = [a, b, c].map(|vertex| self.mesh.positions[vertex as usize].as_dvec3());
        if p == q || q == r || r == p {
            return;
        }
        let normal: DVec3 =
            [a, b, c].iter().map(|&vertex| self.mesh.normals[vertex as usize].as_dvec3()).sum();
        let turned = (q - p).cross(r - p).dot(normal) < 0.0;
        self.mesh.indices.extend(if turned { [a, c, b] } else { [a, b, c] });
    }
}
