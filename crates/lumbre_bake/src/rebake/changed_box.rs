//! The box of an object that changed, then or now. Not what it does to the light.

use glam::Vec3;

/// A box that a changed object filled, or fills now; canonical units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ChangedBox {
    pub low: Vec3,
    pub high: Vec3,
    /// For what is gone: the least and the most that left it, W/m². None for what is here now.
    pub left: Option<[Vec3; 2]>,
}

impl ChangedBox {
    /// Of the sphere around it.
    pub fn center(&self) -> Vec3 {
        0.5 * (self.low + self.high)
    }

    /// Of the sphere around it.
    pub fn radius(&self) -> f32 {
        0.5 * (self.high - self.low).length()
    }
}
