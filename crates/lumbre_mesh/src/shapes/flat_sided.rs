//! The plane and the box. Curved shapes are in `revolution` and `sphere`.

use glam::{DVec3, Vec3};

use crate::TriangleMesh;
use crate::grid::{GridVertex, MAX_SEGMENTS};

/// A rectangle in the xz plane that faces +y: `width` along x and `depth` along z in metres, with `columns`
/// by `rows` quads (1 to [`MAX_SEGMENTS`]).
pub fn plane(width: f32, depth: f32, columns: u32, rows: u32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let size = [DVec3::X * f64::from(width), DVec3::NEG_Z * f64::from(depth)];
    push_rectangle(&mut mesh, DVec3::ZERO, size, DVec3::Y, columns, rows);
    mesh
}

/// A box with side lengths `size` in metres. Each face has `divisions` by `divisions` quads (1 to 256) and
/// covers the whole texture.
pub fn cuboid(size: Vec3, divisions: u32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let size = size.as_dvec3();
    for (right, up) in [
        (DVec3::NEG_Z, DVec3::Y),
        (DVec3::Z, DVec3::Y),
        (DVec3::X, DVec3::NEG_Z),
        (DVec3::X, DVec3::Z),
        (DVec3::X, DVec3::Y),
        (DVec3::NEG_X, DVec3::Y),
    ] {
        let normal = right.cross(up);
        let divisions = divisions.clamp(1, 256);
        push_rectangle(
            &mut mesh,
            normal * size * 0.5,
            [right * size, up * size],
            normal,
            divisions,
            divisions,
        );
    }
    mesh
}

/// Appends a rectangle around `centre`; `size` holds its two side vectors (right, up).
fn push_rectangle(
    mesh: &mut TriangleMesh,
    centre: DVec3,
    size: [DVec3; 2],
    normal: DVec3,
    columns: u32,
    rows: u32,
) {
    let (columns, rows) = (columns.clamp(1, MAX_SEGMENTS), rows.clamp(1, MAX_SEGMENTS));
    mesh.push_grid(columns, rows, |column, row| {
        let (s, t) = (f64::from(column) / f64::from(columns), f64::from(row) / f64::from(rows));
        GridVertex { position: centre + size[0] * (s - 0.5) + size[1] * (t - 0.5), normal, uv0: [s, 1.0 - t] }
    });
}
