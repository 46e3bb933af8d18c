//! Unlit materials, and materials that share a shader: each shows its own values.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_optics::{Light, Material, Shading, Surface};
use lumbre_render::FrameOptions;
use lumbre_scene::{Camera, MaterialTextures, Mesh, MetallicRoughnessTexture, SceneSettings, Transform};
use lumbre_tests::panes::{image, orthographic, pane, pane_of, sharp, srgb};

use crate::adapter::{draw, linear};

/// f32 roundings of a sum of numbers below 1.
const EXACT: f64 = 2e-7;
/// Error of a decoded sRGB texel: half an eight-bit code where the curve is steepest (explained in textures.rs).
const DECODED: f64 = 4.5e-3;

#[test]
fn an_unlit_material_shows_its_colour_whatever_the_light() {
    let front = Surface {
        diffuse: Vec3::new(0.2, 0.4, 0.6),
        emission: Vec3::new(0.1, 0.0, 0.3),
        specular: Vec3::ONE,
        ..Surface::default()
    };
    let mut world = pane_of(Material { front, unlit: true, ..Material::default() });
    world.spawn((Light::directional(Vec3::splat(3.0)), Transform::IDENTITY));
    // KHR_materials_unlit: neither light nor emission.
    let expected = DVec3::new(0.2, 0.4, 0.6);
    for shading in Shading::ALL {
        let (pixels, _) = draw(&mut world, 8, 8, &FrameOptions { shading: Some(*shading), ..linear() });
        assert!(pixels.iter().all(|pixel| (*pixel - expected).abs().max_element() < EXACT), "{}", pixels[0]);
    }
    // Negative control: when lit, the colour is different.
    world.query::<&mut Material>().single_mut(&mut world).unwrap().unlit = false;
    let (pixels, _) = draw(&mut world, 8, 8, &linear());
    assert!(pixels.iter().all(|pixel| (*pixel - expected).abs().max_element() > 0.1));
}

#[test]
fn unlit_materials_with_different_textures_stand_side_by_side() {
    // An unlit shader reads no metallic-roughness texture, but files may have one for viewers that do not support
    // unlit materials.
    let white = image(1, &[[255; 4]]);
    let grey = image(1, &[[188, 188, 188, 255]]);
    let mapped = MetallicRoughnessTexture {
        texture: sharp(&white),
        base_color: Vec3::ONE,
        metallic: 1.0,
        roughness: 1.0,
        dielectric: Vec3::splat(0.04),
    };
    let plain = MaterialTextures { base_color: Some(sharp(&grey)), ..MaterialTextures::default() };
    let metal = MaterialTextures { metallic_roughness: Some(mapped.clone()), ..plain.clone() };
    let only_metal = MaterialTextures { metallic_roughness: Some(mapped), ..MaterialTextures::default() };
    let unlit = Material { unlit: true, ..Material::matt(Vec3::splat(0.5)) };
    let mut world = World::new();
    let quad = Arc::new(pane());
    let quarter = |x: f64, y: f64| Transform::from_xyz(x, y, 0.0).with_scale(DVec3::splat(0.5));
    world.spawn((Mesh(Arc::clone(&quad)), unlit.clone(), plain, quarter(-0.5, 0.5)));
    world.spawn((Mesh(Arc::clone(&quad)), unlit.clone(), metal, quarter(0.5, 0.5)));
    world.spawn((Mesh(Arc::clone(&quad)), unlit.clone(), only_metal, quarter(-0.5, -0.5)));
    world.spawn((Mesh(quad), unlit, quarter(0.5, -0.5)));
    world.spawn(orthographic());
    let (pixels, _) = draw(&mut world, 2, 2, &linear());
    for (at, expected) in [0.5 * srgb(188), 0.5 * srgb(188), 0.5, 0.5].into_iter().enumerate() {
        assert!((pixels[at].x - expected).abs() < DECODED, "pane {at}: {}, not {expected}", pixels[at].x);
    }
}

#[test]
fn every_combination_of_textures_draws_in_every_shading() {
    let texel = image(1, &[[255; 4]]);
    let mut world = World::new();
    let quad = Arc::new(pane());
    let material = Material::from_metallic_roughness(Vec3::splat(0.5), 0.0, 1.0);
    for mask in 0..8_u32 {
        let metallic_roughness = (mask & 4 != 0).then(|| MetallicRoughnessTexture {
            texture: sharp(&texel),
            base_color: Vec3::splat(0.5),
            metallic: 0.0,
            roughness: 1.0,
            dielectric: Vec3::splat(0.04),
        });
        let textures = MaterialTextures {
            base_color: (mask & 1 != 0).then(|| sharp(&texel)),
            emissive: (mask & 2 != 0).then(|| sharp(&texel)),
            metallic_roughness,
            ..MaterialTextures::default()
        };
        let place = Transform::from_xyz(f64::from(mask) * 0.25 - 0.875, 0.0, 0.0)
            .with_scale(DVec3::new(0.125, 1.0, 1.0));
        world.spawn((Mesh(Arc::clone(&quad)), material.clone(), textures, place));
    }
    world.spawn(orthographic());
    world.spawn((Light::directional(Vec3::ONE), Transform::IDENTITY));
    world.insert_resource(SceneSettings { ambient: Vec3::ONE, ..SceneSettings::default() });
    for shading in Shading::ALL {
        let (pixels, _) = draw(&mut world, 8, 8, &FrameOptions { shading: Some(*shading), ..linear() });
        // White textures change nothing: ambient 0.5, diffuse 0.5, specular 0.04 (0 + 2)/8 (exponent 0).
        for pixel in &pixels {
            assert!((pixel.x - 1.01).abs() < 1e-6, "{}: {pixel}", shading.name());
        }
    }
}

#[test]
fn the_exposure_of_the_camera_and_of_the_options_multiplies() {
    let mut world = pane_of(Material::matt(Vec3::splat(0.25)));
    world.query::<&mut Camera>().single_mut(&mut world).unwrap().exposure = 2.0;
    let (pixels, _) = draw(&mut world, 4, 4, &linear());
    assert!(pixels.iter().all(|pixel| *pixel == DVec3::splat(0.5)), "{}", pixels[0]);
    let (pixels, _) = draw(&mut world, 4, 4, &FrameOptions { exposure: Some(3.0), ..linear() });
    assert!(pixels.iter().all(|pixel| *pixel == DVec3::splat(0.75)), "{}", pixels[0]);
}
