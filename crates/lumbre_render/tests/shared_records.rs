//! Fragments that load lights and materials for each other draw what fragments draw that load them
//! separately. Only software rasterizers with subgroups share; on other devices both frames are drawn alike.

#![allow(clippy::unwrap_used, reason = "helpers of tests, which clippy does not count as tests")]

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3, Vec4};
use lumbre_mesh::shapes;
use lumbre_optics::{Attenuation, BakeMode, Light, Material, Shading, SpotCone};
use lumbre_render::{
    FrameOptions, Gpu, LightLists, Offscreen, OffscreenFormat, Renderer, RenderingPath, wgpu,
};
use lumbre_scene::{Camera, EmissiveLight, Lightmap, LightmapEncoding, LightmapImage, Mesh, Transform};

/// Neither a multiple of the rasterizer's blocks of four pixels nor of a cluster's tile.
const SIZE: [u32; 2] = [203, 117];

/// Opens the test machine's device with these features.
fn device(whole: &Gpu, features: wgpu::Features) -> Gpu {
    let descriptor = wgpu::DeviceDescriptor {
        required_features: features,
        required_limits: whole.adapter.limits(),
        ..Default::default()
    };
    let (device, queue) = pollster::block_on(whole.adapter.request_device(&descriptor)).unwrap();
    Gpu::from_parts(whole.instance.clone(), whole.adapter.clone(), device, queue).unwrap()
}

/// Balls of several materials on a floor, partly behind each other, under lights of every kind of list: of
/// clusters with and without a cone, of clusters with records of all parameters, and of objects. The floor has
/// a lightmap, which every fifth light is baked into. Without the sun, some lists are empty.
fn world(Case { shadows, sun, panel, .. }: Case) -> World {
    let mut world = World::new();
    let mut floor = shapes::plane(30.0, 30.0, 3, 3);
    floor.uv1.clone_from(&floor.uv0);
    let texels = (0..16).map(|texel| Vec3::splat(0.02 * texel as f32)).collect();
    let (name, encoding) = ("floor".to_owned(), LightmapEncoding::default());
    let image = Arc::new(LightmapImage { name, width: 4, height: 4, texels, encoding });
    world.spawn((Mesh::from(floor), Material::matt(Vec3::splat(0.7)), Lightmap { image }));
    for number in 0..24 {
        let (column, row) = (f64::from(number % 6), f64::from(number / 6));
        let mut material = Material::matt(Vec3::new(0.9, 0.2 + 0.1 * row as f32, 0.2 + 0.1 * column as f32));
        material.front.specular = Vec3::splat(0.3);
        material.front.shininess = 20.0 + 10.0 * row as f32;
        if number % 3 == 0 {
            material.back = Some(Material::matt(Vec3::new(0.1, 0.2, 0.9)).front);
        }
        let ball = Mesh::from(shapes::uv_sphere(0.4, 16, 8));
        world.spawn((ball, material, Transform::from_xyz(1.1 * column - 2.7, 0.4, -1.3 * row)));
    }
    let ranged = |light: Light| Light {
        attenuation: Attenuation { range: 2.5, ..light.attenuation },
        shadow: shadows,
        ..light
    };
    for number in 0..40 {
        let (x, z) = (f64::from(number % 8), f64::from(number / 8));
        let color = Vec3::new(0.5, 0.2 * (number % 4) as f32, 0.3);
        let light = match number % 4 {
            0 => ranged(Light::point(color)),
            1 => ranged(Light::spot(color, SpotCone::Smooth { inner: 0.3, outer: 0.7 })),
            2 => ranged(Light::spot(color, SpotCone::Exponent { cutoff: 0.6, exponent: 3.0 })),
            _ => Light {
                attenuation: Attenuation { range: 4.0, ..Attenuation::default() },
                ..Light::point(color)
            },
        };
        // The shadow atlas has room for a few.
        let bake = if number % 5 == 0 { BakeMode::Static } else { light.bake };
        let light = Light { shadow: light.shadow && number < 8, bake, ..light };
        let place = Transform::from_xyz(0.9 * x - 3.2, 1.2, 1.0 - 1.2 * z);
        let below = DVec3::new(0.9 * x - 3.0, 0.0, 0.8 - 1.2 * z);
        world.spawn((light, place.looking_at(below, DVec3::Z)));
    }
    if sun {
        let light = Light { shadow: shadows, ..Light::directional(Vec3::splat(0.2)) };
        world.spawn((light, Transform::from_xyz(2.0, 5.0, 3.0).looking_at(DVec3::ZERO, DVec3::Y)));
    }
    if panel {
        let emissive = Material::emissive(Vec3::splat(3.0));
        let place = Transform::from_xyz(0.0, 2.0, -3.0).looking_at(DVec3::new(0.0, 2.0, -4.0), DVec3::NEG_Y);
        world.spawn((Mesh::from(shapes::plane(1.0, 1.0, 1, 1)), emissive, EmissiveLight, place));
    }
    // Out of reach of every lamp.
    let far = Transform::from_xyz(-2.0, 0.6, -11.0);
    world.spawn((Mesh::from(shapes::uv_sphere(1.0, 16, 8)), Material::matt(Vec3::ONE), far));
    let eye = Transform::from_xyz(0.3, 1.7, 3.4).looking_at(DVec3::new(0.0, 0.3, -1.0), DVec3::Y);
    world.spawn((Camera::default(), eye));
    world
}

/// What a frame is drawn with.
#[derive(Clone, Copy, Debug)]
struct Case {
    path: RenderingPath,
    light_lists: LightLists,
    shadows: bool,
    sun: bool,
    panel: bool,
}

fn frame(gpu: &Gpu, case: Case) -> Vec<Vec4> {
    let options = FrameOptions {
        rendering_path: case.path,
        light_lists: case.light_lists,
        shading: Some(Shading::Phong),
        ..FrameOptions::default()
    };
    let mut renderer = Renderer::new(gpu);
    let target = Offscreen::new(gpu, SIZE[0], SIZE[1], OffscreenFormat::LinearFloat).unwrap();
    renderer.render(&mut world(case), &target.target(), &options).unwrap();
    renderer.wait().unwrap();
    gpu.check().unwrap();
    target.read_linear(gpu).unwrap()
}

#[test]
fn shared_loads_draw_the_same_frame() {
    let whole = Gpu::headless().unwrap();
    let subgroups = whole.adapter.features() & wgpu::Features::SUBGROUP;
    if subgroups.is_empty() {
        eprintln!("SKIPPED: {} has no subgroups", whole.describe());
        return;
    }
    let floats = whole.adapter.features() & wgpu::Features::FLOAT32_BLENDABLE;
    let [with, without] = [subgroups | floats, floats].map(|features| device(&whole, features));
    // Both add the same f32 values; only a compiler's choice between equal expressions may differ.
    let differ =
        |[one, other]: [&Vec4; 2]| (*one - *other).abs().max_element() > 1e-5 * (1.0 + other.max_element());
    for path in [RenderingPath::Forward, RenderingPath::Deferred] {
        for light_lists in [LightLists::Clusters, LightLists::Objects] {
            for [shadows, sun, panel] in
                [[false, false, false], [false, true, false], [true, true, false], [false, false, true]]
            {
                let case = Case { path, light_lists, shadows, sun, panel };
                let [shared, separate] = [frame(&with, case), frame(&without, case)];
                assert!(separate.iter().any(|color| color.x > 0.3), "{case:?}: nothing is drawn");
                let different = shared.iter().zip(&separate).filter(|(one, other)| differ([one, other]));
                assert_eq!(different.count(), 0, "{case:?}");
            }
        }
    }
}
