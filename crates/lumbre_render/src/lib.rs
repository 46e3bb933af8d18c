//! Renders a bevy_ecs World with wgpu: the passes, their GPU buffers, and headless frames. This crate depends
//! on no window library and reads no scene files.
//!
//! ```text
//!   World ──► extract ─────────► draws ──────────────► effects ───────────────────► target
//!             changed components  cull, sort, batch     shadows ► g-buffer ►           Offscreen or
//!             to GPU buffers      variants, light lists    lightmap ► forward ►           WindowSurface
//!                 │               and again for mirrors    mirrors ► refraction ►
//!                 │                    │                   transparent ► yours ►
//!                 │                    │                   display ► yours
//!                 └──── facts ─────────┴──► explain: what the scene needs, and what it does not
//! ```
//!
//! The versions of bevy_ecs, glam and wgpu that a program must share with this crate are re-exported. A
//! program that has its own device passes it to [`Gpu::from_parts`]; one that has a schedule adds
//! [`render_frame`] to it; one that has its own passes implements [`Effect`](effects::Effect) and gives it to
//! [`Renderer::builder`]. The program in integrations/own_program does all three.
//!
//! A World, a renderer and a target are all that a frame needs:
//!
//! ```
//! use std::sync::Arc;
//! use bevy_ecs::prelude::*;
//! use glam::Vec3;
//! use lumbre_optics::{Light, Material};
//! use lumbre_render::{FrameOptions, Gpu, Offscreen, OffscreenFormat, Renderer};
//! use lumbre_scene::{Camera, Mesh, Transform};
//!
//! let mut world = World::new();
//! world.spawn((Mesh(Arc::new(lumbre_mesh::shapes::uv_sphere(1.0, 32, 16))), Material::matt(Vec3::ONE)));
//! world.spawn((Light::point(Vec3::splat(9.0)), Transform::from_xyz(0.0, 0.0, 4.0)));
//! world.spawn((Camera::default(), Transform::from_xyz(0.0, 0.0, 4.0)));
//! let gpu = Gpu::headless()?;
//! let frame = Offscreen::new(&gpu, 64, 64, OffscreenFormat::Rgba8)?;
//! Renderer::new(&gpu).render(&mut world, &frame.target(), &FrameOptions::default())?;
//! let middle = &frame.read_rgba8(&gpu)?[4 * (32 * 64 + 32)..][..3];
//! assert!(middle.iter().all(|channel| *channel > 200));
//! # Ok::<(), lumbre_render::RenderError>(())
//! ```

mod accounting;
mod cluster_buffers;
mod cluster_grid;
mod draws;
mod effect_costs;
mod effect_shares;
pub mod effects;
mod error;
mod explain;
mod extract;
mod facts;
mod features;
mod frame_bindings;
mod frame_decision;
mod frame_graph;
mod frame_plan;
mod frame_report;
mod frame_scene;
mod full_screen;
mod g_buffer;
mod gpu;
mod growable_buffer;
mod irradiance_volumes;
mod layout;
mod ledger;
mod light_clusters;
mod light_cone;
mod light_counter;
mod light_grid;
mod light_lists;
mod lightmap_texels;
mod mesh_buffers;
mod metering;
mod mip_level;
mod mirror_views;
mod normal_map;
mod offscreen;
mod options;
mod pending;
mod pipelines;
mod renderer;
mod rendering_path;
mod schedule;
mod shader;
mod shading_by_need;
mod shading_need;
mod shadow_light;
mod shadows;
mod shared_records;
mod stage_clock;
mod statistics;
mod table_texture;
mod target;
mod texture_sets;
mod textures;
mod view_buffers;
mod warm_up;
mod window_surface;
mod worker_thread;
mod world_watch;

pub use {bevy_ecs, glam, wgpu};

pub use accounting::{Accounting, EffectAccount, LightCount, PassAccount, SCENE, StageAccount};
pub use effect_costs::{EffectCost, FrameCost, Removable, effect_costs, removable_effects};
pub use error::{EffectError, RenderError};
pub use explain::{SceneExplanation, explain};
pub use facts::SceneFacts;
pub use frame_plan::FrameShape;
pub use frame_report::FrameReport;
pub use frame_scene::{DrawnObject, FrameScene, FrameView};
pub use gpu::Gpu;
pub use lightmap_texels::LightmapMemory;
pub use metering::{LightMeter, Metering, meter};
pub use offscreen::{Offscreen, OffscreenFormat, read_texture};
pub use options::{Display, FrameOptions, LightLists, Measure, MissingPipelines, RenderingPath};
pub use pending::Pending;
pub use renderer::{Renderer, RendererBuilder};
pub use schedule::{CurrentTarget, LastFrame, RenderSet, render_frame};
pub use shading_need::{ShadingNeed, ShadingNeeds};
pub use statistics::{CpuStages, LightListing, LitPasses, PassLights, Statistics, Uploads};
pub use target::{DEPTH_FORMAT, FrameTarget, Viewport};
pub use window_surface::{Acquired, SurfaceFrame, WindowSurface};
