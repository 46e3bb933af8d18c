//! The settings of a scene for its frames: samples, where lamps end, whether shadows are drawn, the filter and resolution of shadow maps. Each
//! has its effect, and no effect if it is not set.

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{Light, LightKind, Material, Shading, SpotCone};
use lumbre_render::FrameOptions;
use lumbre_scene::{Camera, FrameSettings, Mesh, Projection, SceneSettings, ShadowFilter, Transform};

use crate::adapter::{draw, linear};

const SIZE: u32 = 128;
/// Half the side of the visible floor, in metres.
const HALF: f64 = 3.0;
const BALL: DVec3 = DVec3::new(0.0, 1.0, 0.0);
const RADIUS: f64 = 0.5;
const LAMP: DVec3 = DVec3::new(1.2, 4.0, 0.7);

/// A matt ball over a floor, seen from straight above, under this lamp.
fn ball_and_floor(lamp: Light) -> World {
    let mut world = World::new();
    world.insert_resource(SceneSettings::default());
    world.spawn((Mesh::from(shapes::plane(20.0, 20.0, 4, 4)), Material::matt(Vec3::splat(0.8))));
    let ball = Mesh::from(shapes::uv_sphere(RADIUS as f32, 96, 48));
    world.spawn((ball, Material::matt(Vec3::ONE), Transform::from_translation(BALL)));
    let projection = Projection::orthographic(HALF, HALF, 50.0);
    let view = Transform::from_xyz(0.0, 20.0, 0.0).looking_at(DVec3::ZERO, DVec3::NEG_Z);
    world.spawn((Camera { projection, ..Camera::default() }, view));
    world.spawn((lamp, Transform::from_translation(LAMP).looking_at(DVec3::ZERO, DVec3::Z)));
    world
}

fn lamps() -> [Light; 3] {
    let cone = SpotCone::Smooth { inner: 0.5, outer: 0.8 };
    [
        Light::spot(Vec3::splat(30.0), cone),
        Light::point(Vec3::splat(30.0)),
        Light::directional(Vec3::splat(2.0)),
    ]
    .map(|light| Light { shadow: true, ..light })
}

fn ask(world: &mut World, frame: FrameSettings) {
    world.resource_mut::<SceneSettings>().frame = frame;
}

/// Returns the fraction of the lamp's light that reaches each point of the floor; `None` where the ball is visible
/// or no light would arrive anyway.
fn lit(world: &mut World, frame: FrameSettings) -> Vec<Option<f64>> {
    ask(world, frame);
    let options = FrameOptions { shading: Some(Shading::Phong), ..linear() };
    let (with, _) = draw(world, SIZE, SIZE, &options);
    let (without, _) = draw(world, SIZE, SIZE, &FrameOptions { shadows: false, ..options });
    let part = |index: usize| {
        let place = point(index);
        let on_ball = DVec3::new(place.x, BALL.y, place.z).distance(BALL) < RADIUS + 0.06;
        (!on_ball && without[index].x > 0.0).then(|| with[index].x / without[index].x)
    };
    (0..with.len()).map(part).collect()
}

fn point(index: usize) -> DVec3 {
    let along = |pixel: usize| (pixel as f64 + 0.5) / f64::from(SIZE) * 2.0 - 1.0;
    DVec3::new(along(index % SIZE as usize) * HALF, 0.0, along(index / SIZE as usize) * HALF)
}

/// Returns 0 where the ball hides the lamp's centre from the floor, else 1.
fn by_ray(index: usize, lamp: &Light) -> f64 {
    let place = point(index);
    let distant = lamp.kind == LightKind::Directional;
    let (toward, end) = if distant { (LAMP, f64::INFINITY) } else { (LAMP - place, (LAMP - place).length()) };
    let toward = toward.normalize();
    let along = (BALL - place).dot(toward).clamp(0.0, end);
    if (place + toward * along).distance(BALL) < RADIUS { 0.0 } else { 1.0 }
}

/// Returns the mean difference from shadow rays.
fn off(lit: &[Option<f64>], lamp: &Light) -> f64 {
    let apart = lit.iter().enumerate().filter_map(|(at, lit)| Some((lit.as_ref()? - by_ray(at, lamp)).abs()));
    apart.sum::<f64>() / lit.len() as f64
}

