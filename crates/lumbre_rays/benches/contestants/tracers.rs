//! The crates that are compared, each with its best builder and its own query API. For obvhs that is its slow
//! build, which traces within 7 % of the fastest of its presets wherever it is not the fastest itself. All but ours
//! test triangles with obvhs' `RtTriangle` (Möller and Trumbore with precomputed edges and normal), which is fast
//! and not watertight.

use std::cell::Cell;
use std::hint::black_box;
use std::time::{Duration, Instant};

use super::batches::Batch;
use bvh::aabb::{Aabb as BvhAabb, Bounded, IntersectsAabb};
use bvh::bounding_hierarchy::BHShape;
use glam::{Vec3, Vec3A};
use lumbre_rays::{Bvh, Ray};
use nalgebra::{Point3, Vector3};
use obvhs::ray::{Ray as ObvhsRay, RayHit};
use obvhs::{BvhBuildParams, bvh2, cwbvh, rt_triangle::RtTriangle, triangle::Triangle};

/// The crate and hierarchy that traces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tracer {
    Lumbre,
    ObvhsCwBvh,
    ObvhsBvh2,
    Bvh,
}

impl Tracer {
    pub const ALL: [Self; 4] = [Self::Lumbre, Self::ObvhsCwBvh, Self::ObvhsBvh2, Self::Bvh];

    pub fn name(self) -> &'static str {
        match self {
            Self::Lumbre => "lumbre_rays",
            Self::ObvhsCwBvh => "obvhs CwBvh",
            Self::ObvhsBvh2 => "obvhs Bvh2",
            Self::Bvh => "bvh",
        }
    }
}

/// One scene in every hierarchy.
pub struct Tracers {
    /// How long building ours took, in seconds.
    pub build_seconds: f64,
    lumbre: Bvh,
    /// With the triangles in the order of the leaves.
    cwbvh: (cwbvh::CwBvh, Vec<RtTriangle>),
    bvh2: (bvh2::Bvh2, Vec<RtTriangle>),
    bvh: (bvh::bvh::Bvh<f32, 3>, Vec<Shape>),
}

/// The number of hits, and for closest hits the sum of their distances.
pub type Answer = (usize, f64);

impl Tracers {
    pub fn build(triangles: &[[Vec3; 3]]) -> Self {
        let sources: Vec<Triangle> = triangles
            .iter()
            .map(|t| t.map(Vec3A::from))
            .map(|[v0, v1, v2]| Triangle { v0, v1, v2 })
            .collect();
        let exact: Vec<RtTriangle> = sources.iter().map(RtTriangle::from).collect();
        let in_order = |order: &[u32]| order.iter().map(|&i| exact[i as usize]).collect::<Vec<_>>();
        let parameters = BvhBuildParams::slow_build();
        let cwbvh = cwbvh::builder::build_cwbvh_from_tris(&sources, parameters, &mut Duration::default());
        let bvh2 = bvh2::builder::build_bvh2_from_tris(&sources, parameters, &mut Duration::default());
        let mut shapes: Vec<Shape> = triangles
            .iter()
            .zip(&exact)
            .map(|(&vertices, &triangle)| Shape { vertices, triangle, node: 0 })
            .collect();
        let binary = bvh::bvh::Bvh::build(&mut shapes);
        let start = Instant::now();
        let lumbre = Bvh::build(triangles);
        Self {
            build_seconds: start.elapsed().as_secs_f64(),
            lumbre,
            cwbvh: {
                let order = in_order(&cwbvh.primitive_indices);
                (cwbvh, order)
            },
            bvh2: {
                let order = in_order(&bvh2.primitive_indices);
                (bvh2, order)
            },
            bvh: (binary, shapes),
        }
    }

