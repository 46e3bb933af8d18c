//! Compares what is seen through glass in the frame with the tracer's ray tree: sheets up to a step of eight bits,
//! solid bodies as far as the picture contains what is behind them. A frame without visible glass must contain
//! nothing of this.

use std::ops::ControlFlow;
use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{Fog, FogMode, Light, Material, Shading, Surface};
use lumbre_render::{FrameOptions, RenderingPath};
use lumbre_scene::{Camera, Medium, Mesh, Projection, SceneSettings, Transform};
use lumbre_trace::{TraceOptions, trace};

use crate::adapter::{draw, gpu, linear};

const WIDTH: u32 = 384;
const HEIGHT: u32 = 288;

/// One step of eight bits.
const STEP: f64 = 1.0 / 255.0;

fn matte(diffuse: Vec3) -> Material {
    let front = Surface { ambient: diffuse, diffuse, ..Surface::default() };
    Material { front, ..Material::default() }
}

fn glass(ior: f32) -> Material {
    let front = Surface { specular: Vec3::splat(0.3), shininess: 80.0, ..matte(Vec3::ZERO).front };
    Material { front, transmission: Vec3::splat(1.0), ior, ..Material::default() }
}

fn room() -> World {
    let mut world = World::new();
    let mut spawn = |mesh, material: Material, place: Transform| {
        world.spawn((Mesh(Arc::new(mesh)), material, place));
    };
    for x in -8..8 {
        for z in -8..8 {
            let tile = if (x + z) % 2 == 0 { Vec3::splat(0.7) } else { Vec3::new(0.25, 0.2, 0.15) };
            let place = Transform::from_xyz(0.5 * f64::from(x), 0.0, 0.5 * f64::from(z));
            spawn(shapes::plane(0.5, 0.5, 1, 1), matte(tile), place);
        }
    }
    for x in -8..8 {
        for y in 0..6 {
            let tile = if (x + y) % 2 == 0 { Vec3::new(0.2, 0.3, 0.6) } else { Vec3::new(0.7, 0.6, 0.3) };
            let place = Transform::from_xyz(0.5 * f64::from(x), 0.25 + 0.5 * f64::from(y), -4.0)
                .with_rotation(DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2));
            spawn(shapes::plane(0.5, 0.5, 1, 1), matte(tile), place);
        }
    }
    spawn(
        shapes::uv_sphere(0.4, 48, 24),
        matte(Vec3::new(0.8, 0.1, 0.1)),
        Transform::from_xyz(-1.0, 0.4, -1.5),
    );
    spawn(
        shapes::uv_sphere(0.4, 48, 24),
        matte(Vec3::new(0.1, 0.7, 0.1)),
        Transform::from_xyz(1.1, 0.4, -1.2),
    );
    world.spawn((Light::point(Vec3::splat(14.0)), Transform::from_xyz(-1.5, 3.0, 2.0)));
    let eye = Transform::from_xyz(0.3, 1.3, 3.5).looking_at(DVec3::new(0.0, 0.7, -1.0), DVec3::Y);
    world.spawn((Camera::default(), eye));
    world.insert_resource(SceneSettings {
        ambient: Vec3::splat(0.3),
        background: Vec3::new(0.1, 0.2, 0.4),
        ..SceneSettings::default()
    });
    world
}

fn options() -> FrameOptions {
    FrameOptions { shadows: false, shading: Some(Shading::Phong), ..linear() }
}

fn ball(world: &mut World, medium: Medium) {
    let place = Transform::from_xyz(0.0, 0.75, 0.3);
    world.spawn((Mesh(Arc::new(shapes::uv_sphere(0.7, 96, 48))), glass(1.5), medium, place));
}

/// The comparison of the glass in a frame.
#[derive(Debug)]
struct Against {
    /// Number of pixels in which anything is seen through glass.
    pixels: usize,
    /// The mean difference of their channels from the ray tree, for the frame and for one without refraction.
    mean: f64,
    opaque: f64,
    /// The fraction of these pixels in which the difference is less than 4/255.
    close: f64,
    /// The largest difference over pixels in which the ray tree is even.
    largest: f64,
}

