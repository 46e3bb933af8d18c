//! Settings of a scene, of an object and of a frame: fog, the viewer, mixed techniques, and options that change
//! between frames.

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{Fog, FogMode, Light, ReflectionModel, Shading};
use lumbre_render::{Display, FrameOptions};
use lumbre_scene::{Lightmap, LightmapEncoding, LightmapImage, Material, Mesh, SceneSettings, Transform};
use lumbre_tests::compare::{Difference, compare};
use lumbre_tests::scenes::{ball, ball_of, every_light};
use lumbre_tests::twin::{self, TwinOptions};

use crate::adapter::{Canvas, draw, linear};

const SIZE: usize = 112;

/// f32 compared with f64, as in balls.rs.
const LARGEST: f64 = 1e-4;

fn lamp() -> Light {
    every_light().swap_remove(2).1
}

fn compared(world: &mut World, shading: Option<Shading>) -> Difference {
    let options = TwinOptions { shading, ..TwinOptions::default() };
    let expected = twin::draw(world, SIZE, SIZE, options).inside_surfaces(shading == Some(Shading::Flat));
    let (got, _) = draw(world, SIZE as u32, SIZE as u32, &FrameOptions { shading, ..linear() });
    let difference = compare(&got.into_iter().map(Some).collect::<Vec<_>>(), &expected);
    assert!(difference.pixels > 30, "{} pixels are too few to compare", difference.pixels);
    difference
}

#[test]
fn the_four_fogs_agree_with_the_twin() {
    let modes = [
        FogMode::Linear { start: 2.4, end: 3.5 },
        FogMode::Exponential { density: 0.3 },
        FogMode::ExponentialSquared { density: 0.25 },
        FogMode::DepthCue { start: 2.8, end: 3.3, near_weight: 0.9, far_weight: 0.4 },
    ];
    let mut frames = Vec::new();
    for mode in modes {
        let mut world = ball(lamp());
        let color = Vec3::new(0.5, 0.6, 0.9);
        world.resource_mut::<SceneSettings>().fog = Some(Fog { mode, color });
        for shading in [Shading::Gouraud, Shading::Phong] {
            let difference = compared(&mut world, Some(shading));
            assert!(difference.largest < LARGEST, "{mode:?}, {}: {difference:?}", shading.name());
        }
        frames.push(draw(&mut world, SIZE as u32, SIZE as u32, &linear()).0);
    }
    frames.push(draw(&mut ball(lamp()), SIZE as u32, SIZE as u32, &linear()).0);
    // Negative control: four fogs and no fog are five different pictures.
    for a in 0..frames.len() {
        for b in 0..a {
            let largest = frames[a]
                .iter()
                .zip(&frames[b])
                .map(|(a, b)| (*a - *b).abs().max_element())
                .fold(0.0, f64::max);
            assert!(largest > 100.0 * LARGEST, "fogs {a} and {b} look alike");
        }
    }
}

#[test]
fn a_viewer_infinitely_far_away_agrees_with_the_twin() {
    let mut world = ball(lamp());
    let (local, _) = draw(&mut world, SIZE as u32, SIZE as u32, &linear());
    world.resource_mut::<SceneSettings>().local_viewer = false;
    for shading in Shading::ALL {
        let difference = compared(&mut world, Some(*shading));
        assert!(difference.largest < LARGEST, "{}: {difference:?}", shading.name());
    }
    let (infinite, _) = draw(&mut world, SIZE as u32, SIZE as u32, &linear());
    let largest = local.iter().zip(&infinite).map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f64::max);
    assert!(largest > 100.0 * LARGEST, "negative control: the highlight moves");
}

/// Three coarse balls side by side, one of each technique, regardless of the scene's setting.
fn three_techniques() -> World {
    let mut world = ball_of(shapes::uv_sphere(1.0, 12, 6), lamp());
    let first = world.query_filtered::<Entity, With<Mesh>>().single(&world).unwrap();
    let (mesh, material) =
        (world.get::<Mesh>(first).unwrap().clone(), world.get::<Material>(first).unwrap().clone());
    let place = |x: f64| Transform::from_xyz(x, 0.0, 0.0).with_scale(DVec3::splat(0.5));
    world.entity_mut(first).insert((place(-1.1), Shading::Flat));
    world.spawn((mesh.clone(), material.clone(), place(0.0), Shading::Gouraud));
    world.spawn((mesh, material, place(1.1)));
    world.resource_mut::<SceneSettings>().shading = Shading::Phong;
    world
}

