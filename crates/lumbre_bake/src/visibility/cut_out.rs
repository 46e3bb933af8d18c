//! Cuts out of convex polygons what triangles hide of them from where is looked: the pyramid over each triangle's edges and beyond its
//! plane (Nishita and Nakamae, "Half-Tone Representation of 3-D Objects Illuminated by Area Sources", 1983), or the prism where is looked
//! from infinitely far. Not what is done with the pieces that are left: `visible_part` and `shadow_clipping`.

use glam::DVec3;

use super::shaft::Corners;

/// Corners of a piece, and pieces, at most: what needs more is left to others.
const CORNERS: usize = 12;
const PIECES: usize = 24;

/// What is left, by its share, where triangles that meet leave gaps as narrow as coordinates are rounded: nothing.
pub(crate) const GAP: f64 = 1.0 / (1 << 16) as f64;

/// A convex polygon.
#[derive(Clone, Copy)]
pub(crate) struct Piece {
    corners: [DVec3; CORNERS],
    count: usize,
}

impl Piece {
    const NONE: Self = Self { corners: [DVec3::ZERO; CORNERS], count: 0 };

    /// `None` if it is full.
    fn push(&mut self, corner: DVec3) -> Option<()> {
        *self.corners.get_mut(self.count)? = corner;
        self.count += 1;
        Some(())
    }

    pub fn corners(&self) -> &[DVec3] {
        &self.corners[..self.count]
    }

    /// Its parts outside and inside of a half-space: heights above 0 are inside.
    #[inline(always)]
    fn split(&self, outside: &mut Self, inside: &mut Self, height: impl Fn(DVec3) -> f64) -> Option<()> {
        (outside.count, inside.count) = (0, 0);
        let Some(&last) = self.corners().last() else { return Some(()) };
        let (mut before, mut before_height) = (last, height(last));
        for &corner in self.corners() {
            let own = height(corner);
            if (own > 0.0) != (before_height > 0.0) {
                let crossing = before.lerp(corner, before_height / (before_height - own));
                outside.push(crossing)?;
                inside.push(crossing)?;
            }
            if own > 0.0 {
                inside.push(corner)?
            } else {
                outside.push(corner)?
            }
            (before, before_height) = (corner, own);
        }
        Some(())
    }
}

/// Room for the pieces of a polygon.
pub(crate) struct Pieces {
    list: [Piece; PIECES],
    count: usize,
    /// What is left of one while it is cut, and of that.
    rest: [Piece; 2],
}

impl Pieces {
    pub fn new() -> Self {
        Self { list: [Piece::NONE; PIECES], count: 0, rest: [Piece::NONE; 2] }
    }

    /// Begins anew with a convex polygon.
    pub fn begin(&mut self, corners: &[DVec3]) -> Option<()> {
        self.count = 1;
        self.list[0].count = 0;
        corners.iter().try_for_each(|&corner| self.list[0].push(corner))
    }

    /// Leaves of the only piece what is above a plane.
    pub fn clip(&mut self, height: impl Fn(DVec3) -> f64) -> Option<()> {
        let [whole, below] = &mut self.rest;
        *whole = self.list[0];
        whole.split(below, &mut self.list[0], height)
    }

    /// The pieces that are left.
    pub fn list(&self) -> &[Piece] {
        &self.list[..self.count]
    }

    /// Takes away what a triangle hides; whether that is anything. `None` if there are too many pieces.
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

/// What a triangle hides: inside of three planes through its edges, and beyond its own.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shadow {
    planes: [DVec3; 4],
    heights: [f64; 4],
}

impl Shadow {
    /// Of a triangle relative to the point that looks; none if it is seen edge on.
    pub fn new([a, b, c]: Corners) -> Option<Self> {
        let volume = a.dot(b.cross(c));
        let turned = volume.signum();
        let planes = [a.cross(b), b.cross(c), c.cross(a), (b - a).cross(c - a)].map(|normal| normal * turned);
        (volume != 0.0).then_some(Self { planes, heights: [0.0, 0.0, 0.0, volume.abs()] })
    }

    /// As seen from infinitely far in a direction; none if it is seen edge on.
    pub fn parallel([a, b, c]: Corners, towards: DVec3) -> Option<Self> {
        let own = (b - a).cross(c - a);
        let volume = -own.dot(towards);
        let turned = volume.signum();
        let side = |from: DVec3, to: DVec3| (to - from).cross(towards);
        let planes = [side(a, b), side(b, c), side(c, a), own].map(|normal| normal * turned);
        // Of both ends: the same for the triangle beyond the edge.
        let height =
            |side: usize, from: DVec3, to: DVec3| 0.5 * (planes[side].dot(from) + planes[side].dot(to));
        let heights = [height(0, a, b), height(1, b, c), height(2, c, a), planes[3].dot(a)];
        (volume != 0.0).then_some(Self { planes, heights })
    }

    /// Above 0 inside.
    #[inline(always)]
    fn height(&self, side: usize, corner: DVec3) -> f64 {
        self.planes[side].dot(corner) - self.heights[side]
    }

    fn is_beside(&self, piece: &Piece) -> bool {
        (0..4).any(|side| piece.corners().iter().all(|&corner| self.height(side, corner) <= 0.0))
    }

    /// Whether a point is hidden. Its edge hides, too: triangles that share one leave no gap.
    pub fn hides(&self, point: DVec3) -> bool {
        (0..3).all(|side| self.height(side, point) >= 0.0) && self.height(3, point) > 0.0
    }
}
