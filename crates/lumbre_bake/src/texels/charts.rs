//! Which triangles are neighbours in the map: the charts, across which nothing is filtered or filled.

use std::collections::HashMap;

use crate::scene::BakeScene;

/// The chart of every triangle of the scene; charts of different objects differ.
pub(crate) fn charts(scene: &BakeScene) -> Vec<u32> {
    let mut vertices: HashMap<(u32, u32, u32), u32> = HashMap::new();
    let mut parent: Vec<u32> = (0..scene.triangles.len() as u32).collect();
    for (index, triangle) in scene.triangles.iter().enumerate() {
        for uv in triangle.uv {
            let key = (triangle.object, uv.x.to_bits(), uv.y.to_bits());
            let other = *vertices.entry(key).or_insert(index as u32);
            let (a, b) = (find(&mut parent, index as u32), find(&mut parent, other));
            parent[a.max(b) as usize] = a.min(b);
        }
    }
    (0..scene.triangles.len() as u32).map(|index| find(&mut parent, index)).collect()
}

fn find(parent: &mut [u32], mut at: u32) -> u32 {
    while parent[at as usize] != at {
        parent[at as usize] = parent[parent[at as usize] as usize];
        at = parent[at as usize];
    }
    at
}
