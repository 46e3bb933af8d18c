//! A receiver of direct light with the samples that its light is computed by. The light itself is computed in
//! `irradiance`.

use crate::sampling::Sequence;
use crate::scene::Receiver;
use crate::visibility::Visibility;

/// Maps the unit square onto the surface of a receiver; `None` where it has none.
pub(crate) trait SurfacePoints: Fn(f32, f32) -> Option<Receiver> {}

impl<F: Fn(f32, f32) -> Option<Receiver>> SurfacePoints for F {}

/// A piece of surface that receives direct light as a whole, and how it is sampled.
pub(crate) struct SampledReceiver<'a, P: SurfacePoints> {
    pub point: P,
    /// Where `point` knows only a few points that stand for the receiver: maps the unit square onto all of it and what
    /// is beside it, where it gives `None`.
    pub covered: Option<&'a dyn Fn(f32, f32) -> Option<Receiver>>,
    /// Whether it is a single point, so that its light need not be averaged.
    pub is_point: bool,
    /// The longer side of a receiver that is flat, canonical units: at a distance its middle stands for all of it.
    pub flat_side: Option<f32>,
    /// What is known of the occluders between it and the sources.
    pub visibility: &'a Visibility<'a>,
    pub sequence: Sequence,
    /// Shadow rays to each source that is sampled individually.
    pub samples: u32,
}