fn against_the_ray_tree(world: &mut World, options: &FrameOptions, depth: u32) -> Against {
    let (frame, _) = draw(world, WIDTH, HEIGHT, options);
    let (opaque, _) = draw(world, WIDTH, HEIGHT, &FrameOptions { refraction: false, ..options.clone() });
    let traced =
        TraceOptions { size: (WIDTH, HEIGHT), depth: Some(depth), shadows: false, ..TraceOptions::default() };
    let traced = trace(world, &traced, &|_| ControlFlow::Continue(())).unwrap().0.radiance;
    let mut against = Against { pixels: 0, mean: 0.0, opaque: 0.0, close: 0.0, largest: 0.0 };
    let mean = |difference: DVec3| difference.abs().element_sum() / 3.0;
    for (index, traced_pixel) in traced.iter().enumerate() {
        if (frame[index] - opaque[index]).abs().max_element() < STEP {
            continue;
        }
        let difference = (frame[index] - *traced_pixel).abs().max_element();
        against.pixels += 1;
        against.mean += mean(frame[index] - *traced_pixel);
        against.opaque += mean(opaque[index] - *traced_pixel);
        against.close += f64::from(u8::from(difference < 4.0 * STEP));
        let (row, column) = (index / WIDTH as usize, index % WIDTH as usize);
        let near = |y: usize, x: usize| {
            traced[(row + y).saturating_sub(1).min(HEIGHT as usize - 1) * WIDTH as usize
                + (column + x).saturating_sub(1).min(WIDTH as usize - 1)]
        };
        if (0..9).all(|at| (near(at / 3, at % 3) - *traced_pixel).abs().max_element() < 4.0 * STEP) {
            against.largest = against.largest.max(difference);
        }
    }
    let pixels = against.pixels.max(1) as f64;
    (against.mean, against.opaque) = (against.mean / pixels, against.opaque / pixels);
    against.close /= pixels;
    against
}

#[test]
fn a_sheet_shows_what_the_ray_tree_shows() {
    for (fresnel, samples, fog) in [
        (false, false, false),
        (false, true, false),
        (true, false, false),
        (true, true, false),
        (true, false, true),
    ] {
        let mut world = room();
        if fog {
            let mode = FogMode::Exponential { density: 0.1 };
            world.resource_mut::<SceneSettings>().fog = Some(Fog { mode, color: Vec3::new(0.6, 0.5, 0.3) });
        }
        let place = Transform::from_xyz(0.2, 1.0, 0.5)
            .with_rotation(DQuat::from_rotation_y(0.6) * DQuat::from_rotation_x(1.4));
        let sheet = Material { transmission: Vec3::new(0.9, 0.8, 0.7), ..glass(1.7) };
        let medium = Medium { thin: true, fresnel, ..Medium::default() };
        world.spawn((Mesh(Arc::new(shapes::plane(1.6, 1.4, 2, 2))), sheet, medium, place));
        let options = FrameOptions { multisample: Some(samples), ..options() };
        let against = against_the_ray_tree(&mut world, &options, 1);
        println!("sheet, Fresnel {fresnel}, several samples {samples}, fog {fog}: {against:?}");
        // Behind the sheet the tracer's fog uses the length of the ray, and the frame's the distance along the line
        // of sight.
        let most = if fog { 2.0 * STEP } else { STEP };
        assert!(against.pixels > 8000 && against.largest < most, "{against:?}");
    }
}

