//! All surfaces of a scene, and the questions that rays ask of them: what is met first, and whether anything is. Not what happens there.

use glam::{DAffine3, DMat3, DVec3, Vec3};
use lumbre_rays::{Bvh, Ray};
use lumbre_scene::Quadric;

use super::bounding_ball::BoundingBall;
use super::quadric::{QuadricHit, QuadricSurface};
use super::ray::SpaceRay;

/// The surfaces.
#[derive(Debug)]
pub(crate) struct Geometry {
    bvh: Bvh,
    triangles: Vec<Facet>,
    quadrics: Vec<PlacedQuadric>,
}

/// What there is to know of a triangle that a ray meets, together in memory.
#[derive(Debug)]
struct Facet {
    object: u32,
    /// In its object.
    number: u32,
    /// To its front, unit.
    front: Vec3,
}

#[derive(Debug)]
struct PlacedQuadric {
    object: u32,
    surface: QuadricSurface,
    /// A ball in the tracer's space that holds all of it, if it has an end.
    ball: Option<BoundingBall>,
    /// From the tracer's space to its own.
    to_own: DAffine3,
    from_own: DAffine3,
    normals: DMat3,
}

/// A surface that a ray may meet, before it is known whether it counts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crossing {
    pub object: usize,
    /// The ray comes to the front.
    pub front: bool,
    pub place: Place,
}

/// Where on its object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Place {
    /// In a triangle: its number in the object, the weights of its second and third corner.
    Triangle { triangle: u32, weights: [f64; 2] },
    /// On the exact surface: the point, and its unit normal to the front.
    Exact { point: DVec3, normal: DVec3 },
}

/// The surface that a ray meets.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Meeting {
    pub crossing: Crossing,
    /// Metres.
    pub distance: f64,
    /// Number of the triangle in the scene, if it is one.
    pub triangle: Option<u32>,
}

/// Rays end before the exact surface that their end lies on by this part of their length.
const EXACTLY_SHORT: f64 = 1.0 - 1e-9;

impl Geometry {
    /// `triangles` lists the corners of each, counter-clockwise seen from its front, with its object and its number there.
    pub fn build(
        triangles: Vec<([Vec3; 3], (u32, u32))>,
        quadrics: &[(usize, Quadric, DAffine3, DMat3)],
    ) -> Self {
        let corners: Vec<[Vec3; 3]> = triangles.iter().map(|(corners, _)| *corners).collect();
        let front = |[a, b, c]: &[Vec3; 3]| {
            let normal = (b.as_dvec3() - a.as_dvec3()).cross(c.as_dvec3() - a.as_dvec3());
            normal.normalize_or_zero().as_vec3()
        };
        let placed = |(object, quadric, place, normals): &(usize, Quadric, DAffine3, DMat3)| PlacedQuadric {
            object: *object as u32,
            surface: QuadricSurface::new(quadric),
            ball: BoundingBall::of(quadric, place),
            to_own: place.inverse(),
            from_own: *place,
            normals: *normals,
        };
        Self {
            bvh: Bvh::build(&corners),
            triangles: triangles
                .iter()
                .map(|(corners, (object, number))| Facet {
                    object: *object,
                    number: *number,
                    front: front(corners),
                })
                .collect(),
            quadrics: quadrics.iter().map(placed).collect(),
        }
    }

    /// The nearest surface up to a distance for which `accept` holds.
    pub fn closest(
        &self,
        ray: &SpaceRay,
        farthest: f64,
        accept: impl Fn(&Crossing) -> bool,
    ) -> Option<Meeting> {
        let short = ray.for_triangles(farthest);
        let accepted = |triangle, u, v| accept(&self.crossing(short.direction, triangle, u, v));
        // The nearest of all is nearly always accepted: only then the others are asked too.
        let found = self.bvh.closest_hit(&short).and_then(|hit| {
            let (u, v) = hit.barycentric;
            if accepted(hit.triangle, u, v) {
                Some(hit)
            } else {
                self.bvh.closest_hit_filtered(&short, accepted)
            }
        });
        let mut nearest = found.map(|hit| Meeting {
            crossing: self.crossing(short.direction, hit.triangle, hit.barycentric.0, hit.barycentric.1),
            distance: f64::from(hit.distance),
            triangle: Some(hit.triangle),
        });
        for quadric in &self.quadrics {
            let farthest = nearest.as_ref().map_or(farthest, |nearest| nearest.distance);
            if let Some(meeting) = quadric.closest(ray, farthest, &accept) {
                nearest = Some(meeting);
            }
        }
        nearest
    }

