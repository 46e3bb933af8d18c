//! Normals of meshes: averages with each weight, their convergence to the surface's normals, and degenerate
//! input.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

use std::f64::consts::TAU;

use glam::{Mat3, Vec3};
use lumbre_mesh::flat::compute_flat_normals;
use lumbre_mesh::flat::flat_triangles;
use lumbre_mesh::normals::{NormalWeight, compute_smooth_normals, face_normal};
use lumbre_mesh::surfaces::{
    ImplicitSurface, ParametricSurface, Sphere, Torus, implicit_normal, parametric_mesh,
};
use lumbre_mesh::{Adjacency, TriangleMesh, shapes, weld_positions};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const WEIGHTS: [NormalWeight; 3] = [NormalWeight::Uniform, NormalWeight::Area, NormalWeight::Angle];

/// The largest and the root mean square angle, in radians, between averaged normals and those of the surface.
fn errors(mesh: &TriangleMesh, surface: &impl ImplicitSurface, weight: NormalWeight) -> [f64; 2] {
    let smooth = compute_smooth_normals(mesh, weight).unwrap();
    assert_eq!((smooth.cancelled, smooth.missing), (0, 0));
    let angles: Vec<f64> = smooth
        .mesh
        .positions
        .iter()
        .zip(&smooth.mesh.normals)
        .map(|(point, normal)| {
            let exact = implicit_normal(surface, point.as_dvec3()).unwrap();
            normal.as_dvec3().cross(exact).length().atan2(normal.as_dvec3().dot(exact))
        })
        .collect();
    let square: f64 = angles.iter().map(|angle| angle * angle).sum();
    [angles.iter().copied().fold(0.0, f64::max), (square / angles.len() as f64).sqrt()]
}

/// The convergence orders of the two errors when the edges are halved at each step.
fn orders(name: &str, weight: NormalWeight, steps: &[[f64; 2]]) -> [f64; 2] {
    let last = steps.len() - 1;
    for (step, [largest, mean]) in steps.iter().enumerate() {
        let order = |now: f64, before: Option<f64>| {
            before.map_or("     ".to_owned(), |before| format!("{:5.2}", (before / now).log2()))
        };
        let before = step.checked_sub(1).map(|before| steps[before]);
        let (first, second) = (order(*largest, before.map(|b| b[0])), order(*mean, before.map(|b| b[1])));
        eprintln!("{name:22} {weight:?}\t{step} largest {largest:.3e} {first}   rms {mean:.3e} {second}");
    }
    [0, 1].map(|which| (steps[last - 1][which] / steps[last][which]).log2())
}

#[test]
fn on_a_regular_grid_every_weight_converges_at_order_two() {
    // The six triangles around a vertex are symmetric about it, except for the curvature of the parameters,
    // so errors linear in the edge length cancel.
    let torus = Torus { major_radius: 1.0, minor_radius: 0.4 };
    for weight in WEIGHTS {
        let steps: Vec<_> = [16u32, 32, 64, 128, 256]
            .iter()
            .map(|&n| errors(&parametric_mesh(&torus, 2 * n, n).unwrap(), &torus, weight))
            .collect();
        let [largest, mean] = orders("torus, regular", weight, &steps);
        assert!((largest - 2.0).abs() < 0.1 && (mean - 2.0).abs() < 0.1, "{weight:?}: {largest}, {mean}");
    }
}

#[test]
fn on_the_recursive_sphere_the_largest_error_falls_at_order_one_and_the_mean_at_one_and_a_half() {
    // Along the edges of the initial tetrahedron the triangles are not symmetric, so the error is linear
    // there. These vertices are a fraction proportional to h of all, so the mean square error falls with h^2
    // times h.
    let sphere = Sphere { radius: 1.0 };
    for weight in WEIGHTS {
        let steps: Vec<_> = (2..8)
            .map(|depth| errors(&shapes::tetrahedral_sphere(1.0, depth, false), &sphere, weight))
            .collect();
        let [largest, mean] = orders("recursive sphere", weight, &steps);
        assert!((largest - 1.0).abs() < 0.15, "{weight:?}: {largest}");
        assert!((mean - 1.5).abs() < 0.15, "{weight:?}: {mean}");
    }
}