    /// Traces all rays.
    pub fn trace(&self, tracer: Tracer, any: bool, rays: &[Ray]) -> Answer {
        let rays = black_box(rays);
        black_box(match (tracer, any) {
            (Tracer::Lumbre, false) => {
                closest(rays, |ray| self.lumbre.closest_hit(ray).map(|hit| hit.distance))
            }
            (Tracer::Lumbre, true) => blocked(rays, |ray| self.lumbre.any_hit(ray)),
            (Tracer::ObvhsCwBvh, false) => closest(rays, |ray| {
                let (tree, triangles) = &self.cwbvh;
                let mut hit = RayHit::none();
                tree.ray_traverse(obvhs_ray(ray), &mut hit, |ray, i| triangles[i].intersect(ray))
                    .then_some(hit.t)
            }),
            (Tracer::ObvhsCwBvh, true) => blocked(rays, |ray| {
                let (tree, triangles) = &self.cwbvh;
                !tree.ray_traverse_miss(obvhs_ray(ray), |ray, i| triangles[i].intersect(ray))
            }),
            (Tracer::ObvhsBvh2, false) => closest(rays, |ray| {
                let (tree, triangles) = &self.bvh2;
                let mut hit = RayHit::none();
                tree.ray_traverse(obvhs_ray(ray), &mut hit, |ray, i| triangles[i].intersect(ray))
                    .then_some(hit.t)
            }),
            (Tracer::ObvhsBvh2, true) => blocked(rays, |ray| {
                let (tree, triangles) = &self.bvh2;
                !tree.ray_traverse_miss(obvhs_ray(ray), |ray, i| triangles[i].intersect(ray))
            }),
            (Tracer::Bvh, any) => {
                let (tree, shapes) = &self.bvh;
                let nearest = |ray: &Ray| {
                    let (mut exact, query) = (obvhs_ray(ray), Query::new(ray));
                    for shape in tree.traverse_iterator(&query, shapes) {
                        let distance = shape.triangle.intersect(&exact);
                        if distance < exact.tmax {
                            if any {
                                return Some(distance);
                            }
                            exact.tmax = distance;
                            query.reach.set(distance * query.unit);
                        }
                    }
                    (exact.tmax < ray.t_max).then_some(exact.tmax)
                };
                if any { blocked(rays, |ray| nearest(ray).is_some()) } else { closest(rays, nearest) }
            }
        })
    }

    /// Panics unless all find the same, except for at most one ray in a thousand, as rays slip through edges where
    /// a test is not watertight. Returns our number of hits.
    pub fn agree(&self, scene: &str, batch: &Batch) -> usize {
        let (hits, distance) = self.trace(Tracer::Lumbre, batch.any, &batch.rays);
        for tracer in &Tracer::ALL[1..] {
            let (others, other_distance) = self.trace(*tracer, batch.any, &batch.rays);
            let (who, limit) = (tracer.name(), batch.rays.len() / 1000);
            let place = batch.name;
            assert!(hits.abs_diff(others) <= limit, "{scene}, {place}: {who} hits {others} and we {hits}");
            assert!(
                (distance - other_distance).abs() <= 1e-3 * distance,
                "{scene}, {place}: the distances of {who} sum up to {other_distance} and ours to {distance}"
            );
        }
        hits
    }
}

#[inline(always)]
fn closest(rays: &[Ray], hit: impl Fn(&Ray) -> Option<f32>) -> Answer {
    rays.iter().filter_map(hit).fold((0, 0.0), |(hits, sum), distance| (hits + 1, sum + f64::from(distance)))
}

#[inline(always)]
fn blocked(rays: &[Ray], hit: impl Fn(&Ray) -> bool) -> Answer {
    (rays.iter().filter(|ray| hit(ray)).count(), 0.0)
}

#[inline(always)]
fn obvhs_ray(ray: &Ray) -> ObvhsRay {
    ObvhsRay::new(ray.origin.into(), ray.direction.into(), ray.t_min, ray.t_max)
}

/// A ray of the `bvh` crate that gets shorter with each hit. Its direction is normalized, so distances are in
/// metres.
struct Query {
    ray: bvh::ray::Ray<f32, 3>,
    unit: f32,
    reach: Cell<f32>,
}

impl Query {
    fn new(ray: &Ray) -> Self {
        let unit = ray.direction.length();
        Self {
            ray: bvh::ray::Ray::new(
                Point3::from(ray.origin.to_array()),
                Vector3::from(ray.direction.to_array()),
            ),
            unit,
            reach: Cell::new(ray.t_max * unit),
        }
    }
}

impl IntersectsAabb<f32, 3> for Query {
    fn intersects_aabb(&self, aabb: &BvhAabb<f32, 3>) -> bool {
        self.ray.intersection_slice_for_aabb(aabb).is_some_and(|(enter, _)| enter <= self.reach.get())
    }
}

struct Shape {
    vertices: [Vec3; 3],
    triangle: RtTriangle,
    node: usize,
}

impl Bounded<f32, 3> for Shape {
    fn aabb(&self) -> BvhAabb<f32, 3> {
        let [min, max] = bounds(&self.vertices).map(|corner| Point3::from(corner.to_array()));
        BvhAabb::with_bounds(min, max)
    }
}

impl BHShape<f32, 3> for Shape {
    fn set_bh_node_index(&mut self, index: usize) {
        self.node = index;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

fn bounds(points: &[Vec3; 3]) -> [Vec3; 2] {
    [points[0].min(points[1]).min(points[2]), points[0].max(points[1]).max(points[2])]
}
