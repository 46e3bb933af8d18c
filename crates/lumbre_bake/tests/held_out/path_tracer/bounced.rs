//! Light by bounces on pieces of all surfaces, gathered again and again from one another: what paths are cut short by after their first
//! bounce. Several sets that share no random number, so that their differences tell its error. It is even over a piece, so not exact; paths
//! without it are.

use std::f64::consts::PI;

use glam::DVec3;
use rayon::prelude::*;

use super::super::random::Random;
use super::PathTracer;
use super::hierarchy::Hit;
use super::pieces::{Piece, cut, place_of, sides_of};

pub struct Bounced {
    /// For each triangle its pieces along an edge and the number of its first.
    of_triangle: Vec<(u32, usize)>,
    /// Irradiance by bounces and sky of each piece, by sets.
    sets: Vec<Vec<DVec3>>,
}

/// Independent sets.
pub const SETS: usize = 6;
/// Metres along a piece's edge, about: in the region, and where there is none of it.
const EDGE: f64 = 0.25;
const OUTSIDE: f64 = 1.0;
/// Rays of a piece in each round; rounds that only carry light on, and all.
const RAYS: usize = 12;
const FIRST_ROUNDS: usize = 10;
const ROUNDS: usize = 50;
/// What is nearer than so many offsets of a ray covers a place: about a hundredth of a millimetre.
const COVERED: f64 = 1e3;

/// A mean that grows.
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

impl Bounced {
    pub fn new(tracer: &PathTracer, seed: u64) -> Self {
        let (mut pieces, mut of_triangle) = (Vec::new(), Vec::new());
        for (index, triangle) in tracer.scene.triangles.iter().enumerate() {
            let middle = triangle.point(4.0 / 9.0, 0.5);
            let inside = tracer.region.as_ref().is_none_or(|region| region.holds(middle));
            let sides = sides_of(triangle, if inside { EDGE } else { OUTSIDE });
            of_triangle.push((sides, pieces.len()));
            pieces.extend(cut(index, triangle, sides));
        }
        let mut bounced = Self { of_triangle, sets: Vec::new() };
        let set = |set: u64| bounced.solved(tracer, &pieces, seed ^ ((set + 1) << 40));
        bounced.sets = (0..SETS as u64).into_par_iter().map(set).collect();
        bounced
    }

    /// Of a set, at a point of a triangle.
    pub fn at(&self, tracer: &PathTracer, set: usize, triangle: usize, point: DVec3) -> DVec3 {
        self.sets[set][self.piece(tracer, triangle, point)]
    }

    fn piece(&self, tracer: &PathTracer, triangle: usize, point: DVec3) -> usize {
        let (sides, first) = self.of_triangle[triangle];
        first + place_of(tracer.scene.triangles[triangle].shares(point), sides)
    }

    fn solved(&self, tracer: &PathTracer, pieces: &[Piece], seed: u64) -> Vec<DVec3> {
        let mut random = Random::new(seed);
        let mut bounced = vec![Mean::default(); pieces.len()];
        for round in 0..ROUNDS {
            for (index, piece) in pieces.iter().enumerate() {
                let mut gathered = Mean::default();
                for _ in 0..RAYS {
                    let seen = self.gathered(tracer, piece, &bounced, &mut random);
                    if let Some(seen) = seen {
                        gathered.add(seen);
                    }
                }
                // First rounds carry light on; it is then averaged.
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

    /// What one ray sees, as irradiance; nothing from where something covers the piece.
    fn gathered(
        &self,
        tracer: &PathTracer,
        piece: &Piece,
        bounced: &[Mean],
        random: &mut Random,
    ) -> Option<DVec3> {
        let triangle = &tracer.scene.triangles[piece.triangle];
        let place = triangle.at(piece.shares([random.uniform(), random.uniform()]));
        let origin = place + triangle.normal * tracer.offset;
        // Between a lamp and what it lies against light goes to and fro that nobody sees.
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
        let met = &tracer.scene.triangles[hit.triangle];
        if met.normal.dot(direction) >= 0.0 {
            return Some(DVec3::ZERO);
        }
        let target = origin + direction * hit.distance;
        // Where it ends, not over the whole piece there: part of that may be hidden behind a lamp.
        let direct = tracer.one_direct([target + met.normal * tracer.offset, met.normal], random);
        let seen = direct + bounced[self.piece(tracer, hit.triangle, target)].value();
        Some(weight * met.reflectance * seen)
    }
}
