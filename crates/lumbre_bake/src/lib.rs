//! Bakes radiosity into lightmaps. The input is a World, whose static objects are given lightmaps, or plain meshes,
//! materials and lights, whose maps are returned.
//!
//! The bake needs no GPU; loading scenes and saving lightmaps is `lumbre_scene`'s. Light bounces between patches, and a
//! final gather brings it to the texels.
//!
//! ```text
//!   World ─► scene ─► sources ─► coverage ─► direct_light ─► radiosity ──────► final_gather ──► finish ──► BakedScene ─► World
//!            layout   emitters   what each   local light,    patches,          rays, rounds,    fill        uv1
//!            BVH      lights     texel       shared samples  form factors,     error ledger     seams       Lightmap E/π
//!            rooms    (trees)    covers           │          solver                │            pages       TexelErrors
//!                                                 └────────── denoise ─────────────┘
//!            visibility: occlusion by geometry alone         probes: a gather in open space ──────────────► IrradianceVolume
//!
//!   checkpoint: chunks of the stages' results ─► a resumed bake gives the same bits
//!   rebake: Samples of a previous bake ─► what changed ─► which texels keep their direct light and their bounces ─► Samples
//! ```
//!
//! Start at [`Bake`]: `bake.rs` calls the stages in order, and docs/baking.md follows one photon through these folders.
//!
//! Everything is computed in canonical units (relative to the scene's centre, scaled by a power of two), with one seed
//! per texel and patch. The result is therefore bit-identical on any number of threads and, for an emissive scene, at
//! any scale of 2^k.
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
mod bounds;
mod cancel_token;
mod checkpoint;
mod chunks;
mod color;
mod conjugate_gradients;
mod content_hash;
mod coverage;
mod denoise;
mod direct_light;
mod disjoint_sets;
mod error;
mod final_gather;
mod finish;
mod light_to_bake;
mod memory;
mod monitor;
mod options;
mod prepare;
mod probes;
mod radiosity;
mod rebake;
mod report;
mod sample_allocation;
mod sampling;
mod scene;
mod sources;
mod squared_errors;
mod stage;
mod summary;
mod texel_index;
mod unwrapped_from;
mod visibility;

pub use bake::Bake;
pub use baked_scene::BakedScene;
pub use cancel_token::CancelToken;
pub use checkpoint::Checkpoint;
pub use content_hash::{ContentHash, content_hash};
pub use error::{BakeError, CheckpointError};
pub use finish::baked_maps::{BakedMap, BakedObject, TexelErrors};
pub use light_to_bake::has_light_to_bake;
pub use monitor::Progress;
pub use options::{BakeOptions, Density, FormFactorMethod, Probes, Quality, Solver};
pub use rebake::{PackedSamples, Samples, SamplesError};
pub use report::{
    BakeReport, Ended, ErrorAtTime, ErrorPart, ProbeReport, RebakeReport, ResolutionReport, SeamReport,
    StageTime, WorstPlace,
};
pub use scene::{PlacedLight, PlacedPrimitive, SceneObject, StaticScene, baked_area, baked_meshes};
pub use unwrapped_from::UnwrappedFrom;
