//! Frames in which nothing changed: the world is not searched, nothing is uploaded and, where the target is kept,
//! nothing is drawn. A renderer that has been still detects every change, bit for bit.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, UVec3, Vec3};
use lumbre_graph::Status;
use lumbre_mesh::shapes;
use lumbre_optics::{Light, Material, ReflectionModel, Shading};
use lumbre_render::effects::{Board, Effect, FrameGraph, Stage};
use lumbre_render::{
    EffectError, FrameOptions, FrameReport, FrameShape, Gpu, Offscreen, OffscreenFormat, RenderError,
    Renderer, SceneFacts,
};
use lumbre_scene::{
    ActiveCamera, AmbientCube, Camera, ChildOf, EmissiveLight, Hidden, IrradianceVolume, MaterialTextures,
    Medium, Mesh, SceneSettings, Transform,
};
use lumbre_tests::panes::{image, sharp};

use crate::adapter::gpu;

const SIZE: u32 = 64;

struct Scene {
    world: World,
    ball: Entity,
    lamp: Entity,
    camera: Entity,
    renderer: Renderer,
    target: Offscreen,
    options: FrameOptions,
}

fn scene() -> Scene {
    let mut world = World::new();
    let floor = Mesh(Arc::new(shapes::plane(8.0, 8.0, 4, 4)));
    world.spawn((floor, Material::matt(Vec3::splat(0.6))));
    let parent = world.spawn(Transform::IDENTITY).id();
    let material = Material::from_metallic_roughness(Vec3::splat(0.8), 0.0, 0.3);
    let ball = Mesh(Arc::new(shapes::uv_sphere(0.7, 32, 16)));
    let ball = world.spawn((ball, material, Transform::from_xyz(0.0, 1.0, 0.0), ChildOf(parent))).id();
    let lamp = world.spawn((Light::point(Vec3::splat(6.0)), Transform::from_xyz(-1.0, 3.0, 1.0))).id();
    world.entity_mut(lamp).get_mut::<Light>().unwrap().shadow = true;
    let eye = Transform::from_xyz(0.0, 3.0, 5.0).looking_at(DVec3::new(0.0, 0.5, 0.0), DVec3::Y);
    let camera = world.spawn((Camera::default(), eye)).id();
    let beside = Transform::from_xyz(4.0, 3.0, 2.0).looking_at(DVec3::new(0.0, 0.5, 0.0), DVec3::Y);
    world.spawn((Camera::default(), beside));
    world.insert_resource(SceneSettings { ambient: Vec3::splat(0.1), ..SceneSettings::default() });
    let target = Offscreen::new(gpu(), SIZE, SIZE, OffscreenFormat::Rgba8).unwrap();
    let renderer = Renderer::new(gpu());
    Scene { world, ball, lamp, camera, renderer, target, options: FrameOptions::default() }
}

impl Scene {
    fn frame(&mut self) -> (Vec<u8>, FrameReport) {
        let report = self.renderer.render(&mut self.world, &self.target.target(), &self.options).unwrap();
        (self.target.read_rgba8(gpu()).unwrap(), report)
    }

    /// Draws until a frame has found nothing to do.
    fn rest(&mut self) -> (Vec<u8>, FrameReport) {
        for _ in 0..4 {
            let frame = self.frame();
            if is_still(&frame.1) {
                return frame;
            }
        }
        panic!("it never comes to rest");
    }
}

/// Returns true if the world was not searched, so that no time at all was spent on it.
fn is_still(report: &FrameReport) -> bool {
    let cpu = &report.statistics.cpu;
    [cpu.transforms_ms, cpu.objects_ms, cpu.lights_ms, cpu.draws_ms, cpu.shadows_ms] == [0.0; 5]
}

