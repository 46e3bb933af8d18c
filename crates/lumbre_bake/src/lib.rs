//! Radiosity baked into lightmaps: a World in, the same World with lit texels out.
//!
//! No GPU, no files: `lumbre_scene` loads and saves. Light bounces between patches; texels show it.
//!
//! ```text
//!   World ─► scene ──────────► transport ───────────────────────────► texels ─────────────────► World
//!            collect objects    patches ─► form factors ─► solver       footprints ─► hidden      uv1
//!            lay out uv1         (pooled, reciprocal)   (per channel)   direct light              Lightmap E/π
//!            triangles, BVH     emitters, lights ─► direct light        final gather, rounds
//!            materials                                                  smooth ─► fill
//!                                                                      probes: grid ─► light ─► fill ──► IrradianceVolume
//!   Samples of a former bake ─► rebake: what changed ─► which texels keep their direct light, and their bounces ─► Samples
//! ```
//!
//! Everything is computed in canonical units (relative to the scene's centre, scaled by a power of two), with one seed per
//! texel and patch: the same bits on any number of threads and at any 2^k scale of an emissive scene.
//!
//! ```
//! use std::{ops::ControlFlow, sync::Arc};
//! use bevy_ecs::world::World;
//! use glam::Vec3;
//! use lumbre_bake::{BakeOptions, Density, Quality, bake};
//! use lumbre_optics::{BakeMode, Light, Material};
//! use lumbre_scene::{Lightmap, Mesh, StaticObject, Transform};
//!
//! let mut world = World::new();
//! let floor = Arc::new(lumbre_mesh::shapes::cuboid(Vec3::new(4.0, 0.2, 4.0), 1));
//! let floor = world.spawn((Mesh(floor), Material::default(), StaticObject)).id();
//! let lamp = Light { bake: BakeMode::Static, ..Light::point(Vec3::ONE) };
//! world.spawn((lamp, Transform::from_xyz(0.0, 2.0, 0.0)));
//! let options = BakeOptions { density: Density::MapSize(32), quality: Quality::Draft, ..BakeOptions::default() };
//! let report = bake(&mut world, &options, &mut |_| ControlFlow::Continue(()))?;
//! assert!(report.mean_irradiance[0] > 0.0);
//! assert_eq!(world.get::<Lightmap>(floor).map(|map| map.image.width), Some(32));
//! # Ok::<(), lumbre_bake::BakeError>(())
//! ```

mod apply;
mod bake;
mod checkpoint;
mod chunks;
mod content_hash;
mod error;
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
mod stop;
mod texels;
mod transport;
mod unwrapped_from;

pub use apply::TexelErrors;
pub use bake::{bake, bake_with, rebake};
pub use checkpoint::Checkpoint;
pub use content_hash::{ContentHash, content_hash};
pub use error::{BakeError, CheckpointError};
pub use options::{BakeOptions, Density, FormFactorMethod, Probes, Quality, Solver};
pub use progress::Progress;
pub use rebake::{Samples, SamplesError};
pub use report::{
    BakeReport, Ended, ErrorAtTime, ProbeReport, RebakeReport, ResolutionReport, SeamReport, StageTime,
    WorstPlace,
};
pub use transport::method_study::{FormFactorErrors, form_factor_errors};
pub use unwrapped_from::UnwrappedFrom;
