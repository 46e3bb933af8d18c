//! The part of a small flat piece of surface that a point, or a direction, sends light to past some triangles: exactly, by cutting their
//! shadows out of it. Not which triangles: that is `shaft`; not the light: that is `punctual`.

use glam::DVec3;

use super::cut_out::{GAP, Piece, Pieces, Shadow};

/// Where light comes from, canonical units.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Origin {
    Point(DVec3),
    /// Towards it, of unit length.
    Direction(DVec3),
}

/// What a receiver shows of a plane.
#[derive(Clone, Debug)]
pub(crate) enum ReceiverShape {
    /// Corners, one after the other.
    Parallelogram([DVec3; 4]),
    /// Each as much as any other.
    Points(Vec<DVec3>),
}

/// What is known of a light without size on its way to a receiver.
#[derive(Clone, Debug)]
pub(crate) enum LightVisibility {
    /// Nothing stands between; also to a light with a size.
    Clear,
    /// It does not shine here.
    Dark,
    /// Nothing of it arrives.
    Hidden,
    /// These shadows may fall on it.
    Shadows(Origin, Vec<Shadow>),
}

/// Points along a side of what is cut into too many pieces.
const FINE: u32 = 8;

impl Origin {
    /// What a triangle hides from here; none if it is seen edge on.
    pub fn shadow(self, corners: [DVec3; 3]) -> Option<Shadow> {
        match self {
            Self::Point(point) => Shadow::new(corners.map(|corner| corner - point)),
            Self::Direction(towards) => Shadow::parallel(corners, towards),
        }
    }

    /// What shadows' coordinates begin at.
    fn zero(self) -> DVec3 {
        match self {
            Self::Point(point) => point,
            Self::Direction(_) => DVec3::ZERO,
        }
    }

    /// Calls `visit` for the pieces of `shown` that are lit: with a point that stands for each, and the piece's share of the whole. Returns
    /// whether the shares are exact, and not those of points.
    pub fn lit(
        self,
        shape: &ReceiverShape,
        shadows: &[Shadow],
        room: &mut Pieces,
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
                if room.begin(&corners).is_none() || !left(room, shadows) {
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
                let (whole, _) = middle(&corners);
                if is_left(whole, room) {
                    let parts = room.list().iter().map(Piece::corners).map(middle);
                    parts.for_each(|(area, middle)| visit(zero + middle, area / whole));
                }
                true
            }
        }
    }

    /// Whether nothing of a parallelogram is lit.
    pub fn hides_all(self, corners: [DVec3; 4], shadows: &[Shadow], room: &mut Pieces) -> bool {
        let corners = corners.map(|corner| corner - self.zero());
        let whole = middle(&corners).0;
        // Of no area, nothing is known.
        whole > 0.0 && room.begin(&corners).is_some() && left(room, shadows) && !is_left(whole, room)
    }
}

/// Whether there is more left of a whole area than the gaps that rounding leaves between shadows that meet.
fn is_left(whole: f64, room: &Pieces) -> bool {
    let lit: f64 = room.list().iter().map(|piece| middle(piece.corners()).0).sum();
    whole > 0.0 && lit > GAP * whole
}

/// Cuts shadows out of what is in `room`; `false` if there are too many pieces.
fn left(room: &mut Pieces, shadows: &[Shadow]) -> bool {
    for shadow in shadows {
        if room.cut(shadow).is_none() {
            return false;
        }
        if room.list().is_empty() {
            break;
        }
    }
    true
}

/// Area and centroid of a flat convex polygon.
fn middle(corners: &[DVec3]) -> (f64, DVec3) {
    let Some(&first) = corners.first() else { return (0.0, DVec3::ZERO) };
    let (mut area, mut moment) = (0.0, DVec3::ZERO);
    for pair in corners[1..].windows(2) {
        let own = 0.5 * (pair[0] - first).cross(pair[1] - first).length();
        area += own;
        moment += (pair[0] + pair[1] - 2.0 * first) * (own / 3.0);
    }
    (area, if area > 0.0 { first + moment / area } else { first })
}

#[cfg(test)]
#[path = "shadow_clipping_tests.rs"]
mod tests;
