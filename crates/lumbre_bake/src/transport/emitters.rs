//! Emissive triangles as sources: each a polygon of one radiance. A triangle whose emission varies is cut into pieces.
//! Not what they light: that is `direct`.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use crate::scene::material::Side;
use crate::scene::{BakeScene, SceneTriangle, SurfaceMaterial};

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

impl Emitter {
    /// Its centroid.
    pub fn middle(&self) -> Vec3 {
        let [a, b, c] = self.corners;
        (a + b + c) / 3.0
    }
}

/// For each emitter the number of its lamp: triangles that share a corner, bit by bit, hang together.
pub(crate) fn lamps(scene: &BakeScene, emitters: &[Emitter]) -> Vec<u32> {
    let mut corners: HashMap<[u32; 3], u32> = HashMap::new();
    let mut parent: Vec<u32> = Vec::new();
    let mut of_triangle: HashMap<u32, u32> = HashMap::new();
    for emitter in emitters {
        of_triangle.entry(emitter.triangle).or_insert_with(|| {
            let own = scene.triangles[emitter.triangle as usize].corners.map(|corner| {
                // -0 and 0 are one place.
                let key = (corner + Vec3::ZERO).to_array().map(f32::to_bits);
                *corners.entry(key).or_insert_with(|| {
                    parent.push(parent.len() as u32);
                    parent.len() as u32 - 1
                })
            });
            let roots = own.map(|corner| find(&mut parent, corner));
            let least = roots[0].min(roots[1]).min(roots[2]);
            for root in roots {
                parent[root as usize] = least;
            }
            least
        });
    }
    emitters.iter().map(|emitter| find(&mut parent, of_triangle[&emitter.triangle])).collect()
}

fn find(parent: &mut [u32], mut at: u32) -> u32 {
    while parent[at as usize] != at {
        parent[at as usize] = parent[parent[at as usize] as usize];
        at = parent[at as usize];
    }
    at
}

/// Texels of a texture along an edge of a piece, if that is not more than so many pieces along the edge of a triangle: what is finer
/// is averaged.
const TEXELS: f32 = 2.0;
const MOST_PIECES: u32 = 48;
/// Pieces of all triangles together, beside one each.
const MOST_OF_ALL: f64 = 200_000.0;
/// Points along an edge of a piece over which its radiance is averaged, at most.
const MOST_POINTS: u32 = 16;

/// Pieces along an edge of a triangle, and points along the edge of a piece. `coarser` than its texture asks for by so much.
fn pieces(surface: &SurfaceMaterial, vertices: [u32; 3], coarser: f32) -> (u32, u32) {
    if !surface.emission_varies() {
        return (1, 1);
    }
    let texels = surface.emission_texels(vertices);
    let pieces = ((texels / (TEXELS * coarser)).ceil() as u32).clamp(1, MOST_PIECES);
    // Two points for each texel, so that none is left out.
    let points = ((2.0 * texels / pieces as f32).ceil() as u32).clamp(2, MOST_POINTS);
    (pieces, points)
}

/// By how much all have to be coarser than their textures ask for, so that they are not too many.
fn coarseness(scene: &BakeScene) -> f32 {
    let lit = scene.triangles.iter().filter(|triangle| !triangle.superseded);
    let of = |triangle: &SceneTriangle| {
        let surface = &scene.surfaces[triangle.surface as usize];
        match surface.material.front.emission == Vec3::ZERO && surface.material.back.is_none() {
            true => 0.0,
            false => f64::from(pieces(surface, triangle.vertices, 1.0).0).powi(2) - 1.0,
        }
    };
    (lit.map(of).sum::<f64>() / MOST_OF_ALL).sqrt().max(1.0) as f32
}

/// All emissive triangles.
pub(crate) fn emitters(scene: &BakeScene) -> Vec<Emitter> {
    let mut found = Vec::new();
    let coarser = coarseness(scene);
    for (index, triangle) in scene.triangles.iter().enumerate().filter(|(_, t)| !t.superseded) {
        let surface = &scene.surfaces[triangle.surface as usize];
        for side in [Side::Front, Side::Back] {
            if side == Side::Back && !triangle.two_sided {
                continue;
            }
            let (pieces, points) = pieces(surface, triangle.vertices, coarser);
            for [p, q, r] in cut(pieces) {
                let radiance = mean_of_points(points, |(a, b)| {
                    let u = p.0 + (q.0 - p.0) * a + (r.0 - p.0) * b;
                    let v = p.1 + (q.1 - p.1) * a + (r.1 - p.1) * b;
                    surface.emission(side, triangle.vertices, [1.0 - u - v, u, v])
                });
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

/// Mean over the middles of n² pieces of a triangle, by weights of its second and third corner.
fn mean_of_points(n: u32, value: impl Fn((f32, f32)) -> Vec3) -> Vec3 {
    if n == 1 {
        return value((1.0 / 3.0, 1.0 / 3.0));
    }
    let middles = cut(n).into_iter().map(|[p, q, r]| ((p.0 + q.0 + r.0) / 3.0, (p.1 + q.1 + r.1) / 3.0));
    middles.map(value).sum::<Vec3>() / (n * n) as f32
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
