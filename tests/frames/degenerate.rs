//! Degenerate scenes: nothing visible, no light, broken geometry, numbers that are not finite. Every frame is
//! finite (checked by the probe), nothing panics, wgpu's validation reports nothing, and the intact part looks as
//! if the broken part were not there.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec3, Vec3};
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{Attenuation, Light, Material, Shading};
use lumbre_render::{FrameOptions, LightLists, RenderError, RenderingPath};
use lumbre_scene::{Camera, Mesh, Projection, SceneSettings, Transform};
use lumbre_tests::compare::compare;
use lumbre_tests::panes::{orthographic, pane, pane_of};
use lumbre_tests::scenes::{ball, ball_of, every_light};
use lumbre_tests::twin::{self, TwinOptions};

use crate::adapter::{Canvas, draw, linear};

const SIZE: usize = 48;

fn lamp() -> Light {
    every_light().swap_remove(2).1
}

fn mesh_entity(world: &mut World) -> Entity {
    world.query_filtered::<Entity, With<Mesh>>().single(world).unwrap()
}

fn frame(world: &mut World, shading: Shading) -> Vec<DVec3> {
    draw(world, SIZE as u32, SIZE as u32, &FrameOptions { shading: Some(shading), ..linear() }).0
}

#[test]
fn a_world_without_meshes_is_its_background() {
    let mut world = World::new();
    world.spawn(orthographic());
    let background = Vec3::new(0.1, 2.5, 1e-3);
    world.insert_resource(SceneSettings { background, ..SceneSettings::default() });
    for multisample in [false, true] {
        let (pixels, report) =
            draw(&mut world, 5, 3, &FrameOptions { multisample: Some(multisample), ..linear() });
        assert!(pixels.iter().all(|pixel| *pixel == background.as_dvec3()), "{}", pixels[0]);
        assert!(!report.plan.status("forward").unwrap().runs());
    }
    // A mesh without triangles is not visible either.
    world.spawn(Mesh(Arc::new(TriangleMesh::default())));
    let (pixels, _) = draw(&mut world, 5, 3, &linear());
    assert!(pixels.iter().all(|pixel| *pixel == background.as_dvec3()));
}

#[test]
fn one_pixel_is_a_frame() {
    for multisample in [false, true] {
        let mut world = pane_of(Material::matt(Vec3::splat(0.5)));
        let (pixels, _) =
            draw(&mut world, 1, 1, &FrameOptions { multisample: Some(multisample), ..linear() });
        assert_eq!(pixels, [DVec3::splat(0.5)]);
    }
}

#[test]
fn without_lights_there_is_ambient_light_and_emission() {
    let mut world = ball(lamp());
    let light = world.query_filtered::<Entity, With<Light>>().single(&world).unwrap();
    world.despawn(light);
    let material = world.query::<&Material>().single(&world).unwrap().clone();
    let ambient = world.resource::<SceneSettings>().ambient;
    let expected = (material.front.ambient * ambient + material.front.emission).as_dvec3();
    for shading in Shading::ALL {
        let middle = frame(&mut world, *shading)[SIZE * SIZE / 2 + SIZE / 2];
        // One product and one sum in f32.
        assert!((middle - expected).abs().max_element() < 2e-8, "{}: {middle}", shading.name());
    }
}

#[test]
fn zero_normals_take_ambient_light_only() {
    let light = Light { ambient: Vec3::splat(0.25), ..Light::directional(Vec3::ONE) };
    let mut mesh = pane();
    mesh.normals = vec![Vec3::ZERO; 4];
    for absent in [false, true] {
        if absent {
            mesh.normals.clear();
        }
        let mut world = pane_of(Material::matt(Vec3::splat(0.5)));
        world.spawn((light.clone(), Transform::IDENTITY));
        let entity = mesh_entity(&mut world);
        world.entity_mut(entity).insert(Mesh(Arc::new(mesh.clone())));
        for shading in [Shading::Gouraud, Shading::Phong] {
            let pixels = frame(&mut world, shading);
            assert!(pixels.iter().all(|pixel| *pixel == DVec3::splat(0.5 * 1.25)), "{}", pixels[0]);
        }
        // Flat shading uses the face's normal, which exists: 0.5 * (1.25 + 1).
        let pixels = frame(&mut world, Shading::Flat);
        assert!(pixels.iter().all(|pixel| *pixel == DVec3::splat(0.5 * 2.25)), "{}", pixels[0]);
    }
}

