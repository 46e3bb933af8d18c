//! Radiosity baked into lightmaps: a World in, the same World with lit texels out; or plain meshes, materials and lights in, and maps out.
//!
//! No GPU, no files: `lumbre_scene` loads and saves. Light bounces between patches; texels show it.
//!
//! ```text
//!   World ─► scene ─► sources ─► coverage ─► direct_light ─► radiosity ──────► final_gather ──► finish ──► BakedScene ─► World
//!            layout   emitters   what each   local light,    patches,          rays, rounds,    fill        uv1
//!            BVH      lights     texel       shared samples  form factors,     error ledger     seams       Lightmap E/π
//!            rooms    (trees)    shows            │          solver                │            pages       TexelErrors
//!                                                 └────────── denoise ─────────────┘
//!            visibility: occlusion by geometry alone         probes: the same gather in the air ──────────► IrradianceVolume
//!
//!   checkpoint: what stages have computed, in chunks ─► the same bits after an interruption
//!   rebake: Samples of a former bake ─► what changed ─► which texels keep their direct light and their bounces ─► Samples
//! ```
//!
//! Start at [`Bake`]: `bake.rs` calls the stages in their order, and docs/baking.md follows one photon through these folders.
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
mod cancel_token;
mod checkpoint;
mod chunks;
mod conjugate_gradients;
mod content_hash;
mod coverage;
mod denoise;
mod direct_light;
mod disjoint_sets;
mod error;
mod final_gather;
mod finish;
mod memory;
mod monitor;
mod options;
mod preparing;
mod probes;
mod radiosity;
mod rebake;
mod report;
mod sample_allocation;
mod sampling;
mod scene;
mod sources;
mod squared_errors;
mod summary;
mod texel_index;
mod unwrapped_from;
mod visibility;

pub use bake::Bake;
pub use cancel_token::CancelToken;
pub use checkpoint::Checkpoint;
pub use content_hash::{ContentHash, content_hash};
pub use error::{BakeError, CheckpointError};
pub use finish::baked_scene::{BakedMap, BakedObject, BakedScene, TexelErrors};
pub use monitor::Progress;
pub use options::{BakeOptions, Density, FormFactorMethod, Probes, Quality, Solver};
pub use rebake::{Samples, SamplesError};
pub use report::{
    BakeReport, Ended, ErrorAtTime, ErrorPart, ProbeReport, RebakeReport, ResolutionReport, SeamReport,
    StageTime, WorstPlace,
};
pub use scene::{PlacedLight, PlacedPrimitive, SceneObject, StaticScene};
pub use unwrapped_from::UnwrappedFrom;
