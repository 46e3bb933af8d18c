//! Axis-aligned bounding boxes, which are collected from points.

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// The lowest and the highest coordinates of some points; of no points, +∞ and -∞.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Bounds<V> {
    pub low: V,
    pub high: V,
}

macro_rules! bounds_of {
    ($($point:ty),*) => {$(
        impl Default for Bounds<$point> {
            fn default() -> Self {
                Self { low: <$point>::INFINITY, high: <$point>::NEG_INFINITY }
            }
        }

        impl Extend<$point> for Bounds<$point> {
            fn extend<I: IntoIterator<Item = $point>>(&mut self, points: I) {
                for point in points {
                    (self.low, self.high) = (self.low.min(point), self.high.max(point));
                }
            }
        }

        impl FromIterator<$point> for Bounds<$point> {
            fn from_iter<I: IntoIterator<Item = $point>>(points: I) -> Self {
                let mut bounds = Self::default();
                bounds.extend(points);
                bounds
            }
        }

        impl Bounds<$point> {
            /// Whether there were no points.
            pub fn is_empty(&self) -> bool {
                !self.low.cmple(self.high).all()
            }
        }
    )*};
}

bounds_of!(Vec3, DVec3);
