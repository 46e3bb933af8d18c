//! Where converged light is asked for: points uniform by area on what can be seen, most of them in the level's region, and whether the direct
//! light has an edge near one. Not the light there.

use glam::DVec3;

use super::super::random::Random;
use super::directions::cosine;
use super::{Effort, Irradiance, PathTracer};

/// Of a level's points, in its region.
const INSIDE: f64 = 0.85;
/// Metres from a point to those that tell of an edge: a texel's size.
const TEXEL: f64 = 0.025;
/// Of the scene's size: faces so near to one another touch, though single precision leaves gaps.
const TOUCHING: f64 = 1e-7;
/// The change of direct light over that which makes an edge, of all the light at the point.
const EDGE: f64 = 0.05;

impl PathTracer {
    /// Points uniform by area on what can be seen, and the irradiance there.
    pub fn points(&self, count: usize, effort: Effort, seed: u64) -> Vec<Irradiance> {
        let mut random = Random::new(seed);
        let inside = (self.share_inside() * count as f64).round() as usize;
        let mut places = self.places(inside, true, &mut random);
        places.extend(self.places(count - inside, false, &mut random));
        self.at(&places, effort, seed)
    }

    /// At least as many points as the region has of the area.
    fn share_inside(&self) -> f64 {
        let Some(region) = &self.region else { return 0.0 };
        let (mut inside, mut all) = (0.0, 0.0);
        for triangle in &self.scene.triangles {
            all += triangle.area;
            inside += if region.holds(triangle.point(4.0 / 9.0, 0.5)) { triangle.area } else { 0.0 };
        }
        INSIDE.max(inside / all)
    }

    fn places(&self, count: usize, inside: bool, random: &mut Random) -> Vec<(DVec3, DVec3)> {
        let mut sums = Vec::with_capacity(self.scene.triangles.len());
        let mut sum = 0.0;
        for triangle in &self.scene.triangles {
            sum += triangle.area;
            sums.push(sum);
        }
        let mut places = Vec::new();
        let mut tried = 0;
        // Where there is no outside, or hardly one, there are fewer points.
        while places.len() < count && tried < 2000 * count {
            tried += 1;
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
            // In the open: most of what it sees are fronts or the sky (not the outside of the walls).
            let seen = (0..64).filter(|_| {
                let direction = cosine(triangle.normal, random.uniform(), random.uniform());
                match self.scene.closest(position + triangle.normal * self.offset, direction) {
                    Some(hit) => self.scene.triangles[hit.triangle].normal.dot(direction) < 0.0,
                    None => self.sky != DVec3::ZERO,
                }
            });
            if seen.count() > 32 {
                places.push((position, triangle.normal));
            }
        }
        places
    }

    /// Whether another face looks at this one from where it is.
    fn touches(&self, position: DVec3, normal: DVec3) -> bool {
        let [low, high] = self.scene.bounds();
        let gap = TOUCHING * (high - low).length();
        let (mut origin, mut left) = (position - normal * gap, 2.0 * gap);
        while let Some(hit) = self.scene.closest(origin, normal).filter(|hit| hit.distance < left) {
            if self.scene.triangles[hit.triangle].normal.dot(normal) < -0.5 {
                return true;
            }
            let step = hit.distance + 1e-6 * gap;
            (origin, left) = (origin + normal * step, left - step);
        }
        false
    }

    /// Whether direct light changes within a texel of a place by more than a twentieth of all its light.
    pub(super) fn near_shadow_edge(&self, position: DVec3, normal: DVec3, light: DVec3) -> bool {
        let (right, up) = normal.any_orthonormal_pair();
        let above = normal * (0.1 * TEXEL);
        let own = self.direct(position, normal);
        (0..8).any(|step| {
            let angle = std::f64::consts::TAU * f64::from(step) / 8.0;
            let near = position + (right * angle.cos() + up * angle.sin()) * TEXEL;
            // On the same face still, and not inside of what stands on it.
            let open = !self.scene.hidden(position + above, near + above);
            let faces = |triangle: usize| self.scene.triangles[triangle].normal.dot(normal) > 0.99;
            let below = self.scene.closest(near + above, -normal);
            let same = below.is_some_and(|hit| hit.distance < 0.2 * TEXEL && faces(hit.triangle));
            let change = if open && same { (self.direct(near, normal) - own).abs() } else { DVec3::ZERO };
            change.element_sum() > EDGE * light.element_sum()
        })
    }

    /// Light that comes straight from lamps and lights, by the same numbers everywhere.
    fn direct(&self, position: DVec3, normal: DVec3) -> DVec3 {
        let mut random = Random::new(1);
        let at = [position + normal * self.offset, normal];
        self.direct_light(at, 16, &mut random)
    }
}