#[test]
fn a_still_world_is_not_looked_through_again() {
    let mut scene = scene();
    let (first, report) = scene.frame();
    assert!(!is_still(&report) && report.statistics.uploads.components() > 0);
    let counts = report.statistics;
    let (still, report) = scene.rest();
    assert!(still == first && report.statistics.uploads.components() == 0);
    assert_eq!(
        (report.statistics.objects, report.statistics.draws, report.statistics.triangles),
        (counts.objects, counts.draws, counts.triangles)
    );
    // Another texture of the same shape has the same content afterwards: it is drawn without searching the world.
    scene.target = Offscreen::new(gpu(), SIZE, SIZE, OffscreenFormat::Rgba8).unwrap();
    let (other, report) = scene.frame();
    assert!(is_still(&report) && other == first);
    // Another size, and back.
    let target = Offscreen::new(gpu(), SIZE / 2, SIZE, OffscreenFormat::Rgba8).unwrap();
    let target = std::mem::replace(&mut scene.target, target);
    assert!(!is_still(&scene.frame().1));
    scene.target = target;
    let (back, report) = scene.frame();
    assert!(!is_still(&report) && back == first);
    // A target that was overwritten is drawn again.
    let mut world = World::new();
    world.spawn((Camera::default(), Transform::IDENTITY));
    Renderer::new(gpu()).render(&mut world, &scene.target.target(), &scene.options).unwrap();
    assert!(scene.target.read_rgba8(gpu()).unwrap() != first);
    let (again, report) = scene.frame();
    assert!(is_still(&report) && again == first);
}

#[test]
fn a_target_that_is_kept_is_left_alone() {
    let mut scene = scene();
    let (first, _) = scene.rest();
    scene.options.keep_unchanged = true;
    // The option by itself does not cause a redraw.
    let (kept, report) = scene.frame();
    assert!(kept == first);
    assert_eq!(report.plan.running().count(), 0);
    for pass in ["background", "forward"] {
        let status = report.plan.status(pass).unwrap();
        assert!(matches!(status, Status::Unchanged { .. }), "{pass}: {status:?}");
    }
    let status = report.plan.status("transparent").unwrap();
    assert!(matches!(status, Status::Skipped { .. }), "what was not called for is not unchanged: {status:?}");
    scene.world.get_mut::<Transform>(scene.ball).unwrap().translation.x += 0.5;
    let (moved, report) = scene.frame();
    assert!(moved != first && report.plan.running().count() > 0);
    // Another texture is drawn to.
    scene.rest();
    let target = Offscreen::new(gpu(), SIZE, SIZE, OffscreenFormat::Rgba8).unwrap();
    let kept = std::mem::replace(&mut scene.target, target);
    let (other, report) = scene.frame();
    assert!(other == moved && report.plan.running().count() > 0);
    scene.target = kept;
    assert!(scene.frame().0 == moved);
}

