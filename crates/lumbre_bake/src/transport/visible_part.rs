//! The part of an emitter that a point sees past some triangles, exactly: what each of them hides, a pyramid from the point over its edges
//! and beyond its plane, is cut out of the emitter, and Lambert's formula taken over the pieces that are left (Nishita and Nakamae,
//! "Half-Tone Representation of 3-D Objects Illuminated by Area Sources", 1983). Not which triangles: that is `shaft`.

use glam::DVec3;

use super::polygon::lambert;
use super::shaft::Corners;

/// Corners of a piece, and pieces, at most: what needs more is left to rays.
const CORNERS: usize = 12;
const PIECES: usize = 24;

/// A convex polygon, relative to the point that looks.
#[derive(Clone, Copy)]
struct Piece {
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

    fn corners(&self) -> &[DVec3] {
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

/// Room for the pieces of an emitter.
pub(crate) struct Pieces {
    list: [Piece; PIECES],
    /// What is left of one while it is cut, and of that.
    rest: [Piece; 2],
}

impl Pieces {
    pub const NONE: Self = Self { list: [Piece::NONE; PIECES], rest: [Piece::NONE; 2] };
}

/// What a point sees of an emitter.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Visible {
    /// Form factor of what is seen.
    pub factor: f64,
    /// Some of it is hidden.
    pub hidden: bool,
}

/// Form factor from a point with unit `normal` to what it sees of a triangle, that shines to its counter-clockwise side, past `blockers`.
/// `None` if they cut it into too many pieces.
pub(crate) fn visible_part(
    point: DVec3,
    normal: DVec3,
    emitter: &Corners,
    blockers: &[Corners],
    room: &mut Pieces,
) -> Option<Visible> {
    let [p, q, r] = emitter.map(|corner| corner - point);
    // Behind the triangle, or in its plane.
    if (q - p).cross(r - p).dot(p) >= 0.0 {
        return Some(Visible::default());
    }
    let Pieces { list: pieces, rest } = room;
    let [mut rest, mut next] = rest.each_mut();
    rest.count = 0;
    for corner in [p, q, r] {
        rest.push(corner)?;
    }
    rest.split(next, &mut pieces[0], |corner| corner.dot(normal))?;
    let (mut count, mut hidden) = (1, false);
    for blocker in blockers {
        let Some(shadow) = Shadow::new(blocker.map(|corner| corner - point)) else { continue };
        let (before, mut kept) = (count, 0);
        for place in 0..before {
            if shadow.is_beside(&pieces[place]) {
                if kept < place {
                    pieces[kept] = pieces[place];
                }
                kept += 1;
                continue;
            }
            hidden = true;
            *rest = pieces[place];
            for side in 0..4 {
                let outside = pieces.get_mut(count)?;
                rest.split(outside, next, |corner| shadow.height(side, corner))?;
                count += usize::from(outside.count >= 3);
                (rest, next) = (next, rest);
                if rest.count < 3 {
                    break;
                }
            }
        }
        if kept < before {
            pieces.copy_within(before..count, kept);
            count -= before - kept;
        }
        if count == 0 {
            break;
        }
    }
    let factor = pieces[..count].iter().map(|piece| lambert(normal, piece.corners())).sum::<f64>();
    Some(Visible { factor: factor.clamp(0.0, 1.0), hidden })
}

/// What a triangle hides: inside of three planes through the point and its edges, and beyond its own.
struct Shadow {
    planes: [DVec3; 4],
    /// Of its own.
    distance: f64,
}

impl Shadow {
    /// Of a triangle relative to the point; none if it is seen edge on.
    fn new([a, b, c]: Corners) -> Option<Self> {
        let volume = a.dot(b.cross(c));
        let turned = volume.signum();
        let planes = [a.cross(b), b.cross(c), c.cross(a), (b - a).cross(c - a)].map(|normal| normal * turned);
        (volume != 0.0).then_some(Self { planes, distance: volume.abs() })
    }

    /// Above 0 inside.
    #[inline(always)]
    fn height(&self, side: usize, corner: DVec3) -> f64 {
        let own = self.planes[side].dot(corner);
        if side == 3 { own - self.distance } else { own }
    }

    fn is_beside(&self, piece: &Piece) -> bool {
        (0..4).any(|side| piece.corners().iter().all(|&corner| self.height(side, corner) <= 0.0))
    }
}
