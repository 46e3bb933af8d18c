//! Emissive triangles as sources: each a polygon of one radiance. A triangle whose emission varies is cut into pieces.
//! Not what they light: that is `direct`.

use std::collections::{BTreeMap, HashMap};

use glam::{DVec3, Vec3};

use crate::disjoint_sets::DisjointSets;
use crate::scene::material::Side;
use crate::scene::mean_of_points::{mean_of_points, pieces};
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
    let mut lamps = DisjointSets::default();
    let mut of_triangle: HashMap<u32, u32> = HashMap::new();
    for emitter in emitters {
        of_triangle.entry(emitter.triangle).or_insert_with(|| {
            let own = scene.triangles[emitter.triangle as usize].corners.map(|corner| {
                // -0 and 0 are one place.
                let key = (corner + Vec3::ZERO).to_array().map(f32::to_bits);
                *corners.entry(key).or_insert_with(|| lamps.push())
            });
            let [a, b, c] = own;
            let both = lamps.join(a, b);
            lamps.join(both, c)
        });
    }
    emitters.iter().map(|emitter| lamps.find(of_triangle[&emitter.triangle])).collect()
}

/// Texels of a texture along an edge of a piece, if that is not more than so many pieces along the edge of a triangle: what is finer
/// is averaged.
const TEXELS: f32 = 2.0;
const MAX_PIECES: u32 = 48;
/// Pieces of all triangles together, beside one each.
const MAX_OF_ALL: f64 = 200_000.0;
/// Points along an edge of a piece over which its radiance is averaged, at most; and of all pieces together.
const MAX_POINTS: u32 = 64;
const MAX_SAMPLES: f64 = (1 << 26) as f64;

/// By how much all have to be coarser than their textures ask for, so that they are not too many.
#[derive(Clone, Copy)]
struct Coarser {
    pieces: f32,
    points: f32,
}

/// How the emission of a triangle is read.
#[derive(Clone, Copy)]
struct Reading {
    /// Texels along the longest edge.
    texels: f32,
    /// Pieces along an edge, and points along the edge of a piece.
    pieces: u32,
    points: u32,
}

impl Reading {
    fn new(surface: &SurfaceMaterial, vertices: [u32; 3], coarser: Coarser) -> Self {
        if !surface.emission_varies() {
            return Self { texels: 0.0, pieces: 1, points: 1 };
        }
        let texels = surface.emission_texels(vertices);
        let pieces = ((texels / (TEXELS * coarser.pieces)).ceil() as u32).clamp(1, MAX_PIECES);
        // Two points for each texel, so that none is left out.
        let points = (2.0 * texels / (pieces as f32 * coarser.points)).ceil() as u32;
        Self { texels, pieces, points: points.clamp(2, MAX_POINTS) }
    }
}

impl Coarser {
    fn of(scene: &BakeScene) -> Self {
        let asked = Self { pieces: 1.0, points: 1.0 };
        let sum = |coarser: Self, of: fn(Reading) -> f64| -> f64 {
            let lit = scene
                .triangles
                .iter()
                .filter(|triangle| !triangle.is_hidden_duplicate && !scene.stop.is_cancelled());
            let of_triangle = |triangle: &SceneTriangle| {
                let surface = &scene.surfaces[triangle.surface as usize];
                match surface.material.front.emission == Vec3::ZERO && surface.material.back.is_none() {
                    true => 0.0,
                    false => of(Reading::new(surface, triangle.vertices, coarser)),
                }
            };
            lit.map(of_triangle).sum()
        };
        let pieces = sum(asked, |reading| f64::from(reading.pieces).powi(2) - 1.0);
        let pieces = (pieces / MAX_OF_ALL).sqrt().max(1.0) as f32;
        let points =
            sum(Self { pieces, ..asked }, |reading| f64::from(reading.pieces * reading.points).powi(2));
        Self { pieces, points: (points / MAX_SAMPLES).sqrt().max(1.0) as f32 }
    }
}

/// What is read more coarsely than textures are, in words.
pub(crate) fn coarse_textures(scene: &BakeScene) -> Vec<String> {
    let coarser = Coarser::of(scene);
    // Of each object the triangle with the largest pieces.
    let mut worst: BTreeMap<u32, Reading> = BTreeMap::new();
    let across = |reading: &Reading| reading.texels / reading.pieces as f32;
    for triangle in scene.triangles.iter().filter(|triangle| !triangle.is_hidden_duplicate) {
        let surface = &scene.surfaces[triangle.surface as usize];
        let sides = [Some(&surface.material.front), surface.material.back.as_ref()];
        if sides.into_iter().flatten().any(|side| side.emission != Vec3::ZERO) {
            let reading = Reading::new(surface, triangle.vertices, coarser);
            let own = worst.entry(triangle.object).or_insert(reading);
            if across(&reading) > across(own) {
                *own = reading;
            }
        }
    }
    let is_coarse = |reading: &Reading| across(reading) > TEXELS * 1.001;
    let words = |(object, reading): (u32, Reading)| {
        let (across, points) = (across(&reading), reading.points);
        let name = &scene.names[object as usize];
        let mut words = format!(
            "{name}: its emissive texture has {:.0} texels along a triangle; it lights as {} pieces along there, each of one radiance, the \
             mean of {across:.0} texels along its edge",
            reading.texels, reading.pieces
        );
        if across > points as f32 {
            words.push_str(&format!(" by {points} points: what is smaller may be missed"));
        }
        words
    };
    worst.into_iter().filter(|(_, reading)| is_coarse(reading)).map(words).collect()
}

/// All emissive triangles.
pub(crate) fn emitters(scene: &BakeScene) -> Vec<Emitter> {
    let mut found = Vec::new();
    let coarser = Coarser::of(scene);
    for (index, triangle) in scene.triangles.iter().enumerate().filter(|(_, t)| !t.is_hidden_duplicate) {
        let surface = &scene.surfaces[triangle.surface as usize];
        for side in [Side::Front, Side::Back] {
            if scene.stop.is_cancelled() {
                return found;
            }
            if side == Side::Back && !triangle.two_sided {
                continue;
            }
            let Reading { pieces: count, points, .. } = Reading::new(surface, triangle.vertices, coarser);
            pieces(count, |[p, q, r]| {
                if scene.stop.is_cancelled() {
                    return;
                }
                let radiance = mean_of_points(points, |(a, b)| {
                    let u = p.0 + (q.0 - p.0) * a + (r.0 - p.0) * b;
                    let v = p.1 + (q.1 - p.1) * a + (r.1 - p.1) * b;
                    surface.emission(side, triangle.vertices, [1.0 - u - v, u, v])
                });
                if radiance == Vec3::ZERO {
                    return;
                }
                let mut corners = [p, q, r].map(|(u, v)| triangle.position(u, v));
                if side == Side::Back {
                    corners.swap(1, 2);
                }
                found.push(Emitter {
                    corners,
                    corners_f64: corners.map(|corner| corner.as_dvec3()),
                    normal: triangle.side_normal(side),
                    area: triangle.area / (count * count) as f32,
                    radiance,
                    triangle: index as u32,
                    side,
                });
            });
        }
    }
    found
}
