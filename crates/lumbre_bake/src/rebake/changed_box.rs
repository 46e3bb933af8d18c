//! The bounding box of an object that has changed, before or after the change. The effect on the light is estimated in
//! `direct_light_invalidation` and `indirect_change`.

use glam::Vec3;

use crate::bounds::Bounds;

/// The bounding box of a changed object as it was or as it is, canonical units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ChangedBox {
    pub bounds: Bounds<Vec3>,
    /// For an object of the former scene: the least and the most light that left it, W/m². `None` for an object of the
    /// new scene.
    pub former_exitance: Option<[Vec3; 2]>,
}

impl ChangedBox {
    /// Centre of the bounding sphere.
    pub fn center(&self) -> Vec3 {
        0.5 * (self.bounds.low + self.bounds.high)
    }

    /// Radius of the bounding sphere.
    pub fn radius(&self) -> f32 {
        0.5 * (self.bounds.high - self.bounds.low).length()
    }
}
