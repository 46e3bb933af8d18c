//! Shapes that the mesh crate lacks, surfaces of revolution and arches, and functions that transform and
//! merge meshes.

use std::f64::consts::TAU;

use glam::{DAffine3, DMat3, DVec2, DVec3};
use lumbre_mesh::TriangleMesh;

/// Returns a mesh transformed by an affine map that does not mirror.
pub fn moved(mesh: &TriangleMesh, by: DAffine3) -> TriangleMesh {
    let normals = DMat3::from_cols(
        by.matrix3.y_axis.cross(by.matrix3.z_axis),
        by.matrix3.z_axis.cross(by.matrix3.x_axis),
        by.matrix3.x_axis.cross(by.matrix3.y_axis),
    );
    TriangleMesh {
        positions: mesh.positions.iter().map(|p| by.transform_point3(p.as_dvec3()).as_vec3()).collect(),
        normals: mesh
            .normals
            .iter()
            .map(|n| (normals * n.as_dvec3()).normalize_or_zero().as_vec3())
            .collect(),
        ..mesh.clone()
    }
}

/// Returns a mesh translated by metres.
pub fn at(mesh: &TriangleMesh, x: f64, y: f64, z: f64) -> TriangleMesh {
    moved(mesh, DAffine3::from_translation(DVec3::new(x, y, z)))
}

/// Merges meshes, all of which must have positions, normals and `uv0`.
pub fn together(meshes: impl IntoIterator<Item = TriangleMesh>) -> TriangleMesh {
    let mut whole = TriangleMesh::default();
    for mesh in meshes {
        let first = whole.positions.len() as u32;
        whole.positions.extend(mesh.positions);
        whole.normals.extend(mesh.normals);
        whole.uv0.extend(mesh.uv0);
        whole.indices.extend(mesh.indices.iter().map(|index| first + index));
    }
    whole
}

/// Returns a surface of revolution about the y axis. Each run of `(radius, height)` points, in metres, is
/// smooth, with sharp edges between runs. On the outside, runs go from the bottom up.
pub fn turned(runs: &[&[(f64, f64)]], segments: u32) -> TriangleMesh {
    together(runs.iter().map(|run| turned_run(run, segments)))
}

fn turned_run(run: &[(f64, f64)], segments: u32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let segments = segments.max(3);
    let mut length = 0.0;
    for (index, &(radius, height)) in run.iter().enumerate() {
        let (before, after) = (run[index.saturating_sub(1)], run[(index + 1).min(run.len() - 1)]);
        // Runs go up on the outside, so the outward normal is their direction turned to the right.
        let normal = DVec2::new(after.1 - before.1, before.0 - after.0).normalize_or_zero();
        length += DVec2::new(radius - before.0, height - before.1).length();
        for step in 0..=segments {
            let (sin, cos) = (TAU * f64::from(step % segments) / f64::from(segments)).sin_cos();
            let out = DVec3::new(cos, 0.0, -sin);
            mesh.positions.push((out * radius + DVec3::Y * height).as_vec3() + 0.0);
            mesh.normals.push((out * normal.x + DVec3::Y * normal.y).as_vec3());
            mesh.uv0.push(DVec2::new(f64::from(step) / f64::from(segments), 1.0 - length).as_vec2());
        }
    }
    for row in 0..run.len().saturating_sub(1) as u32 {
        for step in 0..segments {
            let a = row * (segments + 1) + step;
            let (b, c, d) = (a + 1, a + segments + 2, a + segments + 1);
            for triangle in [[a, b, c], [a, c, d]] {
                let [p, q, r] = triangle.map(|vertex| mesh.positions[vertex as usize]);
                if p != q && q != r && r != p {
                    mesh.indices.extend(triangle);
                }
            }
        }
    }
    mesh
}

