//! Checks that there is no absolute length: a scene scaled by 2^k gives bit-identical results, and rays leave the
//! surface that they start on at every scale.

mod common;

use common::{Random, cuboid, soup, sphere};
use glam::Vec3;
use lumbre_rays::{Bvh, Ray, offset_ray_origin, triangle_extent};
use proptest::prelude::*;

fn scaled(triangles: &[[Vec3; 3]], factor: f32) -> Vec<[Vec3; 3]> {
    triangles.iter().map(|triangle| triangle.map(|vertex| vertex * factor)).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn scaling_by_a_power_of_two_changes_no_bit(seed: u64, exponent in -60i32..60) {
        let mut random = Random(seed);
        let triangles = soup(&mut random, 200, 0.3);
        let factor = 2f32.powi(exponent);
        let bvh = Bvh::build(&triangles);
        let other = Bvh::build(&scaled(&triangles, factor));
        for _ in 0..200 {
            let ray = Ray::new(random.cube(), random.direction()).with_range(0.0, random.unit() * 3.0);
            let big = Ray {
                origin: ray.origin * factor,
                direction: ray.direction,
                t_min: ray.t_min * factor,
                t_max: ray.t_max * factor,
            };
            let (hit, expected) = (other.closest_hit(&big), bvh.closest_hit(&ray));
            prop_assert_eq!(hit.map(|h| (h.triangle, h.barycentric, h.back_face)),
                expected.map(|h| (h.triangle, h.barycentric, h.back_face)));
            prop_assert_eq!(hit.map(|h| h.distance), expected.map(|h| h.distance * factor));
            prop_assert_eq!(other.any_hit(&big), bvh.any_hit(&ray));
            if let Some(hit) = expected {
                let triangle = triangles[hit.triangle as usize];
                let normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).normalize();
                let point = hit.position(&triangle);
                let extent = triangle_extent(&triangle);
                prop_assert_eq!(offset_ray_origin(point * factor, normal, extent * factor),
                    offset_ray_origin(point, normal, extent) * factor);
            }
        }
    }
}

/// Casts rays outward from random points of a convex closed surface, down to grazing angles, none of which should
/// hit it. Returns the number of hits.
fn hits_on_leaving(triangles: &[[Vec3; 3]], random: &mut Random, rays: usize) -> usize {
    let bvh = Bvh::build(triangles);
    (0..rays)
        .filter(|_| {
            let triangle = &triangles[random.bits() as usize % triangles.len()];
            let (u, v) = random.barycentric();
            let [a, b, c] = *triangle;
            let position = a * (1.0 - u - v) + b * u + c * v;
            let exact = (b.as_dvec3() - a.as_dvec3()).cross(c.as_dvec3() - a.as_dvec3()).normalize();
            let normal = exact.as_vec3();
            let origin = offset_ray_origin(position, normal, triangle_extent(triangle));
            let along = random.direction().as_dvec3().reject_from_normalized(exact).normalize_or(exact);
            let direction = (along + exact * 10f64.powf(-6.0 * f64::from(random.unit()))).as_vec3();
            // When rounded to f32, a grazing direction may point inward.
            direction.as_dvec3().dot(exact) > 0.0 && bvh.any_hit(&Ray::new(origin, direction))
        })
        .count()
}

#[test]
fn rays_leave_their_surface_from_a_millimetre_to_a_hundred_kilometres() {
    let mut random = Random(5);
    for size in [1e-3, 0.1, 1.0, 37.0, 1e3, 1e5] {
        let corner = random.cube() * size;
        for centre in [Vec3::ZERO, corner] {
            let cube = cuboid(centre - Vec3::splat(size), centre + Vec3::splat(size));
            assert_eq!(hits_on_leaving(&cube, &mut random, 20_000), 0, "cube of {size} m at {centre}");
            // The sphere's faces are slanted; neighbouring faces bend away by more than a grazing ray's error.
            let ball = sphere(2, size, centre);
            assert_eq!(hits_on_leaving(&ball, &mut random, 20_000), 0, "sphere of {size} m at {centre}");
        }
    }
}

#[test]
fn without_the_offset_rays_do_hit_the_surface_they_leave() {
    // Control of the test above: it must detect that there is no offset.
    let mut random = Random(5);
    let triangles = sphere(2, 1.0, Vec3::new(0.3, 0.2, 0.1));
    let bvh = Bvh::build(&triangles);
    let hits = (0..20_000)
        .filter(|_| {
            let [a, b, c] = triangles[random.bits() as usize % triangles.len()];
            let (u, v) = random.barycentric();
            let normal = (b - a).cross(c - a).normalize();
            let direction = random.direction();
            let direction = if direction.dot(normal) < 0.0 { -direction } else { direction };
            bvh.any_hit(&Ray::new(a * (1.0 - u - v) + b * u + c * v, direction))
        })
        .count();
    assert!(hits > 100, "{hits}");
}

#[test]
fn the_offset_is_small() {
    let mut random = Random(9);
    for size in [1e-3f32, 1.0, 1e5] {
        let triangle = [(); 3].map(|()| random.cube() * size);
        let normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).normalize();
        let moved = offset_ray_origin(triangle[0], normal, triangle_extent(&triangle)) - triangle[0];
        assert!(moved.dot(normal) > 0.0);
        // 16 * 2^-24 times the 1-norm of a unit normal (at most sqrt(3)), plus an ulp of the coordinates.
        assert!(moved.length() <= size * 2e-6, "{} of {size}", moved.length());
    }
    let point = Vec3::new(1.0, 2.0, 3.0);
    assert_eq!(offset_ray_origin(point, Vec3::ZERO, 1.0), point);
    assert_eq!(offset_ray_origin(point, Vec3::NAN, 1.0), point);
}
