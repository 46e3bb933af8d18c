//! Effects from outside the renderer: bloom and outline of integrations/own_program are drawn without any code for
//! them in the core, and leave no trace where the scene does not call for them.

#[path = "../../integrations/own_program/src/bloom.rs"]
pub mod bloom;
#[path = "../../integrations/own_program/src/outline.rs"]
pub mod outline;

use std::path::Path;
use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3, Vec4};
use lumbre_graph::Status;
use lumbre_mesh::shapes;
use lumbre_optics::{Light, Material, Surface};
use lumbre_render::{Display, FrameOptions, Offscreen, OffscreenFormat, Renderer};
use lumbre_scene::{Camera, Mesh, Projection, Transform};

use crate::adapter::gpu;
use bloom::{Bloom, BloomEffect};
use outline::{OutlineEffect, Outlined};

const SIZE: u32 = 128;

/// A ball of radius 1 in the middle of the frame, 64 pixels across.
fn ball(material: Material) -> (World, Entity, Entity) {
    let mut world = World::new();
    let mesh = Mesh(Arc::new(shapes::uv_sphere(1.0, 64, 32)));
    let ball = world.spawn((mesh, material, Transform::IDENTITY)).id();
    world.spawn((Light::point(Vec3::splat(20.0)), Transform::from_xyz(2.0, 2.0, 4.0)));
    let projection = Projection::Orthographic { half_width: 2.0, half_height: 2.0, near: 0.1, far: 10.0 };
    let camera = Camera { projection, ..Camera::default() };
    let camera = world.spawn((camera, Transform::from_xyz(0.0, 0.0, 5.0))).id();
    (world, ball, camera)
}

fn with_both() -> Renderer {
    Renderer::builder().with(OutlineEffect::new(4.0)).with(BloomEffect::default()).build(gpu())
}

fn bytes(renderer: &mut Renderer, world: &mut World, options: &FrameOptions) -> Vec<u8> {
    let target = Offscreen::new(gpu(), SIZE, SIZE, OffscreenFormat::Rgba8).unwrap();
    renderer.render(world, &target.target(), options).unwrap();
    target.read_rgba8(gpu()).unwrap()
}

fn radiance(renderer: &mut Renderer, world: &mut World) -> Vec<Vec4> {
    let target = Offscreen::new(gpu(), SIZE, SIZE, OffscreenFormat::LinearFloat).unwrap();
    let options = FrameOptions { display: Display::Linear, ..FrameOptions::default() };
    renderer.render(world, &target.target(), &options).unwrap();
    target.read_linear(gpu()).unwrap()
}

#[test]
fn an_effect_that_is_not_called_for_leaves_every_bit_and_says_why() {
    let (mut world, ..) = ball(Material::matt(Vec3::ONE));
    for options in
        [FrameOptions::default(), FrameOptions { multisample: Some(true), ..FrameOptions::default() }]
    {
        let plain = bytes(&mut Renderer::new(gpu()), &mut world, &options);
        assert_eq!(bytes(&mut with_both(), &mut world, &options), plain);
    }
    let mut renderer = with_both();
    let target = Offscreen::new(gpu(), SIZE, SIZE, OffscreenFormat::Rgba8).unwrap();
    let report = renderer.render(&mut world, &target.target(), &FrameOptions::default()).unwrap();
    for (pass, reason) in [
        ("bloom", "the scene has no camera with bloom"),
        ("bloom downsample 1", "the scene has no camera with bloom"),
        ("outline", "the scene has no outlined object"),
        ("display", "the scene has no use for a linear frame"),
    ] {
        let status = report.plan.status(pass).unwrap();
        assert!(matches!(status, Status::Skipped { .. }), "{pass}: {status:?}");
        assert_eq!(status.reason(), reason);
    }
    // The explanation says the same without drawing.
    let explained = renderer.explain(&mut world, &FrameOptions::default(), SIZE, SIZE).unwrap().to_text();
    assert!(
        explained.contains("no camera with bloom") && explained.contains("no outlined object"),
        "{explained}"
    );
}