#[test]
fn hard_shadows_are_all_or_nothing_and_others_are_not() {
    for lamp in lamps() {
        let mut world = ball_and_floor(lamp.clone());
        let between =
            |lit: &[Option<f64>]| lit.iter().flatten().filter(|lit| (0.01..0.99).contains(*lit)).count();
        let filtered = |world: &mut World, shadow_filter| {
            lit(world, FrameSettings { shadow_filter, ..FrameSettings::default() })
        };
        let hard = filtered(&mut world, ShadowFilter::Hard);
        let dark = hard.iter().flatten().filter(|lit| **lit < 0.5).count();
        assert!(dark > 60, "{lamp:?}: only {dark} points are in the shadow");
        // A quotient of two equal sums of f32.
        assert!(hard.iter().flatten().all(|lit| lit.abs() < 1e-6 || (lit - 1.0).abs() < 1e-6), "{lamp:?}");
        let closer = filtered(&mut world, ShadowFilter::PercentageCloser);
        assert!(between(&closer) > 20, "{lamp:?}: {} points lie between", between(&closer));
        // Away from the edge both agree with the rays.
        let apart = hard.iter().zip(&closer).filter(|(a, b)| a.is_some() && a != b).count();
        assert!(apart > 20 && apart < 800, "{lamp:?}: {apart} points differ");
    }
}

#[test]
fn shadows_of_a_lamp_without_a_size_are_the_same_soft_or_not_and_a_size_counts_only_where_they_are_soft() {
    for lamp in lamps() {
        let wide = Light { radius: 0.4, angle: 0.2, ..lamp.clone() };
        let [small, large] = [lamp, wide].map(|lamp| {
            let mut world = ball_and_floor(lamp);
            [ShadowFilter::PercentageCloser, ShadowFilter::Soft].map(|shadow_filter| {
                lit(&mut world, FrameSettings { shadow_filter, ..FrameSettings::default() })
            })
        });
        assert_eq!(small[0], small[1]);
        assert_eq!(small[0], large[0], "a lamp's size shows without soft shadows");
        assert_ne!(large[0], large[1]);
    }
}

#[test]
fn shadows_are_drawn_unless_the_scene_leaves_them_out() {
    for lamp in lamps() {
        let mut world = ball_and_floor(lamp.clone());
        let mut dark = |shadows| {
            let lit = lit(&mut world, FrameSettings { shadows, ..FrameSettings::default() });
            lit.iter().flatten().filter(|lit| (**lit - 1.0).abs() > 1e-6).count()
        };
        assert_eq!(dark(false), 0, "{lamp:?}");
        assert!(dark(true) > 60, "{lamp:?}: only {} points are in the shadow", dark(true));
    }
}

#[test]
fn more_texels_are_nearer_to_rays() {
    for lamp in lamps() {
        let mut world = ball_and_floor(lamp.clone());
        let error = |world: &mut World, shadow_resolution| {
            off(&lit(world, FrameSettings { shadow_resolution, ..FrameSettings::default() }), &lamp)
        };
        let [coarse, usual, fine] = [0.125, 1.0, 4.0].map(|resolution| error(&mut world, resolution));
        assert!(fine < 0.8 * coarse && fine <= usual && usual <= coarse, "{lamp:?}: {coarse} {usual} {fine}");
        // Numbers beyond the range are clamped to it, and NaN gives the default.
        assert_eq!(error(&mut world, 100.0), fine);
        assert_eq!(error(&mut world, f32::NAN), usual);
    }
}

#[test]
fn lamps_end_by_the_threshold_as_by_a_range_of_their_own() {
    let lamp = Light::point(Vec3::new(4.0, 2.0, 1.0));
    let frame = |world: &mut World| draw(world, SIZE, SIZE, &linear()).0;
    let endless = frame(&mut ball_and_floor(lamp.clone()));
    // 4 / d² = 0.16 at five metres.
    let ranged = frame(&mut ball_and_floor(lamp.clone().with_range(5.0)));
    let mut world = ball_and_floor(lamp);
    ask(&mut world, FrameSettings { light_threshold: 0.16, ..FrameSettings::default() });
    let ended = frame(&mut world);
    let apart = |a: &[DVec3], b: &[DVec3]| {
        a.iter().zip(b).map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f64::max)
    };
    // The square root of 25 in f32.
    assert!(apart(&ended, &ranged) < 1e-6, "{}", apart(&ended, &ranged));
    assert!(apart(&endless, &ranged) > 0.01, "the range shows nowhere");
    ask(&mut world, FrameSettings::default());
    assert_eq!(frame(&mut world), endless);
}

#[test]
fn samples_are_the_scenes_unless_the_frame_says() {
    let [lamp, ..] = lamps();
    let mut world = ball_and_floor(lamp);
    let frame =
        |world: &mut World, multisample| draw(world, 40, 40, &FrameOptions { multisample, ..linear() }).0;
    let [one, four] = [false, true].map(|multisample| frame(&mut world, Some(multisample)));
    assert_ne!(one, four);
    assert_eq!(frame(&mut world, None), one);
    for asked in [true, false] {
        ask(&mut world, FrameSettings { multisample: Some(asked), ..FrameSettings::default() });
        assert_eq!(frame(&mut world, None), if asked { four.clone() } else { one.clone() });
        assert_eq!(frame(&mut world, Some(true)), four);
        assert_eq!(frame(&mut world, Some(false)), one);
    }
}
