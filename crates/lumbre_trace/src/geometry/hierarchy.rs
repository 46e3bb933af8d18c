//! All surfaces of a scene, triangles and quadrics, with the queries for the nearest hit and for any hit.
//! What happens at a hit is decided elsewhere.

use glam::{DAffine3, DMat3, DVec3, Vec3};
use lumbre_rays::{Bvh, Ray};
use lumbre_scene::Quadric;

use super::bounding_ball::BoundingBall;
use super::occluders::Occluders;
use super::owners::Owners;
use super::quadric::{QuadricHit, QuadricSurface};
use super::ray::SpaceRay;

/// All surfaces of a scene.
#[derive(Debug)]
pub(crate) struct Geometry {
    bvh: Bvh,
    owners: Owners,
    /// The unit vector to the front of each triangle.
    fronts: Vec<Vec3>,
    /// The triangles once more, as shadow rays meet them; `None` if every triangle blocks every ray.
    occluders: Option<Occluders>,
    quadrics: Vec<PlacedQuadric>,
}

#[derive(Debug)]
struct PlacedQuadric {
    object: u32,
    surface: QuadricSurface,
    /// A bounding sphere in the tracer's space; `None` if the surface is infinite.
    ball: Option<BoundingBall>,
    /// From the tracer's space to the surface's own.
    to_own: DAffine3,
    from_own: DAffine3,
    normals: DMat3,
}

/// A surface that a ray crosses, before it is decided whether it counts as a hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    pub object: usize,
    /// Whether the ray comes from the front.
    pub front: bool,
    pub place: Place,
}

/// A place on an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Place {
    /// In a triangle: its index in the object, and the weights of its second and third corner.
    Triangle { triangle: u32, weights: [f64; 2] },
    /// On an exact surface: the point, and its unit normal to the front.
    Exact { point: DVec3, normal: DVec3 },
}

/// The hit of a ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    pub candidate: Candidate,
    /// Metres along the ray.
    pub distance: f64,
    /// Index of the triangle in the scene; `None` for exact surfaces.
    pub triangle: Option<u32>,
}

/// Factor on the length of a ray that keeps its end off the exact surface that the end lies on.
const EXACTLY_SHORT: f64 = 1.0 - 1e-9;

