//! Checks that no ray leaves a closed surface from inside, wherever it is aimed (hard case: rays through shared
//! edges).

mod common;

use common::{Random, cuboid, sphere};
use glam::Vec3;
use lumbre_rays::{Bvh, Ray};

/// Casts rays from inside, a third each in random directions, at points on edges, and at vertices; returns the
/// number that escape.
fn escapes(triangles: &[[Vec3; 3]], inside: impl Fn(&mut Random) -> Vec3, rays: usize) -> usize {
    let bvh = Bvh::build(triangles);
    assert!(bvh.skipped().is_empty());
    let mut random = Random(7);
    (0..rays)
        .filter(|i| {
            let origin = inside(&mut random);
            let triangle = &triangles[random.bits() as usize % triangles.len()];
            let corner = random.bits() as usize % 3;
            let direction = match i % 3 {
                0 => random.direction(),
                1 => triangle[corner].lerp(triangle[(corner + 1) % 3], random.unit()) - origin,
                _ => triangle[corner] - origin,
            };
            let ray = Ray::new(origin, direction);
            let (closest, any) = (bvh.closest_hit(&ray).is_some(), bvh.any_hit(&ray));
            assert_eq!(closest, any);
            !closest
        })
        .count()
}

#[test]
fn ten_million_rays_stay_in_a_box() {
    let (min, max) = (Vec3::new(-1.0, -0.3, 2.0), Vec3::new(1.7, 0.9, 2.6));
    let inside = |random: &mut Random| min.lerp(max, 0.5) + random.cube() * (max - min) * 0.49;
    assert_eq!(escapes(&cuboid(min, max), inside, 10_000_000), 0);
}

#[test]
fn a_million_rays_stay_in_a_sphere() {
    let centre = Vec3::new(0.1, -0.2, 0.3);
    let inside = move |random: &mut Random| centre + random.cube() * 0.5;
    assert_eq!(escapes(&sphere(4, 1.0, centre), inside, 1_000_000), 0);
}

#[test]
fn a_small_sphere_far_from_the_origin_and_axis_parallel_rays() {
    let centre = Vec3::new(4000.0, -3000.0, 2000.0);
    let inside = move |random: &mut Random| centre + random.cube() * 0.5;
    assert_eq!(escapes(&sphere(3, 1.0, centre), inside, 100_000), 0);
    // Rays from the centre of a box, exactly at face diagonals, edges and corners, with zero direction components.
    let bvh = Bvh::build(&cuboid(Vec3::NEG_ONE, Vec3::ONE));
    for x in -1..=1 {
        for y in -1..=1 {
            for z in -1..=1 {
                let direction = Vec3::new(x as f32, y as f32, z as f32);
                let hit = bvh.closest_hit(&Ray::new(Vec3::ZERO, direction));
                assert_eq!(hit.map(|hit| hit.distance), (direction != Vec3::ZERO).then_some(1.0));
            }
        }
    }
}

#[test]
fn a_leak_is_found_when_there_is_one() {
    // Control: the same count must detect a missing triangle.
    let triangles = sphere(3, 1.0, Vec3::ZERO);
    let open = &triangles[1..];
    assert!(escapes(open, |random| random.cube() * 0.5, 30_000) > 0);
}
