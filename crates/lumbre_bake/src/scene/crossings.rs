//! Everything that a line crosses, in order, and what it looks like from either side. Not a ray's first hit: that is `occlusion`.

use std::cell::RefCell;

use glam::Vec3;
use lumbre_rays::Ray;

use super::BakeScene;
use super::material::Side;
use super::occlusion::SAME_PLACE;

/// What stands at a place of a line, seen along it one way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Face {
    /// A side that takes part in the exchange of light.
    Lit {
        triangle: u32,
        side: Side,
        /// Barycentric weights of the second and third vertex.
        at: (f32, f32),
    },
    /// The back of a single-sided open surface: black.
    Back,
    /// The inside of a closed piece.
    Inside,
}

/// A place where a line crosses surfaces: one, or several that lie in the same place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    /// VisibilitySummary from before, in the line's direction.
    pub before: Face,
    /// VisibilitySummary from beyond, against the line's direction.
    pub beyond: Face,
}

/// One triangle that the line meets.
#[derive(Clone, Copy, Debug)]
struct Meeting {
    along: f32,
    triangle: u32,
    at: (f32, f32),
    /// Of the line with the front's normal.
    cosine: f32,
}

impl BakeScene {
    /// All crossings of a line from `origin` (before everything) in a direction of unit length, in order; `reach` is how far from the origin
    /// of the coordinates things are, canonical units.
    pub fn crossings(&self, origin: Vec3, direction: Vec3, reach: f32) -> Vec<Crossing> {
        let met = RefCell::new(Vec::new());
        // A hierarchy that accepts no hit goes on to the line's end: one traversal meets them all.
        let refuse = |triangle: u32, u: f32, v: f32| {
            if !self.masked || self.is_solid(triangle, u, v) {
                let own = &self.triangles[triangle as usize];
                let along = (own.position(u, v) - origin).dot(direction);
                let cosine = own.normal.dot(direction);
                met.borrow_mut().push(Meeting { along, triangle, at: (u, v), cosine });
            }
            false
        };
        self.bvh.closest_hit_filtered(&Ray::new(origin, direction), refuse);
        let mut met = met.into_inner();
        met.sort_unstable_by(|a, b| a.along.total_cmp(&b.along).then(a.triangle.cmp(&b.triangle)));
        let slack = SAME_PLACE * reach;
        // How far apart along their normals they are; what a plane's place is off by, a grazing line meets further along.
        let together = |a: &Meeting, b: &Meeting| {
            (b.along - a.along) * a.cosine.abs().min(b.cosine.abs()).max(1.0 / 1024.0) <= slack
        };
        met.chunk_by(together)
            .map(|place| Crossing {
                before: self.face(place.iter(), -1.0),
                beyond: self.face(place.iter().rev(), 1.0),
            })
            .collect()
    }

    /// Of what lies in one place, in the order in which it is met, the first that looks the way that `sign` says; a black one if none does,
    /// or if that way lies the inside of a solid.
    fn face<'a>(&self, place: impl Iterator<Item = &'a Meeting> + Clone, sign: f32) -> Face {
        let solid = |meeting: &Meeting| self.triangles[meeting.triangle as usize].solid;
        // Its backs there, but none of its fronts: it has some thickness.
        let is_inside = |meeting: &Meeting| {
            let own = solid(meeting);
            let shows = |other: &Meeting| solid(other) == own && other.cosine * sign > 0.0;
            own.is_some() && meeting.cosine * sign < 0.0 && !place.clone().any(shows)
        };
        if place.clone().any(is_inside) {
            return Face::Inside;
        }
        let lit = place.clone().find_map(|meeting| {
            let triangle = &self.triangles[meeting.triangle as usize];
            let front = meeting.cosine * sign > 0.0;
            let side = if front { Side::Front } else { Side::Back };
            (front || triangle.two_sided).then_some(Face::Lit {
                triangle: meeting.triangle,
                side,
                at: meeting.at,
            })
        });
        let mut place = place;
        lit.unwrap_or_else(|| match place.next() {
            Some(first) if self.triangles[first.triangle as usize].closed => Face::Inside,
            _ => Face::Back,
        })
    }
}
