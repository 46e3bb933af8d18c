//! Surfaces of revolution about the y axis: sphere by rings, cylinder, cone, torus. Not the recursive sphere.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::{GridVertex, MAX_SEGMENTS};
use crate::TriangleMesh;

/// Direction at a step around the y axis, from +x towards -z; the last step is exactly the first.
fn around(step: u32, steps: u32) -> DVec3 {
    let (sin, cos) = (TAU * f64::from(step % steps) / f64::from(steps)).sin_cos();
    DVec3::new(cos, 0.0, -sin)
}

fn fraction(step: u32, steps: u32) -> f64 {
    f64::from(step) / f64::from(steps)
}

/// A sphere of meridians and parallels: `segments` (3 to [`MAX_SEGMENTS`]) around, `rings` (2 to
/// [`MAX_SEGMENTS`]) from pole to pole: 2 segments (rings - 1) triangles over segments (rings - 1) + 2 points.
///
/// 33 segments and 16 rings make the sphere of 990 triangles and 497 points on which Gouraud and Phong shading
/// are compared in the literature.
pub fn uv_sphere(radius: f32, segments: u32, rings: u32) -> TriangleMesh {
    let (segments, rings) = (segments.clamp(3, MAX_SEGMENTS), rings.clamp(2, MAX_SEGMENTS));
    let mut mesh = TriangleMesh::default();
    mesh.push_grid(segments, rings, |column, row| {
        // From the south pole up; the poles themselves are exact.
        let (sin, cos) = (PI * fraction(row, rings)).sin_cos();
        let normal = match row {
            0 => DVec3::NEG_Y,
            _ if row == rings => DVec3::Y,
            _ => around(column, segments) * sin - DVec3::Y * cos,
        };
        // A pole has no longitude: its vertex takes the middle of the one triangle that uses it.
        let middle = match row {
            0 => 0.5,
            _ if row == rings => -0.5,
            _ => 0.0,
        };
        let u = (f64::from(column) + middle).max(0.0) / f64::from(segments);
        GridVertex { position: normal * f64::from(radius), normal, uv0: [u, 1.0 - fraction(row, rings)] }
    });
    mesh.without_unused_vertices()
}

/// A closed cylinder; `segments` (3 to [`MAX_SEGMENTS`]) around. Its side's normals are radial, its caps' axial.
pub fn cylinder(radius: f32, height: f32, segments: u32) -> TriangleMesh {
    let segments = segments.clamp(3, MAX_SEGMENTS);
    let (radius, half) = (f64::from(radius), f64::from(height) * 0.5);
    let mut mesh = TriangleMesh::default();
    mesh.push_grid(segments, 1, |column, row| {
        let normal = around(column, segments);
        let y = if row == 0 { -half } else { half };
        let uv0 = [fraction(column, segments), f64::from(1 - row)];
        GridVertex { position: normal * radius + DVec3::Y * y, normal, uv0 }
    });
    push_cap(&mut mesh, radius, half, segments);
    push_cap(&mut mesh, radius, -half, segments);
    mesh
}

/// A closed cone, base below and apex above. The apex has one normal per segment, that of the segment's middle.
pub fn cone(radius: f32, height: f32, segments: u32) -> TriangleMesh {
    let segments = segments.clamp(3, MAX_SEGMENTS);
    let (radius, height) = (f64::from(radius), f64::from(height));
    let half = height * 0.5;
    let mut mesh = TriangleMesh::default();
    mesh.push_grid(segments, 1, |column, row| {
        let out = around(column, segments);
        // At the apex of column c's triangle: halfway between columns c - 1 and c.
        let facing = if row == 0 { out } else { around(2 * column + 2 * segments - 1, 2 * segments) };
        let position = if row == 0 { out * radius - DVec3::Y * half } else { DVec3::Y * half };
        let normal = (facing * height + DVec3::Y * radius).normalize_or(DVec3::Y);
        let u = if row == 0 { f64::from(column) } else { (f64::from(column) - 0.5).max(0.0) };
        GridVertex { position, normal, uv0: [u / f64::from(segments), f64::from(1 - row)] }
    });
    push_cap(&mut mesh, radius, -half, segments);
    mesh.without_unused_vertices()
}

/// A torus about the y axis: the tube's centre runs at `major_radius`, the tube has `minor_radius`;
/// `segments` around the axis and `sides` around the tube (3 to [`MAX_SEGMENTS`] each).
pub fn torus(major_radius: f32, minor_radius: f32, segments: u32, sides: u32) -> TriangleMesh {
    let (segments, sides) = (segments.clamp(3, MAX_SEGMENTS), sides.clamp(3, MAX_SEGMENTS));
    let (major, minor) = (f64::from(major_radius), f64::from(minor_radius));
    let mut mesh = TriangleMesh::default();
    mesh.push_grid(segments, sides, |column, row| {
        let out = around(column, segments);
        let (sin, cos) = (TAU * f64::from(row % sides) / f64::from(sides)).sin_cos();
        let normal = out * cos + DVec3::Y * sin;
        let uv0 = [fraction(column, segments), 1.0 - fraction(row, sides)];
        GridVertex { position: out * major + normal * minor, normal, uv0 }
    });
    mesh
}

/// A disc at a height, facing away from the origin.
fn push_cap(mesh: &mut TriangleMesh, radius: f64, y: f64, segments: u32) {
    let first = mesh.positions.len() as u32;
    let normal = DVec3::Y * if y < 0.0 { -1.0 } else { 1.0 };
    for step in 0..=segments {
        // The last vertex is the centre.
        let out = if step < segments { around(step, segments) } else { DVec3::ZERO };
        mesh.positions.push((out * radius + DVec3::Y * y).as_vec3() + 0.0);
        mesh.normals.push(normal.as_vec3());
        mesh.uv0.push((DVec2::new(out.x, out.z * normal.y) * 0.5 + 0.5).as_vec2());
    }
    for step in 0..segments {
        let (a, b) = (first + step, first + (step + 1) % segments);
        let (a, b) = if y < 0.0 { (b, a) } else { (a, b) };
        mesh.indices.extend([first + segments, a, b]);
    }
}