/// Solid bodies: for most of their pixels the picture contains what is seen through them, which there agrees with
/// the ray tree except for internal reflections.
#[test]
fn a_ball_shows_nearly_what_the_ray_tree_shows() {
    let amber = Medium {
        attenuation_color: Vec3::new(0.9, 0.6, 0.2),
        attenuation_distance: 0.5,
        ..Medium::default()
    };
    for (what, medium, most) in [
        ("plain", Medium::default(), 0.04),
        ("absorbing", amber, 0.04),
        ("Fresnel", Medium { fresnel: true, ..Medium::default() }, 0.06),
    ] {
        for scale in [DVec3::ONE, DVec3::new(-1.0, 1.0, 1.0)] {
            let mut world = room();
            ball(&mut world, medium);
            for (material, mut place) in world.query::<(&Material, &mut Transform)>().iter_mut(&mut world) {
                if material.transmission != Vec3::ZERO {
                    place.scale = scale;
                }
            }
            let against = against_the_ray_tree(&mut world, &options(), 5);
            println!("{what}, scale {scale}: {against:?}");
            assert!(against.pixels > 8000 && against.mean < most, "{what}: {against:?}");
            assert!(against.opaque > 5.0 * against.mean, "{what}: {against:?}");
        }
    }
}

/// Water in a basin: a plane without a back, through which the bottom appears nearer than it is.
#[test]
fn a_pool_shows_nearly_what_the_ray_tree_shows() {
    let mut world = room();
    let water = Medium { fresnel: true, ..Medium::default() };
    let place = Transform::from_xyz(0.0, 0.6, 0.2);
    world.spawn((Mesh(Arc::new(shapes::plane(3.0, 2.4, 1, 1))), glass(1.33), water, place));
    let against = against_the_ray_tree(&mut world, &options(), 5);
    println!("pool: {against:?}");
    assert!(against.pixels > 8000 && against.mean < 0.03, "{against:?}");
    assert!(against.opaque > 6.0 * against.mean, "{against:?}");
}

/// Light that is added pixel by pixel, where front faces have been drawn before, is that which is added triangle by
/// triangle. A ray that passes an edge of the picture may end on either side of it.
#[test]
fn light_from_front_faces_is_that_of_the_triangles() {
    let fog = Fog { mode: FogMode::Exponential { density: 0.1 }, color: Vec3::new(0.6, 0.5, 0.3) };
    for (what, height, fog, origin, eye) in [
        ("perspective", None, None, 0.0, 3.5),
        ("parallel", Some(2.0), None, 0.0, 3.5),
        ("fog", None, Some(fog), 0.0, 3.5),
        ("a kilometre from the origin", None, None, 1000.0, 3.5),
        ("the ball begins before the near plane", None, None, 0.0, 1.2),
    ] {
        let mut world = room();
        ball(&mut world, Medium { fresnel: true, ..Medium::default() });
        // One glass in front of another, and a mirrored one that no other overlaps.
        let sheet = Medium { thin: true, fresnel: true, ..Medium::default() };
        let front = Transform::from_xyz(0.3, 1.0, 1.6).with_rotation(DQuat::from_rotation_x(1.4));
        world.spawn((Mesh(Arc::new(shapes::plane(0.5, 0.5, 8, 8))), glass(1.7), sheet, front));
        let mut beside = Transform::from_xyz(-1.3, 0.5, 0.8);
        beside.scale = DVec3::new(-0.4, 0.5, 0.4);
        world.spawn((Mesh(Arc::new(shapes::uv_sphere(0.9, 64, 32))), glass(1.3), Medium::default(), beside));
        world.resource_mut::<SceneSettings>().fog = fog;
        for (camera, mut place) in world.query::<(Has<Camera>, &mut Transform)>().iter_mut(&mut world) {
            if camera {
                place.translation.z = eye;
            }
            place.translation += DVec3::splat(origin);
        }
        for mut camera in world.query::<&mut Camera>().iter_mut(&mut world) {
            camera.projection =
                Projection::Perspective { vertical_fov: 0.9, aspect: None, near: 0.3, far: None };
        }
        if let Some(half_height) = height {
            for mut camera in world.query::<&mut Camera>().iter_mut(&mut world) {
                camera.projection = Projection::Orthographic {
                    half_width: half_height * f64::from(WIDTH) / f64::from(HEIGHT),
                    half_height,
                    near: 0.1,
                    far: 20.0,
                };
            }
        }
        let [forward, deferred] = [RenderingPath::Forward, RenderingPath::Deferred].map(|rendering_path| {
            let (pixels, report) =
                draw(&mut world, WIDTH, HEIGHT, &FrameOptions { rendering_path, ..options() });
            let drawn = report.plan.running().any(|pass| pass == "front faces");
            assert_eq!(drawn, rendering_path == RenderingPath::Deferred);
            pixels
        });
        let (opaque, _) = draw(&mut world, WIDTH, HEIGHT, &FrameOptions { refraction: false, ..options() });
        let (mut through, mut apart) = (0, 0);
        for ((forward, deferred), opaque) in forward.iter().zip(&deferred).zip(&opaque) {
            through += usize::from((*forward - *opaque).abs().max_element() > STEP);
            apart += usize::from((*forward - *deferred).abs().max_element() > 0.1 * STEP);
        }
        println!("{what}: {apart} of {through} pixels differ by more than a tenth of a step");
        assert!(through > 10_000 && apart * 500 < through, "{what}: {apart} of {through}");
    }
}