#[test]
fn triangles_without_area_are_not_seen() {
    let whole = lumbre_mesh::shapes::uv_sphere(1.0, 33, 16);
    let mut broken = whole.clone();
    let last = broken.positions.len() as u32 - 1;
    // A point, an edge, and three collinear points.
    broken.indices.extend([0, 0, 0, 3, 3, last]);
    for x in [-1.0, 0.0, 1.0] {
        broken.indices.push(broken.positions.len() as u32);
        broken.positions.push(Vec3::new(x, 0.2, 1.4));
        broken.normals.push(Vec3::Z);
        broken.uv0.push(glam::Vec2::ZERO);
    }
    for shading in Shading::ALL {
        let expected = frame(&mut ball_of(whole.clone(), lamp()), *shading);
        assert!(frame(&mut ball_of(broken.clone(), lamp()), *shading) == expected, "{}", shading.name());
    }
}

#[test]
fn a_light_in_the_surface_is_finite_and_agrees_with_the_twin() {
    // Large enough for triangles to have an interior, the only place where flat shading can be compared.
    const LARGE: usize = 112;
    // At the middle of the ball's nearest patch, at one of its vertices, and at the eye.
    let vertex = lumbre_mesh::shapes::uv_sphere(1.0, 33, 16).positions[200].as_dvec3();
    for place in [DVec3::new(0.0, 0.0, 1.0), vertex, DVec3::ZERO, DVec3::new(0.0, 0.3, 3.6)] {
        let mut world = ball(Light { attenuation: Attenuation::NONE, ..lamp() });
        let mut lights = world.query_filtered::<&mut Transform, With<Light>>();
        lights.single_mut(&mut world).unwrap().translation = place;
        for shading in Shading::ALL {
            let options = FrameOptions { shading: Some(*shading), ..linear() };
            let (got, _) = draw(&mut world, LARGE as u32, LARGE as u32, &options);
            let got: Vec<_> = got.into_iter().map(Some).collect();
            let options = TwinOptions { shading: Some(*shading), ..TwinOptions::default() };
            let expected = twin::draw(&mut world, LARGE, LARGE, options);
            let expected = expected.inside_surfaces(*shading == Shading::Flat);
            let difference = compare(&got, &expected);
            assert!(difference.pixels > 30, "{} pixels are too few", difference.pixels);
            // f32 compared with f64, as in balls.rs.
            assert!(difference.largest < 1e-4, "{place}, {}: {difference:?}", shading.name());
        }
    }
}

#[test]
fn ten_thousand_lights_behind_the_camera_change_nothing() {
    let mut world = ball(lamp());
    let before = Shading::ALL.iter().map(|shading| frame(&mut world, *shading)).collect::<Vec<_>>();
    let range = Attenuation { range: 2.0, ..Attenuation::INVERSE_SQUARE };
    for number in 0..10_000 {
        let place = Transform::from_xyz(f64::from(number % 100) - 50.0, f64::from(number / 100) - 50.0, 10.0);
        world.spawn((Light { attenuation: range, ..Light::point(Vec3::splat(9.0)) }, place));
    }
    for (shading, before) in Shading::ALL.iter().zip(before) {
        // Bit for bit; deferred shading rounds differently.
        let rendering_path = RenderingPath::Forward;
        let options = FrameOptions { shading: Some(*shading), rendering_path, ..linear() };
        let (after, report) = draw(&mut world, SIZE as u32, SIZE as u32, &options);
        assert_eq!((report.statistics.lights, report.statistics.lights_per_object), (10_001, 1.0));
        assert!(after == before, "{}", shading.name());
    }
    // Negative control: in front of the camera they are visible.
    let mut lights = world.query_filtered::<&mut Transform, With<Light>>();
    lights.iter_mut(&mut world).for_each(|mut place| place.translation.z -= 8.0);
    let by_objects = FrameOptions { light_lists: LightLists::Objects, ..linear() };
    let (after, report) = draw(&mut world, SIZE as u32, SIZE as u32, &by_objects);
    assert!(report.statistics.lights_per_object > 5.0);
    assert!(after.iter().any(|pixel| pixel.max_element() > 10.0));
}

#[test]
fn positions_that_are_no_numbers_take_their_triangles_with_them() {
    for poison in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let whole = lumbre_mesh::shapes::uv_sphere(1.0, 33, 16);
        let mut broken = whole.clone();
        let touched = whole.positions.len() / 2;
        broken.positions[touched].y = poison;
        let mut open = whole.clone();
        open.indices = whole.triangles().filter(|t| !t.contains(&(touched as u32))).flatten().collect();
        for shading in Shading::ALL {
            let expected = frame(&mut ball_of(open.clone(), lamp()), *shading);
            let got = frame(&mut ball_of(broken.clone(), lamp()), *shading);
            let differ = got.iter().zip(&expected).filter(|(a, b)| a != b).count();
            assert_eq!(differ, 0, "{poison}, {}: {differ} pixels differ", shading.name());
        }
    }
}