impl Geometry {
    /// Builds the hierarchy. `triangles` lists the corners of each, counter-clockwise seen from its front, object by
    /// object; `counts` has the number of each object's. `always_blocks` says which objects block every ray that meets
    /// one of their triangles.
    pub fn build(
        triangles: &[[Vec3; 3]],
        counts: &[u32],
        quadrics: &[(usize, Quadric, DAffine3, DMat3)],
        always_blocks: impl Fn(usize) -> bool,
    ) -> Self {
        let owners = Owners::new(counts);
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
            bvh: Bvh::build(triangles),
            occluders: Occluders::build(triangles, |index| always_blocks(owners.of(index as u32).0)),
            owners,
            fronts: triangles.iter().map(front).collect(),
            quadrics: quadrics.iter().map(placed).collect(),
        }
    }

    /// Returns the nearest hit up to a distance that `accept` takes. (Inlined, so that no `Hit` is copied in memory, which
    /// takes half as long as a short traversal.)
    #[inline]
    pub fn closest(&self, ray: &SpaceRay, farthest: f64, accept: impl Fn(&Candidate) -> bool) -> Option<Hit> {
        let short = ray.for_triangles(farthest);
        let found = self.bvh.closest_hit(&short);
        if !self.quadrics.is_empty() {
            let nearest = found.and_then(|met| self.accepted(&short, &met, &accept));
            return self.closest_exact(ray, farthest, nearest, &accept);
        }
        self.accepted(&short, &found?, &accept)
    }

    /// Returns the nearest triangle that `accept` takes, of which `met` is the nearest of all.
    #[inline]
    fn accepted(
        &self,
        ray: &Ray,
        met: &lumbre_rays::Hit,
        accept: &impl Fn(&Candidate) -> bool,
    ) -> Option<Hit> {
        let hit = self.hit(met, !met.back_face);
        // The nearest hit of all is nearly always accepted; the slower filtered query is needed only if it is not.
        if accept(&hit.candidate) { Some(hit) } else { self.closest_filtered(ray, accept) }
    }

    /// Returns the nearest of the exact surfaces that `accept` takes, if it is nearer than the nearest triangle.
    #[inline(never)]
    fn closest_exact(
        &self,
        ray: &SpaceRay,
        farthest: f64,
        mut nearest: Option<Hit>,
        accept: &impl Fn(&Candidate) -> bool,
    ) -> Option<Hit> {
        for quadric in &self.quadrics {
            let farthest = nearest.as_ref().map_or(farthest, |nearest| nearest.distance);
            if let Some(hit) = quadric.closest(ray, farthest, accept) {
                nearest = Some(hit);
            }
        }
        nearest
    }

    /// Returns the nearest triangle that `accept` takes.
    #[inline(never)]
    fn closest_filtered(&self, ray: &Ray, accept: &impl Fn(&Candidate) -> bool) -> Option<Hit> {
        let met = self.bvh.closest_hit_filtered(ray, |triangle, u, v| {
            let front = self.is_front(ray.direction, triangle);
            accept(&self.candidate(triangle, u, v, front))
        })?;
        Some(self.hit(&met, self.is_front(ray.direction, met.triangle)))
    }

    /// Returns true if a triangle that always blocks rays, or another surface that `blocks` takes, lies between the
    /// ray's start and the point at a distance, which may be infinite.
    #[inline]
    pub fn blocked_between(
        &self,
        ray: &SpaceRay,
        distance: f64,
        blocks: impl Fn(&Candidate) -> bool,
    ) -> bool {
        let short = short_of_end(ray, distance);
        let by_triangle = match &self.occluders {
            None => self.bvh.any_hit(&short),
            Some(occluders) => occluders.block(&short, |triangle, u, v| {
                blocks(&self.candidate(triangle, u, v, self.is_front(short.direction, triangle)))
            }),
        };
        by_triangle || self.any_exact_between(ray, distance, &blocks)
    }

    /// Returns true if any surface lies between the ray's start and the point at a distance, which may be
    /// infinite.
    #[inline]
    pub fn anything_between(&self, ray: &SpaceRay, distance: f64) -> bool {
        self.bvh.any_hit(&short_of_end(ray, distance)) || self.any_exact_between(ray, distance, &|_| true)
    }

    #[inline]
    fn any_exact_between(&self, ray: &SpaceRay, distance: f64, accept: &impl Fn(&Candidate) -> bool) -> bool {
        !self.quadrics.is_empty() && self.any_quadric_between(ray, distance, accept)
    }

    /// (Not inlined, so that rays of scenes without exact surfaces can stay in registers.)
    #[inline(never)]
    fn any_quadric_between(
        &self,
        ray: &SpaceRay,
        distance: f64,
        accept: &impl Fn(&Candidate) -> bool,
    ) -> bool {
        let farthest = if distance.is_finite() { distance * EXACTLY_SHORT } else { distance };
        self.quadrics.iter().any(|quadric| quadric.closest(ray, farthest, accept).is_some())
    }

    /// Returns the object of a triangle, and the triangle's index there.
    pub fn owner(&self, triangle: u32) -> (usize, u32) {
        self.owners.of(triangle)
    }

    /// Returns the exact surfaces, to be hashed by their `Debug` output.
    pub fn exact_surfaces(&self) -> &impl std::fmt::Debug {
        &self.quadrics
    }

    /// Returns the hierarchy of the triangles alone.
    pub fn hierarchy(&self) -> &Bvh {
        &self.bvh
    }

    /// Returns the number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.fronts.len()
    }

    /// Describes what the hierarchy has found.
    #[inline]
    fn hit(&self, met: &lumbre_rays::Hit, front: bool) -> Hit {
        let (u, v) = met.barycentric;
        Hit {
            candidate: self.candidate(met.triangle, u, v, front),
            distance: f64::from(met.distance),
            triangle: Some(met.triangle),
        }
    }

    #[inline]
    fn candidate(&self, triangle: u32, u: f32, v: f32, front: bool) -> Candidate {
        let (object, number) = self.owners.of(triangle);
        let place = Place::Triangle { triangle: number, weights: [f64::from(u), f64::from(v)] };
        Candidate { object, front, place }
    }

    /// Returns true if a ray in a direction comes from a triangle's front, of which the hierarchy tells only for the hit
    /// that it returns. Where the ray lies in the triangle's plane, to rounding, either may be said.
    #[inline]
    fn is_front(&self, direction: Vec3, triangle: u32) -> bool {
        direction.dot(self.fronts[triangle as usize]) < 0.0
    }
}

/// Ends the ray short of a surface that its end point lies on.
#[inline]
fn short_of_end(ray: &SpaceRay, distance: f64) -> Ray {
    if distance.is_finite() { ray.between_triangles(distance) } else { ray.for_triangles(distance) }
}

impl PlacedQuadric {
    fn closest(&self, ray: &SpaceRay, farthest: f64, accept: &impl Fn(&Candidate) -> bool) -> Option<Hit> {
        let origin = ray.exact_origin();
        if self.ball.is_some_and(|ball| ball.is_missed(origin, ray.direction, farthest)) {
            return None;
        }
        // The transformed direction is not normalized, so that distances are the same in both spaces.
        let origin = self.to_own.transform_point3(origin);
        let direction = self.to_own.transform_vector3(ray.direction);
        let candidate = |hit: &QuadricHit| {
            let normal = (self.normals * hit.normal).normalize_or_zero();
            let point = self.from_own.transform_point3(hit.point);
            let front = ray.direction.dot(normal) < 0.0;
            Candidate { object: self.object as usize, front, place: Place::Exact { point, normal } }
        };
        let taken = |hit: &QuadricHit| accept(&candidate(hit));
        let hit = self.surface.closest(origin, direction, farthest, &taken)?;
        Some(Hit { candidate: candidate(&hit), distance: hit.distance, triangle: None })
    }
}
