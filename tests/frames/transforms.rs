//! Transforms: mirrored, stretched, flattened and nested ones, and positions far from the origin.

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec3};
use lumbre_mesh::shapes;
use lumbre_optics::{Light, Shading};
use lumbre_render::FrameOptions;
use lumbre_scene::{ChildOf, Material, Mesh, SceneSettings, Transform};
use lumbre_tests::compare::{Difference, compare};
use lumbre_tests::scenes::{ball_of, every_light};
use lumbre_tests::twin::{self, TwinOptions};

use crate::adapter::{draw, linear};

const SIZE: usize = 112;

/// f32 compared with f64, as in balls.rs.
const LARGEST: f64 = 1e-4;

fn lamp() -> Light {
    every_light().swap_remove(2).1
}

/// A ball of polygons large enough to have an interior, the only place where flat shading can be compared.
fn coarse_ball() -> World {
    ball_of(shapes::uv_sphere(1.0, 12, 6), lamp())
}

fn mesh_entity(world: &mut World) -> Entity {
    world.query_filtered::<Entity, With<Mesh>>().single(world).unwrap()
}

fn against_twin(world: &mut World, shading: Shading) -> Difference {
    let options = TwinOptions { shading: Some(shading), ..TwinOptions::default() };
    let expected = twin::draw(world, SIZE, SIZE, options).inside_surfaces(true);
    let (got, _) =
        draw(world, SIZE as u32, SIZE as u32, &FrameOptions { shading: Some(shading), ..linear() });
    compare(&got.into_iter().map(Some).collect::<Vec<_>>(), &expected)
}

#[test]
fn mirrored_stretched_and_sheared_balls_agree_with_the_twin() {
    let tilt = DQuat::from_rotation_z(0.5) * DQuat::from_rotation_x(0.3);
    for scale in [
        DVec3::new(-1.0, 1.0, 1.0),
        DVec3::new(-0.9, -0.8, -1.1),
        DVec3::new(1.3, 0.25, 0.7),
        DVec3::new(0.4, -1.2, 0.8),
        DVec3::new(1.0, 1.0, 1e-3),
    ] {
        let mut world = coarse_ball();
        let entity = mesh_entity(&mut world);
        world.entity_mut(entity).insert(Transform::from_rotation(tilt).with_scale(scale));
        // A parent with a non-uniform scale above a rotation causes a shear.
        let parent =
            world.spawn(Transform::from_xyz(0.1, 0.0, 0.2).with_scale(DVec3::new(1.0, 0.8, 1.1))).id();
        world.entity_mut(entity).insert(ChildOf(parent));
        for shading in Shading::ALL {
            let difference = against_twin(&mut world, *shading);
            assert!(
                difference.pixels > 30,
                "{scale}, {}: {} pixels are too few",
                shading.name(),
                difference.pixels
            );
            assert!(difference.largest < LARGEST, "{scale}, {}: {difference:?}", shading.name());
        }
    }
}

#[test]
fn a_flattened_ball_is_a_disc() {
    let mut world = coarse_ball();
    let entity = mesh_entity(&mut world);
    let turn = DQuat::from_rotation_y(0.4);
    world.entity_mut(entity).insert(Transform::from_rotation(turn).with_scale(DVec3::new(1.0, 1.0, 0.0)));
    for shading in Shading::ALL {
        let difference = against_twin(&mut world, *shading);
        assert!(difference.pixels > 30, "{} pixels are too few", difference.pixels);
        assert!(difference.largest < LARGEST, "{}: {difference:?}", shading.name());
    }
    // A line or a point is not visible.
    let background = glam::Vec3::new(0.1, 0.2, 0.3);
    world.resource_mut::<SceneSettings>().background = background;
    for scale in [DVec3::X, DVec3::ZERO] {
        world.get_mut::<Transform>(entity).unwrap().scale = scale;
        for shading in Shading::ALL {
            let (pixels, _) = draw(
                &mut world,
                SIZE as u32,
                SIZE as u32,
                &FrameOptions { shading: Some(*shading), ..linear() },
            );
            assert!(pixels.iter().all(|pixel| *pixel == background.as_dvec3()), "{scale}");
        }
    }
}

