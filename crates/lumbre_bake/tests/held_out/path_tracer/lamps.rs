//! Direct light from emissive triangles: a few candidates are chosen among pieces near a place, and one of them by the
//! light that it would bring unshadowed (resampled importance sampling: Talbot, Cline and Egbert, 2005), without bias.
//! Punctual lights are in `punctual`.

use glam::{DVec2, DVec3};
use lumbre_scene::Image;

use super::super::random::Random;
use super::choice::{Choice, ChoiceGrid};
use super::hierarchy::{Hierarchy, Triangle};
use super::pieces::{self, Piece};
use super::spherical_triangle;

pub struct Lamps {
    pieces: Vec<Piece>,
    grid: ChoiceGrid,
}

/// The number of pieces along an edge of a triangle with an emissive texture, and the number of points along an edge of
/// a piece by which its power is estimated.
const PIECES: u32 = 64;
const POINTS: u32 = 8;
/// A piece nearer than this multiple of its size is sampled by solid angle.
const NEAR: f64 = 4.0;
/// The largest number of candidates for a shadow ray.
const CANDIDATES: usize = 8;

/// A sampled point on a lamp.
struct Candidate {
    /// The point, moved slightly off the lamp's surface.
    target: DVec3,
    /// Its unshadowed irradiance over the density of the point.
    light: DVec3,
    weight: f64,
}

impl Lamps {
    pub fn new(scene: &Hierarchy) -> Self {
        let mut pieces = Vec::new();
        for (index, triangle) in scene.triangles.iter().enumerate() {
            if triangle.emission == DVec3::ZERO {
                continue;
            }
            let mut parts = cut(index, triangle);
            // The emission between the sampled points is unknown: every piece gets a minimum power, so that none is
            // left out.
            let mean = parts.iter().map(|piece| piece.power).sum::<f64>() / parts.len() as f64;
            parts.iter_mut().for_each(|piece| piece.power += 0.03 * mean);
            pieces.extend(parts.into_iter().filter(|piece| piece.power > 0.0));
        }
        let sources: Vec<_> = pieces.iter().map(|piece| (piece.middle, piece.size, piece.power)).collect();
        Self { grid: ChoiceGrid::new(scene.bounds(), &sources), pieces }
    }

    /// A distribution over all pieces for one point and its normal.
    pub fn choice_for(&self, scene: &Hierarchy, origin: DVec3, normal: DVec3) -> Choice {
        let weight = |piece: &Piece| {
            let towards = piece.middle - origin;
            let squared = towards.length_squared();
            if squared < 9.0 * piece.size * piece.size {
                return piece.power / squared.max(0.01 * piece.size * piece.size);
            }
            let direction = towards / squared.sqrt();
            // The piece's centre may be below the horizon while a part of it is above.
            let cosine = |cosine: f64| cosine.max(0.0) + 0.01 + piece.size / squared.sqrt();
            let emitted = -scene.triangles[piece.triangle].normal.dot(direction);
            piece.power / squared * cosine(normal.dot(direction)) * cosine(emitted)
        };
        Choice::new(self.pieces.iter().map(weight))
    }

    /// The distribution of the grid cell at a point, which is cheaper but less exact.
    pub fn choice_near(&self, origin: DVec3) -> Option<&Choice> {
        self.grid.at(origin)
    }

    /// Estimates the irradiance by one shadow ray.
    pub fn irradiance(
        &self,
        scene: &Hierarchy,
        [origin, normal]: [DVec3; 2],
        choice: &Choice,
        [u, v]: [f64; 2],
        random: &mut Random,
        offset: f64,
    ) -> DVec3 {
        let count = self.pieces.len().min(CANDIDATES);
        let mut candidates: [Option<Candidate>; CANDIDATES] = Default::default();
        let mut sum = 0.0;
        for (index, candidate) in candidates[..count].iter_mut().enumerate() {
            // The candidates are stratified over the distribution.
            let number = (index as f64 + u) / count as f64;
            let v = if index == 0 { v } else { random.uniform() };
            *candidate = self.candidate(scene, [origin, normal], choice, [number, v], offset);
            sum += candidate.as_ref().map_or(0.0, |candidate| candidate.weight);
        }
        let mut remaining = random.uniform() * sum;
        for candidate in candidates.iter().flatten() {
            remaining -= candidate.weight;
            if remaining < 0.0 {
                let arrives = scene.transmission(origin, candidate.target);
                return arrives * candidate.light * (sum / candidate.weight / count as f64);
            }
        }
        DVec3::ZERO
    }

