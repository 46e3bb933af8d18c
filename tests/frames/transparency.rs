//! Alpha: what a mask cuts out, and what panes of glass transmit.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3, Vec4};
use lumbre_optics::{AlphaMode, Light, Material, Shading};
use lumbre_render::FrameOptions;
use lumbre_scene::{MaterialTextures, Mesh, SceneSettings, Transform};
use lumbre_tests::panes::{EYE, image, orthographic, pane, pane_of, perspective, sharp};

use crate::adapter::{Canvas, draw, linear};

/// f32 roundings of a few products and sums of numbers below 1.
const EXACT: f64 = 3e-7;

fn near(a: DVec3, b: DVec3) -> bool {
    (a - b).abs().max_element() < EXACT
}

#[test]
fn a_mask_keeps_what_reaches_its_cutoff() {
    // Texture alpha 100, 125, 130 and 255 of 255, vertex alpha 1, material alpha 0.5: the products are below and above
    // the cutoff of 1/4 by at least 1/500, so that no rounding decides.
    let texels = [[255, 255, 255, 100], [255, 255, 255, 125], [255, 255, 255, 130], [255, 255, 255, 255]];
    let mask = AlphaMode::Mask { cutoff: 0.25 };
    let material = Material { alpha: 0.5, alpha_mode: mask, ..Material::matt(Vec3::splat(0.5)) };
    let mut world = pane_of(material);
    let entity = world.query_filtered::<Entity, With<Mesh>>().single(&world).unwrap();
    let textures =
        MaterialTextures { base_color: Some(sharp(&image(4, &texels))), ..MaterialTextures::default() };
    world.entity_mut(entity).insert(textures);
    let background = Vec3::new(0.0, 0.0, 1.0);
    world.resource_mut::<SceneSettings>().background = background;
    let row = |world: &mut World, shading| {
        let (pixels, _) = draw(world, 4, 4, &FrameOptions { shading: Some(shading), ..linear() });
        (0..4).map(|x| pixels[x] != background.as_dvec3()).collect::<Vec<_>>()
    };
    for shading in Shading::ALL {
        assert_eq!(row(&mut world, *shading), [false, false, true, true], "{}", shading.name());
    }
    // What remains is opaque: its colour is not blended.
    assert!(near(draw(&mut world, 4, 4, &linear()).0[3], DVec3::splat(0.5)));
    // Vertex alpha counts too, and a cutoff of 0 keeps everything.
    let mut faded = pane();
    faded.colors = vec![Vec4::new(1.0, 1.0, 1.0, 0.75); 4];
    world.entity_mut(entity).insert(Mesh(Arc::new(faded)));
    assert_eq!(row(&mut world, Shading::Phong), [false, false, false, true]);
    world.get_mut::<Material>(entity).unwrap().alpha_mode = AlphaMode::Mask { cutoff: 0.0 };
    assert_eq!(row(&mut world, Shading::Phong), [true; 4]);
    // Negative control: without the mask alpha is ignored.
    world.get_mut::<Material>(entity).unwrap().alpha_mode = AlphaMode::Opaque;
    assert_eq!(row(&mut world, Shading::Phong), [true; 4]);
}

fn glass(color: Vec3, alpha: f32) -> Material {
    Material { alpha, alpha_mode: AlphaMode::Blend, ..Material::matt(color) }
}

#[test]
fn two_panes_of_glass_blend_from_the_back() {
    let (red, green) = (DVec3::new(0.75, 0.0, 0.25), DVec3::new(0.0, 0.5, 0.25));
    let (near_alpha, far_alpha) = (0.25, 0.5);
    let background = DVec3::new(0.5, 1.0, 0.0);
    let expected =
        red * near_alpha + (1.0 - near_alpha) * (green * far_alpha + (1.0 - far_alpha) * background);
    let wrong = green * far_alpha + (1.0 - far_alpha) * (red * near_alpha + (1.0 - near_alpha) * background);
    assert!(!near(expected, wrong), "the order matters");
    // Regardless of which was created first.
    for first_is_near in [true, false] {
        for camera in [orthographic(), perspective()] {
            let mut world = World::new();
            world.spawn(camera);
            let quad = Arc::new(pane());
            // Large enough that the frame shows nothing else, with and without perspective.
            let mut spawn = |near: bool| {
                let (color, alpha, z) = if near { (red, near_alpha, 1.0) } else { (green, far_alpha, -1.0) };
                let place = Transform::from_xyz(0.0, 0.0, z).with_scale(DVec3::splat(2.0));
                world.spawn((Mesh(Arc::clone(&quad)), glass(color.as_vec3(), alpha as f32), place));
            };
            spawn(first_is_near);
            spawn(!first_is_near);
            let background = background.as_vec3();
            world.insert_resource(SceneSettings {
                ambient: Vec3::ONE,
                background,
                ..SceneSettings::default()
            });
            let (pixels, report) = draw(&mut world, 6, 6, &linear());
            assert!(report.plan.status("transparent").unwrap().runs());
            assert!(pixels.iter().all(|pixel| near(*pixel, expected)), "{} is not {expected}", pixels[0]);
        }
    }
}

#[test]
fn glass_is_hidden_by_what_stands_before_it_and_hides_nothing() {
    let mut world = World::new();
    world.spawn(orthographic());
    world.insert_resource(SceneSettings { ambient: Vec3::ONE, ..SceneSettings::default() });
    let quad = Arc::new(pane());
    let glass =
        world.spawn((Mesh(Arc::clone(&quad)), glass(Vec3::X, 0.5), Transform::from_xyz(0.0, 0.0, 0.5))).id();
    world.spawn((Mesh(quad), Material::matt(Vec3::Y)));
    let mut canvas = Canvas::new(4, 4);
    let (pixels, _) = canvas.draw(&mut world, &linear());
    assert!(pixels.iter().all(|pixel| near(*pixel, DVec3::new(0.5, 0.5, 0.0))), "{}", pixels[0]);
    world.get_mut::<Transform>(glass).unwrap().translation.z = -0.5;
    let (pixels, _) = canvas.draw(&mut world, &linear());
    assert!(pixels.iter().all(|pixel| near(*pixel, DVec3::Y)), "{}", pixels[0]);
}

#[test]
fn glass_is_lit_like_any_other_surface() {
    let mut world = World::new();
    world.spawn(orthographic());
    // The light shines along -z, perpendicular to the pane: l·n = 1.
    world.spawn((Light::directional(Vec3::splat(0.5)), Transform::from_xyz(0.0, 0.0, EYE)));
    world.spawn((Mesh(Arc::new(pane())), glass(Vec3::new(1.0, 0.5, 0.0), 0.5)));
    for shading in Shading::ALL {
        let (pixels, _) = draw(&mut world, 4, 4, &FrameOptions { shading: Some(*shading), ..linear() });
        let expected = DVec3::new(0.25, 0.125, 0.0);
        assert!(pixels.iter().all(|pixel| near(*pixel, expected)), "{}: {}", shading.name(), pixels[0]);
    }
}
