//! Radiosity baked into lightmaps: a World in, the same World with lit texels out; or plain meshes, materials and lights in, and maps out.
//!
//! No GPU, no files: `lumbre_scene` loads and saves. Light bounces between patches; texels show it.
//!
//! ```text
//!   World ─► scene ─────────► transport ──────────────► texels ──────────────► transport ────────► texels ───────────────► BakedScene ─► World
//!            StaticScene       emitters, lights          covered texels          patches             radiance cache          uv1
//!            lightmap layout   (trees, bounds)           direct light            form factors        final gather, rounds    Lightmap E/π
//!            triangles, BVH                              local light             solver              error ledger            TexelErrors
//!                                                                                                    smooth ─► fill ─► seams
//!                                                                                                    probes: grid ─► light ─► fill ─► IrradianceVolume
//!   checkpoint: what stages have computed, in chunks ─► the same bits after an interruption
//!   Samples of a former bake ─► rebake: what changed ─► which texels keep their direct light, and their bounces ─► Samples
//! ```
//!
//! [`Bake`] is the entrance; `bake.rs` tells the stages in their order, and docs/baking.md the life of one photon through these folders.
//!
//! Everything is computed in canonical units (relative to the scene's centre, scaled by a power of two), with one seed per
//! texel and patch: the same bits on any number of threads and at any 2^k scale of an emissive scene.
//!
//! ```
//! use std::sync::Arc;
//! use bevy_ecs::world::World;
//! use glam::Vec3;
//! use lumbre_bake::{Bake, BakeOptions, Density, Quality};
//! use lumbre_optics::{BakeMode, Light, Material};
//! use lumbre_scene::{Lightmap, Mesh, StaticObject, Transform};
//!
//! let mut world = World::new();
//! let floor = Arc::new(lumbre_mesh::shapes::cuboid(Vec3::new(4.0, 0.2, 4.0), 1));
//! let floor = world.spawn((Mesh(floor), Material::default(), StaticObject)).id();
//! let lamp = Light { bake: BakeMode::Static, ..Light::point(Vec3::ONE) };
//! world.spawn((lamp, Transform::from_xyz(0.0, 2.0, 0.0)));
//! let options = BakeOptions { density: Density::MapSize(32), quality: Quality::Draft, ..BakeOptions::default() };
//! let report = Bake::new(&options).run(&mut world)?;
//! assert!(report.mean_irradiance[0] > 0.0);
//! assert_eq!(world.get::<Lightmap>(floor).map(|map| map.image.width), Some(32));
//! # Ok::<(), lumbre_bake::BakeError>(())
//! ```

mod apply;
mod bake;
mod baked_scene;
mod cancel_token;
mod checkpoint;
mod chunks;
mod conjugate_gradients;
mod content_hash;
mod disjoint_sets;
mod error;
mod light_to_bake;
mod memory;
mod notes;
mod options;
mod pages;
mod preparing;
mod probes;
mod progress;
mod rebake;
mod report;
mod sampling;
mod scene;
mod texel_index;
mod texels;
mod transport;
mod unwrapped_from;

pub use bake::Bake;
pub use baked_scene::{BakedMap, BakedObject, BakedScene, TexelErrors};
pub use cancel_token::CancelToken;
pub use checkpoint::Checkpoint;
pub use content_hash::{ContentHash, content_hash};
pub use error::{BakeError, CheckpointError};
pub use light_to_bake::has_light_to_bake;
pub use options::{BakeOptions, Density, FormFactorMethod, Probes, Quality, Solver};
pub use progress::Progress;
pub use rebake::{Samples, SamplesError};
pub use report::{
    BakeReport, Ended, ErrorAtTime, ErrorPart, ProbeReport, RebakeReport, ResolutionReport, SeamReport,
    StageTime, WorstPlace,
};
pub use scene::{PlacedLight, PlacedPrimitive, SceneObject, StaticScene};
pub use unwrapped_from::UnwrappedFrom;
