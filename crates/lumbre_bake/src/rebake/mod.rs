//! Baking again after a change: keeps the samples of a former bake that the change hardly affects, such as those of a
//! room far from a crate that has moved. The rest is baked by the usual stages, which take what is kept as if they had
//! computed it: [`Rebake`] stands around them.
//!
//! ```text
//!   samples of the former bake ─► changes ─► objects that moved, came or went ─► boxes that block light, or did before
//!                                   │
//!                                   ├─► direct_light_invalidation: texels with a path to a light through such a box
//!                                   │       get new direct light
//!                                   │
//!                                   └─► indirect_change: a linear estimate of the change of the light by bounces,
//!                                       │   first of patches, then of texels
//!                                       └─► choice: keeps the texels whose estimated change, together with their
//!                                               reuse_error so far, is small beside the requested error
//! ```
//!
//! Light is linear: the change of the light by bounces obeys the radiosity equation of the new scene, with the
//! immediate changes as its source (what the boxes hide or reveal, and what has changed in direct light). The equation
//! is solved on patches, so that there is no noise where nothing changes. The estimated change of everything that is
//! kept is added to the stated error, as its `reuse_error`.

mod around_bake;
mod change_sums;
mod changed_box;
mod changes;
mod choice;
mod direct_light_invalidation;
mod fingerprints;
mod indirect_change;
mod samples;
mod samples_file;

pub(crate) use around_bake::Rebake;
pub use samples::Samples;
pub use samples_file::{PackedSamples, SamplesError};