    fn candidate(
        &self,
        scene: &Hierarchy,
        [origin, normal]: [DVec3; 2],
        choice: &Choice,
        [number, v]: [f64; 2],
        offset: f64,
    ) -> Option<Candidate> {
        let (index, probability, u) = choice.pick(number)?;
        let piece = &self.pieces[index];
        let triangle = &scene.triangles[piece.triangle];
        // Near pieces are sampled uniformly by solid angle, so that no point gets a large weight.
        let near = origin.distance_squared(piece.middle) < NEAR * NEAR * piece.size * piece.size;
        let by_solid_angle =
            if near { spherical_triangle::sample(origin, piece.corners(triangle), [u, v]) } else { None };
        let (target, density) = match by_solid_angle {
            Some((direction, angle)) => {
                let ahead = triangle.normal.dot(direction);
                let distance = triangle.normal.dot(triangle.a - origin) / ahead;
                if !(distance > 0.0 && distance.is_finite()) {
                    return None;
                }
                (origin + direction * distance, -ahead / (distance * distance * angle))
            }
            None => (triangle.at(piece.barycentric([u, v])), 1.0 / piece.area),
        };
        let towards = target - origin;
        let squared = towards.length_squared();
        let direction = towards / squared.sqrt();
        let cosines = normal.dot(direction).max(0.0) * (-triangle.normal.dot(direction)).max(0.0);
        if cosines <= 0.0 {
            return None;
        }
        let radiance = emission(triangle, triangle.barycentric(target));
        let light = radiance * (cosines / squared / (density * probability));
        let weight = light.element_sum();
        let target = target + triangle.normal * offset;
        (weight > 0.0).then_some(Candidate { target, light, weight })
    }
}

/// Cuts a triangle into pieces and estimates their power. A triangle without a texture remains one piece.
fn cut(index: usize, triangle: &Triangle) -> Vec<Piece> {
    let divisions = if triangle.picture.is_some() { PIECES } else { 1 };
    let power = |piece: &Piece| {
        if triangle.picture.is_none() {
            return triangle.emission.element_sum() * piece.area;
        }
        let points = (0..POINTS * POINTS).map(|point| {
            let at = [point % POINTS, point / POINTS].map(|i| (f64::from(i) + 0.5) / f64::from(POINTS));
            emission(triangle, piece.barycentric(at))
        });
        points.sum::<DVec3>().element_sum() / f64::from(POINTS * POINTS) * piece.area
    };
    let mut pieces = pieces::cut(index, triangle, divisions);
    pieces.iter_mut().for_each(|piece| piece.power = power(piece));
    pieces
}

/// The emitted radiance at a point of a triangle.
fn emission(triangle: &Triangle, barycentric: DVec2) -> DVec3 {
    let Some((image, [a, b, c])) = &triangle.picture else { return triangle.emission };
    triangle.emission * bilinear(image, *a + (*b - *a) * barycentric.x + (*c - *a) * barycentric.y)
}

/// The linear colour of an sRGB image, filtered bilinearly and clamped at the border.
fn bilinear(image: &Image, at: DVec2) -> DVec3 {
    let size = DVec2::new(f64::from(image.width), f64::from(image.height));
    let at = at * size - 0.5;
    let low = at.floor();
    let f = at - low;
    let read = |dx: f64, dy: f64| {
        let place = (low + DVec2::new(dx, dy)).clamp(DVec2::ZERO, size - 1.0);
        let first = 4 * (place.y as usize * image.width as usize + place.x as usize);
        DVec3::from([0, 1, 2].map(|channel| linear(image.rgba[first + channel])))
    };
    let (top, bottom) = (read(0.0, 0.0).lerp(read(1.0, 0.0), f.x), read(0.0, 1.0).lerp(read(1.0, 1.0), f.x));
    top.lerp(bottom, f.y)
}

/// Decodes an sRGB value (IEC 61966-2-1).
fn linear(value: u8) -> f64 {
    let v = f64::from(value) / 255.0;
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}
