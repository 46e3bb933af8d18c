//! Lights are counted where the device supports it. A device that does not says why, and still draws the
//! frame.

#![allow(clippy::unwrap_used, reason = "helpers of tests, which clippy does not count as tests")]

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{Light, Material, Shading};
use lumbre_render::{
    Accounting, FrameOptions, Gpu, LightCount, LightLists, Measure, Offscreen, OffscreenFormat, Renderer,
    RenderingPath, wgpu,
};
use lumbre_scene::{Camera, Mesh, Transform};

const SIDE: u32 = 32;
const PIXELS: u64 = (SIDE * SIDE) as u64;

/// Opens the test machine's device with these features and this many storage buffers per shader stage.
fn device(features: wgpu::Features, storage_buffers: u32) -> Gpu {
    let whole = Gpu::headless().unwrap();
    let required_limits =
        wgpu::Limits { max_storage_buffers_per_shader_stage: storage_buffers, ..wgpu::Limits::default() };
    let descriptor =
        wgpu::DeviceDescriptor { required_features: features, required_limits, ..Default::default() };
    let (device, queue) = pollster::block_on(whole.adapter.request_device(&descriptor)).unwrap();
    Gpu::from_parts(whole.instance.clone(), whole.adapter.clone(), device, queue).unwrap()
}

/// Draws a wall that fills the view under one light, and a second wall hidden behind it. Returns the account.
fn account(gpu: &Gpu, shading: Shading) -> Accounting {
    let mut world = World::new();
    for z in [0.0, -1.0] {
        let upright = Transform::from_xyz(0.0, 0.0, z).looking_at(DVec3::new(0.0, -1.0, z), DVec3::Z);
        world.spawn((Mesh::from(shapes::plane(20.0, 20.0, 1, 1)), Material::matt(Vec3::ONE), upright));
    }
    world.spawn((Light::directional(Vec3::ONE), Transform::IDENTITY));
    world.spawn((Camera::default(), Transform::from_xyz(0.0, 0.0, 5.0)));
    let target = Offscreen::new(gpu, SIDE, SIDE, OffscreenFormat::Rgba8).unwrap();
    let options =
        FrameOptions { measure: Measure::Lights, shading: Some(shading), ..FrameOptions::default() };
    let mut renderer = Renderer::new(gpu);
    renderer.render(&mut world, &target.target(), &options).unwrap();
    renderer.wait().unwrap();
    gpu.check().unwrap();
    assert!(
        target.read_rgba8(gpu).unwrap().chunks_exact(4).all(|pixel| pixel[0] > 100),
        "the frame is drawn"
    );
    renderer.accounting().unwrap().clone()
}

/// Compute shaders light the G-buffer on a device with the default limits.
#[test]
fn a_device_with_default_limits_lights_in_compute_shaders() {
    let gpu = device(wgpu::Features::empty(), 8);
    let frames = [RenderingPath::Forward, RenderingPath::DeferredCompute].map(|rendering_path| {
        let mut world = World::new();
        world.spawn((Mesh::from(shapes::uv_sphere(1.0, 32, 16)), Material::matt(Vec3::ONE)));
        let lamp = Light { shadow: true, ..Light::point(Vec3::splat(9.0)) };
        world.spawn((lamp.with_range(9.0), Transform::from_xyz(1.0, 2.0, 3.0)));
        world.spawn((Camera::default(), Transform::from_xyz(0.0, 0.0, 5.0)));
        let options = FrameOptions {
            rendering_path,
            light_lists: LightLists::Clusters,
            shading: Some(Shading::Phong),
            ..FrameOptions::default()
        };
        let target = Offscreen::new(&gpu, SIDE, SIDE, OffscreenFormat::Rgba8).unwrap();
        let report = Renderer::new(&gpu).render(&mut world, &target.target(), &options).unwrap();
        gpu.check().unwrap();
        let in_compute = rendering_path == RenderingPath::DeferredCompute;
        assert_eq!(report.plan.status("deferred lighting").is_some_and(|pass| pass.runs()), in_compute);
        target.read_rgba8(&gpu).unwrap()
    });
    let apart = frames[0].iter().zip(&frames[1]).map(|(a, b)| a.abs_diff(*b)).max();
    assert!(frames[0].iter().any(|value| *value > 100) && apart <= Some(1), "{apart:?}");
}

fn forward(accounting: &Accounting) -> Option<LightCount> {
    accounting.passes.iter().find(|pass| pass.pass == "forward").unwrap().lights
}

fn says(accounting: &Accounting, what: &str) -> bool {
    accounting.notes.iter().any(|note| note.contains(what))
}

#[test]
fn without_room_for_one_more_buffer_nothing_is_counted() {
    let gpu = device(wgpu::Features::empty(), 8);
    for shading in [Shading::Phong, Shading::Gouraud] {
        let accounting = account(&gpu, shading);
        assert_eq!(forward(&accounting), None);
        assert!(says(&accounting, "one storage buffer more"), "{:?}", accounting.notes);
        // There are no timestamps either, so the time of waiting stands for the passes.
        assert!(says(&accounting, "TIMESTAMP_QUERY") && accounting.passes_ms.is_none());
        assert!(accounting.remainder_ms().unwrap() < accounting.wall_ms.unwrap());
    }
}

#[test]
fn without_writes_in_vertices_fragments_count_and_without_early_tests_hidden_ones_too() {
    let bare = device(wgpu::Features::empty(), 9);
    let phong = account(&bare, Shading::Phong);
    let tested = forward(&phong).unwrap().tested;
    assert!((PIXELS..=2 * PIXELS).contains(&tested), "{tested}");
    assert!(says(&phong, "VERTEX_WRITABLE_STORAGE") && says(&phong, "SHADER_EARLY_DEPTH_TEST"));
    assert_eq!(forward(&account(&bare, Shading::Gouraud)), None);
    // With both features there is nothing to report.
    let features = wgpu::Features::VERTEX_WRITABLE_STORAGE | wgpu::Features::SHADER_EARLY_DEPTH_TEST;
    let whole = device(features, 9);
    let phong = account(&whole, Shading::Phong);
    assert_eq!(forward(&phong).unwrap(), LightCount { tested: PIXELS, contributing: PIXELS });
    assert!(!says(&phong, "lights") && !says(&phong, "counted"), "{:?}", phong.notes);
    assert!(forward(&account(&whole, Shading::Gouraud)).unwrap().tested > 0);
}
