//! A cache of indirect irradiance on pieces of all surfaces, which the pieces gather from one another in many rounds.
//! Paths that use it end after a few bounces. There are several sets that share no random numbers, so that their
//! differences give the standard error. All points read the same sets, so that their errors are not independent: behind
//! a grille (`grille_0`) all of them are too bright or too dark by one to two per cent together. The cached light is constant over
//! a piece and therefore slightly biased; paths without it are not.

use std::f64::consts::PI;

use glam::DVec3;
use rayon::prelude::*;

use super::super::random::Random;
use super::PathTracer;
use super::hierarchy::Hit;
use super::pieces::{Piece, cut, divisions, index_at};

pub struct IndirectCache {
    /// For each triangle, the number of its pieces along an edge and the index of its first piece.
    triangle_pieces: Vec<(u32, usize)>,
    /// For each set, the irradiance of each piece by bounces and from the sky.
    sets: Vec<Vec<DVec3>>,
}

/// The number of independent sets.
pub const SETS: usize = 6;
/// The approximate length of a piece's edge in metres, inside and outside the region.
const EDGE: f64 = 0.1;
const EDGE_OUTSIDE: f64 = 1.0;
/// The rays of a piece in each round.
const RAYS: usize = 12;
/// The rounds that only propagate light and whose results are not averaged.
const FIRST_ROUNDS: usize = 10;
/// The number of all rounds.
const ROUNDS: usize = 50;
/// A surface nearer to a point than this multiple of a ray's offset covers it: about a hundredth of a millimetre.
const COVERED: f64 = 1e3;

/// A running mean.
#[derive(Clone, Copy, Default)]
struct Mean {
    sum: DVec3,
    count: f64,
}

impl Mean {
    fn value(&self) -> DVec3 {
        if self.count > 0.0 { self.sum / self.count } else { DVec3::ZERO }
    }

    fn add(&mut self, value: DVec3) {
        self.sum += value;
        self.count += 1.0;
    }
}

impl IndirectCache {
    pub fn new(tracer: &PathTracer, seed: u64) -> Self {
        let (mut pieces, mut triangle_pieces) = (Vec::new(), Vec::new());
        for (index, triangle) in tracer.scene.triangles.iter().enumerate() {
            let middle = triangle.point(4.0 / 9.0, 0.5);
            let inside = tracer.region.as_ref().is_none_or(|region| region.holds(middle));
            let sides = divisions(triangle, if inside { EDGE } else { EDGE_OUTSIDE });
            triangle_pieces.push((sides, pieces.len()));
            pieces.extend(cut(index, triangle, sides));
        }
        let mut cache = Self { triangle_pieces, sets: Vec::new() };
        let set = |set: u64| cache.solved_set(tracer, &pieces, seed ^ ((set + 1) << 40));
        cache.sets = (0..SETS as u64).into_par_iter().map(set).collect();
        cache
    }

    /// The indirect irradiance of a set at a point of a triangle.
    pub fn at(&self, tracer: &PathTracer, set: usize, triangle: usize, point: DVec3) -> DVec3 {
        self.sets[set][self.piece(tracer, triangle, point)]
    }

    fn piece(&self, tracer: &PathTracer, triangle: usize, point: DVec3) -> usize {
        let (sides, first) = self.triangle_pieces[triangle];
        first + index_at(tracer.scene.triangles[triangle].barycentric(point), sides)
    }

    /// Computes the irradiance of all pieces for one set.
    fn solved_set(&self, tracer: &PathTracer, pieces: &[Piece], seed: u64) -> Vec<DVec3> {
        let mut random = Random::new(seed);
        let mut bounced = vec![Mean::default(); pieces.len()];
        for round in 0..ROUNDS {
            for (index, piece) in pieces.iter().enumerate() {
                let mut gathered = Mean::default();
                for _ in 0..RAYS {
                    let sample = self.sample(tracer, piece, &bounced, &mut random);
                    if let Some(sample) = sample {
                        gathered.add(sample);
                    }
                }
                // The first rounds only propagate light; the later ones are averaged.
                if round <= FIRST_ROUNDS {
                    bounced[index] = gathered;
                } else {
                    bounced[index].sum += gathered.sum;
                    bounced[index].count += gathered.count;
                }
            }
        }
        bounced.iter().map(Mean::value).collect()
    }

    /// One sample of the piece's indirect irradiance; `None` if the sampled point of the piece is covered.
    fn sample(
        &self,
        tracer: &PathTracer,
        piece: &Piece,
        bounced: &[Mean],
        random: &mut Random,
    ) -> Option<DVec3> {
        let triangle = &tracer.scene.triangles[piece.triangle];
        let place = triangle.at(piece.barycentric([random.uniform(), random.uniform()]));
        let origin = place + triangle.normal * tracer.offset;
        // Light that bounces in the gap between a lamp and the surface that it lies against is invisible and must not
        // leak out.
        let above = tracer.scene.closest(origin, triangle.normal);
        let covers = |hit: &Hit| {
            hit.distance < COVERED * tracer.offset
                || tracer.scene.triangles[hit.triangle].normal.dot(triangle.normal) >= 0.0
        };
        if above.as_ref().is_some_and(covers) {
            return None;
        }
        let chosen = tracer.directions.choose(origin, triangle.normal, random.uniform(), random.uniform());
        let Some((direction, weight)) = chosen else { return Some(DVec3::ZERO) };
        let Some(hit) = tracer.scene.closest(origin, direction) else {
            return Some(PI * weight * tracer.sky);
        };
        let hit_triangle = &tracer.scene.triangles[hit.triangle];
        if hit_triangle.normal.dot(direction) >= 0.0 {
            return Some(DVec3::ZERO);
        }
        let target = origin + direction * hit.distance;
        // The direct light is that of the hit point, not a mean over the piece there: a part of that may be hidden by a
        // lamp.
        let direct = tracer.direct_light_by_one_ray(
            [target + hit_triangle.normal * tracer.offset, hit_triangle.normal],
            random,
        );
        let irradiance = direct + bounced[self.piece(tracer, hit.triangle, target)].value();
        Some(weight * hit_triangle.reflectance * irradiance)
    }
}
