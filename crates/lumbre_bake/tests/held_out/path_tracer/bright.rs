//! The brightly lit pieces of surfaces in a level's region, for example where the sun falls on the floor. The light
//! that they reflect is sampled explicitly, like that of lamps, since few paths would hit them by chance. A point
//! receives the light of a piece either in this way, if it is far enough from the piece, or by its paths. Lamps are in
//! `lamps`.

use std::f64::consts::PI;

use glam::DVec3;

use super::super::random::Random;
use super::PathTracer;
use super::choice::ChoiceGrid;
use super::pieces::{Piece, cut, divisions, index_at};

pub struct BrightPieces {
    pieces: Vec<Piece>,
    /// For each triangle, the number of its pieces along an edge and the index of its first piece.
    triangle_pieces: Vec<(u32, usize)>,
    /// Whether a piece is one of the bright ones.
    is_bright: Vec<bool>,
    grid: ChoiceGrid,
    /// The bright pieces, in the order of the grid's entries.
    chosen: Vec<usize>,
}

/// The approximate length of a piece's edge, m.
const EDGE: f64 = 0.25;
/// The brightest pieces are chosen until they have this share of the reflected light or this share of the area.
const LIGHT_SHARE: f64 = 0.85;
const AREA_SHARE: f64 = 0.2;
/// A piece is sampled explicitly only from distances greater than this multiple of its size. Nearer points receive its
/// light by paths.
const FAR: f64 = 2.0;
/// The number of candidates from which one is chosen by resampled importance sampling.
const CANDIDATES: usize = 4;
/// The number of points in a piece by which its brightness is estimated.
const PLACES: u64 = 6;

impl BrightPieces {
    /// Finds the bright pieces by means of a tracer that has none yet. Without a region there are none.
    pub fn new(tracer: &PathTracer) -> Self {
        let scene = &tracer.scene;
        let (mut pieces, mut triangle_pieces) = (Vec::new(), Vec::new());
        let region = tracer.region.as_ref();
        for (index, triangle) in scene.triangles.iter().enumerate() {
            let divisions_per_edge = divisions(triangle, EDGE);
            triangle_pieces.push((divisions_per_edge, pieces.len()));
            pieces.extend(cut(index, triangle, divisions_per_edge));
        }
        for (index, piece) in pieces.iter_mut().enumerate() {
            if region.is_some_and(|region| region.holds(piece.middle)) {
                piece.power = tracer.reflected_power(piece, index as u64);
            }
        }
        let mut order: Vec<usize> = (0..pieces.len()).filter(|&index| pieces[index].power > 0.0).collect();
        let density = |index: usize| pieces[index].power / pieces[index].area;
        order.sort_by(|&a, &b| density(b).total_cmp(&density(a)));
        let sum = |of: &dyn Fn(&Piece) -> f64| order.iter().map(|&index| of(&pieces[index])).sum::<f64>();
        let (light, area) = (sum(&|piece| piece.power), sum(&|piece| piece.area));
        let mut so_far = [0.0; 2];
        let mut is_bright = vec![false; pieces.len()];
        let mut chosen = Vec::new();
        for index in order {
            if so_far[0] > LIGHT_SHARE * light || so_far[1] > AREA_SHARE * area {
                break;
            }
            so_far = [so_far[0] + pieces[index].power, so_far[1] + pieces[index].area];
            is_bright[index] = true;
            chosen.push(index);
        }
        let weighted_piece = |&index: &usize| (pieces[index].middle, pieces[index].size, pieces[index].power);
        let weighted_pieces: Vec<_> = chosen.iter().map(weighted_piece).collect();
        let grid = ChoiceGrid::new(scene.bounds(), &weighted_pieces);
        Self { pieces, triangle_pieces, is_bright, grid, chosen }
    }

    /// Whether the direct light that a point of a triangle reflects is sampled explicitly from this distance.
    pub fn samples(&self, tracer: &PathTracer, triangle: usize, point: DVec3, distance: f64) -> bool {
        let (divisions_per_edge, first) = self.triangle_pieces[triangle];
        let index = first + index_at(tracer.scene.triangles[triangle].barycentric(point), divisions_per_edge);
        self.is_bright[index] && distance > FAR * self.pieces[index].size
    }

    /// Estimates the irradiance at a point by direct light that the bright pieces reflect once.
    pub fn irradiance(
        &self,
        tracer: &PathTracer,
        [origin, normal]: [DVec3; 2],
        number: f64,
        random: &mut Random,
    ) -> DVec3 {
        let Some(choice) = self.grid.at(origin) else { return DVec3::ZERO };
        let mut candidates = [(0usize, DVec3::ZERO, 0.0); CANDIDATES];
        for (index, candidate) in candidates.iter_mut().enumerate() {
            let picked = choice.pick((index as f64 + number) / CANDIDATES as f64);
            let Some((picked, probability, u)) = picked else { continue };
            let piece = &self.pieces[self.chosen[picked]];
            let triangle = &tracer.scene.triangles[piece.triangle];
            let target = triangle.at(piece.barycentric([u, random.uniform()]));
            let squared = target.distance_squared(origin);
            let direction = (target - origin) / squared.sqrt();
            let cosines = normal.dot(direction).max(0.0) * (-triangle.normal.dot(direction)).max(0.0);
            if cosines > 0.0 && squared.sqrt() > FAR * piece.size {
                // The target function, power times unshadowed geometry term, over the probability of the candidate.
                *candidate = (self.chosen[picked], target, piece.power * cosines / squared / probability);
            }
        }
        let sum: f64 = candidates.iter().map(|(.., weight)| weight).sum();
        let mut remaining = random.uniform() * sum;
        for (index, target, weight) in candidates {
            remaining -= weight;
            if remaining < 0.0 {
                let piece = &self.pieces[index];
                let triangle = &tracer.scene.triangles[piece.triangle];
                let place = target + triangle.normal * tracer.offset;
                if tracer.scene.hidden(origin, place) {
                    return DVec3::ZERO;
                }
                let arrives = tracer.direct_light_by_one_ray([place, triangle.normal], random);
                let brightness = piece.power / piece.area;
                return triangle.reflectance * arrives * (sum / (CANDIDATES as f64 * brightness * PI));
            }
        }
        DVec3::ZERO
    }
}

impl PathTracer {
    /// Estimates the direct light that a piece reflects.
    fn reflected_power(&self, piece: &Piece, seed: u64) -> f64 {
        let mut random = Random::new(seed);
        let triangle = &self.scene.triangles[piece.triangle];
        let arrives = |_| {
            let place = triangle.at(piece.barycentric([random.uniform(), random.uniform()]));
            self.direct_light_by_one_ray(
                [place + triangle.normal * self.offset, triangle.normal],
                &mut random,
            )
        };
        let sum: DVec3 = (0..PLACES).map(arrives).sum();
        (triangle.reflectance * sum).element_sum() / PLACES as f64 * piece.area
    }
}
