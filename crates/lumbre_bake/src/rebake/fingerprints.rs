//! What two bakes of an object are compared by: its bounding box, and hashes of its emission, of its lightmap layout
//! and of what its texels show. The comparison is made in `changes`.

use glam::Vec3;

use crate::bounds::Bounds;
use crate::coverage::{CoveredTexels, Footprint, Texel};
use crate::sampling::hash;
use crate::sources::Sources;

/// The bounding box of each object, canonical units; empty for an object without triangles.
pub(crate) fn bounds(texels: &CoveredTexels<'_>) -> Vec<Bounds<Vec3>> {
    let mut bounds = vec![Bounds::default(); texels.layout.maps.len()];
    for triangle in &texels.scene.triangles {
        bounds[triangle.map.place()].extend(triangle.corners);
    }
    bounds
}

/// Per object, a hash of its emitters; 0 if it has none.
pub(crate) fn emission(sources: &Sources<'_>, texels: &CoveredTexels<'_>) -> Vec<u32> {
    let first = first_triangles(texels);
    let mut emission = vec![0; texels.layout.maps.len()];
    for emitter in &sources.emitters {
        let object = texels.scene.triangles[emitter.triangle as usize].map.place();
        let radiance = emitter.radiance.to_array().map(f32::to_bits);
        let words = radiance.into_iter().chain([emitter.triangle - first[object], emitter.side as u32]);
        emission[object] = words.fold(emission[object], fold).max(1);
    }
    emission
}

/// Per object, a hash of its lightmap's size and texture coordinates, by which its texels are placed on it.
pub(crate) fn layouts(texels: &CoveredTexels<'_>) -> Vec<u32> {
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
pub(super) fn fold(sum: u32, word: u32) -> u32 {
    hash(sum ^ word).wrapping_mul(0x9e37_79b9)
}

/// A hash of what a texel shows: it stays the same as long as its object and what hides parts of it stay the same.
/// `first` is the first triangle of the object.
pub(crate) fn fingerprint(texel: &Texel, first: u32) -> u32 {
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

/// The first triangle of each object.
pub(crate) fn first_triangles(texels: &CoveredTexels<'_>) -> Vec<u32> {
    let mut first = vec![u32::MAX; texels.layout.maps.len()];
    for (index, triangle) in texels.scene.triangles.iter().enumerate() {
        let first = &mut first[triangle.map.place()];
        *first = (*first).min(index as u32);
    }
    first
}
