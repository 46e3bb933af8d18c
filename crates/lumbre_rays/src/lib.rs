//! Bounding volume hierarchy and watertight ray casting over triangles.
//!
//! This crate only intersects rays with triangles: it has no lights, no materials, no ECS and no GPU code.
//!
//! ```text
//!   triangles ──► Bvh::build ──► canonical scale (2^k) ──► obvhs binary tree ──► collapse to eight-wide nodes
//!                                                                                and blocks of eight triangles
//!                                                                                           │
//!   Ray ──► ray setup (shear, widened slabs) ──► traversal ──► box test ──► watertight test ──► Hit
//!    ▲                                          front to back    × 8            × 8              │
//!    └──────────────────────────── offset_ray_origin ◄─────────────────────────────────────────┘
//!
//!        a node                                    a block
//!   lane 0   1   2   3   4   5   6   7       lane 0   1   2   3   4   5   6   7
//!      ┌───┬───┬───┬───┬───┬───┬───┬───┐        ┌───┬───┬───┬───┬───┬───┬───┬───┐
//!      │box│box│box│box│box│box│   │   │        │ △ │ △ │ △ │ △ │ △ │ △ │ △ │   │
//!      └─┬─┴─┬─┴───┴─┬─┴───┴───┴───┴───┘        └───┴───┴───┴───┴───┴───┴───┴───┘
//!        ▼   ▼       ▼                           one test for all, empty lanes are NaN
//!      node block   node     a ray of octant o visits the lanes i ^ o, i = 0 .. 7
//! ```
//!
//! - Watertight: a ray that meets a shared edge or vertex of a closed surface hits the surface (Woop, Benthin, Wald
//!   2013; Ize 2013).
//! - Independent of scale: no absolute epsilon. Multiplying a scene by 2^k changes no hit.
//! - Deterministic: the same triangles give the same tree, and ties go to the lower index. AVX2 is used where the
//!   machine has it and the target's baseline elsewhere; products are never fused with sums, so that both compute
//!   the same bits.
//! - Fast: with the rays that a bake casts no other measured crate is faster in any scene; with camera rays the
//!   fastest is level or ahead in three of the five. The table has millions of rays per second on one thread of an
//!   EPYC (2 shared cores), and their ratio to the rate of obvhs 0.4's `CwBvh` (slow build), which is not
//!   watertight. `cargo bench -p lumbre_rays --bench ratios` prints these figures with quartiles and the other
//!   crates; `--bench throughput` prints divan's table.
//!
//! | scene, triangles | camera, closest | cosine, closest | cosine, any | to the lamp, any |
//! |---|---|---|---|---|
//! | Cornell box, 38 | 17.2, 1.02 times | 11.1, 1.39 times | 21.0, 1.54 times | 18.6, 1.76 times |
//! | study, 230 | 19.7, 0.95 times | 13.6, 1.49 times | 23.3, 1.56 times | 15.9, 1.46 times |
//! | two rooms, 194 | 17.1, 1.50 times | 9.7, 1.51 times | 22.5, 1.54 times | 13.2, 1.60 times |
//! | walls in small triangles, 140,000 | 6.2, 18 times | 1.3, 5.2 times | 1.5, 4.4 times | 1.8, 6.2 times |
//! | bunny in a room, 69,467 | 20.9, 0.80 times | 13.8, 1.34 times | 22.7, 1.50 times | 18.6, 1.28 times |
//!
//! ```
//! use glam::Vec3;
//! use lumbre_rays::{Bvh, Ray, offset_ray_origin, triangle_extent};
//!
//! let triangle = [Vec3::ZERO, Vec3::X, Vec3::Y];
//! let bvh = Bvh::build(&[triangle]);
//! let hit = bvh.closest_hit(&Ray::new(Vec3::new(0.25, 0.5, 2.0), Vec3::NEG_Z)).expect("straight at it");
//! assert_eq!((hit.triangle, hit.distance, hit.barycentric), (0, 2.0, (0.25, 0.5)));
//! let origin = offset_ray_origin(hit.position(&triangle), Vec3::Z, triangle_extent(&triangle));
//! assert!(!bvh.any_hit(&Ray::new(origin, Vec3::new(1.0, 0.0, 1e-6))));
//! ```

mod build;
mod bvh;
mod canonical_scale;
mod collapse;
mod median_split;
mod ray;
mod ray_offset;
mod ray_setup;
mod traversal;
mod triangle_block;
mod visit_order;
mod wide_node;
mod wide_tree;

pub use bvh::Bvh;
pub use ray::{Hit, Ray};
pub use ray_offset::{offset_ray_origin, triangle_extent};
