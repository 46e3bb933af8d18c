//! What is known of the ways from a receiver to the sources. Not how it is found: that is `shaft`; not the light: that is `direct`.

use glam::DVec3;

use super::shadow_clipping::{LightVisibility, ReceiverShape};
use super::shaft::Corners;

/// What is known of the ways from a receiver to the sources: of those that are not named rays have to tell.
pub(crate) struct Visibility<'a> {
    /// Parts of the emissive surfaces.
    pub lamps: Vec<LampOccluders>,
    /// Lights, by their numbers and in their order.
    pub lights: &'a [(u32, LightVisibility)],
    /// What the receiver shows, where shadows of lights may fall on it.
    pub receiver_shape: Option<ReceiverShape>,
    /// Its corners, one after the other, if it is all of a parallelogram; canonical units.
    pub square: Option<[DVec3; 4]>,
}

/// The triangles that may stand between a receiver and the emitters of one part of the sources: no others do.
pub(crate) struct LampOccluders {
    pub node: u32,
    /// Those that shine on it; none where nothing stands before any of them.
    pub emitters: Vec<(u32, Vec<Corners>)>,
}

impl Visibility<'_> {
    /// Nothing is known.
    pub const UNKNOWN: Self = Self { lamps: Vec::new(), lights: &[], receiver_shape: None, square: None };

    /// What is known of a light, by its number.
    pub fn of_light(&self, light: u32) -> Option<&LightVisibility> {
        let place = self.lights.binary_search_by_key(&light, |(light, _)| *light).ok()?;
        Some(&self.lights[place].1)
    }
}
