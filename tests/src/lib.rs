//! What the frame tests share: the f64 twin of a frame, comparisons and their bounds, and small scenes. This
//! crate's library contains no frame tests itself.
//!
//! ```text
//!    World ──► lumbre_render (GPU, f32) ──► frame ─┐
//!      │                                           ├─► compare ──► max-abs, relative L2
//!      └─────► twin (CPU, f64) ───────────► frame ─┘
//! ```
//!
//! ```
//! use lumbre_tests::compare::compare;
//! use glam::DVec3;
//!
//! let black = vec![Some(DVec3::ZERO); 4];
//! let mut grey = black.clone();
//! assert_eq!(compare(&black, &grey).largest, 0.0);
//! grey[2] = Some(DVec3::splat(0.25));
//! assert_eq!(compare(&black, &grey).largest, 0.25);
//! ```

pub mod compare;
pub mod device;
pub mod kernel;
pub mod panes;
pub mod running_error;
pub mod scenes;
pub mod shared_files;
pub mod twin;
