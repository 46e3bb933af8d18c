//! Checks that the tree gives the same results as a brute-force f64 search, and handles every input.

mod common;

use common::{Random, cuboid, soup, sphere};
use glam::{DVec3, Vec3};
use lumbre_rays::{Bvh, Ray};

/// Distance by Möller and Trumbore in f64, if the ray hits the triangle; `margin` widens the triangle.
fn reference(triangle: &[Vec3; 3], ray: &Ray, margin: f64) -> Option<f64> {
    let [a, b, c] = triangle.map(|vertex| vertex.as_dvec3());
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (ab, ac) = (b - a, c - a);
    let p: DVec3 = direction.cross(ac);
    let determinant = ab.dot(p);
    let s = origin - a;
    let u = s.dot(p) / determinant;
    let q = s.cross(ab);
    let v = direction.dot(q) / determinant;
    let inside = u >= -margin && v >= -margin && u + v <= 1.0 + margin;
    let t = ac.dot(q) / determinant;
    (inside && t >= -margin).then_some(t)
}

#[test]
fn agrees_with_brute_force() {
    let mut random = Random(11);
    let triangles = soup(&mut random, 3000, 0.2);
    let bvh = Bvh::build(&triangles);
    let mut hits = 0;
    for _ in 0..3000 {
        let ray = Ray::new(random.cube() * 1.5, random.direction());
        let nearest =
            |margin: f64| triangles.iter().filter_map(|t| reference(t, &ray, margin)).min_by(f64::total_cmp);
        // f32 errors of a few times 2^-24 on triangles of .05 and more stay below 1e-4 of their size.
        let (narrow, wide) = (nearest(-1e-4), nearest(1e-4));
        match bvh.closest_hit(&ray) {
            Some(hit) => {
                hits += 1;
                let distance = f64::from(hit.distance);
                assert!(wide.is_some_and(|wide| distance >= wide - 1e-4), "{distance} {wide:?}");
                assert!(narrow.is_none_or(|narrow| distance <= narrow + 1e-4), "{distance} {narrow:?}");
                let triangle = &triangles[hit.triangle as usize];
                assert!((hit.position(triangle) - ray.at(hit.distance)).length() < 1e-4);
                let normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
                assert_eq!(hit.back_face, normal.dot(ray.direction) > 0.0);
            }
            None => assert!(narrow.is_none(), "missed a hit at {narrow:?}"),
        }
        assert_eq!(bvh.any_hit(&ray), bvh.closest_hit(&ray).is_some());
    }
    // With few hits the comparison would mean little.
    assert!(hits > 1000, "only {hits} of 3000 rays hit");
}

#[test]
fn exact_distances_and_weights() {
    let bvh = Bvh::build(&cuboid(Vec3::ZERO, Vec3::new(2.0, 4.0, 8.0)));
    let inside = Ray::new(Vec3::new(0.5, 1.0, 2.0), Vec3::new(0.0, 0.0, 2.0));
    let hit = bvh.closest_hit(&inside).unwrap();
    assert_eq!(hit.distance, 3.0); // (8 - 2) / 2, in units of the direction
    assert!(hit.back_face);
    assert!(!bvh.any_hit(&inside.with_range(0.0, 2.999_999)));
    assert!(bvh.any_hit(&inside.with_range(0.0, 3.0)));
    assert!(bvh.any_hit(&inside.with_range(3.0, 4.0)));
    assert!(!bvh.any_hit(&inside.with_range(3.000_001, 4.0)));
    assert!(!bvh.any_hit(&Ray::segment(Vec3::ONE, Vec3::new(1.0, 3.0, 7.0))));
    assert!(bvh.any_hit(&Ray::segment(Vec3::ONE, Vec3::new(1.0, 3.0, 9.0))));
    assert_eq!(bvh.bounds(), [Vec3::ZERO, Vec3::new(2.0, 4.0, 8.0)]);
}

#[test]
fn a_filter_lets_rays_through() {
    let layer = |z: f32| [Vec3::new(-1.0, -1.0, z), Vec3::new(3.0, -1.0, z), Vec3::new(-1.0, 3.0, z)];
    let bvh = Bvh::build(&[layer(1.0), layer(2.0), layer(3.0)]);
    let ray = Ray::new(Vec3::ZERO, Vec3::Z);
    let seen = |accept: &dyn Fn(u32, f32, f32) -> bool| {
        bvh.closest_hit_filtered(&ray, accept).map(|hit| hit.triangle)
    };
    assert_eq!(seen(&|_, _, _| true), Some(0));
    assert_eq!(seen(&|triangle, _, _| triangle != 0), Some(1));
    assert_eq!(seen(&|_, u, v| u + v > 0.9), None); // (0, 0) has u = v = 1/4
    assert!(bvh.any_hit_filtered(&ray, |triangle, _, _| triangle == 2));
    assert!(!bvh.any_hit_filtered(&ray, |_, _, _| false));
}

#[test]
fn of_coincident_triangles_the_first_wins() {
    let mut random = Random(3);
    let mut triangles = soup(&mut random, 50, 0.5);
    triangles.extend(triangles.clone());
    let bvh = Bvh::build(&triangles);
    for _ in 0..2000 {
        let hit = bvh.closest_hit(&Ray::new(random.cube() * 2.0, random.direction()));
        assert!(hit.is_none_or(|hit| hit.triangle < 50));
    }
}

