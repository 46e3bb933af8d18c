//! Cases of normals without a length: triangles without area, averages that cancel, zeros set in code.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::TriangleMesh;
use lumbre_mesh::normals::{NormalWeight, compute_smooth_normals};
use lumbre_optics::{Light, Material, Shading};
use lumbre_render::FrameOptions;
use lumbre_scene::{Mesh, Transform};
use lumbre_tests::panes::{pane, pane_of};

use crate::adapter::{draw, linear};
use crate::case::Outcome;

crate::cases! {
    "normal of length 0" {
        degenerate_triangles_leave_the_frame_as_it_is, a_vertex_of_degenerate_triangles_only, an_average_that_cancels,
        that_mesh_is_named_once, zero_normals_in_code, zero_normals_in_code_under_flat_shading,
        normals_that_cancel_across_a_triangle,
    }
}

fn grey(color: DVec3) -> f64 {
    color.element_sum() / 3.0
}

/// The mesh under ambient light of 1 and a light along its normal; k is 0.5.
fn lit(mesh: TriangleMesh, shading: Shading) -> Vec<f64> {
    let mut world = pane_of(Material::matt(Vec3::splat(0.5)));
    let entity = world.query_filtered::<Entity, With<Mesh>>().single(&world).unwrap();
    world.entity_mut(entity).insert(Mesh(Arc::new(mesh)));
    world.spawn((Light::directional(Vec3::ONE), Transform::IDENTITY));
    let options = FrameOptions { shading: Some(shading), ..linear() };
    draw(&mut world, 16, 16, &options).0.into_iter().map(grey).collect()
}

/// The pane with a point, an edge and three collinear points as additional triangles.
fn with_degenerate_triangles() -> TriangleMesh {
    let mut mesh = pane();
    let first = mesh.positions.len() as u32;
    for x in [-0.5, 0.0, 0.5] {
        mesh.positions.push(Vec3::new(x, 0.3, 0.5));
        mesh.normals.push(Vec3::Z);
        mesh.uv0.push(glam::Vec2::ZERO);
    }
    mesh.indices.extend([0, 0, 0, 1, 1, 2, first, first + 1, first + 2]);
    mesh
}

fn degenerate_triangles_leave_the_frame_as_it_is() -> Outcome {
    let changed = Shading::ALL.iter().map(|shading| {
        let (whole, broken) = (lit(pane(), *shading), lit(with_degenerate_triangles(), *shading));
        whole.iter().zip(&broken).filter(|(a, b)| a != b).count() as f64
    });
    let changed: Vec<f64> = changed.collect();
    Outcome::worst(
        changed.into_iter().map(|count| (0.0, count)),
        0.0,
        "pixels that differ in any shading, bit for bit",
    )
}

fn a_vertex_of_degenerate_triangles_only() -> Outcome {
    // When averaging, the points of the line have no face, and the pane's vertices keep their normals.
    let smooth = compute_smooth_normals(&with_degenerate_triangles(), NormalWeight::Angle).unwrap();
    assert_eq!((smooth.cancelled, smooth.missing), (0, 3));
    let expected = [1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0];
    let got = smooth.mesh.normals.iter().map(|normal| f64::from(normal.z));
    Outcome::worst(
        expected.into_iter().zip(got),
        0.0,
        "faces without area weigh nothing: the pane's +z, and 0 where there is no face",
    )
}

/// The pane with the same triangles in opposite winding too: every average is 0.
fn two_faced() -> TriangleMesh {
    let mut mesh = pane();
    mesh.normals.clear();
    mesh.indices.extend([0, 2, 1, 0, 3, 2]);
    mesh
}

fn an_average_that_cancels() -> Outcome {
    let smooth = compute_smooth_normals(&two_faced(), NormalWeight::Angle).unwrap();
    assert_eq!((smooth.cancelled, smooth.missing), (4, 0));
    let got = lit(smooth.mesh, Shading::Phong);
    Outcome::worst(got.into_iter().map(|x| (1.0, x)), 1e-6, "the first face's normal, +z: k_a I_a + k_d L")
}

fn that_mesh_is_named_once() -> Outcome {
    let smooth = compute_smooth_normals(&two_faced(), NormalWeight::Angle).unwrap();
    Outcome::text(
        "mesh \"card\": the normals around 4 vertices cancel",
        smooth.remark("card").unwrap_or_default(),
    )
}

fn zero() -> TriangleMesh {
    TriangleMesh { normals: vec![Vec3::ZERO; 4], ..pane() }
}

fn zero_normals_in_code() -> Outcome {
    let got = [Shading::Gouraud, Shading::Phong].map(|shading| lit(zero(), shading)).concat();
    Outcome::worst(
        got.into_iter().map(|x| (0.5, x)),
        0.0,
        "made in code a zero stays a zero, as in OpenGL: k_a I_a",
    )
}

fn zero_normals_in_code_under_flat_shading() -> Outcome {
    let got = lit(zero(), Shading::Flat);
    Outcome::worst(got.into_iter().map(|x| (1.0, x)), 1e-6, "the face's own normal: k_a I_a + k_d L")
}

fn normals_that_cancel_across_a_triangle() -> Outcome {
    // The normals of the right and left edges are opposite, +x and -x: the interpolated normal has the sign of x,
    // and is 0 in the middle.
    let mut mesh = pane();
    mesh.normals = mesh.positions.iter().map(|position| Vec3::X * position.x).collect();
    let mut world = pane_of(Material::matt(Vec3::splat(0.5)));
    let entity = world.query_filtered::<Entity, With<Mesh>>().single(&world).unwrap();
    world.entity_mut(entity).insert(Mesh(Arc::new(mesh)));
    let sun = Transform::from_xyz(1.0, 0.0, 0.0).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Light::directional(Vec3::ONE), sun));
    let (pixels, _) = draw(&mut world, 17, 17, &linear());
    // In the middle column the normal is 0 or what rounding leaves of it, so half of the light or none is correct
    // there.
    let pairs = pixels
        .iter()
        .enumerate()
        .filter(|(at, _)| at % 17 != 8)
        .map(|(at, pixel)| (if at % 17 > 8 { 1.0 } else { 0.5 }, grey(*pixel)));
    let worst = Outcome::worst(
        pairs.collect::<Vec<_>>(),
        1e-6,
        "k_a I_a + k_d L where x > 0, k_a I_a where x < 0, between the two at 0",
    );
    assert!((0..17).all(|row| (0.5..=1.0 + 1e-6).contains(&grey(pixels[row * 17 + 8]))));
    worst
}
