//! What is known about the occluders between a receiver and the sources. `shaft` finds them, `sources` computes the
//! light.

use glam::DVec3;

use super::shadow_clipping::{LightVisibility, ReceiverShape};
use super::shaft::Triangle;

/// What is known about the visibility of sources from a receiver. Sources that are not listed need shadow rays.
pub(crate) struct Visibility<'a> {
    /// Emissive surfaces whose possible occluders are known.
    pub lamps: Vec<LampOccluders>,
    /// Punctual lights whose visibility is known, by ascending index.
    pub lights: &'a [(u32, LightVisibility)],
    /// The receiver's shape, if shadows of punctual lights may fall on it.
    pub receiver_shape: Option<ReceiverShape>,
    /// The corners of the receiver in order, if it is a whole parallelogram; canonical units.
    pub square: Option<[DVec3; 4]>,
}

/// All triangles that may stand between a receiver and the emitters of one node of the emitter tree.
pub(crate) struct LampOccluders {
    pub node: u32,
    /// The emitters that face the receiver, each with its possible occluders; empty if nothing occludes any of them.
    pub emitters: Vec<(u32, Vec<Triangle>)>,
}

impl Visibility<'_> {
    /// Nothing is known.
    pub const UNKNOWN: Self = Self { lamps: Vec::new(), lights: &[], receiver_shape: None, square: None };

    /// What is known about a light, given by its index.
    pub fn of_light(&self, light: u32) -> Option<&LightVisibility> {
        let place = self.lights.binary_search_by_key(&light, |(light, _)| *light).ok()?;
        Some(&self.lights[place].1)
    }
}
