//! Baking again what a change can have affected, and keeping the rest: after a crate has moved, the far room's samples are still good.
//! Not the bake: that takes what is kept as if it had computed it.
//!
//! ```text
//!   Samples of the former bake ─► changes ─► which objects moved, came, went ──► boxes that light may now pass, or no longer
//!                                   │
//!                                   ├─► relit:  texels whose ways to a lamp lead through such a box: direct light anew
//!                                   │
//!                                   └─► change: a linear estimate of how the light by bounces changes, patches first, then texels
//!                                          └─► choice: texels where that, with what was reuse_error before, is small beside the error asked for
//! ```
//!
//! Light is linear: the change of the light by bounces obeys the radiosity equation of the new scene, with the change that is seen at first hand as
//! its source (what the boxes hide or show, and what direct light has changed). That is solved on the patches, so that it brings no noise where nothing changes. What is reuse_error is added to the stated error.

mod changed_box;
mod changes;
mod choice;
mod direct_light_invalidation;
mod estimate;
mod fingerprints;
mod indirect_change;
mod report;
mod reuse;
mod samples;
mod samples_file;
mod settled;

pub(crate) use indirect_change::reused_gather;
pub(crate) use report::rebake_report;
pub(crate) use reuse::Reuse;
pub use samples::Samples;
pub(crate) use samples::TexelSamples;
pub use samples_file::SamplesError;
