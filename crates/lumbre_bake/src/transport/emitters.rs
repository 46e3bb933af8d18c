//! Emissive triangles as sources: each a polygon of one radiance. A triangle whose emission varies is cut into pieces.
//! Not what they light: that is `direct`.

use glam::{DVec3, Vec3};

use crate::scene::BakeScene;
use crate::scene::material::Side;

/// A triangle of one radiance.
#[derive(Clone, Debug)]
pub(crate) struct Emitter {
    /// Counter-clockwise seen from where it shines to.
    pub corners: [Vec3; 3],
    pub corners_f64: [DVec3; 3],
    /// Unit, to where it shines.
    pub normal: Vec3,
    /// Square canonical units.
    pub area: f32,
    /// W/(m² sr).
    pub radiance: Vec3,
    /// Triangle of the scene.
    pub triangle: u32,
    pub side: Side,
}

/// Pieces along an edge of a triangle whose emission varies.
const PIECES: u32 = 8;

/// All emissive triangles.
pub(crate) fn emitters(scene: &BakeScene) -> Vec<Emitter> {
    let mut found = Vec::new();
    for (index, triangle) in scene.triangles.iter().enumerate().filter(|(_, t)| !t.superseded) {
        let surface = &scene.surfaces[triangle.surface as usize];
        for side in [Side::Front, Side::Back] {
            if side == Side::Back && !triangle.two_sided {
                continue;
            }
            let pieces = if surface.emission_varies() { PIECES } else { 1 };
            for [p, q, r] in cut(pieces) {
                let middle = [(p.0 + q.0 + r.0) / 3.0, (p.1 + q.1 + r.1) / 3.0];
                let weights = [1.0 - middle[0] - middle[1], middle[0], middle[1]];
                let radiance = surface.emission(side, triangle.vertices, weights);
                if radiance == Vec3::ZERO {
                    continue;
                }
                let mut corners = [p, q, r].map(|(u, v)| triangle.position(u, v));
                if side == Side::Back {
                    corners.swap(1, 2);
                }
                found.push(Emitter {
                    corners,
                    corners_f64: corners.map(|corner| corner.as_dvec3()),
                    normal: triangle.side_normal(side),
                    area: triangle.area / (pieces * pieces) as f32,
                    radiance,
                    triangle: index as u32,
                    side,
                });
            }
        }
    }
    found
}

/// Barycentric corners of the pieces.
fn cut(n: u32) -> Vec<[(f32, f32); 3]> {
    let at = |a: u32, b: u32| (a as f32 / n as f32, b as f32 / n as f32);
    let mut pieces = Vec::with_capacity((n * n) as usize);
    for a in 0..n {
        for b in 0..n - a {
            pieces.push([at(a, b), at(a + 1, b), at(a, b + 1)]);
            if a + b + 1 < n {
                pieces.push([at(a + 1, b), at(a + 1, b + 1), at(a, b + 1)]);
            }
        }
    }
    pieces
}