/// Software rasterizers add light pixel by pixel where surfaces have many triangles and pixels one sample.
#[test]
fn front_faces_are_drawn_where_triangles_are_many() {
    let front_faces = |world: &mut World, options: FrameOptions| {
        draw(world, WIDTH, HEIGHT, &options).1.plan.running().any(|pass| pass == "front faces")
    };
    let software = gpu().is_software();
    let mut world = room();
    ball(&mut world, Medium::default());
    assert_eq!(front_faces(&mut world, options()), software);
    let several = FrameOptions { multisample: Some(true), ..options() };
    assert!(!front_faces(&mut world, FrameOptions { rendering_path: RenderingPath::Deferred, ..several }));
    let mut world = room();
    world.spawn((
        Mesh(Arc::new(shapes::plane(1.6, 1.4, 2, 2))),
        glass(1.5),
        Medium::default(),
        Transform::from_xyz(0.0, 1.0, 0.5).with_rotation(DQuat::from_rotation_x(1.4)),
    ));
    assert!(!front_faces(&mut world, options()));
    // Beside a ball the light of the pane is still added by its triangles.
    ball(&mut world, Medium::default());
    let report = draw(&mut world, WIDTH, HEIGHT, &options()).1;
    for (name, runs) in [("refraction", true), ("refraction by pixel", software)] {
        assert_eq!(report.plan.running().any(|pass| pass == name), runs, "{name}");
    }
}

#[test]
fn a_frame_without_glass_in_sight_has_none_of_it() {
    let status = |world: &mut World, options: &FrameOptions| {
        let (pixels, report) = draw(world, WIDTH, HEIGHT, options);
        let passes: Vec<&str> = report.plan.running().collect();
        let none = !passes.iter().any(|pass| {
            ["behind", "back faces", "front faces", "refraction", "refraction by pixel"].contains(pass)
        });
        assert!(none, "{passes:?}");
        (pixels, format!("{:?}", report.plan.status("refractive surfaces").unwrap()))
    };
    let mut bare = room();
    let (_, said) = status(&mut bare, &options());
    assert!(said.contains("no mesh that light passes through"), "{said}");
    let mut world = room();
    ball(&mut world, Medium::default());
    let (_, said) = status(&mut world, &FrameOptions { refraction: false, ..options() });
    assert!(said.contains("no refraction switched on"), "{said}");
    for mut transform in world.query_filtered::<&mut Transform, With<Camera>>().iter_mut(&mut world) {
        *transform = transform.looking_at(DVec3::new(0.0, 1.0, 9.0), DVec3::Y);
    }
    let (_, said) = status(&mut world, &options());
    assert!(said.contains("no such mesh in sight"), "{said}");
}
