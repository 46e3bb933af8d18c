//! Offline reference renderer: Whitted ray tracing and path tracing of the same `World` that frames are drawn
//! from. It runs on the CPU alone and reads and writes no files.
//!
//! ```text
//!   World ─► Scene: objects, lights, polygons ─► Geometry: triangles (lumbre_rays) + quadrics
//!                                                    │
//!   camera_ray ─► SpaceRay ──────────────────────────┴──► Hit ─────► SurfacePoint: normals, textures, coefficients
//!      ▲                                                                  │
//!      │ film: filters,          ┌────────────────────────────────────────┤
//!      │ samples, errors         ▼                                        ▼
//!    tiles, rendering    ray_tree (Whitted)                          path (all light)
//!                          direct_light ─► shadow_ray                  light_sampling ─► shadow_ray
//!                          interface: mirror, Snell, Fresnel           lamp_cone, lobe_sampling, interface
//!                          medium: the media around a ray              medium
//!                          branch: the recorded tree
//! ```
//!
//! - One lighting equation: every term comes from `lumbre_optics`, whose shader twins light the frames. With
//!   depth 0 and without shadows the picture is the frame under Phong shading.
//! - The same bits on any number of threads: every pixel is computed independently, with random numbers of
//!   its own.
//! - Hit points are computed in f64: the f32 hierarchy finds the triangle, and the intersection is then
//!   computed again in f64, so that long chains of mirrors keep their digits.
//! - What the limits of depth and weight cut off is measured and reported ([`Cut`]), and so is the noise of
//!   paths ([`TraceReport::standard_error`]).
//!
//! ```
//! use std::{ops::ControlFlow, sync::Arc};
//! use bevy_ecs::world::World;
//! use lumbre_scene::{Camera, Light, Material, Mesh, Transform};
//! use lumbre_trace::{TraceOptions, trace};
//!
//! let mut world = World::new();
//! let glass = Material { transmission: glam::Vec3::ONE, ior: 1.5, ..Material::matt(glam::Vec3::ZERO) };
//! world.spawn((Mesh(Arc::new(lumbre_mesh::shapes::uv_sphere(1.0, 64, 32))), glass));
//! world.spawn((Light::point(glam::Vec3::ONE), Transform::from_xyz(2.0, 2.0, 2.0)));
//! world.spawn((Camera::default(), Transform::from_xyz(0.0, 0.0, 4.0)));
//! let options = TraceOptions { size: (64, 48), depth: Some(5), ..TraceOptions::default() };
//! let (picture, report) = trace(&mut world, &options, &|_| ControlFlow::Continue(()))?;
//! assert!(picture.radiance.len() == 64 * 48 && report.finished == 1.0);
//! # Ok::<(), lumbre_trace::TraceError>(())
//! ```

mod aov;
mod branch;
mod branch_drawing;
mod branch_svg;
mod camera_ray;
mod checkpoint;
mod comparison;
mod coplanar;
mod direct_light;
mod display;
mod emitter_tree;
mod error;
mod estimator;
mod film;
mod filter;
mod fingerprint;
mod first_hit;
pub mod flip;
mod geometry;
mod heat;
mod interface;
mod lamp_cone;
mod light_aovs;
mod light_sampling;
mod light_terms;
mod light_tree;
mod lobe_sampling;
mod medium;
mod metering;
mod options;
mod path;
mod random;
mod ray_rates;
mod ray_tree;
mod ray_tree_node;
mod rendering;
mod sample_distribution;
mod scene;
mod scene_outline;
mod shadow_ray;
mod surface_point;
mod tiles;
mod trace;
mod view;

pub use aov::{Aov, AovPicture, AovValues, LightPart};
pub use branch::{Branch, BranchLamp, BranchLight, BranchPoint, Kind};
pub use branch_drawing::TreeFormat;
pub use checkpoint::{Continuation, Keep};
pub use comparison::{Comparison, Displayed, compare, compare_displayed, relative_error};
pub use display::shown;
pub use error::{CheckpointError, TraceError};
pub use filter::Filter;
pub use first_hit::FirstHit;
pub use heat::heat_color;
pub use metering::Metering;
pub use options::{
    Cut, DEFAULT_DEPTH, DEFAULT_PATHS, DEFAULT_WEIGHT, Ended, Integrator, MAXIMUM_DEPTH, MAXIMUM_SAMPLES,
    Picture, Progress, TraceOptions, TraceReport,
};
pub use ray_rates::{RayRate, RayRates};
pub use rendering::Listener;
pub use trace::{Tracer, trace};
