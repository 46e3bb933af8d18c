//! The brightly lit parts of a level's region, whose reflected light is sought there and not met by chance: where the sun falls on the floor.
//! Not lamps. What is far enough from a part gets its light once, by this or by its paths.

use std::f64::consts::PI;

use glam::DVec3;

use super::super::random::Random;
use super::PathTracer;
use super::choice::ChoiceGrid;
use super::pieces::{Piece, cut, place_of, sides_of};

pub struct Bright {
    pieces: Vec<Piece>,
    /// For each triangle its pieces along an edge and the number of its first.
    of_triangle: Vec<(u32, usize)>,
    bright: Vec<bool>,
    near: ChoiceGrid,
    /// By the numbers that the grid knows.
    chosen: Vec<usize>,
}

/// Metres along a piece's edge, about.
const EDGE: f64 = 0.25;
/// The brightest pieces until they have that share of the light that is reflected, or of the area.
const OF_LIGHT: f64 = 0.85;
const OF_AREA: f64 = 0.2;
/// Sizes of a piece that its light has to travel; nearer it is met by chance.
const FAR: f64 = 2.0;
const CANDIDATES: usize = 4;
/// Places in a piece that tell how bright it is.
const PLACES: u64 = 6;

impl Bright {
    /// Of a tracer that has none yet; nothing without a region.
    pub fn new(tracer: &PathTracer) -> Self {
        let scene = &tracer.scene;
        let (mut pieces, mut of_triangle) = (Vec::new(), Vec::new());
        let region = tracer.region.as_ref();
        for (index, triangle) in scene.triangles.iter().enumerate() {
            let sides = sides_of(triangle, EDGE);
            of_triangle.push((sides, pieces.len()));
            pieces.extend(cut(index, triangle, sides));
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
        let mut bright = vec![false; pieces.len()];
        let mut chosen = Vec::new();
        for index in order {
            if so_far[0] > OF_LIGHT * light || so_far[1] > OF_AREA * area {
                break;
            }
            so_far = [so_far[0] + pieces[index].power, so_far[1] + pieces[index].area];
            bright[index] = true;
            chosen.push(index);
        }
        let thing = |&index: &usize| (pieces[index].middle, pieces[index].size, pieces[index].power);
        let things: Vec<_> = chosen.iter().map(thing).collect();
        let near = ChoiceGrid::new(scene.bounds(), &things);
        Self { pieces, of_triangle, bright, near, chosen }
    }

    /// Whether what a point of a triangle reflects of direct light is sought from so far.
    pub fn seeks(&self, tracer: &PathTracer, triangle: usize, point: DVec3, distance: f64) -> bool {
        let (sides, first) = self.of_triangle[triangle];
        let index = first + place_of(tracer.scene.triangles[triangle].shares(point), sides);
        self.bright[index] && distance > FAR * self.pieces[index].size
    }

    /// Irradiance by direct light that these parts reflect once.
    pub fn irradiance(
        &self,
        tracer: &PathTracer,
        [origin, normal]: [DVec3; 2],
        number: f64,
        random: &mut Random,
    ) -> DVec3 {
        let Some(choice) = self.near.at(origin) else { return DVec3::ZERO };
        let mut candidates = [(0usize, DVec3::ZERO, 0.0); CANDIDATES];
        for (index, candidate) in candidates.iter_mut().enumerate() {
            let picked = choice.pick((index as f64 + number) / CANDIDATES as f64);
            let Some((picked, probability, u)) = picked else { continue };
            let piece = &self.pieces[self.chosen[picked]];
            let triangle = &tracer.scene.triangles[piece.triangle];
            let target = triangle.at(piece.shares([u, random.uniform()]));
            let squared = target.distance_squared(origin);
            let direction = (target - origin) / squared.sqrt();
            let cosines = normal.dot(direction).max(0.0) * (-triangle.normal.dot(direction)).max(0.0);
            if cosines > 0.0 && squared.sqrt() > FAR * piece.size {
                // Its density of power times what would arrive, over the density of the point.
                *candidate = (self.chosen[picked], target, piece.power * cosines / squared / probability);
            }
        }
        let sum: f64 = candidates.iter().map(|(.., weight)| weight).sum();
        let mut left = random.uniform() * sum;
        for (index, target, weight) in candidates {
            left -= weight;
            if left < 0.0 {
                let piece = &self.pieces[index];
                let triangle = &tracer.scene.triangles[piece.triangle];
                let place = target + triangle.normal * tracer.offset;
                if tracer.scene.hidden(origin, place) {
                    return DVec3::ZERO;
                }
                let arrives = tracer.one_direct([place, triangle.normal], random);
                let brightness = piece.power / piece.area;
                return triangle.reflectance * arrives * (sum / (CANDIDATES as f64 * brightness * PI));
            }
        }
        DVec3::ZERO
    }
}

impl PathTracer {
    /// What a piece reflects of direct light, about.
    fn reflected_power(&self, piece: &Piece, seed: u64) -> f64 {
        let mut random = Random::new(seed);
        let triangle = &self.scene.triangles[piece.triangle];
        let arrives = |_| {
            let place = triangle.at(piece.shares([random.uniform(), random.uniform()]));
            self.one_direct([place + triangle.normal * self.offset, triangle.normal], &mut random)
        };
        let sum: DVec3 = (0..PLACES).map(arrives).sum();
        (triangle.reflectance * sum).element_sum() / PLACES as f64 * piece.area
    }
}
