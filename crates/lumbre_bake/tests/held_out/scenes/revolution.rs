//! Smooth surfaces of revolution about the vertical axis, for vases and bulbs.

use std::f64::consts::TAU;

use glam::{DVec3, Vec2};
use lumbre_mesh::TriangleMesh;

/// Builds the surface from a profile, which gives the radius and the height for a parameter between 0 (the lower end)
/// and 1 (the upper). An end with a radius of 0 is closed. The mesh has 2 · segments · rings triangles, minus `segments` for each
/// closed end. It faces outwards where the height grows.
pub fn revolution(profile: impl Fn(f64) -> [f64; 2], segments: u32, rings: u32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for ring in 0..=rings {
        let t = f64::from(ring) / f64::from(rings);
        let [radius, height] = profile(t);
        let [before, after] = [(t - 1e-4).max(0.0), (t + 1e-4).min(1.0)].map(&profile);
        let slope = [after[0] - before[0], after[1] - before[1]];
        for segment in 0..=segments {
            let angle = TAU * f64::from(segment % segments) / f64::from(segments);
            let out = DVec3::new(angle.cos(), 0.0, -angle.sin());
            let normal = (out * slope[1] - DVec3::Y * slope[0]).normalize();
            mesh.positions.push((out * radius + DVec3::Y * height).as_vec3() + 0.0);
            mesh.normals.push(normal.as_vec3());
            mesh.uv0.push(Vec2::new(segment as f32 / segments as f32, t as f32));
        }
    }
    let at = |segment: u32, ring: u32| ring * (segments + 1) + segment;
    for ring in 0..rings {
        for segment in 0..segments {
            let [a, b] = [at(segment, ring), at(segment + 1, ring)];
            let [c, d] = [at(segment + 1, ring + 1), at(segment, ring + 1)];
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
