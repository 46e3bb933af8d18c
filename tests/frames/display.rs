//! From radiance to the target's numbers: where nothing needs the linear frame there is no display pass, and the picture is the same.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::Vec3;
use lumbre_mesh::shapes;
use lumbre_optics::{Fog, FogMode, Light, Material, Shading};
use lumbre_render::effects::display_color;
use lumbre_render::{Display, FrameOptions, FrameTarget, Offscreen, OffscreenFormat, Renderer};
use lumbre_scene::{Camera, Mesh, SceneSettings, Transform};

use crate::adapter::gpu;

const SIZE: u32 = 96;

/// Balls from nearly black to far beyond white before a coloured background, in fog.
fn scene(shading: Shading) -> World {
    let mut world = World::new();
    let mesh = Mesh(Arc::new(shapes::uv_sphere(0.45, 24, 12)));
    for (index, brightness) in [0.01, 0.1, 0.5, 1.0, 4.0, 100.0].into_iter().enumerate() {
        let (x, y) = ((index % 3) as f64 - 1.0, (index / 3) as f64 - 0.5);
        let color = Vec3::new(0.9, 0.6, 0.3) * brightness;
        let material = Material {
            front: lumbre_optics::Surface { emission: 0.1 * color, ..Material::matt(color).front },
            ..Material::matt(color)
        };
        world.spawn((mesh.clone(), material, Transform::from_xyz(x, y, 0.0)));
    }
    world.spawn((Light::point(Vec3::splat(12.0)), Transform::from_xyz(2.0, 2.0, 4.0)));
    world.spawn((Camera::default(), Transform::from_xyz(0.0, 0.0, 3.0)));
    let fog = Fog { color: Vec3::new(0.2, 0.3, 0.4), mode: FogMode::Exponential { density: 0.1 } };
    let background = Vec3::new(0.05, 0.4, 3.0);
    world.insert_resource(SceneSettings { shading, fog: Some(fog), background, ..SceneSettings::default() });
    world
}

/// A frame of eight bits, and whether it had a display pass.
fn frame(world: &mut World, options: &FrameOptions) -> (Vec<u8>, bool) {
    let target = Offscreen::new(gpu(), SIZE, SIZE, OffscreenFormat::Rgba8).unwrap();
    let report = Renderer::new(gpu()).render(world, &target.target(), options).unwrap();
    (target.read_rgba8(gpu()).unwrap(), report.plan.running().any(|pass| pass == "display"))
}

#[test]
fn without_a_display_pass_the_picture_is_the_same() {
    for (display, shading) in Display::ALL.iter().zip(Shading::ALL).chain([(&Display::Srgb, &Shading::Phong)])
    {
        let mut world = scene(*shading);
        let options = FrameOptions { display: *display, exposure: Some(0.7), ..FrameOptions::default() };
        let (folded, passed) = frame(&mut world, &options);
        assert!(!passed, "{}", display.name());
        // The probe looks into the linear frame.
        let (apart, passed) = frame(&mut world, &FrameOptions { probe: true, ..options });
        assert!(passed);
        let difference = folded.iter().zip(&apart).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(difference <= Some(1), "{}: {difference:?} of 255", display.name());
        let different = folded.chunks_exact(4).filter(|pixel| **pixel != folded[..4]).count();
        assert!(different > 1000, "the balls are there");
    }
}

#[test]
fn a_frame_without_a_display_pass_has_the_numbers_of_the_f64_twin() {
    let mut world = scene(Shading::Phong);
    let target = Offscreen::new(gpu(), SIZE, SIZE, OffscreenFormat::LinearFloat).unwrap();
    let linear = FrameOptions { display: Display::Linear, exposure: Some(1.0), ..FrameOptions::default() };
    Renderer::new(gpu()).render(&mut world, &target.target(), &linear).unwrap();
    let radiance = target.read_linear(gpu()).unwrap();
    for display in [Display::Linear, Display::Srgb] {
        let options = FrameOptions { display, exposure: Some(0.7), ..FrameOptions::default() };
        let (shown, _) = frame(&mut world, &options);
        for (pixel, radiance) in shown.chunks_exact(4).zip(&radiance) {
            let format = wgpu::TextureFormat::Rgba8Unorm;
            let expected =
                display_color(display, format, 0.7, radiance.truncate()).clamp(Vec3::ZERO, Vec3::ONE);
            for (byte, expected) in pixel.iter().zip(expected.to_array()) {
                // Half a step of rounding, and f32's powers.
                assert!((f32::from(*byte) - 255.0 * expected).abs() < 0.52, "{pixel:?} {expected}");
            }
        }
    }
}

#[test]
fn what_needs_radiance_keeps_the_display_pass() {
    let mut world = scene(Shading::Phong);
    assert!(!frame(&mut world, &FrameOptions::default()).1);
    assert!(frame(&mut world, &FrameOptions { multisample: true, ..FrameOptions::default() }).1);
    let glass =
        Material { alpha: 0.5, alpha_mode: lumbre_optics::AlphaMode::Blend, ..Material::matt(Vec3::ONE) };
    world.spawn((Mesh(Arc::new(shapes::uv_sphere(0.2, 8, 4))), glass, Transform::from_xyz(0.0, 0.0, 1.0)));
    assert!(frame(&mut world, &FrameOptions::default()).1);
}

/// The bytes of a target whose format encodes sRGB by itself.
fn encoded(world: &mut World, options: &FrameOptions) -> Vec<u8> {
    let texture = gpu().device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: 64, height: 64, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8UnormSrgb,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    Renderer::new(gpu()).render(world, &FrameTarget::from_texture(&texture), options).unwrap();
    lumbre_render::read_texture(gpu(), &texture).unwrap()
}

#[test]
fn a_target_that_encodes_holds_the_same_bytes() {
    let mut world = scene(Shading::Gouraud);
    for display in Display::ALL {
        for probe in [false, true] {
            let options =
                FrameOptions { display: *display, exposure: Some(0.5), probe, ..FrameOptions::default() };
            let target = Offscreen::new(gpu(), 64, 64, OffscreenFormat::Rgba8).unwrap();
            Renderer::new(gpu()).render(&mut world, &target.target(), &options).unwrap();
            let plain = target.read_rgba8(gpu()).unwrap();
            let encoded = encoded(&mut world, &options);
            let difference = plain.iter().zip(&encoded).map(|(a, b)| a.abs_diff(*b)).max();
            assert!(difference <= Some(1), "{}: {difference:?}", display.name());
            let mean = plain.iter().map(|byte| f64::from(*byte)).sum::<f64>() / plain.len() as f64;
            assert!((20.0..250.0).contains(&mean), "{mean}");
        }
    }
}