#[test]
fn degenerate_triangles_are_skipped_and_indices_kept() {
    let good = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let line = [Vec3::ZERO, Vec3::X, Vec3::X * 2.0];
    let nan = [Vec3::NAN, Vec3::X, Vec3::Y];
    let infinite = [Vec3::INFINITY, Vec3::X, Vec3::Y];
    let bvh = Bvh::build(&[line, nan, good, infinite, [Vec3::ONE; 3]]);
    assert_eq!(bvh.skipped(), [0, 1, 3, 4]);
    let hit = bvh.closest_hit(&Ray::new(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z));
    assert_eq!(hit.map(|hit| (hit.triangle, hit.distance)), Some((2, 1.0)));
    for bvh in [Bvh::build(&[]), Bvh::build(&[line])] {
        assert_eq!(bvh.closest_hit(&Ray::new(Vec3::ZERO, Vec3::X)), None);
        assert_eq!(bvh.bounds(), [Vec3::ZERO; 2]);
    }
}

#[test]
fn senseless_rays_hit_nothing() {
    let bvh = Bvh::build(&sphere(2, 1.0, Vec3::ZERO));
    let good = Ray::new(Vec3::ZERO, Vec3::X);
    assert!(bvh.any_hit(&good));
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert!(!bvh.any_hit(&Ray { origin: Vec3::new(0.0, bad, 0.0), ..good }));
        assert!(!bvh.any_hit(&Ray { direction: Vec3::new(1.0, 0.0, bad), ..good }));
    }
    assert!(!bvh.any_hit(&Ray { direction: Vec3::ZERO, ..good }));
    assert!(!bvh.any_hit(&good.with_range(f32::NAN, 10.0)));
    assert!(!bvh.any_hit(&good.with_range(0.0, f32::NAN)));
    assert!(!bvh.any_hit(&good.with_range(2.0, 0.5)));
    assert!(!bvh.any_hit(&good.with_range(f32::INFINITY, f32::INFINITY)));
    assert!(bvh.any_hit(&good.with_range(-5.0, 10.0)));
    assert!(!bvh.any_hit(&good.with_range(-5.0, -0.5)));
}

#[test]
fn piles_of_triangles_build_in_time() {
    let mut random = Random(21);
    let ray = Ray::new(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z);
    for jitter in [0.0, 1e-6, 1e-3] {
        let pile: Vec<[Vec3; 3]> = (0..20_000)
            .map(|_| [Vec3::ZERO, Vec3::X, Vec3::Y].map(|vertex| vertex + random.cube() * jitter))
            .collect();
        let start = std::time::Instant::now();
        let hit = Bvh::build(&pile).closest_hit(&ray).unwrap();
        // This takes milliseconds on an idle machine; a quadratic build would take the better part of a minute.
        let seconds = start.elapsed().as_secs_f64();
        eprintln!("jitter {jitter}: {seconds:.2} s");
        assert!(seconds < 10.0, "{seconds} s at {jitter}");
        if jitter == 0.0 {
            assert_eq!(hit.triangle, 0);
        }
        let highest = pile.iter().filter_map(|t| reference(t, &ray, 0.0)).min_by(f64::total_cmp).unwrap();
        assert!((f64::from(hit.distance) - highest).abs() < 1e-6);
    }
}

#[test]
fn the_tree_changes_no_bit_of_an_answer() {
    let mut random = Random(21);
    let mut triangles = soup(&mut random, 80, 0.5);
    // Faces in the planes of boxes and duplicates in one place, which a box test that is not wide enough would
    // miss.
    triangles.extend(cuboid(Vec3::splat(-0.5), Vec3::splat(0.5)));
    triangles.extend(cuboid(Vec3::splat(-0.5), Vec3::new(0.5, 0.25, 0.75)));
    triangles.extend(cuboid(Vec3::NEG_ONE, Vec3::ONE));
    let bvh = Bvh::build(&triangles);
    let mut ties = 0;
    for i in 0..4000 {
        let origin = if i % 3 == 0 { random.cube() * 0.5 } else { random.cube() * 1.5 };
        let triangle = &triangles[random.bits() as usize % triangles.len()];
        let direction = match i % 5 {
            0 => triangle[i % 3] - origin,
            1 => triangle[i % 3].lerp(triangle[(i + 1) % 3], random.unit()) - origin,
            2 => [Vec3::X, Vec3::NEG_Y, Vec3::new(0.0, 1.0, -1.0), Vec3::new(1e-20, -1.0, 0.0)][i % 4],
            _ => random.direction(),
        };
        let ray = Ray::new(origin, direction);
        // Each triangle is tested alone, so that no hit hides another: the same arithmetic without the culling.
        let alone: Vec<_> = (0..triangles.len() as u32)
            .filter_map(|index| bvh.closest_hit_filtered(&ray, |triangle, _, _| triangle == index))
            .collect();
        let first =
            alone.iter().min_by(|a, b| a.distance.total_cmp(&b.distance).then(a.triangle.cmp(&b.triangle)));
        assert_eq!(bvh.closest_hit(&ray).as_ref(), first);
        assert_eq!(bvh.any_hit(&ray), first.is_some());
        ties += alone.iter().filter(|hit| first.is_some_and(|first| hit.distance == first.distance)).count()
            - usize::from(first.is_some());
    }
    // The two smaller boxes share a face; without ties the order of equal distances would not be tested.
    assert!(ties > 100, "{ties}");
}
