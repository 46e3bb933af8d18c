//! Points along seams, about two per texel: what bilinear filtering reads there on either side. Only where the surfaces
//! join: the same place, normals that agree, each on its own side, and nothing that stands in between.

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::edge_grid::EdgeGrid;
use super::edges::Edge;
use super::{Maps, NO_CHART};
use crate::texel_index::MapTexel;

/// Edges nearer than this are in one place, canonical units: 64 roundings of the largest coordinate, which is below 2.
const SAME_PLACE: f64 = 64.0 / (1 << 23) as f64;
/// Cosine of 2 degrees: shading normals within it make one smooth surface. Beyond, light differs by rights.
const SMOOTH: f32 = 0.999_39;
/// Cosine of the angle between the two surfaces above which one lies folded back on the other.
const FOLDED: f32 = 0.5;
/// Samples along a texel.
const PER_TEXEL: f64 = 2.0;
/// A wall between the two sides is looked for so far from the seam, and so far above the surface, in texels.
const BESIDE: f32 = 0.25;
const ABOVE: f32 = 0.5;
/// Coordinates of the same map that differ by less, in texels, read the same.
const SAME_READING: f32 = 1e-3;
/// Weights below this are roundings of a border on texel centres.
const NEGLIGIBLE: f32 = 1.0 / 1024.0;

/// What filtering reads at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Reading {
    pub texels: [MapTexel; 4],
    /// In [0, 1]; their sum is 1.
    pub weights: [f32; 4],
}

/// A point of a seam.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub sides: [Reading; 2],
    /// Length of seam that it stands for, canonical units.
    pub length: f64,
}

/// All that was found.
pub(crate) struct Found {
    pub samples: Vec<Sample>,
    /// Pairs of edges with at least one sample.
    pub pairs: usize,
    pub rays: u64,
    /// Edges that were not compared with all that lie in their place.
    pub crowded: usize,
}

/// The search.
pub(crate) struct Sampling<'a> {
    pub maps: &'a Maps<'a>,
    /// Per texel of all maps.
    pub charts: &'a [u32],
    pub filled: &'a [Vec3],
    pub edges: &'a [Edge],
}

