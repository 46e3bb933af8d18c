//! The part of a level that is looked at, and the openings that light comes in through. Not its geometry.

#![allow(dead_code, reason = "what only builds the scenes reads none of it")]

use bevy_ecs::resource::Resource;
use glam::DVec3;

/// An axis-aligned box of the world, and rectangles (a corner and two edges) that guide paths to the light: windows, doors.
#[derive(Resource, Clone, Debug)]
pub struct Region {
    pub low: DVec3,
    pub high: DVec3,
    pub openings: Vec<[DVec3; 3]>,
}

impl Region {
    /// Whether a point is in the box or on its sides.
    pub fn holds(&self, point: DVec3) -> bool {
        let slack = 1e-4 * (self.high - self.low).max_element();
        point.cmpge(self.low - slack).all() && point.cmple(self.high + slack).all()
    }
}
