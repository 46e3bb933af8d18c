//! What both benchmarks share: scenes, batches of rays, and the crates that trace them. The measuring itself is in
//! the benchmarks.
#![allow(dead_code, reason = "each benchmark uses a part of this")]

pub mod batches;
pub mod models;
pub mod scenes;
pub mod tracers;

use batches::{Batch, camera, cosine, shadow};
use scenes::Scene;
use tracers::Tracers;

/// A scene in every crate's hierarchy, and the rays to trace in it.
pub struct Case {
    pub scene: &'static str,
    pub triangles: usize,
    pub tracers: Tracers,
    pub batches: Vec<Batch>,
}

/// All scenes; those whose file is missing are reported on standard error.
pub fn cases() -> Vec<Case> {
    cases_of(scenes::all())
}

pub fn cases_of(scenes: Vec<Scene>) -> Vec<Case> {
    scenes
        .into_iter()
        .map(|scene| Case {
            scene: scene.name,
            triangles: scene.triangles.len(),
            tracers: Tracers::build(&scene.triangles),
            batches: vec![
                Batch { name: "camera, closest", any: false, rays: camera(&scene) },
                Batch { name: "cosine, closest", any: false, rays: cosine(&scene) },
                Batch { name: "cosine, any", any: true, rays: cosine(&scene) },
                Batch { name: "to the lamp, any", any: true, rays: shadow(&scene) },
            ],
        })
        .collect()
}