#[test]
fn three_techniques_in_one_frame() {
    // Large enough for triangles to have an interior, the only place where flat shading can be compared.
    const SIZE: usize = 200;
    let mut world = three_techniques();
    let frame = twin::draw(&mut world, SIZE, SIZE, TwinOptions::default());
    let inside = frame.inside_surfaces(true);
    let options = linear();
    let (got, report) = draw(&mut world, SIZE as u32, SIZE as u32, &options);
    assert_eq!(report.statistics.draws, 3);
    let of_ball = |ball: usize| -> Vec<Option<DVec3>> {
        let shows = |at: usize| frame.surface[at].is_some_and(|(object, _)| object == ball);
        (0..SIZE * SIZE).map(|at| inside[at].filter(|_| shows(at))).collect()
    };
    let some = |pixels: Vec<DVec3>| pixels.into_iter().map(Some).collect::<Vec<_>>();
    let got = some(got);
    for ball in 0..3 {
        let difference = compare(&got, &of_ball(ball));
        assert!(difference.pixels > 500, "ball {ball}: {} pixels", difference.pixels);
        assert!(difference.largest < LARGEST, "ball {ball}: {difference:?}");
    }
    // Negative control: a frame's own technique overrides all three, which changes two of the balls.
    for shading in Shading::ALL {
        let options = FrameOptions { shading: Some(*shading), ..options.clone() };
        let forced = some(draw(&mut world, SIZE as u32, SIZE as u32, &options).0);
        let other = (0..3).filter(|ball| compare(&forced, &of_ball(*ball)).largest > 10.0 * LARGEST).count();
        assert_eq!(other, 2, "{}", shading.name());
    }
}

/// The three balls over a lightmapped floor that a static lamp also lights.
fn lightmapped() -> World {
    let mut world = three_techniques();
    let mut floor = shapes::plane(6.0, 6.0, 4, 4);
    floor.uv1 = floor.uv0.clone();
    let texels = (0..16).map(|i| Vec3::new(0.1, 0.02, 0.05) * i as f32).collect();
    let image = LightmapImage {
        name: String::new(),
        width: 4,
        height: 4,
        texels,
        encoding: LightmapEncoding::default(),
    };
    world.spawn((
        Mesh(floor.into()),
        Material::matt(Vec3::splat(0.7)),
        Lightmap { image: image.into() },
        Transform::from_xyz(0.0, -0.8, 0.0),
    ));
    let baked = Light { bake: lumbre_optics::BakeMode::Static, ..Light::point(Vec3::splat(2.0)) };
    world.spawn((baked, Transform::from_xyz(-1.0, 2.0, 0.5)));
    world
}

#[test]
fn options_that_change_from_frame_to_frame_leave_nothing_behind() {
    let mut world = lightmapped();
    let with_shading = |shading| FrameOptions { shading: Some(shading), ..linear() };
    let frames = [
        with_shading(Shading::Flat),
        with_shading(Shading::Gouraud),
        with_shading(Shading::Phong),
        FrameOptions { lightmaps: false, ..linear() },
        linear(),
        FrameOptions { reflection: Some(ReflectionModel::Blinn), ..linear() },
        FrameOptions { multisample: Some(true), ..linear() },
        FrameOptions { full_precision: false, exposure: Some(0.5), ..linear() },
        FrameOptions { display: Display::Clamp, ..linear() },
        FrameOptions { display: Display::Srgb, ..linear() },
        FrameOptions { lightmaps: false, multisample: Some(true), ..with_shading(Shading::Gouraud) },
        linear(),
    ];
    let mut canvas = Canvas::new(SIZE as u32, SIZE as u32);
    let mut seen: Vec<Vec<DVec3>> = Vec::new();
    for (number, options) in frames.iter().enumerate() {
        let (kept, _) = canvas.draw(&mut world, options);
        let (fresh, _) = draw(&mut world, SIZE as u32, SIZE as u32, options);
        let differ = kept.iter().zip(&fresh).filter(|(a, b)| a != b).count();
        assert_eq!(
            differ, 0,
            "frame {number} ({options:?}) differs from a fresh renderer's in {differ} pixels"
        );
        seen.push(kept);
    }
    assert_eq!(seen[4], seen[11], "the same options give the same frame");
    // Negative control: all others are different pictures, except the one with the scene's own options.
    for a in 0..11 {
        for b in 0..a {
            assert!(seen[a] != seen[b], "frames {a} and {b} are equal");
        }
    }
}

