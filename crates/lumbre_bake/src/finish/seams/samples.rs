//! Samples along seams, about two per texel: what bilinear filtering reads there on either side. Only where the
//! surfaces join: in the same place, with normals that agree, not folded back on each other, and with nothing in
//! between. Not how texels are moved: that is `least_squares`.

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::edge_grid::EdgeGrid;
use super::edges::Edge;
use crate::coverage::CoveredTexels;
use crate::texel_index::MapTexel;

/// Edges nearer to each other than this are in one place, canonical units: 64 roundings of the largest coordinate,
/// which is below 2.
const SAME_PLACE: f64 = 64.0 / (1 << 23) as f64;
/// Cosine of 2 degrees: shading normals within it make one smooth surface. Beyond that, light may really differ.
const SMOOTH: f32 = 0.999_39;
/// Cosine between the inward directions of two surfaces from which on one lies folded back on the other.
const FOLDED: f32 = 0.5;
/// Samples per texel of a seam.
const PER_TEXEL: f64 = 2.0;
/// A wall between the two sides is looked for this far from the seam, and this far above the surface, in texels.
const BESIDE: f32 = 0.25;
const ABOVE: f32 = 0.5;
/// Coordinates on the same map that differ by less than this, in texels, read the same value.
const SAME_READING: f32 = 1e-3;
/// Filter weights below this come from rounding, where a border runs through texel centres.
const NEGLIGIBLE: f32 = 1.0 / 1024.0;

/// What bilinear filtering reads at a point: four texels and their weights.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Reading {
    pub texels: [MapTexel; 4],
    /// Each in [0, 1]; their sum is 1.
    pub weights: [f32; 4],
}

/// A point of a seam, with what is read on either side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub sides: [Reading; 2],
    /// The length of seam that it represents, canonical units.
    pub length: f64,
}

/// All samples of the seams, or those of one edge.
#[derive(Default)]
pub(crate) struct SeamSamples {
    pub samples: Vec<Sample>,
    /// Pairs of edges with at least one sample.
    pub pairs: usize,
    pub rays: u64,
    /// Edges that lie in so crowded a place that they were not compared with all others there.
    pub crowded: usize,
}

/// The search for samples.
pub(crate) struct Sampling<'a> {
    pub texels: &'a CoveredTexels<'a>,
    pub filled: &'a [Vec3],
    pub edges: &'a [Edge],
}

impl Sampling<'_> {
    /// The samples of all seams.
    pub fn all(&self) -> SeamSamples {
        let grid = EdgeGrid::new(self.edges, SAME_PLACE);
        let of_edge = |index: u32| {
            let mut samples = SeamSamples::default();
            let (near, is_crowded) = grid.near(index);
            samples.crowded = usize::from(is_crowded);
            for other in near.into_iter().take_while(|_| !self.texels.scene.stop.is_cancelled()) {
                let before = samples.samples.len();
                samples.rays += self.between(index, other, &mut samples.samples);
                samples.pairs += usize::from(samples.samples.len() > before);
            }
            samples
        };
        let by_edge: Vec<SeamSamples> = (0..self.edges.len() as u32).into_par_iter().map(of_edge).collect();
        let mut all = SeamSamples::default();
        for of_edge in by_edge {
            all.samples.extend(of_edge.samples);
            all.pairs += of_edge.pairs;
            all.rays += of_edge.rays;
            all.crowded += of_edge.crowded;
        }
        all
    }

    /// Adds the samples of the part that two edges share; returns how many rays were cast.
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
        // Position of a point of the shared part along an edge, in [0, 1].
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
        let texel_side = (length / f64::from(texels)) as f32;
        let mut rays = 0;
        for sample in 0..count {
            let point = begin.lerp(end, (f64::from(sample) + 0.5) / f64::from(count));
            let (s, t) = (along(long, point), along(short, point));
            let [long_normal, short_normal] =
                [(long, s), (short, t)].map(|(e, t)| e.normals[0].lerp(e.normals[1], t).normalize_or_zero());
            if long_normal.dot(short_normal) < SMOOTH {
                continue;
            }
            let uv = [(long, s), (short, t)].map(|(edge, t)| edge.uv[0].lerp(edge.uv[1], t));
            let scene = self.texels.scene;
            let maps = [long, short].map(|edge| scene.triangles[edge.triangle as usize].map);
            if maps[0] == maps[1] && (uv[0] - uv[1]).abs().max_element() < SAME_READING {
                continue;
            }
            let (Some(long_reading), Some(short_reading)) =
                (self.reading(long, uv[0]), self.reading(short, uv[1]))
            else {
                continue;
            };
            rays += 1;
            let [from, to] = [long, short].map(|edge| {
                let normal = scene.triangles[edge.triangle as usize].normal;
                point.as_vec3() + (edge.inward * BESIDE + normal * ABOVE) * texel_side
            });
            if !scene.blocked(from, to) {
                let sides = [long_reading, short_reading];
                samples.push(Sample { sides, length: length / f64::from(count) });
            }
        }
        rays
    }

    /// What bilinear filtering reads at a place of a map, if all its texels are known and none is another chart's.
    fn reading(&self, edge: &Edge, uv: Vec2) -> Option<Reading> {
        let triangle = &self.texels.scene.triangles[edge.triangle as usize];
        let map = &self.texels.layout.maps[triangle.map.place()];
        let chart = self.texels.charts[edge.triangle as usize];
        let mut reading = Reading::default();
        let mut sum = 0.0;
        for (corner, (texel, weight)) in map.bilinear(uv).into_iter().enumerate() {
            reading.texels[corner] = texel;
            if weight < NEGLIGIBLE {
                continue;
            }
            let is_of_other = self.texels.chart_at(texel).is_some_and(|owner| owner != chart);
            if !self.filled[texel.place()].is_finite() || is_of_other {
                return None;
            }
            reading.weights[corner] = weight;
            sum += weight;
        }
        reading.weights = reading.weights.map(|weight| weight / sum);
        (sum > 0.0).then_some(reading)
    }
}

/// The ends of the part that two edges share; `None` if the shorter one does not lie on the longer one's line.
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
