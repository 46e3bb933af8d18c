//! All surfaces that a line crosses, in order, and what each shows towards either end of the line. `occlusion` finds
//! only the first hit of a ray.

use std::cell::RefCell;

use glam::Vec3;
use lumbre_rays::Ray;

use super::BakeScene;
use super::material::Side;
use super::occlusion::SAME_PLACE;

/// What a crossing shows to one of the two directions along the line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Face {
    /// A side of a triangle that receives and reflects light.
    Lit {
        triangle: u32,
        side: Side,
        /// Barycentric weights of the second and third vertex.
        at: (f32, f32),
    },
    /// The back of a single-sided open surface, which is black.
    Back,
    /// The inside of a closed mesh.
    Inside,
}

/// A place where a line crosses one surface, or several coincident ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    /// What is seen from before the crossing, looking along the line's direction.
    pub before: Face,
    /// What is seen from beyond the crossing, looking against the line's direction.
    pub beyond: Face,
}

/// One triangle that the line hits.
#[derive(Clone, Copy, Debug)]
struct LineHit {
    /// Distance along the line.
    along: f32,
    triangle: u32,
    at: (f32, f32),
    /// Cosine between the line's direction and the normal of the triangle's front.
    cosine: f32,
}

impl BakeScene {
    /// All crossings of a line, in order. `origin` must lie before the whole scene and `direction` must be a unit
    /// vector; `reach` is the largest distance from the coordinate origin, which sets the rounding tolerance, in
    /// canonical units.
    pub fn crossings(&self, origin: Vec3, direction: Vec3, reach: f32) -> Vec<Crossing> {
        let hits = RefCell::new(Vec::new());
        // A traversal in which every hit is rejected continues to the end of the line, so one traversal finds all hits.
        let collect_hit = |triangle: u32, u: f32, v: f32| {
            if self.is_solid(triangle, u, v) {
                let hit = &self.triangles[triangle as usize];
                let along = (hit.position(u, v) - origin).dot(direction);
                let cosine = hit.normal.dot(direction);
                hits.borrow_mut().push(LineHit { along, triangle, at: (u, v), cosine });
            }
            false
        };
        self.bvh.closest_hit_filtered(&Ray::new(origin, direction), collect_hit);
        let mut hits = hits.into_inner();
        hits.sort_unstable_by(|a, b| a.along.total_cmp(&b.along).then(a.triangle.cmp(&b.triangle)));
        let slack = SAME_PLACE * reach;
        // Compares distances along the normal: on a grazing line, an error in a plane's position moves the hit much
        // further along the line.
        let is_same_place = |a: &LineHit, b: &LineHit| {
            (b.along - a.along) * a.cosine.abs().min(b.cosine.abs()).max(1.0 / 1024.0) <= slack
        };
        hits.chunk_by(is_same_place)
            .map(|place| Crossing {
                before: self.face(place.iter(), -1.0),
                beyond: self.face(place.iter().rev(), 1.0),
            })
            .collect()
    }

    /// What coincident triangles, in the order in which a viewer reaches them, show to that viewer. A triangle's front
    /// faces the viewer if its cosine has the sign `sign`. The result is the first lit side, or a black face if no side
    /// is lit or if the viewer is inside a solid.
    fn face<'a>(&self, place: impl Iterator<Item = &'a LineHit> + Clone, sign: f32) -> Face {
        let solid = |hit: &LineHit| self.triangles[hit.triangle as usize].solid;
        // The viewer is inside a solid if it sees the solid's backs here but none of its fronts; with both, the solid
        // has no thickness here.
        let is_inside = |hit: &LineHit| {
            let hit_solid = solid(hit);
            let is_front = |other: &LineHit| solid(other) == hit_solid && other.cosine * sign > 0.0;
            hit_solid.is_some() && hit.cosine * sign < 0.0 && !place.clone().any(is_front)
        };
        if place.clone().any(is_inside) {
            return Face::Inside;
        }
        let lit = place.clone().find_map(|hit| {
            let triangle = &self.triangles[hit.triangle as usize];
            let front = hit.cosine * sign > 0.0;
            let side = if front { Side::Front } else { Side::Back };
            (front || triangle.two_sided).then_some(Face::Lit { triangle: hit.triangle, side, at: hit.at })
        });
        let mut place = place;
        lit.unwrap_or_else(|| match place.next() {
            Some(first) if self.triangles[first.triangle as usize].closed => Face::Inside,
            _ => Face::Back,
        })
    }
}
