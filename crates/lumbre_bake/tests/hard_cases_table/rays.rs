//! Cases about rays that leave a face, and rays through edges.

use std::f64::consts::PI;

use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_mesh::TriangleMesh;
use lumbre_rays::{Bvh, Ray, offset_ray_origin, triangle_extent};

use crate::case::Outcome;
use crate::common::shapes::square;
use crate::random::{Random, cuboid, sphere};
use crate::scenes::{differing_values, draft, grey, irradiance, mean_of, run, spawn};

crate::cases! {
    "a ray hits the face it left, scenes of 1e-3 to 1e5 m" {
        rays_that_leave_a_box_of_a_millimetre, rays_that_leave_a_box_of_a_metre_a_kilometre_away,
        rays_that_leave_a_box_of_a_hundred_kilometres, rays_that_leave_a_slanted_sphere, the_offset_is_ulps,
        a_floor_of_a_millimetre, a_floor_of_a_hundred_kilometres, a_thousand_times_smaller_by_two_to_the_tenth,
        a_hundred_thousand_times_larger_by_two_to_the_seventeenth,
    }
    "rays through shared edges and T-junctions" {
        a_closed_box, a_closed_sphere, a_missing_triangle_is_seen, a_box_with_t_junctions, aimed_at_t_junctions,
        a_furnace_with_t_junctions,
    }
}

/// Counts the rays that hit the convex closed surface on which they start, though they go outwards, down to a millionth
/// above the face.
fn hits_on_leaving(triangles: &[[Vec3; 3]], rays: usize) -> f64 {
    let bvh = Bvh::build(triangles);
    let mut random = Random(5);
    let hit = |_: &usize| {
        let triangle = &triangles[random.bits() as usize % triangles.len()];
        let (u, v) = random.barycentric();
        let [a, b, c] = *triangle;
        let position = a * (1.0 - u - v) + b * u + c * v;
        let normal = (b.as_dvec3() - a.as_dvec3()).cross(c.as_dvec3() - a.as_dvec3()).normalize();
        let origin = offset_ray_origin(position, normal.as_vec3(), triangle_extent(triangle));
        let tangent = random.direction().as_dvec3().reject_from_normalized(normal).normalize_or(normal);
        let direction = (tangent + normal * 10f64.powf(-6.0 * f64::from(random.unit()))).as_vec3();
        // A grazing direction that points inwards after rounding to f32 does not count.
        direction.as_dvec3().dot(normal) > 0.0 && bvh.any_hit(&Ray::new(origin, direction))
    };
    (0..rays).filter(hit).count() as f64
}

const LEAVING: &str =
    "none of 100,000 rays, down to a millionth above the face, meets the convex surface it leaves";

fn leaving_box(size: f32, middle: Vec3) -> Outcome {
    let triangles = cuboid(middle - Vec3::splat(size), middle + Vec3::splat(size));
    Outcome::number(0.0, hits_on_leaving(&triangles, 100_000), 0.0, LEAVING)
}

fn rays_that_leave_a_box_of_a_millimetre() -> Outcome {
    leaving_box(1e-3, Vec3::ZERO)
}

fn rays_that_leave_a_box_of_a_metre_a_kilometre_away() -> Outcome {
    leaving_box(1.0, Vec3::new(700.0, -500.0, 510.0))
}

fn rays_that_leave_a_box_of_a_hundred_kilometres() -> Outcome {
    leaving_box(1e5, Vec3::new(3e4, -7e4, 1e4))
}

fn rays_that_leave_a_slanted_sphere() -> Outcome {
    let triangles = sphere(2, 37.0, Vec3::new(11.0, -23.0, 5.0));
    Outcome::number(0.0, hits_on_leaving(&triangles, 100_000), 0.0, LEAVING)
}

fn the_offset_is_ulps() -> Outcome {
    let mut random = Random(9);
    let moved = [1e-3f32, 1.0, 1e5].into_iter().flat_map(|size| [size; 50]).map(|size| {
        let triangle = [(); 3].map(|()| random.cube() * size);
        let normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).normalize();
        let start = offset_ray_origin(triangle[0], normal, triangle_extent(&triangle));
        (0.0, f64::from((start - triangle[0]).length() / size))
    });
    let why = "of the triangle's size: 16 x 2^-24 x the 1-norm of a normal, at most √3, and an ulp of each coordinate";
    Outcome::worst(moved.collect::<Vec<_>>(), 2e-6, why)
}

/// The irradiance at the centre of a square floor of half side `half` under an emissive square of the same size at a
/// height of `half`.
fn floor_of(half: f32) -> Outcome {
    let mut world = World::new();
    spawn(&mut world, "floor", square(2.0 * half, 0.0, true), grey(0.0, 0.0));
    spawn(&mut world, "lamp", square(2.0 * half, half, false), grey(0.0, 1.0));
    run(&mut world, &draft(48));
    let measured = irradiance(&mut world, DVec3::Y, [DVec3::ZERO])[0];
    // The form factor to four quarters of side a = height: 4/(2π) · 2 · (1/√2) atan(1/√2); E is π times that.
    let root = 0.5f64.sqrt();
    let why = "Lambert's formula, 2 √2 atan(1/√2); between texels of h/22, h² E''/8 along both axes and the texels' mean: 0.2 %";
    Outcome::number(4.0 * root * root.atan(), measured, 2e-3 * PI, why)
}

fn a_floor_of_a_millimetre() -> Outcome {
    floor_of(1e-3)
}

fn a_floor_of_a_hundred_kilometres() -> Outcome {
    floor_of(1e5)
}

