//! The part of a level that a player sees, and the openings through which light enters it.

#![allow(dead_code, reason = "programs that only build the scenes do not read it")]

use bevy_ecs::resource::Resource;
use glam::DVec3;

/// An axis-aligned box in world space, and rectangles (a corner and two edges), such as windows and doors, towards
/// which paths are guided.
#[derive(Resource, Clone, Debug)]
pub struct Region {
    pub low: DVec3,
    pub high: DVec3,
    pub openings: Vec<[DVec3; 3]>,
}

impl Region {
    /// Whether a point is inside the box or on its faces.
    pub fn holds(&self, point: DVec3) -> bool {
        let slack = 1e-4 * (self.high - self.low).max_element();
        point.cmpge(self.low - slack).all() && point.cmple(self.high + slack).all()
    }
}
