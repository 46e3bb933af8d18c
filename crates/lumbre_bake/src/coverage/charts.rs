//! The charts of the lightmaps: sets of triangles that share vertices in the map. Nothing is filtered or filled from
//! one chart to another.

use std::collections::HashMap;

use crate::disjoint_sets::DisjointSets;
use crate::scene::BakeScene;
use crate::texel_index::MapIndex;

/// The chart of every triangle of the scene; charts of different objects differ.
pub(crate) fn charts(scene: &BakeScene) -> Vec<u32> {
    let mut vertices: HashMap<(MapIndex, u32, u32), u32> = HashMap::new();
    let mut charts = DisjointSets::new(scene.triangles.len());
    for (index, triangle) in scene.triangles.iter().enumerate() {
        for uv in triangle.uv {
            let key = (triangle.map, uv.x.to_bits(), uv.y.to_bits());
            let other = *vertices.entry(key).or_insert(index as u32);
            charts.join(index as u32, other);
        }
    }
    charts.into_sets()
}