#[test]
fn normals_and_colours_that_are_no_numbers_do_not_reach_the_frame() {
    for poison in [f32::NAN, f32::INFINITY] {
        let whole = lumbre_mesh::shapes::uv_sphere(1.0, 33, 16);
        let middle = whole.positions.len() / 2;
        let mut normals = whole.clone();
        normals.normals[middle].x = poison;
        let mut colors = whole.clone();
        colors.colors = vec![glam::Vec4::ONE; whole.positions.len()];
        colors.colors[middle].y = poison;
        for shading in Shading::ALL {
            frame(&mut ball_of(normals.clone(), lamp()), *shading);
            frame(&mut ball_of(colors.clone(), lamp()), *shading);
        }
    }
}

#[test]
fn objects_that_are_nowhere_are_not_drawn() {
    for place in [
        Transform::from_xyz(f64::NAN, 0.0, 0.0),
        Transform::from_xyz(f64::INFINITY, 0.0, 0.0),
        Transform::from_xyz(1e300, 0.0, 0.0),
        Transform::IDENTITY.with_scale(DVec3::new(1.0, f64::NAN, 1.0)),
        Transform::IDENTITY.with_rotation(DQuat::from_xyzw(f64::NAN, 0.0, 0.0, 1.0)),
    ] {
        let mut world = ball(lamp());
        let expected = frame(&mut world, Shading::Phong);
        let (mesh, material) = {
            let entity = mesh_entity(&mut world);
            (world.get::<Mesh>(entity).unwrap().clone(), world.get::<Material>(entity).unwrap().clone())
        };
        let lost = world.spawn((mesh, material, place)).id();
        let mut canvas = Canvas::new(SIZE as u32, SIZE as u32);
        assert!(canvas.draw(&mut world, &linear()).0 == expected, "{place:?}");
        // With a valid transform it is drawn again: the ball is covered by a larger one.
        world.entity_mut(lost).insert(Transform::IDENTITY.with_scale(DVec3::splat(1.2)));
        assert!(canvas.draw(&mut world, &linear()).0 != expected);
        world.entity_mut(lost).insert(place);
        assert!(canvas.draw(&mut world, &linear()).0 == expected, "{place:?}, for the second time");
    }
}

#[test]
fn huge_scales_stay_finite() {
    for scale in [1e30, 1e38, 1e60, 1e300] {
        let mut world = ball(lamp());
        let entity = mesh_entity(&mut world);
        world.entity_mut(entity).insert(Transform::IDENTITY.with_scale(DVec3::splat(scale)));
        frame(&mut world, Shading::Phong);
        world.entity_mut(entity).insert(Transform::IDENTITY.with_scale(DVec3::splat(1.0 / scale)));
        frame(&mut world, Shading::Phong);
    }
}

#[test]
fn lights_that_are_no_lights_are_left_out() {
    let mut world = ball(lamp());
    let expected = Shading::ALL.iter().map(|shading| frame(&mut world, *shading)).collect::<Vec<_>>();
    let lamp = lamp();
    let nan = Vec3::new(1.0, f32::NAN, 1.0);
    let broken = [
        (Light { diffuse: nan, ..lamp.clone() }, Transform::IDENTITY),
        (Light { ambient: nan, ..lamp.clone() }, Transform::IDENTITY),
        (Light { specular: Vec3::splat(f32::INFINITY), ..lamp.clone() }, Transform::IDENTITY),
        (Light::ambient(nan), Transform::IDENTITY),
        (
            Light { attenuation: Attenuation { quadratic: f32::NAN, ..Attenuation::NONE }, ..lamp.clone() },
            Transform::IDENTITY,
        ),
        (lamp.clone(), Transform::from_xyz(0.0, f64::NAN, 0.0)),
        (lamp, Transform::from_xyz(0.0, f64::INFINITY, 0.0)),
    ];
    for (light, place) in broken {
        let added = world.spawn((light.clone(), place)).id();
        for (shading, expected) in Shading::ALL.iter().zip(&expected) {
            assert!(frame(&mut world, *shading) == *expected, "{light:?} at {}", place.translation);
        }
        world.despawn(added);
    }
}

fn camera(projection: Projection) -> Camera {
    Camera { projection, exposure: 1.0 }
}