impl Sampling<'_> {
    pub fn all(&self) -> Found {
        let grid = EdgeGrid::new(self.edges, SAME_PLACE);
        let of_edge = |index: u32| {
            let mut own = Found { samples: Vec::new(), pairs: 0, rays: 0, crowded: 0 };
            let (near, crowded) = grid.near(index);
            own.crowded = usize::from(crowded);
            for other in near.into_iter().take_while(|_| !self.maps.scene.stop.is_cancelled()) {
                let before = own.samples.len();
                own.rays += self.between(index, other, &mut own.samples);
                own.pairs += usize::from(own.samples.len() > before);
            }
            own
        };
        let mut all = Found { samples: Vec::new(), pairs: 0, rays: 0, crowded: 0 };
        let found: Vec<Found> = (0..self.edges.len() as u32).into_par_iter().map(of_edge).collect();
        for own in found {
            all.samples.extend(own.samples);
            all.pairs += own.pairs;
            all.rays += own.rays;
            all.crowded += own.crowded;
        }
        all
    }

    /// Adds the samples of what two edges share; returns the rays cast.
    fn between(&self, a: u32, b: u32, samples: &mut Vec<Sample>) -> u64 {
        let (mut long, mut short) = (&self.edges[a as usize], &self.edges[b as usize]);
        if short.length() > long.length() {
            (long, short) = (short, long);
        }
        if long.triangle == short.triangle || long.inward.dot(short.inward) >= FOLDED {
            return 0;
        }
        let Some((begin, end)) = shared_part(long, short) else { return 0 };
        let length = (end - begin).length();
        // Where a point of the shared part is along an edge.
        let along = |edge: &Edge, point: DVec3| {
            let whole = edge.ends[1] - edge.ends[0];
            ((point - edge.ends[0]).dot(whole) / whole.length_squared()).clamp(0.0, 1.0) as f32
        };
        let share = |edge: &Edge| (along(edge, end) - along(edge, begin)).abs() * edge.texels();
        let texels = share(long).max(share(short));
        if texels.is_nan() || texels <= 0.0 {
            return 0;
        }
        let count = (f64::from(texels) * PER_TEXEL).ceil().clamp(1.0, 65536.0) as u32;
        let side = (length / f64::from(texels)) as f32;
        let mut rays = 0;
        for sample in 0..count {
            let point = begin.lerp(end, (f64::from(sample) + 0.5) / f64::from(count));
            let (s, t) = (along(long, point), along(short, point));
            let [one, other] =
                [(long, s), (short, t)].map(|(e, t)| e.normals[0].lerp(e.normals[1], t).normalize_or_zero());
            if one.dot(other) < SMOOTH {
                continue;
            }
            let uv = [(long, s), (short, t)].map(|(edge, t)| edge.uv[0].lerp(edge.uv[1], t));
            let scene = self.maps.scene;
            let [object, other] = [long, short].map(|edge| scene.triangles[edge.triangle as usize].object);
            if object == other && (uv[0] - uv[1]).abs().max_element() < SAME_READING {
                continue;
            }
            let (Some(one), Some(other)) = (self.reading(long, uv[0]), self.reading(short, uv[1])) else {
                continue;
            };
            rays += 1;
            let [from, to] = [long, short].map(|edge| {
                let normal = scene.triangles[edge.triangle as usize].normal;
                point.as_vec3() + (edge.inward * BESIDE + normal * ABOVE) * side
            });
            if !scene.blocked(from, to) {
                samples.push(Sample { sides: [one, other], length: length / f64::from(count) });
            }
        }
        rays
    }

    /// What is read at a place of a map, if all of it is known and no other chart's.
    fn reading(&self, edge: &Edge, uv: Vec2) -> Option<Reading> {
        let triangle = &self.maps.scene.triangles[edge.triangle as usize];
        let map = &self.maps.layout.maps[triangle.object as usize];
        let chart = self.maps.charts[edge.triangle as usize];
        let at = uv - 0.5;
        let low = at.floor();
        let fraction = at - low;
        let mut reading = Reading { texels: [MapTexel::NONE; 4], weights: [0.0; 4] };
        let mut sum = 0.0;
        for corner in 0..4 {
            let step = Vec2::new((corner % 2) as f32, (corner / 2) as f32);
            let share = (Vec2::ONE - step) * (Vec2::ONE - fraction) + step * fraction;
            let weight = share.x * share.y;
            // `as` saturates: clamped to the border, as a sampler does.
            let (x, y) = ((low.x + step.x) as u32, (low.y + step.y) as u32);
            let texel = map.texel(x.min(map.width - 1), y.min(map.height - 1));
            reading.texels[corner] = texel;
            if weight < NEGLIGIBLE {
                continue;
            }
            let owner = self.charts[texel.place()];
            if !self.filled[texel.place()].is_finite() || (owner != chart && owner != NO_CHART) {
                return None;
            }
            reading.weights[corner] = weight;
            sum += weight;
        }
        reading.weights = reading.weights.map(|weight| weight / sum);
        (sum > 0.0).then_some(reading)
    }
}

/// The ends of what two edges share: the shorter one lies on the longer one's line.
fn shared_part(long: &Edge, short: &Edge) -> Option<(DVec3, DVec3)> {
    let start = long.ends[0];
    let length = long.length();
    let direction = (long.ends[1] - start) / length;
    let [s, t] = short.ends.map(|end| {
        let along = (end - start).dot(direction);
        (along, (end - start - direction * along).length())
    });
    if s.1.max(t.1) > SAME_PLACE {
        return None;
    }
    let (from, to) = (s.0.min(t.0).max(0.0), s.0.max(t.0).min(length));
    (to - from > 4.0 * SAME_PLACE).then(|| (start + direction * from, start + direction * to))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edge(a: [f64; 3], b: [f64; 3]) -> Edge {
        Edge {
            triangle: 0,
            ends: [DVec3::from(a), DVec3::from(b)],
            uv: [Vec2::ZERO, Vec2::X],
            normals: [Vec3::Y; 2],
            inward: Vec3::Z,
        }
    }

    #[test]
    fn edges_share_what_lies_on_one_line() {
        let long = edge([0.0; 3], [1.0, 0.0, 0.0]);
        let part = |short: Edge| shared_part(&long, &short).map(|(a, b)| [a.x, b.x]);
        assert_eq!(part(edge([1.0, 0.0, 0.0], [0.0; 3])), Some([0.0, 1.0]));
        assert_eq!(part(edge([0.25, 0.0, 0.0], [0.5, 0.0, 0.0])), Some([0.25, 0.5]));
        assert_eq!(part(edge([1.5, 0.0, 0.0], [0.75, 1e-7, 0.0])), Some([0.75, 1.0]));
        assert_eq!(part(edge([1.0, 0.0, 0.0], [1.5, 0.0, 0.0])), None);
        assert_eq!(part(edge([0.0, 0.001, 0.0], [1.0, 0.001, 0.0])), None);
        assert_eq!(part(edge([0.0; 3], [0.0, 1.0, 0.0])), None);
    }
}