/// The name of a change, and what it does.
type Change = (&'static str, fn(&mut Scene));

#[test]
fn whatever_changes_is_seen() {
    let changes: [Change; 20] = [
        ("transform", |s| s.world.get_mut::<Transform>(s.ball).unwrap().translation.x += 0.3),
        ("transform of a parent", |s| {
            let parent = s.world.get::<ChildOf>(s.ball).unwrap().parent();
            s.world.get_mut::<Transform>(parent).unwrap().translation.z += 0.5;
        }),
        ("another parent", |s| {
            let parent = s.world.spawn(Transform::from_xyz(-0.4, 0.0, 0.0)).id();
            s.world.entity_mut(s.ball).insert(ChildOf(parent));
        }),
        ("material", |s| s.world.get_mut::<Material>(s.ball).unwrap().front.diffuse = Vec3::X),
        ("transmission", |s| s.world.get_mut::<Material>(s.ball).unwrap().transmission = Vec3::splat(0.7)),
        ("medium", |s| {
            s.world.entity_mut(s.ball).insert(Medium { thin: true, ..Medium::default() });
        }),
        ("mesh", |s| {
            let cube = Mesh(Arc::new(shapes::cuboid(Vec3::ONE, 1)));
            s.world.entity_mut(s.ball).insert(cube);
        }),
        ("shading", |s| {
            s.world.entity_mut(s.ball).insert(Shading::Flat);
        }),
        ("reflection", |s| {
            s.world.entity_mut(s.ball).insert(ReflectionModel::TorranceSparrow);
        }),
        ("texture", |s| {
            let texture = sharp(&image(2, &[[255, 0, 0, 255]; 4]));
            let maps = MaterialTextures { base_color: Some(texture), ..MaterialTextures::default() };
            s.world.entity_mut(s.ball).insert(maps);
        }),
        ("a texture that is gone", |s| {
            s.world.entity_mut(s.ball).remove::<MaterialTextures>();
        }),
        ("light", |s| s.world.get_mut::<Light>(s.lamp).unwrap().diffuse = Vec3::new(9.0, 1.0, 1.0)),
        ("emissive light", |s| {
            s.world.get_mut::<Material>(s.ball).unwrap().front.emission = Vec3::splat(2.0);
            s.world.entity_mut(s.ball).insert(EmissiveLight);
        }),
        ("irradiance volume", |s| {
            let cubes = vec![AmbientCube([Vec3::new(0.2, 0.4, 0.3); 6])];
            let volume = IrradianceVolume { resolution: UVec3::ONE, cubes, inside: Vec::new() };
            s.world.spawn((volume, Transform::IDENTITY));
        }),
        ("an irradiance volume that is gone", |s| {
            let mut volumes = s.world.query_filtered::<Entity, With<IrradianceVolume>>();
            let volume = volumes.single(&s.world).unwrap();
            s.world.despawn(volume);
        }),
        ("settings", |s| s.world.resource_mut::<SceneSettings>().ambient = Vec3::splat(0.4)),
        ("camera", |s| s.world.get_mut::<Camera>(s.camera).unwrap().exposure = 0.5),
        ("another camera", |s| {
            let mut cameras = s.world.query_filtered::<Entity, With<Camera>>();
            let other = cameras.iter(&s.world).find(|camera| *camera != s.camera).unwrap();
            s.world.entity_mut(other).insert(ActiveCamera);
        }),
        ("hidden", |s| {
            s.world.entity_mut(s.ball).insert(Hidden);
        }),
        ("a lamp that is gone", |s| {
            s.world.despawn(s.lamp);
        }),
    ];
    let mut scene = scene();
    for (name, change) in changes {
        let (before, _) = scene.rest();
        change(&mut scene);
        let (after, report) = scene.frame();
        assert!(!is_still(&report), "{name}");
        let options = scene.options.clone();
        let fresh = Offscreen::new(gpu(), SIZE, SIZE, OffscreenFormat::Rgba8).unwrap();
        Renderer::new(gpu()).render(&mut scene.world, &fresh.target(), &options).unwrap();
        assert!(after == fresh.read_rgba8(gpu()).unwrap(), "{name}: not as a fresh renderer shows it");
        assert!(after != before, "{name}: negative control: it is seen");
    }
}

/// An effect that cannot be drawn while it is broken, and that reads a component of its own.
struct Fragile {
    called_for: bool,
}

/// A component of any entity.
#[derive(Component)]
struct Broken(bool);

impl Effect for Fragile {
    fn name(&self) -> &'static str {
        "fragile"
    }

    fn stage(&self) -> Stage {
        Stage::Picture
    }

    fn extract(&mut self, world: &mut World, _: &SceneFacts, _: &FrameOptions) -> bool {
        self.called_for = world.query::<&Broken>().iter(world).any(|broken| broken.0);
        self.called_for
    }

    fn prepare(&mut self, _: &Gpu, _: &FrameShape) -> Result<(), EffectError> {
        Err("it is broken".into())
    }

    fn declare<'a>(&'a self, _: &mut FrameGraph<'a>, _: &mut Board) {}
}

#[test]
fn a_frame_that_fails_leaves_no_shadow_map_for_drawn() {
    let mut scene = scene();
    scene.renderer = Renderer::builder().with(Fragile { called_for: false }).build(gpu());
    let broken = scene.world.spawn(Broken(true)).id();
    let failed = scene.renderer.render(&mut scene.world, &scene.target.target(), &scene.options);
    assert!(matches!(failed, Err(RenderError::Effect { effect: "fragile", .. })), "{failed:?}");
    // An effect's own components are also checked for changes.
    scene.world.get_mut::<Broken>(broken).unwrap().0 = false;
    let (whole, report) = scene.frame();
    assert!(report.plan.status("shadow maps").unwrap().runs(), "they were never drawn");
    let mut fresh = self::scene();
    assert!(whole == fresh.frame().0);
    // A map that existed, and that a failed frame would have drawn again.
    scene.world.get_mut::<Transform>(scene.ball).unwrap().translation.x += 0.4;
    scene.world.get_mut::<Broken>(broken).unwrap().0 = true;
    assert!(scene.renderer.render(&mut scene.world, &scene.target.target(), &scene.options).is_err());
    scene.world.get_mut::<Broken>(broken).unwrap().0 = false;
    let (moved, _) = scene.frame();
    fresh.world.get_mut::<Transform>(fresh.ball).unwrap().translation.x += 0.4;
    assert!(moved == fresh.frame().0 && moved != whole);
    assert!(!is_still(&scene.frame().1), "an effect that says nothing of it is asked in every frame");
}
