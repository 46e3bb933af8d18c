//! Compares flat mirrors in the frame with the tracer's ray tree: what each pixel of a mirror shows, mirrors in
//! mirrors, panes that reflect by Fresnel's equations, fog, and both kinds of cameras. A frame without a visible
//! mirror must contain nothing of this.

use std::ops::ControlFlow;
use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{AlphaMode, Fog, FogMode, Light, Material, Shading, SpotCone, Surface};
use lumbre_render::{FrameOptions, LightLists};
use lumbre_scene::{Camera, Medium, Mesh, Projection, SceneSettings, Transform};
use lumbre_trace::{TraceOptions, trace};

use crate::adapter::{draw, linear, shown};

const WIDTH: u32 = 192;
const HEIGHT: u32 = 144;

/// One step of eight bits.
const STEP: f64 = 1.0 / 255.0;

fn matte(diffuse: Vec3) -> Material {
    let front = Surface { ambient: diffuse, diffuse, ..Surface::default() };
    Material { front, ..Material::default() }
}

/// A mirror on a dark surface with a highlight.
fn mirror(k_r: f32) -> Material {
    let specular = Vec3::splat(0.2);
    let front =
        Surface { diffuse: Vec3::new(0.02, 0.03, 0.05), specular, shininess: 40.0, ..Surface::default() };
    Material { front, mirror: Vec3::new(k_r, 0.95 * k_r, 0.9 * k_r), ..Material::default() }
}

/// A floor, balls and a tilted slab under two lamps, seen from the front; behind them is a wall with the material
/// `back`.
fn room(back: Material) -> World {
    let mut world = World::new();
    let mut spawn = |mesh, material: Material, place: Transform| {
        world.spawn((Mesh(Arc::new(mesh)), material, place)).id()
    };
    spawn(shapes::plane(12.0, 12.0, 8, 8), matte(Vec3::new(0.5, 0.45, 0.4)), Transform::default());
    let red =
        Surface { specular: Vec3::splat(0.4), shininess: 20.0, ..matte(Vec3::new(0.7, 0.15, 0.1)).front };
    let red = Material { front: red, ..Material::default() };
    spawn(shapes::uv_sphere(0.6, 48, 24), red, Transform::from_xyz(-0.9, 0.6, -0.4));
    spawn(
        shapes::uv_sphere(0.4, 48, 24),
        matte(Vec3::new(0.1, 0.3, 0.7)),
        Transform::from_xyz(0.9, 0.4, 1.2),
    );
    let slab = Transform::from_xyz(0.8, 0.7, -1.0).with_rotation(DQuat::from_rotation_y(0.5));
    spawn(shapes::cuboid(Vec3::new(0.8, 1.2, 0.1), 1), matte(Vec3::new(0.2, 0.6, 0.2)), slab);
    let upright = Transform::from_xyz(0.0, 1.2, -2.0)
        .with_rotation(DQuat::from_rotation_y(0.25) * DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2));
    spawn(shapes::plane(4.0, 2.4, 1, 1), back, upright);
    world.spawn((Light::point(Vec3::splat(14.0)), Transform::from_xyz(-1.5, 3.0, 2.0)));
    world.spawn((Light::point(Vec3::new(4.0, 5.0, 7.0)), Transform::from_xyz(2.0, 2.2, -0.2)));
    let eye = Transform::from_xyz(0.7, 1.7, 4.5).looking_at(DVec3::new(0.0, 0.9, -1.0), DVec3::Y);
    world.spawn((Camera::default(), eye));
    world.insert_resource(SceneSettings {
        ambient: Vec3::splat(0.1),
        background: Vec3::new(0.1, 0.2, 0.4),
        ..SceneSettings::default()
    });
    world
}

/// The comparison of a frame with mirrors.
#[derive(Debug)]
struct Against {
    /// The largest difference from the ray tree in any channel, over pixels that show one surface.
    largest: f64,
    /// The number of such pixels, and in how many of them a mirror shows something.
    pixels: usize,
    mirrored: usize,
    /// In how many of them the difference is visible.
    apart: usize,
}

