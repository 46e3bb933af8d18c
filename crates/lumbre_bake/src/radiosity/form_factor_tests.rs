//! Tests of form factors against their closed forms: within 5 sigma, sigma = sqrt(F (1 - F) / N).

use std::ops::ControlFlow;
use std::sync::Arc;

use glam::Vec3;
use lumbre_mesh::TriangleMesh;

use super::form_factors::FormFactors;
use super::patch_index::PatchIndex;
use super::patches::Patches;
use super::subdivision::Subdivision;
use crate::monitor::{BakeMonitor, Progress};
use crate::options::FormFactorMethod;
use crate::scene::laid_out::laid_out;
use crate::scene::{BakeScene, Canonical, PlacedPrimitive, SceneObject};
use crate::{BakeOptions, Density};

fn carry_on(_: Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn mesh(triangles: &[[Vec3; 3]]) -> Arc<TriangleMesh> {
    let positions: Vec<Vec3> = triangles.iter().flatten().copied().collect();
    let indices = (0..positions.len() as u32).collect();
    Arc::new(TriangleMesh { positions, indices, ..TriangleMesh::default() })
}

pub(crate) fn square(origin: [f32; 3], u: Vec3, v: Vec3) -> [[Vec3; 3]; 2] {
    let o = Vec3::from(origin);
    [[o, o + u, o + u + v], [o, o + u + v, o + v]]
}

/// A scene of matt objects, one per list of triangles.
pub(crate) fn scene(objects: &[&[[Vec3; 3]]]) -> BakeScene {
    let object = |triangles: &&[[Vec3; 3]]| {
        let primitive = PlacedPrimitive { mesh: mesh(triangles), ..PlacedPrimitive::default() };
        SceneObject::new("object", vec![primitive])
    };
    let objects: Vec<SceneObject> = objects.iter().map(object).collect();
    let points = objects.iter().flat_map(|o| &o.primitives[0].mesh.positions).map(|p| p.as_dvec3());
    let space = Canonical::of(points);
    let options = BakeOptions { density: Density::MapSize(16), ..BakeOptions::default() };
    laid_out(&objects, space, &options).1
}

/// The patches of a scene, of about `side` canonical units.
pub(crate) fn patches_of(scene: &BakeScene, side: f32) -> Patches {
    Patches::new(scene, &Subdivision::new(scene, side), 64)
}

const METHODS: [FormFactorMethod; 2] = [FormFactorMethod::CosineRays, FormFactorMethod::GlobalLines];

/// The form factor from the first object to the second, and the number of rays from the first that it was counted from.
fn factor(objects: &[&[[Vec3; 3]]], side: f32, method: FormFactorMethod) -> (f64, f64) {
    let scene = scene(objects);
    let patches = patches_of(&scene, side * scene.space.scale as f32);
    let mut carry_on = carry_on;
    let monitor = &mut BakeMonitor::new(&mut carry_on, None);
    let (factors, _) = FormFactors::sample(&scene, &patches, method, 200_000, 7, monitor).unwrap();
    let object = |patch: PatchIndex| scene.triangles[patches.list[patch.place()].triangle as usize].map.0;
    let (mut exchange, mut area) = (0.0, 0.0);
    for i in PatchIndex::all(factors.len()).filter(|&i| object(i) == 0) {
        area += f64::from(factors.areas[i.place()]);
        exchange += factors.row(i).filter(|&(j, _)| object(j) == 1).map(|(_, g)| g).sum::<f64>();
    }
    let rays = match method {
        FormFactorMethod::CosineRays => factors.rays as f64,
        // A share of 2A / A_sphere of all lines through the bounding sphere crosses the first object.
        FormFactorMethod::GlobalLines => {
            let corners: Vec<Vec3> = scene.triangles.iter().flat_map(|triangle| triangle.corners).collect();
            let low = corners.iter().copied().fold(Vec3::INFINITY, Vec3::min);
            let high = corners.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
            let reach = corners.iter().map(|&c| (c - 0.5 * (low + high)).length()).fold(0.0, f32::max);
            factors.rays as f64 * 2.0 * area / (4.0 * std::f64::consts::PI * f64::from(reach * reach))
        }
    };
    (exchange / area, rays)
}

fn check(name: &str, objects: &[&[[Vec3; 3]]], expected: f64) {
    for (side, method) in [4.0, 0.4].into_iter().flat_map(|side| METHODS.map(|method| (side, method))) {
        let (factor, rays) = factor(objects, side, method);
        let sigma = (expected * (1.0 - expected) / rays).sqrt();
        assert!(
            (factor - expected).abs() < 5.0 * sigma,
            "{name}, patches of {side}, {method:?}: {factor} instead of {expected}"
        );
    }
}

#[test]
fn parallel_squares() {
    let lower = square([0.0; 3], Vec3::Z, Vec3::X);
    for (distance, expected) in [
        (0.01, 0.980416602925973),
        (0.1, 0.826994522397257),
        (0.5, 0.415253283577147),
        (1.0, 0.199824895698387),
        (2.0, 0.0685895888185524),
        (5.0, 0.0124039773132451),
        (10.0, 0.0031620568387576),
    ] {
        let upper = square([0.0, distance, 0.0], Vec3::X, Vec3::Z);
        check(&format!("distance {distance}"), &[&lower, &upper], expected);
    }
    let shifted = square([1.0, 1.0, 0.0], Vec3::X, Vec3::Z);
    check("shifted by one width", &[&lower, &shifted], 0.0860504891523273);
}

#[test]
fn perpendicular_squares_down_to_a_shared_edge() {
    let floor = square([0.0; 3], Vec3::Z, Vec3::X);
    for (gap, height, expected) in [
        (0.0, 1.0, 0.200043776075403),
        (0.0, 2.0, 0.232852602795362),
        (0.0, 10.0, 0.249209485790311),
        (1e-3, 1.0, 0.19961080893592),
    ] {
        let wall = square([-gap, 0.0, 0.0], Vec3::Y * height, Vec3::Z);
        check(&format!("gap {gap}, height {height}"), &[&floor, &wall], expected);
    }
}

#[test]
fn a_blocker_between_makes_the_form_factor_0() {
    let lower = square([0.0; 3], Vec3::Z, Vec3::X);
    let upper = square([0.0, 1.0, 0.0], Vec3::X, Vec3::Z);
    let blocker = square([-9.0, 0.5, -9.0], Vec3::X * 20.0, Vec3::Z * 20.0);
    for method in METHODS {
        assert_eq!(factor(&[&lower, &upper, &blocker], 0.4, method).0, 0.0);
    }
}

/// A cube seen from inside: a cuboid whose faces are flipped.
fn room() -> Vec<[Vec3; 3]> {
    let outside = lumbre_mesh::shapes::cuboid(Vec3::ONE, 1).triangle_positions().unwrap();
    outside.into_iter().map(|[a, b, c]| [a, c, b]).collect()
}

#[test]
fn a_closed_room_is_reciprocal_and_its_rows_sum_to_one() {
    for method in METHODS {
        let scene = scene(&[&room()]);
        let patches = patches_of(&scene, 0.25 * scene.space.scale as f32);
        let mut carry_on = carry_on;
        let monitor = &mut BakeMonitor::new(&mut carry_on, None);
        let (factors, _) = FormFactors::sample(&scene, &patches, method, 100_000, 3, monitor).unwrap();
        for i in PatchIndex::all(factors.len()) {
            // Twelve rounds of scaling have not quite converged, and entries are f32.
            assert!((factors.row_sum(i) - 1.0).abs() < 2e-3, "{method:?} row {i:?}: {}", factors.row_sum(i));
            assert!(factors.row_sum(i) <= 1.0 + 1e-6);
            for (j, g) in factors.row(i) {
                let back = factors.row(j).find(|&(k, _)| k == i).map(|(_, g)| g);
                assert_eq!(back, Some(g), "A_i F_ij = A_j F_ji");
            }
        }
        assert!(factors.energy_lost < 2e-3, "{method:?}: {}", factors.energy_lost);
    }
}

#[test]
fn blockers_between_near_patches_count() {
    let lower = square([0.0; 3], Vec3::Z, Vec3::X);
    let upper = square([0.0, 0.1, 0.0], Vec3::X, Vec3::Z);
    let full_blocker = square([-9.0, 0.05, -9.0], Vec3::X * 20.0, Vec3::Z * 20.0);
    // It covers x < 0.5 and divides the narrow gap between the squares in two: F is about half of 0.8, and a little
    // more by what passes its edge.
    let half_blocker = square([-9.0, 0.05, -9.0], Vec3::X * 9.5, Vec3::Z * 20.0);
    for method in METHODS {
        assert_eq!(factor(&[&lower, &upper, &full_blocker], 0.1, method).0, 0.0);
        let [fine, coarse] = [0.1, 4.0].map(|side| factor(&[&lower, &upper, &half_blocker], side, method));
        let sigma = |(factor, rays): (f64, f64)| (factor * (1.0 - factor) / rays).sqrt();
        let difference = (fine.0 - coarse.0).abs();
        assert!(difference < 5.0 * sigma(fine).hypot(sigma(coarse)), "{method:?}: {fine:?} {coarse:?}");
        assert!(fine.0 > 0.35 && fine.0 < 0.5, "{fine:?}");
    }
}

#[test]
fn agrees_with_the_contour_integral_where_nothing_blocks() {
    // Two skew triangles in general position.
    let one = [[Vec3::ZERO, Vec3::new(0.3, 0.1, 1.0), Vec3::new(1.0, 0.0, 0.2)]];
    let two = [[Vec3::new(0.2, 0.9, 0.1), Vec3::new(1.1, 1.3, 0.2), Vec3::new(0.4, 0.8, 0.9)]];
    let f64s = |t: [Vec3; 3]| t.map(|p| p.as_dvec3());
    let expected = crate::visibility::lambert_integral::triangle_to_triangle(&f64s(one[0]), &f64s(two[0]));
    assert!(expected > 0.01, "the triangles must face each other: {expected}");
    check("skew triangles", &[&one, &two], expected);
}
