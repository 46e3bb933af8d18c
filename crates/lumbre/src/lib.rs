//! Lumbre: lighting for games that tells you what it costs. This crate re-exports all crates under one name;
//! the program of the same name is in `main.rs`.
//!
//! ```text
//!    level.glb ─► scene ─► bake ─► level.baked.glb ─► scene ─► render ─► frame
//!                   │  └─► trace ─► reference picture            │
//!                 optics, mesh, rays                           graph
//!
//!    cost: studies of all of these, with a report page
//! ```
//!
//! ```
//! use lumbre::optics::Light;
//! use lumbre::scene::{Census, Transform};
//!
//! let mut world = bevy_ecs::world::World::new();
//! world.spawn((Light::point(glam::Vec3::ONE), Transform::from_xyz(0.0, 2.0, 0.0)));
//! let census = Census::of(&mut world);
//! assert!(census.lines().iter().any(|line| line.called_for));
//! ```

pub use lumbre_bake as bake;
pub use lumbre_cost as cost;
pub use lumbre_demo as demo;
pub use lumbre_graph as graph;
pub use lumbre_mesh as mesh;
pub use lumbre_optics as optics;
pub use lumbre_rays as rays;
pub use lumbre_render as render;
pub use lumbre_scene as scene;
pub use lumbre_trace as trace;