/// Compares a frame with the ray tree with the same number of reflections, in those pixels over which the ray tree
/// has no edge.
fn against_the_ray_tree(world: &mut World, options: &FrameOptions) -> Against {
    let (frame, _) = draw(world, WIDTH, HEIGHT, options);
    let (without, _) =
        draw(world, WIDTH, HEIGHT, &FrameOptions { mirror_depth: 0, refraction: false, ..options.clone() });
    // Of three by three rays per pixel, the middle one is that of the pixel's centre.
    let traced = TraceOptions {
        size: (3 * WIDTH, 3 * HEIGHT),
        depth: Some(options.mirror_depth),
        shadows: options.shadows,
        ..TraceOptions::default()
    };
    let traced = trace(world, &traced, &|_| ControlFlow::Continue(())).unwrap().0.radiance;
    let mut against = Against { largest: 0.0, pixels: 0, mirrored: 0, apart: 0 };
    for (index, (pixel, without)) in frame.iter().zip(&without).enumerate() {
        let (row, column) = (index / WIDTH as usize, index % WIDTH as usize);
        // The nearest rays of the surrounding pixels are included, as samples of a pixel are farther from its
        // centre than its rays.
        let ray = |y: usize, x: usize| {
            let (y, x) = ((3 * row + y).saturating_sub(1), (3 * column + x).saturating_sub(1));
            traced[y.min(3 * HEIGHT as usize - 1) * 3 * WIDTH as usize + x.min(3 * WIDTH as usize - 1)]
        };
        let middle = ray(2, 2);
        let even = (0..25).all(|at| (ray(at / 5, at % 5) - middle).abs().max_element() < 2.0 * STEP);
        if even {
            against.pixels += 1;
            against.mirrored += usize::from((*pixel - *without).abs().max_element() > STEP);
            let difference = (*pixel - middle).abs().max_element();
            against.largest = against.largest.max(difference);
            against.apart += usize::from(difference > 4.0 * STEP);
        }
    }
    against
}

/// Checks that a frame with mirrors agrees with the ray tree.
#[allow(clippy::print_stdout, reason = "the figures of the documentation")]
fn is_the_ray_trees(what: &str, world: &mut World, options: &FrameOptions) {
    let against = against_the_ray_tree(world, options);
    println!("{what}: {against:?}");
    assert!(against.mirrored > 300, "{what}: {against:?}");
    assert!(against.largest < STEP, "{what}: {against:?}");
}

fn unshadowed(mirror_depth: u32) -> FrameOptions {
    FrameOptions { mirror_depth, shadows: false, shading: Some(Shading::Phong), ..linear() }
}

/// Adds a second mirror behind the camera, facing the first.
fn add_mirror(world: &mut World, material: Material) {
    let place = Transform::from_xyz(0.5, 1.3, 5.0)
        .with_rotation(DQuat::from_rotation_y(0.2) * DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2));
    world.spawn((Mesh(Arc::new(shapes::plane(7.0, 2.6, 3, 2))), material, place));
}

#[test]
fn a_mirror_shows_what_the_ray_tree_shows() {
    is_the_ray_trees("mirror", &mut room(mirror(0.8)), &unshadowed(1));
    let sampled = FrameOptions { multisample: Some(true), ..unshadowed(1) };
    is_the_ray_trees("four samples", &mut room(mirror(0.8)), &sampled);
    let clustered = FrameOptions { light_lists: LightLists::Clusters, ..unshadowed(1) };
    is_the_ray_trees("clusters of lights", &mut room(mirror(0.8)), &clustered);
}

/// A blended pane in a mirror is blended over what the mirror shows, as in the frame itself.
#[test]
fn what_is_blended_is_blended_in_mirrors() {
    let pane = |alpha| {
        let mut world = room(mirror(0.8));
        let material =
            Material { alpha, alpha_mode: AlphaMode::Blend, unlit: true, ..matte(Vec3::new(0.9, 0.1, 0.6)) };
        let place = Transform::from_xyz(-0.3, 1.6, 5.5)
            .with_rotation(DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2));
        world.spawn((Mesh(Arc::new(shapes::plane(6.0, 6.0, 1, 1))), material, place));
        world
    };
    for multisample in [false, true] {
        let options = FrameOptions { multisample: Some(multisample), ..unshadowed(1) };
        let [clear, half, full] =
            [0.0, 0.5, 1.0].map(|alpha| draw(&mut pane(alpha), WIDTH, HEIGHT, &options).0);
        let mut mixed = 0;
        for ((clear, half), full) in clear.iter().zip(&half).zip(&full) {
            assert!((0.5 * (*clear + *full) - *half).abs().max_element() < 1e-5, "{clear} {half} {full}");
            mixed += usize::from((*clear - *full).abs().max_element() > STEP);
        }
        assert!(mixed > 1000, "{mixed}");
    }
}