#[test]
fn on_an_irregular_mesh_every_weight_converges_at_order_one() {
    // Vertices are moved along the torus by up to a seventh of a cell each way: no triangle has a symmetric
    // counterpart, and no angle comes near 180 degrees, where even a triangle's own normal does not converge
    // (Schwarz's lantern; moving by a third of a cell shows it).
    let torus = Torus { major_radius: 1.0, minor_radius: 0.4 };
    for weight in WEIGHTS {
        let steps: Vec<_> = [16u32, 32, 64, 128, 256]
            .iter()
            .map(|&n| {
                let mut mesh = parametric_mesh(&torus, 2 * n, n).unwrap();
                let mut state = 7u64;
                let mut random = || {
                    state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                    ((state >> 40) as f64 / (1u64 << 23) as f64 - 1.0) / 7.0
                };
                let welded = weld_positions(&mesh.positions);
                for (vertex, &first) in welded.iter().enumerate() {
                    let first = first as usize;
                    mesh.positions[vertex] = if first == vertex {
                        let part = mesh.uv0[vertex].as_dvec2();
                        let u = part.x + random() / f64::from(2 * n);
                        let v = 1.0 - part.y + random() / f64::from(n);
                        torus.point(TAU * u, TAU * v).as_vec3()
                    } else {
                        mesh.positions[first]
                    };
                }
                errors(&mesh, &torus, weight)
            })
            .collect();
        let [_, mean] = orders("torus, moved", weight, &steps);
        assert!((mean - 1.0).abs() < 0.05, "{weight:?}: {mean}");
    }
}

#[test]
fn averaged_normals() {
    // A corner of a cube has three faces with one or two triangles each; only the angle weight is independent
    // of that.
    let cube = shapes::cuboid(Vec3::ONE, 1);
    let bare = TriangleMesh { normals: Vec::new(), ..cube };
    let smooth = |mesh: &TriangleMesh, weight| compute_smooth_normals(mesh, weight).unwrap().mesh.normals;
    for (normal, position) in smooth(&bare, NormalWeight::Angle).iter().zip(&bare.positions) {
        assert!((*normal - position.normalize()).length() < 1e-6);
    }
    let uniform = smooth(&bare, NormalWeight::Uniform);
    assert!(uniform.iter().zip(&bare.positions).any(|(n, p)| (*n - p.normalize()).length() > 0.1));

    // Two faces of areas 1/2 and 2 at a right angle along x: the ratio of the components shows the weights.
    let wedge = TriangleMesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z * 4.0],
        indices: vec![0, 1, 2, 0, 3, 1],
        ..TriangleMesh::default()
    };
    let by_area = Vec3::new(0.0, 4.0, 1.0).normalize();
    assert!((smooth(&wedge, NormalWeight::Area)[0] - by_area).length() < 1e-7);
    let half = Vec3::new(0.0, 1.0, 1.0).normalize();
    assert!((smooth(&wedge, NormalWeight::Uniform)[0] - half).length() < 1e-7);
    assert!((smooth(&wedge, NormalWeight::Angle)[0] - half).length() < 1e-7);
    // At vertex 1 the angles are 45 degrees and atan 4.
    let angles = Vec3::new(0.0, 4f32.atan(), std::f32::consts::FRAC_PI_4).normalize();
    assert!((smooth(&wedge, NormalWeight::Angle)[1] - angles).length() < 1e-6);

    // Averaged normals of the sphere approach the exact ones.
    let sphere = shapes::tetrahedral_sphere(1.0, 5, false);
    for weight in [NormalWeight::Uniform, NormalWeight::Area, NormalWeight::Angle] {
        let normals = smooth(&sphere, weight);
        let worst = normals.iter().zip(&sphere.normals).map(|(n, s)| n.angle_between(*s)).fold(0.0, f32::max);
        assert!(worst.to_degrees() < 3.0, "{weight:?}: {worst}");
    }
}

#[test]
fn normals_that_cannot_be_computed() {
    // A face and its own back cancel, so the first face decides. A lone degenerate triangle has no normal:
    // zero.
    let mesh = TriangleMesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::NAN, Vec3::Z],
        indices: vec![0, 1, 2, 0, 2, 1, 3, 4, 4],
        ..TriangleMesh::default()
    };
    for weight in [NormalWeight::Uniform, NormalWeight::Area, NormalWeight::Angle] {
        let smooth = compute_smooth_normals(&mesh, weight).unwrap();
        assert_eq!(smooth.mesh.normals, [Vec3::Z, Vec3::Z, Vec3::Z, Vec3::ZERO, Vec3::ZERO]);
        assert_eq!((smooth.cancelled, smooth.missing), (3, 2));
        // One message per mesh, with its name.
        let remark = smooth.remark("leaf").unwrap();
        assert!(remark.contains("\"leaf\"") && remark.lines().count() == 1, "{remark}");
        let sound = compute_smooth_normals(&shapes::cuboid(Vec3::ONE, 1), weight).unwrap();
        assert_eq!(sound.remark("box"), None);
    }
    let flat = compute_flat_normals(mesh.clone());
    assert_eq!((flat.positions.len(), flat.normals[3], flat.normals[8]), (9, Vec3::NEG_Z, Vec3::ZERO));
    assert_eq!(compute_flat_normals(flat.clone()).normals, flat.normals);
    assert_eq!(flat_triangles(&flat).count(), 3);
    // Sizes at both ends of the range of f32 have normals, since the cross product is computed in f64.
    for size in [1e-30f32, 1e30] {
        assert_eq!(face_normal(&[Vec3::ZERO, Vec3::X * size, Vec3::Y * size]), Some(Vec3::Z));
    }
}

