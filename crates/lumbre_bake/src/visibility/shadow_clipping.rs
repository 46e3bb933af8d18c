//! The lit part of a small flat receiver under a point or directional light, computed exactly by cutting the shadows of
//! occluders out of it. `shaft` finds the occluders, and `sources::punctual` computes the light.

use glam::DVec3;

use super::cut_out::{ConvexPolygon, GAP, PolygonClipper, Shadow};

/// Where the light comes from, in canonical units.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Origin {
    Point(DVec3),
    /// Unit vector towards the light.
    Direction(DVec3),
}

/// The shape of a flat receiver.
#[derive(Clone, Debug)]
pub(crate) enum ReceiverShape {
    /// The corners in order.
    Parallelogram([DVec3; 4]),
    /// Points of equal weight.
    Points(Vec<DVec3>),
}

/// What is known about the visibility of a light from a receiver.
#[derive(Clone, Debug)]
pub(crate) enum LightVisibility {
    /// Nothing occludes the light.
    Clear,
    /// The light emits nothing towards the receiver.
    Dark,
    /// The light is fully occluded.
    Hidden,
    /// These shadows of the light, which has no size, may fall on the receiver.
    Shadows(Origin, Vec<Shadow>),
}

/// Points along a side of the grid that replaces exact clipping if there are too many pieces.
const FINE: u32 = 8;

impl Origin {
    /// The shadow of a triangle; `None` if the triangle is edge-on to the light.
    pub fn shadow(self, corners: [DVec3; 3]) -> Option<Shadow> {
        match self {
            Self::Point(point) => Shadow::new(corners.map(|corner| corner - point)),
            Self::Direction(towards) => Shadow::parallel(corners, towards),
        }
    }

    /// The origin of the shadows' coordinates.
    fn zero(self) -> DVec3 {
        match self {
            Self::Point(point) => point,
            Self::Direction(_) => DVec3::ZERO,
        }
    }

    /// Calls `visit` for each lit piece of the receiver, with a point that represents it and its fraction of the whole.
    /// Returns whether the fractions are exact, and not estimated by points.
    pub fn lit(
        self,
        shape: &ReceiverShape,
        shadows: &[Shadow],
        pieces: &mut PolygonClipper,
        mut visit: impl FnMut(DVec3, f64),
    ) -> bool {
        let zero = self.zero();
        let is_lit = |point: DVec3| !shadows.iter().any(|shadow| shadow.hides(point - zero));
        match shape {
            ReceiverShape::Points(points) => {
                let share = 1.0 / points.len() as f64;
                points.iter().filter(|point| is_lit(**point)).for_each(|&point| visit(point, share));
                false
            }
            ReceiverShape::Parallelogram(corners) => {
                let corners = corners.map(|corner| corner - zero);
                if pieces.begin(&corners).is_none() || !cut_all(pieces, shadows) {
                    let share = 1.0 / f64::from(FINE * FINE);
                    let at = |place: u32| (f64::from(place) + 0.5) / f64::from(FINE);
                    let [a, b, _, d] = corners;
                    for place in 0..FINE * FINE {
                        let point = zero + a + (b - a) * at(place % FINE) + (d - a) * at(place / FINE);
                        if is_lit(point) {
                            visit(point, share);
                        }
                    }
                    return false;
                }
                let (whole, _) = area_and_centroid(&corners);
                if is_partly_lit(whole, pieces) {
                    let lit = pieces.list().iter().map(ConvexPolygon::corners).map(area_and_centroid);
                    lit.for_each(|(area, centroid)| visit(zero + centroid, area / whole));
                }
                true
            }
        }
    }

    /// Whether the shadows are known to cover a whole parallelogram.
    pub fn hides_all(self, corners: [DVec3; 4], shadows: &[Shadow], pieces: &mut PolygonClipper) -> bool {
        let corners = corners.map(|corner| corner - self.zero());
        let whole = area_and_centroid(&corners).0;
        // Nothing is known about a parallelogram without area.
        whole > 0.0
            && pieces.begin(&corners).is_some()
            && cut_all(pieces, shadows)
            && !is_partly_lit(whole, pieces)
    }
}

/// Whether more of the area `whole` remains than the gaps that rounding leaves between adjacent shadows.
fn is_partly_lit(whole: f64, pieces: &PolygonClipper) -> bool {
    let lit: f64 = pieces.list().iter().map(|piece| area_and_centroid(piece.corners()).0).sum();
    whole > 0.0 && lit > GAP * whole
}

/// Cuts all shadows out of `pieces`; `false` if there are too many pieces.
fn cut_all(pieces: &mut PolygonClipper, shadows: &[Shadow]) -> bool {
    for shadow in shadows {
        if pieces.cut(shadow).is_none() {
            return false;
        }
        if pieces.list().is_empty() {
            break;
        }
    }
    true
}

/// Area and centroid of a flat convex polygon.
fn area_and_centroid(corners: &[DVec3]) -> (f64, DVec3) {
    let Some(&first) = corners.first() else { return (0.0, DVec3::ZERO) };
    let (mut area, mut moment) = (0.0, DVec3::ZERO);
    for pair in corners[1..].windows(2) {
        let triangle_area = 0.5 * (pair[0] - first).cross(pair[1] - first).length();
        area += triangle_area;
        moment += (pair[0] + pair[1] - 2.0 * first) * (triangle_area / 3.0);
    }
    (area, if area > 0.0 { first + moment / area } else { first })
}

#[cfg(test)]
#[path = "shadow_clipping_tests.rs"]
mod tests;