/// The ray tree's shadows are exact, so pixels at the edges of shadows differ; only a few may.
#[test]
fn shadows_are_in_mirrors_too() {
    for light in [
        Light::directional(Vec3::new(2.0, 1.9, 1.7)),
        Light::point(Vec3::splat(16.0)),
        Light::spot(Vec3::splat(30.0), SpotCone::Smooth { inner: 0.4, outer: 0.6 }),
    ] {
        let mut world = room(mirror(0.9));
        world.resource_mut::<SceneSettings>().frame.shadow_resolution = 4.0;
        let lamps: Vec<Entity> = world.query_filtered::<Entity, With<Light>>().iter(&world).collect();
        lamps.into_iter().for_each(|lamp| assert!(world.despawn(lamp)));
        // The post and its shadow are behind the camera.
        let place = Transform::from_xyz(4.0, 3.5, 4.5).looking_at(DVec3::new(0.0, 0.5, 3.5), DVec3::Y);
        world.spawn((Light { shadow: true, ..light.clone() }, place));
        let post = Transform::from_xyz(0.2, 0.9, 5.2);
        world.spawn((
            Mesh(Arc::new(shapes::cuboid(Vec3::new(0.5, 1.8, 0.5), 1))),
            matte(Vec3::splat(0.4)),
            post,
        ));
        let options = FrameOptions { shadows: true, ..unshadowed(1) };
        let apart = against_the_ray_tree(&mut world, &options).apart;
        let (shadowed, _) = draw(&mut world, WIDTH, HEIGHT, &options);
        let (lit, _) = draw(&mut world, WIDTH, HEIGHT, &unshadowed(1));
        let dark = shadowed.iter().zip(&lit).filter(|(a, b)| (**a - **b).abs().max_element() > STEP).count();
        println!("{:?}: {dark} pixels in shadow, {apart} differ", light.kind);
        assert!(dark > 400 && apart * 40 < dark, "{:?}: {apart} of {dark} differ", light.kind);
    }
}

#[test]
fn a_mirror_in_a_mirror_shows_what_the_ray_tree_shows() {
    for depth in 1..4 {
        let mut world = room(mirror(0.8));
        add_mirror(&mut world, mirror(0.9));
        is_the_ray_trees(&format!("two mirrors, depth {depth}"), &mut world, &unshadowed(depth));
        let mut pixels = |depth| draw(&mut world, WIDTH, HEIGHT, &unshadowed(depth)).0;
        let once_more = pixels(depth).into_iter().zip(pixels(depth - 1));
        let shown = once_more.filter(|(with, without)| (*with - *without).abs().max_element() > STEP);
        assert!(shown.count() > 300, "depth {depth} shows next to nothing");
        let (_, report) = draw(&mut world, WIDTH, HEIGHT, &unshadowed(depth));
        assert_eq!(report.statistics.mirror_views, depth as usize);
    }
}

#[test]
fn any_transform_of_a_mirror_is_the_ray_trees() {
    for (what, scale, place) in [
        ("stretched", DVec3::new(1.3, 2.0, 0.7), DVec3::ZERO),
        ("mirrored by its transform", DVec3::new(-1.0, 1.0, 1.0), DVec3::ZERO),
        ("far away", DVec3::ONE, DVec3::new(3e6, -1e6, 2e6)),
    ] {
        let mut world = room(mirror(0.8));
        let mut objects = world.query::<(&mut Transform, Option<&Material>)>();
        for (mut transform, material) in objects.iter_mut(&mut world) {
            transform.translation += place;
            if material.is_some_and(|material| material.mirror != Vec3::ZERO) {
                transform.scale = scale;
            }
        }
        is_the_ray_trees(what, &mut world, &unshadowed(1));
    }
}

