//! From radiance to display values: where nothing needs the linear frame there is no display pass, and the picture
//! is the same.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::Vec3;
use lumbre_mesh::shapes;
use lumbre_optics::{Fog, FogMode, Light, Material, Shading};
use lumbre_render::effects::display_color;
use lumbre_render::{
    Display, FrameOptions, FrameTarget, Offscreen, OffscreenFormat, RenderError, Renderer, Viewport,
};
use lumbre_scene::{Camera, Mesh, SceneSettings, Transform};

use crate::adapter::gpu;

const SIZE: u32 = 96;

/// Balls from nearly black to far brighter than white in front of a coloured background, in fog.
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

/// Draws a frame of eight bits, and returns whether it had a display pass.
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
        // The probe needs the linear frame.
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
                // The rounding of a device, at most 0.6 of a step (Direct3D 11.3, section 3.2.3.6; half a step in
                // software), and the error of f32's powers.
                let rounding = if gpu().is_software() { 0.5 } else { 0.6 };
                assert!(
                    (f32::from(*byte) - 255.0 * expected).abs() < rounding + 0.02,
                    "{pixel:?} {expected}"
                );
            }
        }
    }
}

#[test]
fn what_needs_radiance_keeps_the_display_pass() {
    let mut world = scene(Shading::Phong);
    assert!(!frame(&mut world, &FrameOptions::default()).1);
    assert!(frame(&mut world, &FrameOptions { multisample: Some(true), ..FrameOptions::default() }).1);
    let glass =
        Material { alpha: 0.5, alpha_mode: lumbre_optics::AlphaMode::Blend, ..Material::matt(Vec3::ONE) };
    world.spawn((Mesh(Arc::new(shapes::uv_sphere(0.2, 8, 4))), glass, Transform::from_xyz(0.0, 0.0, 1.0)));
    assert!(frame(&mut world, &FrameOptions::default()).1);
}

/// Returns the bytes of a target whose format encodes sRGB itself.
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

/// Returns a rectangle of a picture of eight bits.
fn part(picture: &[u8], width: u32, [x, y]: [u32; 2], [columns, rows]: [u32; 2]) -> Vec<u8> {
    let row = |row: u32| {
        let first = 4 * (row * width + x) as usize;
        &picture[first..first + 4 * columns as usize]
    };
    (y..y + rows).flat_map(row).copied().collect()
}

#[test]
fn a_viewport_holds_the_frame_and_what_is_around_it_is_kept_or_cleared() {
    let mut world = scene(Shading::Phong);
    let options = FrameOptions { exposure: Some(0.7), ..FrameOptions::default() };
    let (size, origin) = ([40, 64], [50, 20]);
    // The frame on its own, with a display pass as in a viewport.
    let alone = Offscreen::new(gpu(), size[0], size[1], OffscreenFormat::Rgba8).unwrap();
    let mut renderer = Renderer::new(gpu());
    renderer.render(&mut world, &alone.target(), &FrameOptions { probe: true, ..options.clone() }).unwrap();
    let alone = alone.read_rgba8(gpu()).unwrap();

    let target = Offscreen::new(gpu(), SIZE, SIZE, OffscreenFormat::Rgba8).unwrap();
    renderer.render(&mut world, &target.target(), &options).unwrap();
    let whole = target.read_rgba8(gpu()).unwrap();
    let viewport = Viewport::new(origin, size);
    renderer.render(&mut world, &target.target().with_viewport(viewport), &options).unwrap();
    let within = target.read_rgba8(gpu()).unwrap();
    assert_eq!(part(&within, SIZE, origin, size), alone);
    let changed = |x: u32, y: u32| {
        let pixel = 4 * (y * SIZE + x) as usize;
        within[pixel..pixel + 4] != whole[pixel..pixel + 4]
    };
    for (x, y) in (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y))) {
        let inside =
            (origin[0]..origin[0] + size[0]).contains(&x) && (origin[1]..origin[1] + size[1]).contains(&y);
        assert!(inside || !changed(x, y), "{x}, {y}");
    }

    // An unchanged world in the same viewport is kept; in another viewport it is drawn.
    let kept = FrameOptions { keep_unchanged: true, ..options.clone() };
    let drawn = |renderer: &mut Renderer, world: &mut World, viewport: Viewport| {
        let report = renderer.render(world, &target.target().with_viewport(viewport), &kept).unwrap();
        report.plan.running().count() > 0
    };
    assert!(!drawn(&mut renderer, &mut world, viewport));
    assert!(drawn(&mut renderer, &mut world, viewport.with_clear(wgpu::Color::GREEN)));
    let cleared = target.read_rgba8(gpu()).unwrap();
    assert_eq!(part(&cleared, SIZE, origin, size), alone);
    assert_eq!(cleared[..4], [0, 255, 0, 255]);
    assert_eq!(cleared[4 * (SIZE * SIZE - 1) as usize..], [0, 255, 0, 255]);

    for (origin, size) in [([50, 20], [47, 64]), ([0, 0], [0, 5]), ([u32::MAX, 0], [2, 2])] {
        let outside = target.target().with_viewport(Viewport::new(origin, size));
        let error = renderer.render(&mut world, &outside, &options).unwrap_err();
        assert!(matches!(error, RenderError::Viewport { .. }), "{error}");
    }
}