    /// Whether a surface for which `accept` holds lies between the ray's start and the point at a distance, which may be infinite.
    pub fn any_between(&self, ray: &SpaceRay, distance: f64, accept: impl Fn(&Crossing) -> bool) -> bool {
        let short = short_of_end(ray, distance);
        let accepted = |triangle, u, v| accept(&self.crossing(short.direction, triangle, u, v));
        self.bvh.any_hit_filtered(&short, accepted) || self.any_exact_between(ray, distance, &accept)
    }

    /// The same where every surface counts.
    pub fn anything_between(&self, ray: &SpaceRay, distance: f64) -> bool {
        self.bvh.any_hit(&short_of_end(ray, distance)) || self.any_exact_between(ray, distance, &|_| true)
    }

    fn any_exact_between(&self, ray: &SpaceRay, distance: f64, accept: &impl Fn(&Crossing) -> bool) -> bool {
        let farthest = if distance.is_finite() { distance * EXACTLY_SHORT } else { distance };
        self.quadrics.iter().any(|quadric| quadric.closest(ray, farthest, accept).is_some())
    }

    /// The object and the number there of a triangle of the scene.
    pub fn owner(&self, triangle: u32) -> (usize, u32) {
        let facet = &self.triangles[triangle as usize];
        (facet.object as usize, facet.number)
    }

    /// What there is beside triangles, as it says of itself.
    pub fn exact_surfaces(&self) -> &impl std::fmt::Debug {
        &self.quadrics
    }

    /// The triangles alone.
    pub fn hierarchy(&self) -> &Bvh {
        &self.bvh
    }

    /// How many triangles there are.
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    #[inline]
    fn crossing(&self, direction: Vec3, triangle: u32, u: f32, v: f32) -> Crossing {
        let facet = &self.triangles[triangle as usize];
        Crossing {
            object: facet.object as usize,
            front: direction.dot(facet.front) < 0.0,
            place: Place::Triangle { triangle: facet.number, weights: [f64::from(u), f64::from(v)] },
        }
    }
}

/// Not as far as the surface that a ray's end lies on.
fn short_of_end(ray: &SpaceRay, distance: f64) -> Ray {
    if distance.is_finite() { ray.between_triangles(distance) } else { ray.for_triangles(distance) }
}

impl PlacedQuadric {
    fn closest(&self, ray: &SpaceRay, farthest: f64, accept: &impl Fn(&Crossing) -> bool) -> Option<Meeting> {
        let origin = ray.exact_origin();
        if self.ball.is_some_and(|ball| ball.is_missed(origin, ray.direction, farthest)) {
            return None;
        }
        // Distances are in units of the direction, which is not made unit, so that they are the same in both spaces.
        let origin = self.to_own.transform_point3(origin);
        let direction = self.to_own.transform_vector3(ray.direction);
        let crossing = |hit: &QuadricHit| {
            let normal = (self.normals * hit.normal).normalize_or_zero();
            let point = self.from_own.transform_point3(hit.point);
            let front = ray.direction.dot(normal) < 0.0;
            Crossing { object: self.object as usize, front, place: Place::Exact { point, normal } }
        };
        let taken = |hit: &QuadricHit| accept(&crossing(hit));
        let hit = self.surface.closest(origin, direction, farthest, &taken)?;
        Some(Meeting { crossing: crossing(&hit), distance: hit.distance, triangle: None })
    }
}