/// Returns an arch across the x axis: the part of a wall, `thickness` deep in z, between a half ellipse from
/// y = 0, with the half axes `half_width` and `rise`, and the height `top`. Its ends at ±`half_width` are
/// open: walls or legs stand there.
pub fn arch(half_width: f64, rise: f64, top: f64, thickness: f64, segments: u32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let point = |step: u32| {
        let part = f64::from(step) / f64::from(segments);
        // Exact at both ends, so that the arch meets its legs.
        let angle = std::f64::consts::PI * part;
        let x = if step == 0 {
            1.0
        } else if step == segments {
            -1.0
        } else {
            angle.cos()
        };
        let y = if step == 0 || step == segments { 0.0 } else { angle.sin() };
        let normal = DVec2::new(-x * rise, -y * half_width).normalize_or_zero();
        (DVec2::new(x * half_width, y * rise), normal)
    };
    let mut strip = |corner: &dyn Fn(u32, bool) -> (DVec3, DVec3, DVec2)| {
        let first = mesh.positions.len() as u32;
        for step in 0..=segments {
            for second in [false, true] {
                let (position, normal, uv) = corner(step, second);
                mesh.positions.push(position.as_vec3() + 0.0);
                mesh.normals.push(normal.as_vec3());
                mesh.uv0.push(uv.as_vec2());
            }
        }
        for step in 0..segments {
            let [a, b] = [first + 2 * step, first + 2 * step + 1];
            mesh.indices.extend([a, b, a + 2, a + 2, b, b + 2]);
        }
    };
    for (z, facing) in [(0.5 * thickness, DVec3::Z), (-0.5 * thickness, DVec3::NEG_Z)] {
        strip(&|step, second| {
            let (inner, _) = point(step);
            let upper = second == (z > 0.0);
            let position = DVec3::new(inner.x, if upper { top } else { inner.y }, z);
            (position, facing, DVec2::new(position.x, -position.y))
        });
    }
    // The underside.
    strip(&|step, second| {
        let (inner, normal) = point(step);
        let z = if second { 0.5 } else { -0.5 } * thickness;
        let along = f64::from(step) / f64::from(segments) * std::f64::consts::PI * half_width;
        (inner.extend(z), normal.extend(0.0), DVec2::new(along, z))
    });
    // The top.
    strip(&|step, second| {
        let (inner, _) = point(step);
        let z = if second { -0.5 } else { 0.5 } * thickness;
        (DVec3::new(inner.x, top, z), DVec3::Y, DVec2::new(inner.x, z))
    });
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    fn faces_its_normals(mesh: &TriangleMesh) {
        mesh.validate().unwrap();
        assert!(mesh.triangle_count() > 0);
        for triangle in mesh.triangles() {
            let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize].as_dvec3());
            let facing = (b - a).cross(c - a);
            for vertex in triangle {
                let normal = mesh.normals[vertex as usize].as_dvec3();
                assert!((normal.length() - 1.0).abs() < 1e-5);
                assert!(facing.normalize().dot(normal) > 0.5, "{facing} against {normal}");
            }
        }
    }

    #[test]
    fn a_turned_cylinder_encloses_its_volume() {
        let mesh =
            turned(&[&[(0.0, 0.0), (1.0, 0.0)], &[(1.0, 0.0), (1.0, 2.0)], &[(1.0, 2.0), (0.0, 2.0)]], 64);
        faces_its_normals(&mesh);
        let corner = |vertex: u32| mesh.positions[vertex as usize].as_dvec3();
        let volume: f64 =
            mesh.triangles().map(|[a, b, c]| corner(a).dot(corner(b).cross(corner(c))) / 6.0).sum();
        // A prism over a regular 64-gon.
        let expected = 2.0 * 32.0 * (TAU / 64.0).sin();
        assert!((volume - expected).abs() < 1e-5, "{volume} for {expected}");
    }

    #[test]
    fn an_arch_faces_outward() {
        let mesh = arch(1.5, 1.1, 1.3, 0.4, 12);
        faces_its_normals(&mesh);
        let lowest_middle =
            mesh.positions.iter().filter(|p| p.x.abs() < 1e-6).map(|p| p.y).fold(f32::INFINITY, f32::min);
        assert!((lowest_middle - 1.1).abs() < 1e-6);
    }

    #[test]
    fn moving_keeps_normals_upright_under_uneven_scale() {
        let ball = lumbre_mesh::shapes::tetrahedral_sphere(1.0, 4, false);
        let flat = moved(&ball, DAffine3::from_scale(DVec3::new(1.0, 0.25, 1.0)));
        faces_its_normals(&flat);
        assert_eq!(at(&ball, 1.0, 2.0, 3.0).positions[0] - ball.positions[0], glam::Vec3::new(1.0, 2.0, 3.0));
    }
}