#[test]
fn bloom_spreads_light_and_keeps_its_energy() {
    let lamp = Material {
        front: Surface { emission: Vec3::new(40.0, 20.0, 5.0), ..Surface::default() },
        unlit: false,
        ..Material::matt(Vec3::ZERO)
    };
    let (mut world, ball, camera) = ball(lamp);
    // Small and in the middle, so that almost none of its glow is lost outside the frame.
    world.entity_mut(ball).insert(Transform { scale: DVec3::splat(0.2), ..Transform::IDENTITY });
    let mut renderer = with_both();
    let sharp = radiance(&mut renderer, &mut world);
    world.entity_mut(camera).insert(Bloom { strength: 0.3, levels: 4 });
    let glowing = radiance(&mut renderer, &mut world);
    let energy = |pixels: &[Vec4]| pixels.iter().map(|pixel| pixel.truncate().as_dvec3()).sum::<DVec3>();
    let (before, after) = (energy(&sharp), energy(&glowing));
    assert!(((after - before) / before).abs().max_element() < 0.01, "{before} became {after}");
    let at = |pixels: &[Vec4], x: usize, y: usize| pixels[y * SIZE as usize + x].truncate();
    assert_eq!(at(&sharp, 64, 44), Vec3::ZERO);
    let near = at(&glowing, 64, 44);
    assert!(near.min_element() > 0.0 && near.x > near.y && near.y > near.z, "it glows in its colour: {near}");
    let far = at(&glowing, 64, 20);
    assert!(far.x < near.x, "less farther away: {far} {near}");
    // A frame for a target of eight bits then has a linear frame and a display pass.
    let target = Offscreen::new(gpu(), SIZE, SIZE, OffscreenFormat::Rgba8).unwrap();
    let report = renderer.render(&mut world, &target.target(), &FrameOptions::default()).unwrap();
    let run: Vec<_> = report.plan.running().collect();
    assert!(run.contains(&"display") && run.contains(&"bloom"), "{run:?}");
    // Without the component it is bit for bit as before.
    world.entity_mut(camera).remove::<Bloom>();
    assert_eq!(radiance(&mut renderer, &mut world), sharp);
}

#[test]
fn an_outline_is_a_rim_of_its_width_around_its_object_and_nothing_else() {
    for multisample in [false, true] {
        let options = FrameOptions { multisample: Some(multisample), ..FrameOptions::default() };
        let (mut world, ball, _) = ball(Material::matt(Vec3::ONE));
        // A wall in front of it, through which the outline is visible.
        let wall = Mesh(Arc::new(shapes::cuboid(Vec3::new(0.5, 4.0, 0.1), 1)));
        world.spawn((wall, Material::matt(Vec3::splat(0.5)), Transform::from_xyz(0.9, 0.0, 2.0)));
        let mut renderer = with_both();
        let plain = bytes(&mut renderer, &mut world, &options);
        world.entity_mut(ball).insert(Outlined { color: Vec3::new(1.0, 0.0, 1.0) });
        let outlined = bytes(&mut renderer, &mut world, &options);
        let (mut rim, mut expected) = (0, 0);
        for (index, (before, after)) in plain.chunks_exact(4).zip(outlined.chunks_exact(4)).enumerate() {
            let pixel =
                DVec3::new((index % SIZE as usize) as f64 + 0.5, (index / SIZE as usize) as f64 + 0.5, 0.0);
            let distance = pixel.distance(DVec3::new(64.0, 64.0, 0.0)) - 32.0;
            expected += usize::from((0.0..4.0).contains(&distance));
            if after == [255, 0, 255, 255] {
                rim += 1;
                assert!((-1.0..5.0).contains(&distance), "{distance} pixels from the ball");
            } else {
                assert_eq!(before, after, "a pixel {distance} from the ball");
            }
        }
        let part = rim as f64 / expected as f64;
        assert!((0.85..1.15).contains(&part), "{rim} of {expected} pixels");
    }
}

#[test]
fn the_core_has_no_line_about_them() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut folders: Vec<_> = ["crates/lumbre_render", "shaders"].map(|folder| root.join(folder)).to_vec();
    let (mut files, mut lines) = (0, Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let Ok(text) = std::fs::read_to_string(&path) else { continue };
            files += 1;
            let about = |line: &&str| {
                let line = line.to_lowercase();
                line.contains("bloom") || line.contains("outline")
            };
            lines.extend(text.lines().filter(about).map(|line| format!("{}: {line}", path.display())));
        }
    }
    assert!(files > 80, "only {files} files were read");
    assert!(lines.is_empty(), "{} lines of the core are about them:\n{}", lines.len(), lines.join("\n"));
}

#[test]
fn effects_that_say_that_they_are_still_let_a_frame_be_kept() {
    let (mut world, ball, camera) = ball(Material::matt(Vec3::ONE));
    world.entity_mut(camera).insert(Bloom { strength: 0.4, levels: 2 });
    world.entity_mut(ball).insert(Outlined { color: Vec3::X });
    let mut renderer = with_both();
    let target = Offscreen::new(gpu(), SIZE, SIZE, OffscreenFormat::Rgba8).unwrap();
    let options = FrameOptions { keep_unchanged: true, ..FrameOptions::default() };
    let mut drawn = |world: &mut World| {
        let report = renderer.render(world, &target.target(), &options).unwrap();
        report.plan.running().count() > 0
    };
    assert!(drawn(&mut world));
    // Transforms are propagated in the first frame, which counts as a change.
    drawn(&mut world);
    assert!(!drawn(&mut world));
    world.get_mut::<Bloom>(camera).unwrap().strength = 0.5;
    assert!(drawn(&mut world) && !drawn(&mut world));
    world.entity_mut(ball).remove::<Outlined>();
    assert!(drawn(&mut world) && !drawn(&mut world));
}
