//! Emissive triangles as light sources, each of uniform radiance. A triangle whose emission varies is divided into
//! pieces. Their light is computed in `area_light` and `shared_samples`.

use std::collections::{BTreeMap, HashMap};

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::disjoint_sets::DisjointSets;
use crate::scene::mean_of_points::{SubTriangle, mean_of_points, pieces};
use crate::scene::{BakeScene, LitTexels, SceneTriangle, Side, SurfaceMaterial, position_bits};
use crate::texel_index::MapIndex;

/// A triangle of uniform radiance.
#[derive(Clone, Debug)]
pub(crate) struct Emitter {
    /// Counter-clockwise seen from the side that emits.
    pub corners: [Vec3; 3],
    pub corners_f64: [DVec3; 3],
    /// Unit normal of the side that emits.
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

/// For each emitter the number of its lamp. A lamp is a connected set of emissive triangles: they are connected if they
/// share a corner, bit for bit.
pub(crate) fn lamps(scene: &BakeScene, emitters: &[Emitter]) -> Vec<u32> {
    let mut corners: HashMap<[u32; 3], u32> = HashMap::new();
    let mut lamps = DisjointSets::default();
    let mut of_triangle: HashMap<u32, u32> = HashMap::new();
    for emitter in emitters {
        of_triangle.entry(emitter.triangle).or_insert_with(|| {
            let [a, b, c] = scene.triangles[emitter.triangle as usize]
                .corners
                .map(|corner| *corners.entry(position_bits(corner)).or_insert_with(|| lamps.push()));
            let both = lamps.join(a, b);
            lamps.join(both, c)
        });
    }
    emitters.iter().map(|emitter| lamps.find(of_triangle[&emitter.triangle])).collect()
}

/// Texels along an edge of a piece that the division of a triangle aims at; finer detail is averaged.
const TEXELS: f32 = 2.0;
/// Most pieces along an edge of a triangle.
const MAX_PIECES: u32 = 48;
/// Most pieces of all triangles together, not counting one for each triangle.
const MAX_TOTAL_PIECES: f64 = 200_000.0;
/// Most points along an edge of a piece over which its radiance is averaged.
const MAX_POINTS: u32 = 64;
/// Most such points of all pieces together.
const MAX_TOTAL_POINTS: f64 = (1 << 26) as f64;

/// Factors by which all triangles are divided and sampled more coarsely than their textures require, to stay within the
/// limits on the totals.
#[derive(Clone, Copy)]
struct Coarsening {
    pieces: f32,
    points: f32,
}

/// How the emission of a triangle is divided and sampled.
#[derive(Clone, Copy)]
struct EmissionSampling {
    /// Texels along the longest edge.
    texels: f32,
    /// Pieces along an edge.
    pieces: u32,
    /// Points along an edge of a piece.
    points: u32,
}

impl EmissionSampling {
    fn new(surface: &SurfaceMaterial, vertices: [u32; 3], coarsening: Coarsening) -> Self {
        if !surface.emission_varies() {
            return Self { texels: 0.0, pieces: 1, points: 1 };
        }
        let texels = surface.emission_texels(vertices);
        let pieces = ((texels / (TEXELS * coarsening.pieces)).ceil() as u32).clamp(1, MAX_PIECES);
        // Two points per texel, so that no texel is missed.
        let points = (2.0 * texels / (pieces as f32 * coarsening.points)).ceil() as u32;
        Self { texels, pieces, points: points.clamp(2, MAX_POINTS) }
    }
}

impl Coarsening {
    fn of(scene: &BakeScene) -> Self {
        let none = Self { pieces: 1.0, points: 1.0 };
        let sum = |coarsening: Self, count: fn(EmissionSampling) -> f64| -> f64 {
            let triangles = scene
                .triangles
                .iter()
                .filter(|triangle| !triangle.is_hidden_duplicate && !scene.stop.is_cancelled());
            let of_triangle = |triangle: &SceneTriangle| {
                let surface = &scene.surfaces[triangle.surface as usize];
                match surface.material.front.emission == Vec3::ZERO && surface.material.back.is_none() {
                    true => 0.0,
                    false => count(EmissionSampling::new(surface, triangle.vertices, coarsening)),
                }
            };
            triangles.map(of_triangle).sum()
        };
        let pieces = sum(none, |sampling| f64::from(sampling.pieces).powi(2) - 1.0);
        let pieces = (pieces / MAX_TOTAL_PIECES).sqrt().max(1.0) as f32;
        let points =
            sum(Self { pieces, ..none }, |sampling| f64::from(sampling.pieces * sampling.points).powi(2));
        Self { pieces, points: (points / MAX_TOTAL_POINTS).sqrt().max(1.0) as f32 }
    }
}

/// Warnings about the objects whose emissive textures are divided more coarsely than [`TEXELS`] aims at.
pub(crate) fn coarse_textures(scene: &BakeScene) -> Vec<String> {
    let coarsening = Coarsening::of(scene);
    // For each object, the triangle whose pieces span the most texels.
    let mut worst: BTreeMap<MapIndex, EmissionSampling> = BTreeMap::new();
    let across = |sampling: &EmissionSampling| sampling.texels / sampling.pieces as f32;
    for triangle in scene.triangles.iter().filter(|triangle| !triangle.is_hidden_duplicate) {
        let surface = &scene.surfaces[triangle.surface as usize];
        let sides = [Some(&surface.material.front), surface.material.back.as_ref()];
        if sides.into_iter().flatten().any(|side| side.emission != Vec3::ZERO) {
            let sampling = EmissionSampling::new(surface, triangle.vertices, coarsening);
            let object_worst = worst.entry(triangle.map).or_insert(sampling);
            if across(&sampling) > across(object_worst) {
                *object_worst = sampling;
            }
        }
    }
    let is_coarse = |sampling: &EmissionSampling| across(sampling) > TEXELS * 1.001;
    let warning = |(map, sampling): (MapIndex, EmissionSampling)| {
        let (across, points) = (across(&sampling), sampling.points);
        let name = &scene.names[map.place()];
        let mut warning = format!(
            "{name}: its emissive texture has {:.0} texels along a triangle; it lights as {} pieces along there, each of one radiance, the \
             mean of {across:.0} texels along its edge",
            sampling.texels, sampling.pieces
        );
        if across > points as f32 {
            warning.push_str(&format!(" by {points} points: what is smaller may be missed"));
        }
        warning
    };
    worst.into_iter().filter(|(_, sampling)| is_coarse(sampling)).map(warning).collect()
}

/// The emitters of the scene, in the order of its triangles.
pub(crate) fn emitters(scene: &BakeScene) -> Vec<Emitter> {
    let (coarsening, lit) = (Coarsening::of(scene), LitTexels::of(&scene.surfaces));
    let of_triangle = |index: usize| {
        let triangle = &scene.triangles[index];
        let mut emitters = Vec::new();
        if !triangle.is_hidden_duplicate {
            add_emitters(scene, index, Side::Front, (coarsening, &lit), &mut emitters);
        }
        if !triangle.is_hidden_duplicate && triangle.two_sided {
            add_emitters(scene, index, Side::Back, (coarsening, &lit), &mut emitters);
        }
        emitters
    };
    (0..scene.triangles.len()).into_par_iter().flat_map_iter(of_triangle).collect()
}

/// Adds the emitters of a side of a triangle.
fn add_emitters(
    scene: &BakeScene,
    index: usize,
    side: Side,
    (coarsening, lit): (Coarsening, &LitTexels),
    emitters: &mut Vec<Emitter>,
) {
    let triangle = &scene.triangles[index];
    let surface = &scene.surfaces[triangle.surface as usize];
    let may_shine =
        |piece: SubTriangle| !scene.stop.is_cancelled() && lit.may_shine(surface, triangle.vertices, piece);
    if !may_shine([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]) {
        return;
    }
    let EmissionSampling { pieces: count, points, .. } =
        EmissionSampling::new(surface, triangle.vertices, coarsening);
    pieces(count, |piece| {
        if scene.stop.is_cancelled() || !may_shine(piece) {
            return;
        }
        let [p, q, r] = piece;
        let radiance = mean_of_points(points, |(a, b)| {
            let u = p.0 + (q.0 - p.0) * a + (r.0 - p.0) * b;
            let v = p.1 + (q.1 - p.1) * a + (r.1 - p.1) * b;
            surface.emission(side, triangle.vertices, [1.0 - u - v, u, v])
        });
        if radiance == Vec3::ZERO {
            return;
        }
        let mut corners = piece.map(|(u, v)| triangle.position(u, v));
        if side == Side::Back {
            corners.swap(1, 2);
        }
        emitters.push(Emitter {
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