#[test]
fn the_back_of_a_mirror_is_the_ray_trees() {
    let mut world = room(Material { double_sided: true, ..mirror(0.8) });
    world.resource_mut::<SceneSettings>().two_sided = true;
    for (mut transform, material) in world.query::<(&mut Transform, &Material)>().iter_mut(&mut world) {
        if material.mirror != Vec3::ZERO {
            transform.rotation *= DQuat::from_rotation_x(std::f64::consts::PI);
        }
    }
    is_the_ray_trees("back", &mut world, &unshadowed(1));
}

#[test]
fn a_parallel_camera_is_the_ray_trees() {
    let mut world = room(mirror(0.8));
    // A frame's highlights are those of an eye at the camera, as in OpenGL, or of one infinitely far away; the ray
    // tree's are along the rays.
    world.resource_mut::<SceneSettings>().local_viewer = false;
    for mut camera in world.query::<&mut Camera>().iter_mut(&mut world) {
        camera.projection =
            Projection::Orthographic { half_width: 2.4, half_height: 1.8, near: 0.1, far: 40.0 };
    }
    is_the_ray_trees("parallel rays", &mut world, &unshadowed(1));
}

#[test]
fn a_mirror_in_fog_is_the_ray_trees() {
    let mut world = room(mirror(0.8));
    let mode = FogMode::Exponential { density: 0.15 };
    world.resource_mut::<SceneSettings>().fog = Some(Fog { mode, color: Vec3::new(0.6, 0.5, 0.3) });
    is_the_ray_trees("fog", &mut world, &unshadowed(1));
}

/// Transmitted light adds nothing here: behind the sheet it is black, and the solid absorbs it.
#[test]
fn a_pane_reflects_by_fresnels_equations_as_in_the_ray_tree() {
    for thin in [true, false] {
        let pane = Material { mirror: Vec3::ZERO, transmission: Vec3::splat(0.9), ior: 1.9, ..mirror(0.0) };
        let mut world = room(pane);
        world.resource_mut::<SceneSettings>().background = Vec3::ZERO;
        let mut panes = world.query_filtered::<(Entity, &Material, &mut Transform), Without<Medium>>();
        let dark = Medium { attenuation_color: Vec3::ZERO, attenuation_distance: 1e-3, ..Medium::default() };
        let mut found = Vec::new();
        for (entity, material, mut transform) in panes.iter_mut(&mut world) {
            if material.transmission != Vec3::ZERO {
                found.push(entity);
            } else if transform.translation == DVec3::ZERO {
                // Moved so that the floor ends in front of the pane.
                transform.translation.z = 4.4;
            }
        }
        for entity in found {
            world.entity_mut(entity).insert(Medium { fresnel: true, thin, ..dark });
        }
        is_the_ray_trees(if thin { "sheet" } else { "solid" }, &mut world, &unshadowed(1));
    }
}

#[test]
fn mirrors_of_one_plane_share_a_view() {
    let mut world = room(mirror(0.8));
    let mut copies = Vec::new();
    for (material, mesh, transform) in world.query::<(&Material, &Mesh, &Transform)>().iter(&world) {
        if material.mirror != Vec3::ZERO {
            let mut beside = *transform;
            beside.translation += transform.rotation * DVec3::new(3.2, 0.0, 0.0);
            beside.scale = DVec3::new(0.5, 1.0, 1.0);
            copies.push((Material { mirror: Vec3::splat(0.3), ..material.clone() }, mesh.clone(), beside));
        }
    }
    world.spawn_batch(copies);
    is_the_ray_trees("two mirrors in a plane", &mut world, &unshadowed(1));
    let (_, report) = draw(&mut world, WIDTH, HEIGHT, &unshadowed(2));
    assert_eq!(report.statistics.mirror_views, 1);
}

