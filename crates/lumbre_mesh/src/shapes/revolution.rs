//! Surfaces of revolution about the y axis: sphere, cylinder, cone and torus. The subdivided sphere is in
//! `sphere`.

use glam::{DVec2, DVec3};

use super::MAX_SEGMENTS;
use crate::TriangleMesh;
use crate::surfaces::{Cone, Cylinder, ParametricSurface, Sphere, Torus, push_surface};

/// A sphere of meridians and parallels: `segments` (3 to [`MAX_SEGMENTS`]) around the axis and `rings` (2 to
/// [`MAX_SEGMENTS`]) from pole to pole. It has 2 segments (rings - 1) triangles and segments (rings - 1) + 2
/// points.
///
/// With 33 segments and 16 rings this is the sphere of 990 triangles and 497 points on which document \[M\]
/// compares the three shadings (table 1.1).
pub fn uv_sphere(radius: f32, segments: u32, rings: u32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let rings = rings.clamp(2, MAX_SEGMENTS);
    push_surface(&mut mesh, &Sphere { radius: radius.into() }, in_range(segments), rings);
    mesh
}

/// A closed cylinder with `segments` (3 to [`MAX_SEGMENTS`]) around the axis. Normals are radial on the side
/// and axial on the caps.
pub fn cylinder(radius: f32, height: f32, segments: u32) -> TriangleMesh {
    let side = Cylinder { radius: radius.into(), height: height.into() };
    let segments = in_range(segments);
    let mut mesh = TriangleMesh::default();
    push_surface(&mut mesh, &side, segments, 1);
    push_cap(&mut mesh, side.radius, 0.5 * side.height, segments);
    push_cap(&mut mesh, side.radius, -0.5 * side.height, segments);
    mesh
}

/// A closed cone with its base below and its apex above. The apex has one normal per segment, that of the
/// segment's middle.
pub fn cone(radius: f32, height: f32, segments: u32) -> TriangleMesh {
    let side = Cone { radius: radius.into(), height: height.into() };
    let segments = in_range(segments);
    let mut mesh = TriangleMesh::default();
    push_surface(&mut mesh, &side, segments, 1);
    push_cap(&mut mesh, side.radius, -0.5 * side.height, segments);
    mesh
}

/// A disc about the y axis at height `y` that faces away from the origin, with `segments` (3 to [`MAX_SEGMENTS`])
/// along its rim.
pub fn disc(radius: f32, y: f32, segments: u32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    push_cap(&mut mesh, radius.into(), y.into(), in_range(segments));
    mesh
}

/// A torus about the y axis: the centre of the tube is at `major_radius` from the axis, the tube has the
/// radius `minor_radius`, and there are `segments` around the axis and `sides` around the tube (3 to
/// [`MAX_SEGMENTS`] each).
pub fn torus(major_radius: f32, minor_radius: f32, segments: u32, sides: u32) -> TriangleMesh {
    let torus = Torus { major_radius: major_radius.into(), minor_radius: minor_radius.into() };
    let mut mesh = TriangleMesh::default();
    push_surface(&mut mesh, &torus, in_range(segments), in_range(sides));
    mesh
}

fn in_range(segments: u32) -> u32 {
    segments.clamp(3, MAX_SEGMENTS)
}

/// Appends a disc at height `y` that faces away from the origin.
fn push_cap(mesh: &mut TriangleMesh, radius: f64, y: f64, segments: u32) {
    let first = mesh.positions.len() as u32;
    let normal = DVec3::Y * if y < 0.0 { -1.0 } else { 1.0 };
    // The rim is bitwise equal to that of a side with the same radius.
    let rim = Cylinder { radius: 1.0, height: 0.0 };
    for step in 0..=segments {
        // The last vertex is the centre.
        let angle = rim.domain()[1].x * f64::from(step) / f64::from(segments);
        let out = if step < segments { rim.point(angle, 0.0) } else { DVec3::ZERO };
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