#[test]
fn bad_cameras_are_named_with_the_field_and_the_value() {
    let lens =
        |vertical_fov, near| camera(Projection::Perspective { vertical_fov, aspect: None, near, far: None });
    let parallel = |half_width, half_height, near, far| {
        camera(Projection::Orthographic { half_width, half_height, near, far })
    };
    let (nan, infinite) = (f64::NAN, f64::INFINITY);
    let mut canvas = Canvas::new(4, 4);
    let mut world = World::new();
    assert!(matches!(canvas.refuse(&mut world, &linear()), RenderError::NoCamera));
    let entity = world.spawn(Mesh(Arc::new(pane()))).id();
    let asked = FrameOptions { camera: Some(entity), ..linear() };
    let refused = canvas.refuse(&mut world, &asked);
    assert!(matches!(refused, RenderError::NotACamera { entity: named } if named == entity), "{refused}");
    for (bad, expected) in [
        (lens(0.0, 0.1), "vertical_fov"),
        (lens(-1.0, 0.1), "vertical_fov"),
        (lens(nan, 0.1), "vertical_fov"),
        (lens(std::f64::consts::PI, 0.1), "vertical_fov"),
        (lens(1.0, 0.0), "near"),
        (lens(1.0, nan), "near"),
        (lens(1.0, infinite), "near"),
        (parallel(0.0, 1.0, 0.0, 1.0), "half_width"),
        (parallel(nan, 1.0, 0.0, 1.0), "half_width"),
        (parallel(1.0, infinite, 0.0, 1.0), "half_height"),
        (parallel(1.0, 1.0, 1.0, 1.0), "far"),
        (parallel(1.0, 1.0, 0.0, nan), "far"),
        (parallel(1.0, 1.0, nan, 1.0), "far"),
        (Camera { exposure: f32::NAN, ..Camera::default() }, "exposure"),
        (Camera { exposure: f32::INFINITY, ..Camera::default() }, "exposure"),
    ] {
        let named = world.spawn((bad, Transform::from_xyz(0.0, 0.0, 2.0))).id();
        match canvas.refuse(&mut world, &linear()) {
            RenderError::BadCamera { entity, field, .. } => assert_eq!((entity, field), (named, expected)),
            other => panic!("{bad:?}: {other}"),
        }
        world.despawn(named);
    }
    let lost = world.spawn((Camera::default(), Transform::from_xyz(nan, 0.0, 0.0))).id();
    let refused = canvas.refuse(&mut world, &linear());
    assert!(matches!(refused, RenderError::BadCamera { field: "translation", .. }), "{refused}");
    // After all these errors the renderer still draws.
    world.despawn(lost);
    world.spawn(orthographic());
    world.insert_resource(SceneSettings { ambient: Vec3::ONE, ..SceneSettings::default() });
    assert!(canvas.draw(&mut world, &linear()).0.iter().all(|pixel| pixel.x == f64::from(0.8_f32)));
}

#[test]
fn a_camera_turned_by_no_number_or_scaled_away_still_makes_a_finite_frame() {
    for place in [
        Transform::from_xyz(0.0, 0.0, 3.0).with_rotation(DQuat::from_xyzw(f64::NAN, 0.0, 0.0, 1.0)),
        Transform::from_xyz(0.0, 0.0, 3.0).with_scale(DVec3::ZERO),
        Transform::from_xyz(0.0, 0.0, 3.0).with_scale(DVec3::new(1.0, 0.0, 1.0)),
        Transform::from_xyz(0.0, 0.0, 3.0).with_scale(DVec3::splat(f64::INFINITY)),
        Transform::from_xyz(1e300, 0.0, 3.0),
    ] {
        let mut world = ball(lamp());
        let camera = world.query_filtered::<Entity, With<Camera>>().single(&world).unwrap();
        world.entity_mut(camera).insert(place);
        frame(&mut world, Shading::Phong);
    }
}

#[test]
fn frames_without_texels_are_refused() {
    use lumbre_render::{Offscreen, OffscreenFormat};
    for (width, height) in [(0, 4), (4, 0), (u32::MAX, 1)] {
        let refused = Offscreen::new(crate::adapter::gpu(), width, height, OffscreenFormat::LinearFloat);
        assert!(matches!(refused, Err(RenderError::TargetTooLarge { .. })), "{width}x{height}");
    }
}

#[test]
fn materials_and_settings_that_are_no_numbers_are_black_there() {
    use lumbre_optics::Material;
    use lumbre_scene::SceneSettings;
    let mut world = lumbre_tests::scenes::ball(lumbre_optics::Light::point(glam::Vec3::splat(9.0)));
    let mut settings = world.resource_mut::<SceneSettings>();
    settings.ambient.x = f32::NAN;
    settings.background.y = f32::INFINITY;
    let mut materials = world.query::<&mut Material>();
    let mut material = materials.single_mut(&mut world).unwrap();
    material.front.diffuse.x = f32::NAN;
    material.front.emission.x = f32::NEG_INFINITY;
    material.front.specular.x = f32::NAN;
    material.front.ambient.x = f32::NAN;
    // The probe runs in `draw`.
    let (pixels, _) = crate::adapter::draw(&mut world, 24, 24, &crate::adapter::linear());
    let middle = pixels[12 * 24 + 12];
    assert!(middle.x == 0.0 && middle.y > 0.0, "{middle}");
}
