//! Chooses the points at which a level's converged irradiance is computed: uniform by area on visible surfaces, most of
//! them in the level's region. Also tests whether a point is near an edge of the direct light.

use glam::DVec3;

use super::super::random::Random;
use super::directions::cosine;
use super::{Effort, Irradiance, PathTracer};

/// The least share of a level's points that lie in its region.
const INSIDE: f64 = 0.85;
/// The distance, in metres, over which an edge of the direct light is looked for: the size of a texel.
const TEXEL: f64 = 0.025;
/// Faces nearer to one another than this share of the scene's size touch: single precision leaves gaps between them.
const TOUCHING: f64 = 1e-7;
/// A change of the direct light over a texel that is more than this share of all light at the point counts as an edge.
const EDGE: f64 = 0.05;

impl PathTracer {
    /// Chooses points uniformly by area on visible surfaces and computes the irradiance there.
    pub fn points(&self, count: usize, effort: Effort, seed: u64) -> Vec<Irradiance> {
        let mut random = Random::new(seed);
        let inside = (self.share_inside() * count as f64).round() as usize;
        let mut places = self.places(inside, true, &mut random);
        places.extend(self.places(count - inside, false, &mut random));
        self.at(&places, effort, seed)
    }

    /// The share of the points that lie in the region: at least its share of the area.
    fn share_inside(&self) -> f64 {
        let Some(region) = &self.region else { return 0.0 };
        let (mut inside, mut all) = (0.0, 0.0);
        for triangle in &self.scene.triangles {
            all += triangle.area;
            inside += if region.holds(triangle.point(4.0 / 9.0, 0.5)) { triangle.area } else { 0.0 };
        }
        INSIDE.max(inside / all)
    }

    /// Chooses points inside or outside the region; fewer than `count` if there is hardly any such surface.
    fn places(&self, count: usize, inside: bool, random: &mut Random) -> Vec<(DVec3, DVec3)> {
        let mut sums = Vec::with_capacity(self.scene.triangles.len());
        let mut sum = 0.0;
        for triangle in &self.scene.triangles {
            sum += triangle.area;
            sums.push(sum);
        }
        let mut places = Vec::new();
        let mut attempts = 0;
        while places.len() < count && attempts < 2000 * count {
            attempts += 1;
            let chosen = random.uniform() * sum;
            let index = sums.partition_point(|&sum| sum <= chosen).min(sums.len() - 1);
            let triangle = &self.scene.triangles[index];
            let position = triangle.point(random.uniform(), random.uniform());
            if self.region.as_ref().is_some_and(|region| region.holds(position) != inside) {
                continue;
            }
            if self.touches(position, triangle.normal) {
                continue;
            }
            // Most directions from a visible point end at front sides or in the sky; this excludes the outside of
            // walls.
            let open_directions = (0..64).filter(|_| {
                let direction = cosine(triangle.normal, random.uniform(), random.uniform());
                match self.scene.closest(position + triangle.normal * self.offset, direction) {
                    Some(hit) => self.scene.triangles[hit.triangle].normal.dot(direction) < 0.0,
                    None => self.sky != DVec3::ZERO,
                }
            });
            if open_directions.count() > 32 {
                places.push((position, triangle.normal));
            }
        }
        places
    }

    /// Whether another face touches this point and faces it.
    pub fn touches(&self, position: DVec3, normal: DVec3) -> bool {
        let [low, high] = self.scene.bounds();
        let gap = TOUCHING * (high - low).length();
        let (mut origin, mut remaining) = (position - normal * gap, 2.0 * gap);
        while let Some(hit) = self.scene.closest(origin, normal).filter(|hit| hit.distance < remaining) {
            if self.scene.triangles[hit.triangle].normal.dot(normal) < -0.5 {
                return true;
            }
            let step = hit.distance + 1e-6 * gap;
            (origin, remaining) = (origin + normal * step, remaining - step);
        }
        false
    }

    /// Whether the direct light within a texel of a point differs from that at the point by more than a twentieth of
    /// all its light.
    pub(super) fn near_shadow_edge(&self, position: DVec3, normal: DVec3, light: DVec3) -> bool {
        let (right, up) = normal.any_orthonormal_pair();
        let above = normal * (0.1 * TEXEL);
        let at_point = self.direct(position, normal);
        (0..8).any(|step| {
            let angle = std::f64::consts::TAU * f64::from(step) / 8.0;
            let near = position + (right * angle.cos() + up * angle.sin()) * TEXEL;
            // Only neighbours on the same face count, and not inside of an object that stands on it.
            let open = !self.scene.hidden(position + above, near + above);
            let faces = |triangle: usize| self.scene.triangles[triangle].normal.dot(normal) > 0.99;
            let below = self.scene.closest(near + above, -normal);
            let same = below.is_some_and(|hit| hit.distance < 0.2 * TEXEL && faces(hit.triangle));
            let change =
                if open && same { (self.direct(near, normal) - at_point).abs() } else { DVec3::ZERO };
            change.element_sum() > EDGE * light.element_sum()
        })
    }

    /// The direct light of lamps and lights, with the same random numbers at every point.
    fn direct(&self, position: DVec3, normal: DVec3) -> DVec3 {
        let mut random = Random::new(1);
        let at = [position + normal * self.offset, normal];
        self.direct_light(at, 16, &mut random)
    }
}
