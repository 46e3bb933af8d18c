//! What two bakes of an object are compared by: its bounding box, and hashes of its emission, of its lightmap layout
//! and of what its texels show. The comparison is made in `changes`.

use glam::Vec3;

use crate::bounds::Bounds;
use crate::coverage::{CoveredTexels, Footprint, Texel};
use crate::sampling::hash;
use crate::sources::Sources;

/// What objects are compared by, per object.
pub(super) struct ObjectFingerprints {
    /// Bounding box, canonical units; empty for an object without triangles.
    pub bounds: Vec<Bounds<Vec3>>,
    /// Hash of its emitters; 0 if it has none.
    pub emission: Vec<u32>,
    /// Hash of its lightmap's size and texture coordinates, by which its texels are placed on it.
    pub layouts: Vec<u32>,
    /// Its first triangle.
    pub first_triangles: Vec<u32>,
}

impl ObjectFingerprints {
    pub fn new(sources: &Sources<'_>, texels: &CoveredTexels<'_>) -> Self {
        let first_triangles = first_triangles(texels);
        let emission = emission(sources, texels, &first_triangles);
        Self { bounds: bounds(texels), emission, layouts: layouts(texels), first_triangles }
    }
}

fn bounds(texels: &CoveredTexels<'_>) -> Vec<Bounds<Vec3>> {
    let mut bounds = vec![Bounds::default(); texels.layout.maps.len()];
    for triangle in &texels.scene.triangles {
        bounds[triangle.map.place()].extend(triangle.corners);
    }
    bounds
}

fn emission(sources: &Sources<'_>, texels: &CoveredTexels<'_>, first: &[u32]) -> Vec<u32> {
    let mut emission = vec![0; texels.layout.maps.len()];
    for emitter in &*sources.emitters {
        let object = texels.scene.triangles[emitter.triangle as usize].map.place();
        let radiance = emitter.radiance.to_array().map(f32::to_bits);
        let words = radiance.into_iter().chain([emitter.triangle - first[object], emitter.side as u32]);
        emission[object] = words.fold(emission[object], fold).max(1);
    }
    emission
}

fn layouts(texels: &CoveredTexels<'_>) -> Vec<u32> {
    let maps = texels.layout.maps.iter();
    let mut sums: Vec<u32> = maps.map(|map| fold(fold(0, map.width), map.height)).collect();
    for triangle in &texels.scene.triangles {
        let sum = &mut sums[triangle.map.place()];
        for uv in triangle.uv {
            *sum = fold(fold(*sum, uv.x.to_bits()), uv.y.to_bits());
        }
    }
    sums
}

/// Combines a hash with one more word.
fn fold(sum: u32, word: u32) -> u32 {
    hash(sum ^ word).wrapping_mul(0x9e37_79b9)
}

/// A hash of what a texel shows: it stays the same as long as its object and what hides parts of it stay the same.
/// `first` is the first triangle of the object.
pub(super) fn fingerprint(texel: &Texel, first: u32) -> u32 {
    match &texel.footprint {
        Footprint::Hidden => 0,
        Footprint::Whole(triangle) => fold(1, triangle - first),
        Footprint::Points(points) => points.iter().fold(2, |sum, point| {
            let (u, v) = point.at;
            let sum = fold(sum, point.triangle - first);
            let sum = fold(fold(sum, u.to_bits()), v.to_bits());
            fold(fold(sum, point.offset.x.to_bits()), point.offset.y.to_bits())
        }),
    }
}

fn first_triangles(texels: &CoveredTexels<'_>) -> Vec<u32> {
    let mut first = vec![u32::MAX; texels.layout.maps.len()];
    for (index, triangle) in texels.scene.triangles.iter().enumerate() {
        let first = &mut first[triangle.map.place()];
        *first = (*first).min(index as u32);
    }
    first
}
