//! Cases of whole frames: broken input does not reach the picture, and extreme input keeps its value.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_optics::{Attenuation, Light, Material, Shading, SpotCone, Surface};
use lumbre_render::{Display, FrameOptions, Gpu, Offscreen, OffscreenFormat, Renderer};
use lumbre_scene::{Camera, Mesh, Projection, SceneSettings, Transform};
use lumbre_tests::panes::{pane, pane_of};

use crate::adapter::{Canvas, draw, gpu, linear, shown};
use crate::case::Outcome;

crate::cases! {
    "light at the surface, d = 0 and a = b = 0" { a_light_in_the_surface, in_opengls_display_it_is_clamped }
    "the largest product stays below the target's overflow" {
        a_light_of_1e30_in_full_precision, a_light_of_1e30_in_half_precision,
    }
    "depth: near 1e-3, far 1e6; coplanar faces" {
        a_millimetre_at_a_kilometre, a_metre_at_a_thousand_kilometres, a_micrometre_at_two_millimetres,
        coplanar_faces_do_not_flicker, coplanar_faces_under_a_moving_camera,
    }
    "Gouraud with a spot inside one triangle" { a_spot_between_vertices_is_not_seen_by_gouraud, phong_sees_it }
    "zero-size window, 1x1, minimised, resize each frame, device lost" {
        a_frame_of_no_size, a_frame_of_one_pixel, fifty_sizes_in_a_row, a_lost_device,
        a_world_that_outlives_its_device,
    }
    "NaN in any frame" { a_material_of_no_numbers, normals_of_no_numbers, a_light_of_no_numbers }
}

fn matt(color: f32) -> Material {
    Material::matt(Vec3::splat(color))
}

/// Returns the middle pixel of a frame of 9 x 9.
fn middle(world: &mut World, options: &FrameOptions) -> DVec3 {
    draw(world, 9, 9, options).0[40]
}

fn grey(color: DVec3) -> f64 {
    color.element_sum() / 3.0
}

fn a_light_in_the_surface() -> Outcome {
    let mut world = pane_of(matt(0.5));
    world.spawn((
        Light { attenuation: Attenuation::INVERSE_SQUARE, ..Light::point(Vec3::ONE) },
        Transform::IDENTITY,
    ));
    // The centre pixel is at the light's own position: no direction, so ambient light alone, 0.5 * 1.
    let got = middle(&mut world, &linear());
    Outcome::number(0.5, grey(got), 1e-7, "no direction there: the ambient part only")
}

fn in_opengls_display_it_is_clamped() -> Outcome {
    let mut world = pane_of(matt(0.5));
    let light = Light { ambient: Vec3::splat(0.01), ..Light::point(Vec3::ONE) };
    world.spawn((light, Transform::IDENTITY));
    let got = middle(&mut world, &FrameOptions { display: Display::Clamp, ..linear() });
    Outcome::number(
        1.0,
        grey(got),
        0.0,
        "k0 = k1 = 0 divides by 0 in OpenGL; ours is 50 at the floor of 1 cm, both show 1",
    )
}

/// A pane under a light of intensity 1e30.
fn dazzling() -> World {
    let mut world = pane_of(matt(1.0));
    let above = Transform::from_xyz(0.0, 0.0, 1.0).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Light::directional(Vec3::splat(1e30)), above));
    world
}

fn a_light_of_1e30_in_full_precision() -> Outcome {
    let expected = f64::from(1e30f32);
    let got = grey(middle(&mut dazzling(), &linear()));
    Outcome::number(expected, got, expected * 1e-6, "f32 holds it; a few roundings")
}

fn a_light_of_1e30_in_half_precision() -> Outcome {
    // With the default display: half floats, a tone curve, eight bits. The probe inspects the half floats.
    let bytes = shown(&mut dazzling(), 9, 9, &FrameOptions::default());
    let white = bytes.into_iter().map(|byte| (255.0, f64::from(byte)));
    Outcome::worst(white.collect::<Vec<_>>(), 0.0, "white: the largest half, 65504, and no infinity")
}

