//! Fronts and backs: which faces are drawn, and with which normal and material they are lit.

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{Light, Material, Shading, Surface};
use lumbre_render::FrameOptions;
use lumbre_scene::{Mesh, SceneSettings, Transform};
use lumbre_tests::compare::compare;
use lumbre_tests::scenes::ball_of;
use lumbre_tests::twin::{self, TwinOptions};

use crate::adapter::{draw, linear};

const SIZE: usize = 112;

/// f32 compared with f64, as in balls.rs.
const LARGEST: f64 = 1e-4;

/// A ball whose front is cut away, so that the camera sees its rim from outside and its hollow from inside.
fn bowl() -> TriangleMesh {
    // Polygons large enough to have an interior, the only place where flat shading can be compared.
    let mut mesh = shapes::uv_sphere(1.0, 16, 10);
    let kept: Vec<u32> = mesh
        .triangles()
        .filter(|t| {
            t.iter().map(|&i| mesh.positions[i as usize].dot(Vec3::new(0.5, 0.0, 0.87))).sum::<f32>() < 1.2
        })
        .flatten()
        .collect();
    mesh.indices = kept;
    mesh
}

fn bowl_scene(double_sided: bool, two_sided: bool) -> World {
    let lamp = Light { ambient: Vec3::splat(0.05), ..Light::point(Vec3::splat(12.0)) };
    let mut world = ball_of(bowl(), lamp);
    let back = Surface {
        ambient: Vec3::new(0.1, 0.5, 0.2),
        diffuse: Vec3::new(0.2, 0.7, 0.3),
        specular: Vec3::splat(0.3),
        emission: Vec3::new(0.05, 0.0, 0.0),
        shininess: 5.0,
    };
    let mut material = world.query::<&mut Material>().single_mut(&mut world).unwrap();
    (material.double_sided, material.back) = (double_sided, Some(back));
    world.resource_mut::<SceneSettings>().two_sided = two_sided;
    world
}

#[test]
fn fronts_and_backs_agree_with_the_twin() {
    for (double_sided, two_sided) in [(true, true), (true, false), (false, true)] {
        let mut world = bowl_scene(double_sided, two_sided);
        for shading in Shading::ALL {
            let options = TwinOptions { shading: Some(*shading), ..TwinOptions::default() };
            let expected = twin::draw(&mut world, SIZE, SIZE, options).inside_surfaces(true);
            let (got, _) = draw(
                &mut world,
                SIZE as u32,
                SIZE as u32,
                &FrameOptions { shading: Some(*shading), ..linear() },
            );
            let got: Vec<_> = got.into_iter().map(Some).collect();
            let difference = compare(&got, &expected);
            let case = format!("double-sided {double_sided}, two-sided {two_sided}, {}", shading.name());
            assert!(difference.pixels > 60, "{case}: {} pixels", difference.pixels);
            assert!(difference.largest < LARGEST, "{case}: {difference:?}");
        }
    }
}

#[test]
fn the_three_ways_to_see_a_back_differ() {
    // Negative control of the test above: its three cases give three different pictures.
    let mut frames = Vec::new();
    for (double_sided, two_sided) in [(true, true), (true, false), (false, true)] {
        frames.push(draw(&mut bowl_scene(double_sided, two_sided), SIZE as u32, SIZE as u32, &linear()).0);
    }
    for (a, b) in [(0, 1), (1, 2), (0, 2)] {
        let differ = (0..SIZE * SIZE).filter(|&at| (frames[a][at] - frames[b][at]).length() > 0.01).count();
        assert!(differ > SIZE * SIZE / 20, "frames {a} and {b} differ in {differ} pixels only");
    }
}

#[test]
fn the_back_of_a_single_sided_pane_is_not_there() {
    let mut world = lumbre_tests::panes::pane_of(Material::matt(Vec3::splat(0.5)));
    let background = Vec3::new(0.1, 0.2, 0.3);
    world.resource_mut::<SceneSettings>().background = background;
    let pane = world.query_filtered::<Entity, With<Mesh>>().single(&world).unwrap();
    let turned = Transform::from_rotation(glam::DQuat::from_rotation_y(std::f64::consts::PI));
    let color = |world: &mut World| draw(world, 4, 4, &linear()).0;
    assert!(color(&mut world).iter().all(|pixel| *pixel == DVec3::splat(0.5)));
    world.entity_mut(pane).insert(turned);
    assert!(color(&mut world).iter().all(|pixel| *pixel == background.as_dvec3()));
    world.get_mut::<Material>(pane).unwrap().double_sided = true;
    assert!(color(&mut world).iter().all(|pixel| *pixel == DVec3::splat(0.5)));
    // Mirrored and not turned, its front is visible.
    world.get_mut::<Material>(pane).unwrap().double_sided = false;
    let mut mirrored = *world.get::<Transform>(pane).unwrap();
    mirrored.rotation = glam::DQuat::IDENTITY;
    mirrored.scale = DVec3::new(-1.0, 1.0, 1.0);
    world.entity_mut(pane).insert(mirrored);
    assert!(color(&mut world).iter().all(|pixel| *pixel == DVec3::splat(0.5)));
}