#[test]
fn switched_settings_of_the_scene_leave_nothing_behind() {
    let mut world = lightmapped();
    let mut canvas = Canvas::new(SIZE as u32, SIZE as u32);
    let fog = Fog { mode: FogMode::Exponential { density: 0.2 }, color: Vec3::splat(0.5) };
    let plain = *world.resource::<SceneSettings>();
    let mut seen: Vec<Vec<DVec3>> = Vec::new();
    for settings in [
        plain,
        SceneSettings { fog: Some(fog), ..plain },
        SceneSettings { local_viewer: false, ..plain },
        SceneSettings { background: Vec3::X, ..plain },
        SceneSettings { ambient: Vec3::splat(0.4), ..plain },
        SceneSettings { reflection: ReflectionModel::TorranceSparrow, ..plain },
        SceneSettings { shading: Shading::Gouraud, ..plain },
    ] {
        world.insert_resource(settings);
        let (kept, _) = canvas.draw(&mut world, &linear());
        let (fresh, _) = draw(&mut world, SIZE as u32, SIZE as u32, &linear());
        assert!(kept == fresh, "{settings:?}");
        assert!(seen.iter().all(|other| *other != kept), "negative control: {settings:?} changes nothing");
        seen.push(kept);
    }
    world.insert_resource(plain);
    assert!(canvas.draw(&mut world, &linear()).0 == seen[0]);
}

#[test]
fn the_sky_is_the_background_and_lights_what_has_no_lightmap() {
    let sky = Vec3::new(0.25, 0.5, 1.0);
    let frame = |settings: SceneSettings, lightmapped: bool| {
        let mut world = ball(Light { enabled: false, ..lamp() });
        let given = SceneSettings {
            ambient: Vec3::ZERO,
            background: Vec3::ZERO,
            ..*world.resource::<SceneSettings>()
        };
        world.insert_resource(SceneSettings {
            ambient: settings.ambient,
            background: settings.background,
            sky: settings.sky,
            ..given
        });
        if lightmapped {
            let (encoding, texels) = (LightmapEncoding::Rgb32Float, vec![Vec3::ZERO; 4]);
            let image = LightmapImage { name: "dark".to_owned(), width: 2, height: 2, texels, encoding };
            let entity = world.query_filtered::<Entity, With<Mesh>>().single(&world).unwrap();
            let mut mesh = (*world.get::<Mesh>(entity).unwrap().0).clone();
            mesh.uv1 = vec![glam::Vec2::splat(0.5); mesh.positions.len()];
            let map = Lightmap { image: std::sync::Arc::new(image) };
            world.entity_mut(entity).insert((Mesh(std::sync::Arc::new(mesh)), map));
        }
        draw(&mut world, SIZE as u32, SIZE as u32, &linear()).0
    };
    let none = SceneSettings::default();
    let under_sky = frame(SceneSettings { sky, ..none }, false);
    // A sky of radiance L has the effect on k_a of ambient light of L; the corner of the frame is beside the ball.
    let in_ambient_light = frame(SceneSettings { ambient: sky, background: sky, ..none }, false);
    assert_eq!(under_sky, in_ambient_light);
    assert_eq!(under_sky[0], sky.as_dvec3());
    assert!(
        under_sky.iter().any(|pixel| (*pixel - sky.as_dvec3()).abs().max_element() > 0.05),
        "the ball is seen"
    );
    // An explicit background is kept; a lightmap already contains the sky's light.
    let background = Vec3::new(0.0, 0.0, 0.125);
    let baked = frame(SceneSettings { sky, background, ..none }, true);
    assert_eq!(baked[0], background.as_dvec3());
    let without = frame(SceneSettings { background, ..none }, true);
    assert!(baked == without, "what is baked takes no sky twice");
}