/// Two panes, one behind the other, and a camera that sees both from far away.
fn two_panes(distance: f64, apart: f64, near: f64, far: Option<f64>) -> Outcome {
    let mut world = World::new();
    let mesh = Arc::new(pane());
    let scale = DVec3::splat(distance);
    let at = |z: f64| Transform { scale, ..Transform::from_xyz(0.0, 0.0, z) };
    // The nearer pane is dark and drawn last or first: depth decides.
    world.spawn((Mesh(Arc::clone(&mesh)), matt(0.25), at(-distance)));
    world.spawn((Mesh(Arc::clone(&mesh)), matt(0.75), at(-distance - apart)));
    world.spawn((Mesh(mesh), matt(0.75), at(-distance - apart)));
    let projection = Projection::Perspective { vertical_fov: 0.5, aspect: None, near, far };
    world.spawn((Camera { projection, exposure: 1.0 }, Transform::IDENTITY));
    world.insert_resource(SceneSettings { ambient: Vec3::ONE, ..SceneSettings::default() });
    let (pixels, _) = draw(&mut world, 9, 9, &linear());
    Outcome::worst(
        pixels.iter().map(|pixel| (0.25, grey(*pixel))),
        0.0,
        "the nearer one, at every pixel: reversed-Z keeps f32's digits",
    )
}

// The bound is 2^-20 of the distance between the panes: the depth near/d has a rounding of 2^-24 in f32, and the
// planes' positions and the interpolation a few.

fn a_millimetre_at_a_kilometre() -> Outcome {
    two_panes(1e3, 1e-3, 1e-3, None)
}

fn a_metre_at_a_thousand_kilometres() -> Outcome {
    two_panes(9.9e5, 1.0, 1e-3, Some(1e6))
}

fn a_micrometre_at_two_millimetres() -> Outcome {
    two_panes(2e-3, 1e-6, 1e-3, None)
}

fn coplanar_faces_under_a_moving_camera() -> Outcome {
    let mut world = pane_of(matt(0.25));
    world.spawn((Mesh(Arc::new(pane())), matt(0.75)));
    let eye = world.query_filtered::<Entity, With<Camera>>().single(&world).unwrap();
    let mut canvas = Canvas::new(33, 33);
    let mut shown = 0;
    for step in 0..20 {
        let at = DVec3::new(0.1 * f64::from(step) - 1.0, 0.37, 1.5 + 0.05 * f64::from(step));
        let place = Transform::from_translation(at).looking_at(DVec3::ZERO, DVec3::Y);
        let projection = Projection::Perspective { vertical_fov: 0.5, aspect: None, near: 1e-3, far: None };
        world.entity_mut(eye).insert((Camera { projection, exposure: 1.0 }, place));
        shown += canvas.draw(&mut world, &linear()).0.iter().filter(|pixel| grey(**pixel) == 0.25).count();
    }
    let because = "equally far, the one drawn last is seen, which is the younger: pixels of twenty frames that show the other";
    Outcome::number(0.0, shown as f64, 0.0, because)
}

fn coplanar_faces_do_not_flicker() -> Outcome {
    let mut world = pane_of(matt(0.25));
    world.spawn((Mesh(Arc::new(pane())), matt(0.75)));
    let mut canvas = Canvas::new(9, 9);
    let first = canvas.draw(&mut world, &linear()).0;
    let frames = (0..10).map(|_| canvas.draw(&mut world, &linear()).0).collect::<Vec<_>>();
    let changed = frames.iter().filter(|frame| **frame != first).count();
    Outcome::number(0.0, changed as f64, 0.0, "of ten frames none differs, bit for bit")
}

/// A cone that falls between the pane's corners.
fn spotted(shading: Shading) -> f64 {
    let mut world = pane_of(matt(1.0));
    world.insert_resource(SceneSettings::default());
    let cone = SpotCone::Exponent { cutoff: 0.3, exponent: 0.0 };
    let light = Light { attenuation: Attenuation::NONE, ..Light::spot(Vec3::ONE, cone) };
    world.spawn((light, Transform::from_xyz(0.0, 0.0, 1.0).looking_at(DVec3::ZERO, DVec3::Y)));
    grey(middle(&mut world, &FrameOptions { shading: Some(shading), ..linear() }))
}

