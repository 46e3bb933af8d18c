//! Cuts the shadows of triangles out of convex polygons. The shadow of a triangle as seen from a point is the pyramid
//! through its edges, beyond its plane (Nishita and Nakamae, "Half-Tone Representation of 3-D Objects Illuminated by
//! Area Sources", 1983); for a direction it is a prism. `visible_part` and `shadow_clipping` use the pieces that
//! remain.

use glam::DVec3;

use super::shaft::Triangle;

/// Most corners of a piece; cuts that need more fail, and the caller falls back on sampling.
const MAX_CORNERS: usize = 12;
/// Most pieces, likewise.
const MAX_PIECES: usize = 24;

/// Remaining fraction of a polygon up to which it counts as fully hidden: rounding leaves narrow gaps between adjacent
/// triangles.
pub(crate) const GAP: f64 = 1.0 / (1 << 16) as f64;

/// A convex polygon.
#[derive(Clone, Copy)]
pub(crate) struct ConvexPolygon {
    corners: [DVec3; MAX_CORNERS],
    count: usize,
}

impl ConvexPolygon {
    const NONE: Self = Self { corners: [DVec3::ZERO; MAX_CORNERS], count: 0 };

    /// Appends a corner; `None` if the piece is full.
    fn push(&mut self, corner: DVec3) -> Option<()> {
        *self.corners.get_mut(self.count)? = corner;
        self.count += 1;
        Some(())
    }

    pub fn corners(&self) -> &[DVec3] {
        &self.corners[..self.count]
    }

    /// Splits the piece into its parts outside and inside a half-space; points with heights above 0 are inside. `None`
    /// if a part has too many corners.
    #[inline(always)]
    fn split(&self, outside: &mut Self, inside: &mut Self, height: impl Fn(DVec3) -> f64) -> Option<()> {
        (outside.count, inside.count) = (0, 0);
        let Some(&last) = self.corners().last() else { return Some(()) };
        let (mut before, mut before_height) = (last, height(last));
        for &corner in self.corners() {
            let corner_height = height(corner);
            if (corner_height > 0.0) != (before_height > 0.0) {
                let crossing = before.lerp(corner, before_height / (before_height - corner_height));
                outside.push(crossing)?;
                inside.push(crossing)?;
            }
            if corner_height > 0.0 {
                inside.push(corner)?
            } else {
                outside.push(corner)?
            }
            (before, before_height) = (corner, corner_height);
        }
        Some(())
    }
}

/// The remaining pieces of a polygon, in memory that is reused from polygon to polygon.
pub(crate) struct PolygonClipper {
    list: [ConvexPolygon; MAX_PIECES],
    count: usize,
    /// Scratch memory for the piece that is being cut.
    rest: [ConvexPolygon; 2],
}

impl PolygonClipper {
    pub fn new() -> Self {
        Self { list: [ConvexPolygon::NONE; MAX_PIECES], count: 0, rest: [ConvexPolygon::NONE; 2] }
    }

    /// Starts over with a convex polygon; `None` if it has too many corners.
    pub fn begin(&mut self, corners: &[DVec3]) -> Option<()> {
        self.count = 1;
        self.list[0].count = 0;
        corners.iter().try_for_each(|&corner| self.list[0].push(corner))
    }

    /// Clips the first and only piece to the points whose `height` is above 0.
    pub fn clip(&mut self, height: impl Fn(DVec3) -> f64) -> Option<()> {
        let [whole, below] = &mut self.rest;
        *whole = self.list[0];
        whole.split(below, &mut self.list[0], height)
    }

    /// The remaining pieces.
    pub fn list(&self) -> &[ConvexPolygon] {
        &self.list[..self.count]
    }

    /// Removes a shadow from all pieces. Returns whether it overlapped any of them; `None` if there are too many
    /// pieces.
    pub fn cut(&mut self, shadow: &Shadow) -> Option<bool> {
        let Self { list: pieces, count, rest } = self;
        let [mut rest, mut next] = rest.each_mut();
        let (before, mut kept) = (*count, 0);
        for place in 0..before {
            if shadow.is_beside(&pieces[place]) {
                if kept < place {
                    pieces[kept] = pieces[place];
                }
                kept += 1;
                continue;
            }
            *rest = pieces[place];
            for side in 0..4 {
                let outside = pieces.get_mut(*count)?;
                rest.split(outside, next, |corner| shadow.height(side, corner))?;
                *count += usize::from(outside.count >= 3);
                (rest, next) = (next, rest);
                if rest.count < 3 {
                    break;
                }
            }
        }
        if kept < before {
            pieces.copy_within(before..*count, kept);
            *count -= before - kept;
        }
        Some(kept < before)
    }
}

/// The shadow of a triangle: the points inside three planes through its edges and beyond its own plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shadow {
    planes: [DVec3; 4],
    heights: [f64; 4],
}

impl Shadow {
    /// The shadow as seen from a point, with corners relative to that point; `None` if the triangle is seen edge-on.
    pub fn new([a, b, c]: Triangle) -> Option<Self> {
        let volume = a.dot(b.cross(c));
        let sign = volume.signum();
        let planes = [a.cross(b), b.cross(c), c.cross(a), (b - a).cross(c - a)].map(|normal| normal * sign);
        (volume != 0.0).then_some(Self { planes, heights: [0.0, 0.0, 0.0, volume.abs()] })
    }

    /// The shadow as seen from infinitely far away in the direction `towards`; `None` if the triangle is seen edge-on.
    pub fn parallel([a, b, c]: Triangle, towards: DVec3) -> Option<Self> {
        let normal = (b - a).cross(c - a);
        let volume = -normal.dot(towards);
        let sign = volume.signum();
        let side = |from: DVec3, to: DVec3| (to - from).cross(towards);
        let planes = [side(a, b), side(b, c), side(c, a), normal].map(|normal| normal * sign);
        // The mean over both ends of an edge, so that the adjacent triangle gets exactly the same plane.
        let height =
            |side: usize, from: DVec3, to: DVec3| 0.5 * (planes[side].dot(from) + planes[side].dot(to));
        let heights = [height(0, a, b), height(1, b, c), height(2, c, a), planes[3].dot(a)];
        (volume != 0.0).then_some(Self { planes, heights })
    }

    /// Signed distance from a plane of the shadow, scaled by the length of its normal; above 0 inside.
    #[inline(always)]
    fn height(&self, side: usize, corner: DVec3) -> f64 {
        self.planes[side].dot(corner) - self.heights[side]
    }

    /// Whether one of the planes separates the shadow from a piece.
    fn is_beside(&self, piece: &ConvexPolygon) -> bool {
        (0..4).any(|side| piece.corners().iter().all(|&corner| self.height(side, corner) <= 0.0))
    }

    /// Whether a point is in the shadow. The edges are included, so that adjacent triangles leave no gap.
    pub fn hides(&self, point: DVec3) -> bool {
        (0..3).all(|side| self.height(side, point) >= 0.0) && self.height(3, point) > 0.0
    }
}
