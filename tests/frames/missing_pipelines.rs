//! Frames that do not wait for their pipelines: they continue to show bit for bit what the previous one did, and
//! end up with what a waiting renderer shows. The example `switch_on` of lumbre_render prints how long they take.

use std::sync::Arc;
use std::time::{Duration, Instant};

use bevy_ecs::prelude::*;
use glam::{DVec3, UVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{AlphaMode, Fog, FogMode, Light, Material, Shading, SpotCone};
use lumbre_render::{
    FrameOptions, FrameReport, MissingPipelines, Offscreen, OffscreenFormat, Renderer, RenderingPath,
};
use lumbre_scene::{AmbientCube, Camera, IrradianceVolume, MaterialTextures, Mesh, SceneSettings, Transform};
use lumbre_tests::panes::{image, sharp};

use crate::adapter::gpu;

const SIZE: u32 = 64;

struct Scene {
    world: World,
    ball: Entity,
    lamp: Entity,
    renderer: Renderer,
    target: Offscreen,
    options: FrameOptions,
}

/// A ball over a floor under a lamp, with a spotlight that is off, drawn once, with later frames not waiting.
fn scene() -> Scene {
    let mut world = World::new();
    let floor = Mesh(Arc::new(shapes::plane(8.0, 8.0, 4, 4)));
    world.spawn((floor, Material::from_metallic_roughness(Vec3::splat(0.6), 0.0, 0.8)));
    let ball = Mesh(Arc::new(shapes::uv_sphere(0.7, 32, 16)));
    let place = Transform::from_xyz(0.0, 1.0, 0.0);
    let ball = world.spawn((ball, Material::from_metallic_roughness(Vec3::splat(0.8), 0.0, 0.3), place)).id();
    world.spawn((Light::point(Vec3::splat(6.0)), Transform::from_xyz(-2.0, 3.0, 1.0)));
    let cone = SpotCone::Smooth { inner: 0.2, outer: 0.5 };
    let place = Transform::from_xyz(1.0, 4.0, 1.0).looking_at(DVec3::ZERO, DVec3::Y);
    let lamp = world.spawn((Light { enabled: false, ..Light::spot(Vec3::splat(40.0), cone) }, place)).id();
    let eye = Transform::from_xyz(0.0, 3.0, 5.0).looking_at(DVec3::new(0.0, 0.5, 0.0), DVec3::Y);
    world.spawn((Camera::default(), eye));
    world.insert_resource(SceneSettings { ambient: Vec3::splat(0.1), ..SceneSettings::default() });
    let target = Offscreen::new(gpu(), SIZE, SIZE, OffscreenFormat::Rgba8).unwrap();
    let options = FrameOptions { missing_pipelines: MissingPipelines::Background, ..FrameOptions::default() };
    let mut scene = Scene { world, ball, lamp, renderer: Renderer::new(gpu()), target, options };
    let (_, report) = scene.frame();
    assert_eq!(report.statistics.pipelines_awaited, 0, "the first frame of a World waits");
    scene
}

impl Scene {
    fn frame(&mut self) -> (Vec<u8>, FrameReport) {
        let report = self.renderer.render(&mut self.world, &self.target.target(), &self.options).unwrap();
        (self.target.read_rgba8(gpu()).unwrap(), report)
    }

    /// Returns what a renderer that waits draws.
    fn fresh(&mut self) -> Vec<u8> {
        let options = FrameOptions { missing_pipelines: MissingPipelines::Wait, ..self.options.clone() };
        let mut renderer = Renderer::new(gpu());
        let report = renderer.render(&mut self.world, &self.target.target(), &options).unwrap();
        assert_eq!(report.statistics.pipelines_awaited, 0);
        self.target.read_rgba8(gpu()).unwrap()
    }

    /// Draws until no pipeline is awaited; returns the first and the last frame.
    fn until_there(&mut self) -> [(Vec<u8>, FrameReport); 2] {
        let first = self.frame();
        let begun = Instant::now();
        loop {
            let last = self.frame();
            if last.1.statistics.pipelines_awaited == 0 {
                return [first, last];
            }
            assert!(begun.elapsed() < Duration::from_secs(120), "its pipelines never come");
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Makes a change whose pipelines do not exist yet. The first frame equals the previous one if `as_before`, and
    /// the last one is what it should be.
    fn change(&mut self, name: &str, as_before: bool, change: impl FnOnce(&mut Self)) {
        let (before, _) = self.frame();
        change(self);
        let [(first, report), (last, _)] = self.until_there();
        assert!(report.statistics.pipelines_awaited > 0, "{name}: nothing was missing");
        if as_before {
            assert!(first == before, "{name}: the frame did not go on as it was");
        }
        let fresh = self.fresh();
        assert!(last == fresh, "{name}: it has not come to what it should be");
        assert!(before != fresh, "{name}: negative control: the change is seen");
        // It stays that way, without anything to wait for.
        let (again, report) = self.frame();
        assert!(again == fresh && report.statistics.pipelines_awaited == 0, "{name}");
    }
}

#[test]
fn what_is_switched_on_for_the_first_time_is_shown_when_its_pipelines_are_there() {
    let mut scene = scene();
    scene.change("spot light", true, |scene| {
        scene.world.get_mut::<Light>(scene.lamp).unwrap().enabled = true;
    });
    scene.change("shadow", true, |scene| {
        scene.world.get_mut::<Light>(scene.lamp).unwrap().shadow = true;
    });
    scene.change("texture", true, |scene| {
        let texture = sharp(&image(2, &[[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [255; 4]]));
        let textures = MaterialTextures { base_color: Some(texture), ..MaterialTextures::default() };
        scene.world.entity_mut(scene.ball).insert(textures);
    });
    scene.change("fog", true, |scene| {
        let fog = Fog { mode: FogMode::Exponential { density: 0.1 }, color: Vec3::splat(0.3) };
        scene.world.resource_mut::<SceneSettings>().fog = Some(fog);
    });
    scene.change("directional light", true, |scene| {
        let place = Transform::from_xyz(0.0, 5.0, 3.0).looking_at(DVec3::ZERO, DVec3::Y);
        scene.world.spawn((Light::directional(Vec3::ONE), place));
    });
    scene.change("irradiance volume", true, |scene| {
        scene.world.spawn((volume(), Transform::from_scale(6.0)));
    });
    scene.change("mirror", true, |scene| {
        let mut materials = scene.world.query::<(&Mesh, &mut Material)>();
        let (_, mut floor) =
            materials.iter_mut(&mut scene.world).min_by_key(|(mesh, _)| mesh.0.triangle_count()).unwrap();
        floor.mirror = Vec3::splat(0.5);
    });
    scene.change("glass", true, |scene| {
        scene.world.get_mut::<Material>(scene.ball).unwrap().transmission = Vec3::splat(0.4);
    });
    scene.change("deferred shading in compute shaders, without fog", true, |scene| {
        scene.options.rendering_path = RenderingPath::DeferredCompute;
        scene.world.resource_mut::<SceneSettings>().fog = None;
    });
    let (_, report) = scene.frame();
    assert!(report.plan.status("deferred lighting").unwrap().runs());
    scene.change("flat shading", true, |scene| scene.options.shading = Some(Shading::Flat));
    // Multisampling uses another format and a separate display pass.
    scene.change("multisampling", true, |scene| scene.options.multisample = Some(true));
}

#[test]
fn a_surface_that_waits_is_shown_as_far_as_it_can_be() {
    let mut scene = scene();
    // A blended object, for which the frame has no pass yet, is missing at first; the rest is there.
    scene.change("a pane of glass", true, |scene| {
        let glass = Material { alpha: 0.5, alpha_mode: AlphaMode::Blend, ..Material::matt(Vec3::X) };
        let pane = Mesh(Arc::new(shapes::plane(3.0, 3.0, 1, 1)));
        scene.world.spawn((pane, glass, Transform::from_xyz(0.0, 1.5, 1.0)));
    });
    // A box without a highlight is drawn by the shader of objects with one, with a highlight of zero.
    let mut fresh = Vec::new();
    let [(first, report), (last, _)] = {
        let cube = Mesh(Arc::new(shapes::cuboid(Vec3::splat(0.6), 1)));
        scene.world.spawn((cube, Material::matt(Vec3::Y), Transform::from_xyz(1.2, 1.0, 1.0)));
        fresh.extend(scene.fresh());
        scene.until_there()
    };
    assert!(report.statistics.pipelines_awaited > 0 && last == fresh);
    let differ = |a: &[u8], b: &[u8]| a.iter().zip(b).filter(|(a, b)| a.abs_diff(**b) > 1).count();
    assert_eq!(differ(&first, &fresh), 0, "it was there from the first frame on");
}

#[test]
fn lamps_that_go_out_are_out_at_once() {
    go_out(false);
}

#[test]
fn lamps_with_a_shadow_that_go_out_are_out_at_once() {
    go_out(true);
}

fn go_out(shadow: bool) {
    let mut scene = scene();
    let lamps: Vec<Entity> = (0..4)
        .map(|number| {
            let cone = SpotCone::Smooth { inner: 0.2, outer: 0.9 };
            let lamp = Light { shadow, ..Light::spot(Vec3::splat(4.0), cone).with_range(9.0) };
            let place = Transform::from_xyz(f64::from(number) - 1.5, 3.0, 0.0);
            scene.world.spawn((lamp, place.looking_at(DVec3::ZERO, DVec3::Z))).id()
        })
        .collect();
    scene.world.spawn((Light::directional(Vec3::splat(0.5)), Transform::IDENTITY));
    scene.until_there();
    // The clusters' lists of a class of lights of which none is left.
    for lamp in &lamps {
        scene.world.get_mut::<Light>(*lamp).unwrap().enabled = false;
    }
    let [(first, report), (last, _)] = scene.until_there();
    assert!(report.statistics.pipelines_awaited > 0, "without clusters it is another shader");
    let fresh = scene.fresh();
    assert!(last == fresh);
    let farthest = first.iter().zip(&fresh).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
    assert!(farthest <= 1, "{farthest} of 255 apart");
}

/// A volume of two cells.
fn volume() -> IrradianceVolume {
    let cubes =
        [Vec3::new(0.6, 0.2, 0.1), Vec3::new(0.1, 0.2, 0.6)].map(|light| AmbientCube([light; 6])).to_vec();
    IrradianceVolume { resolution: UVec3::new(2, 1, 1), cubes, inside: Vec::new() }
}

#[test]
fn a_volume_that_is_gone_gives_no_light_even_if_the_frame_has_to_wait_for_that() {
    let mut scene = scene();
    let volume = scene.world.spawn((volume(), Transform::from_scale(6.0))).id();
    let [_, (lit, _)] = scene.until_there();
    // Together with another change that no earlier frame had.
    scene.options.shading = Some(Shading::Gouraud);
    scene.world.despawn(volume);
    let (first, report) = scene.frame();
    assert_eq!(report.statistics.pipelines_awaited, 0, "it has waited");
    assert!(first == scene.fresh() && first != lit);
}

#[test]
fn another_world_and_another_format_wait_for_what_they_need() {
    let mut scene = scene();
    let linear = Offscreen::new(gpu(), SIZE, SIZE, OffscreenFormat::LinearFloat).unwrap();
    let report = scene.renderer.render(&mut scene.world, &linear.target(), &scene.options).unwrap();
    assert_eq!(report.statistics.pipelines_awaited, 0);
    let (bytes, report) = scene.frame();
    assert_eq!(report.statistics.pipelines_awaited, 0);
    assert_eq!(bytes, scene.fresh());
    let mut other = self::scene();
    other.world.get_mut::<Light>(other.lamp).unwrap().enabled = true;
    std::mem::swap(&mut scene.world, &mut other.world);
    let (bytes, report) = scene.frame();
    assert_eq!(report.statistics.pipelines_awaited, 0, "nothing of another World is shown");
    assert_eq!(bytes, scene.fresh());
}