fn a_spot_between_vertices_is_not_seen_by_gouraud() -> Outcome {
    Outcome::number(0.0, spotted(Shading::Gouraud), 0.0, "no vertex is inside the cone: unlit is correct")
}

fn phong_sees_it() -> Outcome {
    Outcome::number(
        1.0,
        spotted(Shading::Phong),
        1e-6,
        "k_d L_d n.l on the axis: the error of the tessellation is 1",
    )
}

fn a_frame_of_no_size() -> Outcome {
    match Offscreen::new(gpu(), 0, 4, OffscreenFormat::LinearFloat) {
        Err(error) => Outcome::text("0x4", error.to_string()),
        Ok(_) => Outcome::text("0x4", "made".to_owned()),
    }
}

fn a_frame_of_one_pixel() -> Outcome {
    let (pixels, _) = draw(&mut pane_of(matt(0.5)), 1, 1, &linear());
    Outcome::worst(pixels.iter().map(|pixel| (0.5, grey(*pixel))), 0.0, "k_a I_a")
}

fn fifty_sizes_in_a_row() -> Outcome {
    let mut world = pane_of(matt(0.5));
    let all = (1..=50u32).flat_map(|step| {
        let (width, height) = (1 + step * 7 % 61, 1 + step * 13 % 47);
        let (pixels, _) = draw(&mut world, width, height, &linear());
        assert_eq!(pixels.len(), (width * height) as usize);
        pixels.into_iter().map(|pixel| (0.5, grey(pixel))).collect::<Vec<_>>()
    });
    Outcome::worst(all.collect::<Vec<_>>(), 0.0, "k_a I_a at every size (windows: lumbre_demo's tests)")
}

/// Creates a separate device, destroys it after its first frame, and returns what the renderer says to the second.
fn lost() -> (World, String) {
    let gpu = Gpu::headless().unwrap();
    let mut world = pane_of(matt(0.5));
    let frame = Offscreen::new(&gpu, 1, 1, OffscreenFormat::LinearFloat).unwrap();
    let mut renderer = Renderer::new(&gpu);
    renderer.render(&mut world, &frame.target(), &linear()).unwrap();
    // Destroyed while the frame is still being drawn.
    gpu.device.destroy();
    let refused = renderer.render(&mut world, &frame.target(), &linear());
    let said = refused.err().map_or_else(|| "drawn".to_owned(), |error| error.to_string());
    (world, said)
}

fn a_lost_device() -> Outcome {
    Outcome::text("the graphics device is lost; create a new Gpu and Renderer", lost().1)
}

fn a_world_that_outlives_its_device() -> Outcome {
    let (mut world, _) = lost();
    let (pixels, _) = draw(&mut world, 1, 1, &linear());
    Outcome::number(0.5, grey(pixels[0]), 0.0, "k_a I_a on the next device, everything uploaded anew")
}

fn a_material_of_no_numbers() -> Outcome {
    let front = Surface { ambient: Vec3::splat(f32::NAN), ..Surface::default() };
    let mut world = pane_of(Material { front, ..Material::default() });
    Outcome::number(0.0, grey(middle(&mut world, &linear())), 0.0, "black there; the probe finds no NaN")
}

fn normals_of_no_numbers() -> Outcome {
    let mut mesh = pane();
    mesh.normals = vec![Vec3::splat(f32::NAN); 4];
    let mut world = pane_of(matt(0.5));
    world.spawn((Light::directional(Vec3::ONE), Transform::IDENTITY));
    let entity = world.query_filtered::<Entity, With<Mesh>>().single(&world).unwrap();
    world.entity_mut(entity).insert(Mesh(Arc::new(mesh)));
    Outcome::number(0.5, grey(middle(&mut world, &linear())), 0.0, "a normal of zero: ambient light only")
}

fn a_light_of_no_numbers() -> Outcome {
    let mut world = pane_of(matt(0.5));
    let above = Transform::from_xyz(0.0, 0.0, 1.0).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Light::directional(Vec3::splat(f32::NAN)), above));
    world.spawn((Light::directional(Vec3::ONE), above));
    Outcome::number(1.0, grey(middle(&mut world, &linear())), 1e-6, "left out; the other one stays")
}