#[test]
fn a_thousand_kilometres_away_the_frame_is_the_same() {
    let far = DVec3::new(1e6, -2e5, 3e5);
    for shading in Shading::ALL {
        let options = FrameOptions { shading: Some(*shading), ..linear() };
        let mut world = coarse_ball();
        let entity = mesh_entity(&mut world);
        let inside = {
            let options = TwinOptions { shading: Some(*shading), ..TwinOptions::default() };
            twin::draw(&mut world, SIZE, SIZE, options).inside_surfaces(*shading == Shading::Flat)
        };
        let (near, _) = draw(&mut world, SIZE as u32, SIZE as u32, &options);
        let near: Vec<_> = near.iter().zip(&inside).map(|(pixel, inside)| inside.map(|_| *pixel)).collect();
        let mut places = world.query::<&mut Transform>();
        places.iter_mut(&mut world).for_each(|mut place| place.translation += far);
        let seen_from_afar = |world: &mut World| {
            let (pixels, _) = draw(world, SIZE as u32, SIZE as u32, &options);
            compare(&pixels.into_iter().map(Some).collect::<Vec<_>>(), &near)
        };
        let moved = seen_from_afar(&mut world);
        assert!(moved.pixels > 30, "{} pixels are too few", moved.pixels);
        // Camera-relative space has its origin at the camera there, so only its f32 rounding matters: as near the
        // origin, the difference is at most balls.rs' bound.
        assert!(moved.largest < LARGEST, "{}: {moved:?}", shading.name());
        // Negative control: half of f32's step at 10^6 m, which a renderer without camera-relative positions would
        // lose, is visible.
        world.get_mut::<Transform>(entity).unwrap().translation.x += 0.03;
        assert!(seen_from_afar(&mut world).largest > 10.0 * LARGEST);
    }
}

#[test]
fn a_child_stands_where_its_parents_put_it() {
    // A lamp, a ball and the camera, three levels deep, compared with the same objects with their transforms
    // multiplied by hand.
    let turn = |angle: f64| DQuat::from_rotation_y(angle) * DQuat::from_rotation_x(0.2);
    let levels = [
        Transform::from_xyz(3.0, -1.0, 2.0).with_rotation(turn(0.7)),
        Transform::from_xyz(-0.5, 0.3, 0.1).with_rotation(turn(-1.9)).with_scale(DVec3::splat(2.0)),
        Transform::from_xyz(0.2, 0.1, -0.3).with_rotation(turn(2.5)).with_scale(DVec3::splat(0.5)),
    ];
    let mut nested = coarse_ball();
    let roots: Vec<Entity> = nested.query_filtered::<Entity, With<Transform>>().iter(&nested).collect();
    let mut parent = None;
    for level in levels {
        let child = nested.spawn(level).id();
        if let Some(parent) = parent {
            nested.entity_mut(child).insert(ChildOf(parent));
        }
        parent = Some(child);
    }
    for root in roots {
        nested.entity_mut(root).insert(ChildOf(parent.unwrap()));
    }
    // The whole scene was moved, rotated and scaled by 1, so the picture is that of the original scene.
    for shading in Shading::ALL {
        let options = TwinOptions { shading: Some(*shading), ..TwinOptions::default() };
        let expected =
            twin::draw(&mut coarse_ball(), SIZE, SIZE, options).inside_surfaces(*shading == Shading::Flat);
        let options = FrameOptions { shading: Some(*shading), ..linear() };
        let (got, _) = draw(&mut nested, SIZE as u32, SIZE as u32, &options);
        let difference = compare(&got.into_iter().map(Some).collect::<Vec<_>>(), &expected);
        assert!(difference.pixels > 30, "{} pixels are too few", difference.pixels);
        assert!(difference.largest < LARGEST, "{}: {difference:?}", shading.name());
    }
    // Negative control: the middle level has an effect.
    let middle = nested.get::<ChildOf>(parent.unwrap()).unwrap().parent();
    let ball = mesh_entity(&mut nested);
    nested.entity_mut(ball).insert(ChildOf(middle));
    let (got, _) = draw(&mut nested, SIZE as u32, SIZE as u32, &linear());
    let expected = twin::draw(&mut coarse_ball(), SIZE, SIZE, TwinOptions::default()).inside_surfaces(false);
    assert!(compare(&got.into_iter().map(Some).collect::<Vec<_>>(), &expected).largest > 0.1);
}

#[test]
fn instances_of_one_mesh_stand_each_in_its_place() {
    // One mesh, one pipeline, one draw, while each object has its own transform and material.
    let mut world = ball_of(shapes::cuboid(glam::Vec3::splat(0.5), 1), lamp());
    let first = mesh_entity(&mut world);
    let (mesh, material) =
        (world.get::<Mesh>(first).unwrap().clone(), world.get::<Material>(first).unwrap().clone());
    for number in 0..8_u32 {
        let (x, y) = (f64::from(number % 3) - 1.0, f64::from(number / 3) - 1.0);
        let mut material = material.clone();
        material.front.diffuse *= 0.1 * (number + 1) as f32;
        let turn = DQuat::from_rotation_y(0.3 * f64::from(number));
        world.spawn((mesh.clone(), material, Transform::from_xyz(x, y, 0.0).with_rotation(turn)));
    }
    world.entity_mut(first).insert(Transform::from_xyz(1.0, 1.0, 0.0));
    for shading in Shading::ALL {
        let difference = against_twin(&mut world, *shading);
        assert!(difference.pixels > 500, "{} pixels are too few", difference.pixels);
        assert!(difference.largest < LARGEST, "{}: {difference:?}", shading.name());
    }
    let (_, report) = draw(&mut world, 8, 8, &linear());
    assert_eq!((report.statistics.objects, report.statistics.draws), (9, 1));
}