#[test]
fn a_frame_without_a_mirror_in_sight_has_none_of_it() {
    let plan = |world: &mut World, options: &FrameOptions| {
        let (_, report) = draw(world, WIDTH, HEIGHT, options);
        (report.statistics.mirror_views, format!("{:?}", report.plan.status("mirrors").unwrap()))
    };
    let mut bare = room(matte(Vec3::splat(0.3)));
    let (views, status) = plan(&mut bare, &unshadowed(2));
    assert!(views == 0 && status.contains("no flat mesh that mirrors"), "{status}");
    let mut world = room(mirror(0.8));
    let (views, status) = plan(&mut world, &unshadowed(0));
    assert!(views == 0 && status.contains("no mirrors switched on"), "{status}");
    for mut transform in world.query_filtered::<&mut Transform, With<Camera>>().iter_mut(&mut world) {
        *transform = transform.looking_at(DVec3::new(0.0, 1.0, 9.0), DVec3::Y);
    }
    let (views, status) = plan(&mut world, &unshadowed(2));
    assert!(views == 0 && status.contains("no mirror in sight"), "{status}");
}

#[test]
fn a_hall_of_mirrors_has_no_more_views_than_a_frame_may_have_and_says_so() {
    let mut world = room(mirror(0.8));
    for turn in 0..24 {
        let angle = 0.05 * f64::from(turn) - 0.6;
        let place = Transform::from_xyz(2.0 * angle, 2.6, -1.5)
            .with_rotation(DQuat::from_rotation_y(angle) * DQuat::from_rotation_x(1.7 + 0.1 * angle));
        let mesh = Mesh(Arc::new(shapes::plane(0.2, 0.4, 1, 1)));
        world.spawn((mesh, mirror(0.5), place));
    }
    let (_, report) = draw(&mut world, WIDTH, HEIGHT, &unshadowed(4));
    assert_eq!(report.statistics.mirror_views, 16);
    let said = report.left_out.iter().any(|said| said.contains("16 views of mirrors at most"));
    assert!(said, "{:?}", report.left_out);
}

/// From any viewpoint, including in a mirror's plane, inside glass and very near, with half floats and
/// multisampling: the probe finds only finite values.
#[test]
fn no_view_of_mirrors_and_glass_breaks_a_frame() {
    let mut world = room(Material { double_sided: true, ..mirror(0.9) });
    add_mirror(&mut world, mirror(1.0));
    world.resource_mut::<SceneSettings>().two_sided = true;
    let ice = Material { transmission: Vec3::ONE, double_sided: true, ior: 2.4, ..mirror(0.1) };
    for (thin, place) in [(false, DVec3::new(0.1, 0.6, 1.0)), (true, DVec3::new(-1.2, 1.4, 1.6))] {
        let medium = Medium { thin, fresnel: true, ..Medium::default() };
        let ball = Mesh(Arc::new(shapes::uv_sphere(0.5, 16, 8)));
        world.spawn((ball, ice.clone(), medium, Transform::from_translation(place)));
    }
    let camera = world.query_filtered::<Entity, With<Camera>>().single(&world).unwrap();
    for step in 0..60 {
        let t = f64::from(step);
        let [x, y, z] = [1.7, 2.3, 3.1].map(|speed| (t * speed).sin());
        let eye = match step % 4 {
            // In the plane of a mirror, and just in front of it.
            0 => DVec3::new(0.5 + 2.0 * x, 1.3, 5.0),
            1 => DVec3::new(0.5 + x, 1.3 + y, 5.0 - 1e-6),
            // Inside the glass ball.
            2 => DVec3::new(0.1 + 0.3 * x, 0.6 + 0.2 * y, 1.0 + 0.2 * z),
            _ => DVec3::new(4.0 * x, 1.5 + 1.4 * y, 4.0 * z),
        };
        let toward = eye + DVec3::new(z, 0.3 * x, y + 0.01);
        let place = Transform::from_translation(eye).looking_at(toward, DVec3::Y);
        let projection = match step % 3 {
            0 => Projection::Orthographic { half_width: 1.5, half_height: 1.0, near: 0.0, far: 9.0 },
            1 => Projection::perspective(2.6),
            _ => Projection::perspective(0.8),
        };
        world.entity_mut(camera).insert((place, Camera { projection, ..Camera::default() }));
        let multisample = Some(step % 5 == 0);
        let options = FrameOptions { multisample, mirror_depth: 3, ..FrameOptions::default() };
        let pixels = shown(&mut world, 64, 48, &options);
        assert_eq!(pixels.len(), 64 * 48 * 4);
    }
}