/// Points on a coarse grid, so that many coincide and many triangles are degenerate; some are very large,
/// tiny or not finite.
fn point() -> impl Strategy<Value = Vec3> {
    let grid = || prop::sample::select(vec![-1.0f32, 0.0, 1.0, 2.0]);
    let odd = prop::sample::select(vec![f32::NAN, f32::INFINITY, 1e30, -1e-30, f32::MIN_POSITIVE, 0.3]);
    prop_oneof![
        12 => [grid(), grid(), grid()].prop_map(Vec3::from),
        1 => (odd, grid(), grid()).prop_map(|(x, y, z)| Vec3::new(x, y, z)),
    ]
}

fn mesh() -> impl Strategy<Value = TriangleMesh> {
    prop::collection::vec(point(), 1..24).prop_flat_map(|positions| {
        let index = 0..positions.len() as u32;
        prop::collection::vec([index.clone(), index.clone(), index], 0..40).prop_map(move |triangles| {
            TriangleMesh {
                positions: positions.clone(),
                indices: triangles.concat(),
                ..TriangleMesh::default()
            }
        })
    })
}

fn bits(normals: &[Vec3]) -> Vec<[u32; 3]> {
    normals.iter().map(|normal| (*normal + 0.0).to_array().map(f32::to_bits)).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, rng_seed: RngSeed::Fixed(3), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_mesh_has_unit_normals_or_says_where_it_has_none(mesh in mesh()) {
        let welded = weld_positions(&mesh.positions);
        for weight in WEIGHTS {
            let smooth = compute_smooth_normals(&mesh, weight).unwrap();
            let mut missing = 0;
            for (vertex, normal) in smooth.mesh.normals.iter().enumerate() {
                prop_assert_eq!(*normal, smooth.mesh.normals[welded[vertex] as usize]);
                let has_face = mesh.triangles().any(|triangle| {
                    let touches = triangle.iter().any(|v| welded[*v as usize] == welded[vertex]);
                    touches && face_normal(&triangle.map(|v| mesh.positions[v as usize])).is_some()
                });
                missing += usize::from(!has_face);
                let length = normal.as_dvec3().length();
                prop_assert!(if has_face { (length - 1.0).abs() < 1e-6 } else { length == 0.0 }, "{normal} at {vertex}");
            }
            prop_assert_eq!(smooth.missing, missing);
            prop_assert_eq!(smooth.remark("m").is_some(), smooth.missing + smooth.cancelled > 0);
        }
    }

    #[test]
    fn scaling_by_a_power_of_two_changes_no_bit_and_mirroring_every_sign(mesh in mesh(), exponent in -20i32..20) {
        // Scaling must not leave the range of f32.
        prop_assume!(mesh.positions.iter().all(|p| !p.is_finite() || p.abs().max_element() < 1e9));
        prop_assume!(mesh.positions.iter().all(|p| p.to_array().iter().all(|c| *c == 0.0 || c.is_nan() || c.abs() >= 1e-20)));
        for weight in WEIGHTS {
            let normals = |mesh: &TriangleMesh| compute_smooth_normals(mesh, weight).unwrap().mesh.normals;
            let mut scaled = mesh.clone();
            scaled.positions.iter_mut().for_each(|position| *position *= 2f32.powi(exponent));
            prop_assert_eq!(bits(&normals(&mesh)), bits(&normals(&scaled)));
            let mut turned = mesh.clone();
            turned.indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
            let mirrored = Mat3::from_diagonal(Vec3::new(-1.0, 1.0, 1.0));
            turned.positions.iter_mut().for_each(|position| *position = mirrored * *position);
            let both = normals(&mesh).into_iter().zip(normals(&turned));
            for (normal, turned) in both {
                prop_assert!((mirrored * normal - turned).length() < 1e-6, "{normal} became {turned}");
            }
        }
    }

    #[test]
    fn adjacency_is_what_counting_finds(mesh in mesh()) {
        let triangles: Vec<[u32; 3]> = mesh.triangles().collect();
        let adjacency = Adjacency::new(&triangles, mesh.positions.len());
        for vertex in 0..mesh.positions.len() as u32 {
            let uses = |t: &[u32; 3]| t.iter().filter(|v| **v == vertex).count();
            let counted: Vec<u32> =
                (0u32..).zip(&triangles).flat_map(|(i, t)| std::iter::repeat_n(i, uses(t))).collect();
            prop_assert_eq!(adjacency.triangles_of_vertex(vertex), &counted[..]);
        }
        let edges: usize = adjacency.edge_valences().iter().map(|(valence, edges)| *valence as usize * edges).sum();
        prop_assert_eq!(edges, 3 * triangles.len());
    }
}