fn scaled_by(exponent: i32) -> Outcome {
    let [mut plain, mut scaled] = [1.0, 2f32.powi(exponent)].map(|scale| {
        let mut world = World::new();
        spawn(&mut world, "floor", square(3.0 * scale, 0.0, true), grey(0.7, 0.0));
        spawn(&mut world, "shelf", square(0.7 * scale, 0.6 * scale, true), grey(0.4, 0.0));
        spawn(&mut world, "lamp", square(1.1 * scale, 1.3 * scale, false), grey(0.2, 3.0));
        run(&mut world, &draft(24));
        world
    });
    let why =
        "texels that differ in a bit: everything is computed in canonical units, and no length is absolute";
    Outcome::number(0.0, differing_values(&mut plain, &mut scaled), 0.0, why)
}

fn a_thousand_times_smaller_by_two_to_the_tenth() -> Outcome {
    scaled_by(-10)
}

fn a_hundred_thousand_times_larger_by_two_to_the_seventeenth() -> Outcome {
    scaled_by(17)
}

/// Counts the rays from inside a closed surface that escape: a third each in random directions, towards points of edges
/// and towards vertices.
fn escaping_rays(triangles: &[[Vec3; 3]], inside: impl Fn(&mut Random) -> Vec3, rays: usize) -> f64 {
    let bvh = Bvh::build(triangles);
    let mut random = Random(7);
    let escapes = |i: &usize| {
        let origin = inside(&mut random);
        let triangle = &triangles[random.bits() as usize % triangles.len()];
        let corner = random.bits() as usize % 3;
        let direction = match i % 3 {
            0 => random.direction(),
            1 => triangle[corner].lerp(triangle[(corner + 1) % 3], random.unit()) - origin,
            _ => triangle[corner] - origin,
        };
        bvh.closest_hit(&Ray::new(origin, direction)).is_none()
    };
    (0..rays).filter(escapes).count() as f64
}

const LOW: Vec3 = Vec3::new(-1.0, -0.3, 2.0);
const HIGH: Vec3 = Vec3::new(1.7, 0.9, 2.6);
const WATERTIGHT: &str =
    "none of a million rays, a third each at random, at edges and at vertices: shared edges round alike";

fn in_the_box(random: &mut Random) -> Vec3 {
    LOW.midpoint(HIGH) + random.cube() * (HIGH - LOW) * 0.49
}

fn a_closed_box() -> Outcome {
    Outcome::number(0.0, escaping_rays(&cuboid(LOW, HIGH), in_the_box, 1_000_000), 0.0, WATERTIGHT)
}

fn a_closed_sphere() -> Outcome {
    let middle = Vec3::new(0.1, -0.2, 0.3);
    let escaped = escaping_rays(&sphere(4, 1.0, middle), |random| middle + random.cube() * 0.5, 1_000_000);
    Outcome::number(0.0, escaped, 0.0, WATERTIGHT)
}

fn a_missing_triangle_is_seen() -> Outcome {
    let triangles = sphere(3, 1.0, Vec3::ZERO);
    let share = escaping_rays(&triangles[1..], |random| random.cube() * 0.01, 300_000) / 300_000.0;
    let why = "negative control: of 512 faces one is open, for the third of the rays that are random; those at edges and corners go by its own";
    Outcome::number(1.0 / 512.0 / 3.0, share, 5e-4, why)
}

/// The box with one of its triangles split in two at a vertex on its edge that the neighbouring triangle does not have.
fn with_t_junctions() -> Vec<[Vec3; 3]> {
    let mut triangles = cuboid(LOW, HIGH);
    let [a, b, c] = triangles.remove(6);
    // A third of the way is not representable in f32.
    let middle = a.lerp(b, 1.0 / 3.0);
    triangles.extend([[a, middle, c], [middle, b, c]]);
    triangles
}

fn a_box_with_t_junctions() -> Outcome {
    let bvh = Bvh::build(&with_t_junctions());
    let mut random = Random(3);
    let rays = 2_000_000;
    let escaped = (0..rays)
        .filter(|_| bvh.closest_hit(&Ray::new(in_the_box(&mut random), random.direction())).is_none());
    let why = "of two million random rays: the slit is half an ulp wide, 2^-24 of the side, and is met by 0.1 of them";
    Outcome::number(0.0, escaped.count() as f64, 2.0, why)
}

fn aimed_at_t_junctions() -> Outcome {
    let triangles = with_t_junctions();
    let [a, middle, _] = triangles[triangles.len() - 2];
    let bvh = Bvh::build(&triangles);
    let mut random = Random(4);
    let rays = 200_000;
    let escaped = (0..rays).filter(|_| {
        let origin = in_the_box(&mut random);
        bvh.closest_hit(&Ray::new(origin, a.lerp(middle, random.unit()) - origin)).is_none()
    });
    let why = "the share of rays aimed into the slit itself that pass it: two edges that do not share both ends round apart by an ulp, a direction by as much: a few in a thousand";
    Outcome::number(0.0, escaped.count() as f64 / f64::from(rays), 0.01, why)
}

fn a_furnace_with_t_junctions() -> Outcome {
    let corners: Vec<[Vec3; 3]> = with_t_junctions().into_iter().map(|[a, b, c]| [a, c, b]).collect();
    let mesh = TriangleMesh {
        positions: corners.iter().flatten().copied().collect(),
        indices: (0..3 * corners.len() as u32).collect(),
        ..TriangleMesh::default()
    };
    let mut world = World::new();
    let room = spawn(&mut world, "room", mesh, grey(0.5, 1.0));
    run(&mut world, &draft(48));
    let why = "π L / (1 - ρ): what passes the slits is no light lost that could be measured; 0.5 % for the row sums";
    Outcome::number(2.0 * PI, mean_of(&world, room), 5e-3 * 2.0 * PI, why)
}
