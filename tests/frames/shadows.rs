//! Compares shadow maps with shadow rays in f64: a ball and a box over a floor, under every kind of light. A flat
//! surface never shadows itself, an object on the floor has a shadow that touches it, and unchanged maps are not
//! drawn again.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_graph::Status;
use lumbre_mesh::shapes;
use lumbre_optics::{Light, LightKind, Material, Shading, SpotCone};
use lumbre_render::{Display, FrameOptions, FrameReport, LightLists, Offscreen, OffscreenFormat, Renderer};
use lumbre_scene::{Camera, Mesh, Projection, Transform};

use crate::adapter::gpu;

const SIZE: u32 = 256;
/// Half the side of the visible floor, in metres.
const HALF: f64 = 3.0;
const BALL: DVec3 = DVec3::new(0.0, 1.0, 0.0);
const RADIUS: f64 = 0.5;

/// A floor seen from straight above.
fn floor() -> World {
    let mut world = World::new();
    world.spawn((Mesh::from(shapes::plane(20.0, 20.0, 4, 4)), Material::matt(Vec3::splat(0.8))));
    let projection = Projection::orthographic(HALF, HALF, 50.0);
    let view = Transform::from_xyz(0.0, 20.0, 0.0).looking_at(DVec3::ZERO, DVec3::NEG_Z);
    world.spawn((Camera { projection, ..Camera::default() }, view));
    world
}

fn light(world: &mut World, light: Light, place: DVec3, target: DVec3) -> Entity {
    let transform = Transform::from_translation(place).looking_at(target, DVec3::Z);
    world.spawn((Light { shadow: true, ..light }, transform)).id()
}

/// Returns the point of the floor at the centre of a pixel.
fn point(index: usize) -> DVec3 {
    let along = |pixel: usize| (pixel as f64 + 0.5) / f64::from(SIZE) * 2.0 - 1.0;
    let (x, y) = (index % SIZE as usize, index / SIZE as usize);
    DVec3::new(along(x) * HALF, 0.0, along(y) * HALF)
}

struct Drawn {
    /// For each pixel the red radiance with shadows over that without; 1 where it is dark without.
    lit: Vec<f64>,
    report: FrameReport,
}

fn draw(renderer: &mut Renderer, world: &mut World, shading: Shading) -> Drawn {
    draw_by(renderer, world, shading, LightLists::Auto)
}

fn draw_by(renderer: &mut Renderer, world: &mut World, shading: Shading, light_lists: LightLists) -> Drawn {
    let target = Offscreen::new(gpu(), SIZE, SIZE, OffscreenFormat::LinearFloat).unwrap();
    let options = FrameOptions {
        display: Display::Linear,
        shading: Some(shading),
        light_lists,
        probe: true,
        ..FrameOptions::default()
    };
    let report = renderer.render(world, &target.target(), &options).unwrap();
    let measured = renderer.wait().unwrap().unwrap();
    assert!(measured.probed && measured.non_finite.is_none(), "{:?}", measured.non_finite);
    let with = target.read_linear(gpu()).unwrap();
    renderer.render(world, &target.target(), &FrameOptions { shadows: false, ..options }).unwrap();
    let without = target.read_linear(gpu()).unwrap();
    let part = |(with, without): (&glam::Vec4, &glam::Vec4)| match without.x > 0.0 {
        true => f64::from(with.x) / f64::from(without.x),
        false => 1.0,
    };
    Drawn { lit: with.iter().zip(&without).map(part).collect(), report }
}

/// Returns the distance at which a ray from the floor to the light passes the centre of the ball.
fn passes(point: DVec3, toward: DVec3, end: f64) -> f64 {
    let along = (BALL - point).dot(toward).clamp(0.0, end);
    (point + toward * along).distance(BALL)
}

fn every_light() -> [(&'static str, Light, DVec3); 7] {
    let place = DVec3::new(1.2, 4.0, 0.7);
    let cone = SpotCone::Smooth { inner: 0.5, outer: 0.8 };
    let wide = SpotCone::Smooth { inner: 1.3, outer: 1.5 };
    [
        ("spot", Light::spot(Vec3::splat(30.0), cone), place),
        ("wide spot", Light::spot(Vec3::splat(30.0), wide), place),
        ("point", Light::point(Vec3::splat(30.0)), place),
        ("spot with a range", Light::spot(Vec3::splat(30.0), cone).with_range(12.0), place),
        ("wide spot with a range", Light::spot(Vec3::splat(30.0), wide).with_range(12.0), place),
        ("point with a range", Light::point(Vec3::splat(30.0)).with_range(12.0), place),
        ("directional", Light::directional(Vec3::splat(2.0)), place),
    ]
}

#[test]
fn shadows_fall_where_rays_say() {
    fall_where_rays_say(LightLists::Everything);
}

#[test]
fn shadows_of_lamps_in_clusters_fall_where_rays_say() {
    // Lamps with a range have compact records there.
    assert_eq!(fall_where_rays_say(LightLists::Clusters), 3);
}

/// Compares the shadows of every kind of light with rays, and returns how many lamps had compact records.
fn fall_where_rays_say(lists: LightLists) -> u32 {
    let mut renderer = Renderer::new(gpu());
    let mut compact = 0;
    for (name, lamp, place) in every_light() {
        let mut world = floor();
        let ball = Mesh::from(shapes::uv_sphere(RADIUS as f32, 96, 48));
        world.spawn((ball, Material::matt(Vec3::ONE), Transform::from_translation(BALL)));
        let distant = lamp.kind == LightKind::Directional;
        light(&mut world, lamp, place, DVec3::ZERO);
        let Drawn { lit, report } = draw_by(&mut renderer, &mut world, Shading::Phong, lists);
        compact += report.statistics.light_lists.shadowed_lights;
        let (mut dark, mut bright, mut near) = (0, 0, 0);
        for (index, lit) in lit.iter().enumerate() {
            let point = point(index);
            // The ball covers the floor there, and is lit itself.
            if DVec3::new(point.x, BALL.y, point.z).distance(BALL) < RADIUS + 0.03 {
                continue;
            }
            let toward = if distant { place } else { place - point };
            let end = if distant { f64::INFINITY } else { toward.length() };
            let passed = passes(point, toward.normalize(), end);
            // At most three texels of the maps.
            if (passed - RADIUS).abs() < 0.1 {
                near += 1;
                assert!((0.0..=1.0 + 1e-6).contains(lit), "{name}: {lit} at {point}");
            } else if passed < RADIUS {
                dark += 1;
                assert!(
                    *lit < 1e-6,
                    "{name}: {lit} of the light at {point}, {passed} from the middle of the ball"
                );
            } else {
                bright += 1;
                assert!(
                    (lit - 1.0).abs() < 1e-6,
                    "{name}: {lit} of the light at {point}, {passed} from the middle"
                );
            }
        }
        assert!(dark > 300 && bright > 20_000, "{name}: {dark} dark, {near} near the edge, {bright} bright");
    }
    compact
}

#[test]
fn a_flat_floor_never_shadows_itself_and_a_box_has_its_shadow_at_its_feet() {
    let mut renderer = Renderer::new(gpu());
    for elevation in [2.0_f64, 5.0, 10.0, 20.0, 45.0, 70.0, 89.0, 90.0] {
        let (sine, cosine) = elevation.to_radians().sin_cos();
        let toward = DVec3::new(cosine * 0.8, sine, cosine * 0.6);
        for (name, lamp, place) in [
            ("directional", Light::directional(Vec3::splat(2.0)), toward * 30.0),
            ("point", Light::point(Vec3::splat(90.0)), toward * 6.0),
            (
                "spot",
                Light::spot(Vec3::splat(90.0), SpotCone::Smooth { inner: 0.6, outer: 0.9 }),
                toward * 6.0,
            ),
        ] {
            let distant = lamp.kind == LightKind::Directional;
            let mut world = floor();
            light(&mut world, lamp, place, DVec3::ZERO);
            for shading in [Shading::Phong, Shading::Gouraud] {
                let Drawn { lit, .. } = draw(&mut renderer, &mut world, shading);
                let worst = lit.iter().fold(1.0, |worst: f64, lit| worst.min(*lit));
                assert!(worst > 0.999, "{name} at {elevation} degrees: {worst} of the light");
            }
            // A box of half a metre on the floor.
            world.spawn((
                Mesh::from(shapes::cuboid(Vec3::splat(0.5), 1)),
                Material::matt(Vec3::ONE),
                Transform::from_xyz(0.0, 0.25, 0.0),
            ));
            let Drawn { lit, .. } = draw(&mut renderer, &mut world, Shading::Phong);
            let shadow = |distance: f64| {
                let direction = DVec3::new(-toward.x, 0.0, -toward.z).normalize_or_zero();
                // From the box's side, in the middle of its shadow.
                let place =
                    direction * (0.25 / direction.x.abs().max(direction.z.abs()).max(1e-9) + distance);
                let pixel = |along: f64| ((along / HALF + 1.0) * 0.5 * f64::from(SIZE)) as usize;
                lit[pixel(place.z) * SIZE as usize + pixel(place.x)]
            };
            if elevation < 71.0 {
                let length = 0.5 * cosine / sine;
                let touching = shadow(0.06);
                // The map of a near light has texels of a tenth of a metre there, which at two degrees also contain
                // what is in front of the box.
                assert!(
                    touching < 0.02 || !distant && elevation < 10.0,
                    "{name} at {elevation} degrees: {touching} of the light at the box's feet"
                );
                if distant && length < 1.5 {
                    let beyond = shadow(length + 0.15);
                    assert!(
                        beyond > 0.99,
                        "{name} at {elevation} degrees: {beyond} of the light beyond the shadow"
                    );
                }
            }
        }
    }
}

#[test]
fn a_large_light_has_a_penumbra_that_grows_with_distance() {
    let widths = [0.3, 1.5].map(|height| {
        let mut world = floor();
        // Half of the floor is under a sheet.
        let sheet = Mesh::from(shapes::plane(8.0, 8.0, 1, 1));
        world.spawn((
            sheet,
            Material { double_sided: true, ..Material::matt(Vec3::ONE) },
            Transform::from_xyz(-4.0, height, 0.0),
        ));
        let lamp = Light {
            radius: 0.25,
            ..Light::spot(Vec3::splat(30.0), SpotCone::Smooth { inner: 0.6, outer: 0.8 })
        };
        light(&mut world, lamp, DVec3::new(0.0, 4.0, 0.0), DVec3::ZERO);
        // Seen from below the sheet, so that the covered floor is visible.
        let mut cameras = world.query::<(&mut Transform, &Camera)>();
        for (mut transform, _) in cameras.iter_mut(&mut world) {
            transform.translation.y = 0.5 * height;
        }
        let Drawn { lit, .. } = draw(&mut Renderer::new(gpu()), &mut world, Shading::Phong);
        let row = &lit[128 * SIZE as usize..129 * SIZE as usize];
        assert!(row[20] < 0.01 && row[236] > 0.99, "dark under the sheet, light beside it");
        row.iter().filter(|lit| (0.05..0.95).contains(*lit)).count() as f64 / f64::from(SIZE) * 2.0 * HALF
    });
    // The width of the penumbra of a spherical light is 2 r h / (H - h), of which the filter shows some nine
    // tenths, with a tolerance of a texel.
    for (width, height) in widths.iter().zip([0.3, 1.5]) {
        let expected = 2.0 * 0.25 * height / (4.0 - height);
        assert!(
            (0.5 * expected - 0.03..1.6 * expected + 0.06).contains(width),
            "{width} m under {height} m, {expected} expected"
        );
    }
    assert!(widths[1] > 2.0 * widths[0], "{widths:?}");
}

#[test]
fn what_did_not_change_is_not_drawn_again() {
    let mut world = floor();
    let ball = Mesh(Arc::new(shapes::uv_sphere(RADIUS as f32, 32, 16)));
    let ball = world.spawn((ball, Material::matt(Vec3::ONE), Transform::from_translation(BALL))).id();
    let lamp = light(&mut world, Light::point(Vec3::splat(30.0)), DVec3::new(1.0, 4.0, 0.0), DVec3::ZERO);
    let target = Offscreen::new(gpu(), SIZE, SIZE, OffscreenFormat::LinearFloat).unwrap();
    let options = FrameOptions { display: Display::Linear, ..FrameOptions::default() };
    let mut renderer = Renderer::new(gpu());
    let mut frame = |world: &mut World| {
        let report = renderer.render(world, &target.target(), &options).unwrap();
        let drawn = matches!(report.plan.status("shadow maps"), Some(Status::Runs { .. }));
        (target.read_linear(gpu()).unwrap(), drawn)
    };
    let (first, drawn) = frame(&mut world);
    assert!(drawn);
    let (second, drawn) = frame(&mut world);
    assert!(!drawn && first == second, "the maps of the frame before are read");
    world.get_mut::<Transform>(ball).unwrap().translation.x += 0.5;
    let (moved, drawn) = frame(&mut world);
    assert!(drawn && moved != first);
    world.get_mut::<Transform>(lamp).unwrap().translation.x -= 1.0;
    assert!(frame(&mut world).1);
    // A new renderer draws the same.
    let fresh = Renderer::new(gpu()).render(&mut world, &target.target(), &options);
    assert!(fresh.is_ok());
    let fresh = target.read_linear(gpu()).unwrap();
    let (kept, drawn) = frame(&mut world);
    assert!(!drawn && kept == fresh);
    // A light without a shadow, which also changes the frame.
    world.get_mut::<Light>(lamp).unwrap().shadow = false;
    let (plain, drawn) = frame(&mut world);
    assert!(!drawn && plain != kept);
}

#[test]
fn lights_without_room_are_named() {
    let mut world = floor();
    for number in 0..30 {
        light(
            &mut world,
            Light::point(Vec3::ONE),
            DVec3::new(f64::from(number) * 0.1, 2.0, 0.0),
            DVec3::ZERO,
        );
    }
    let Drawn { lit, report } = draw(&mut Renderer::new(gpu()), &mut world, Shading::Phong);
    // 128 views are enough for 21 point lights with six views each.
    assert_eq!(report.left_out.len(), 9, "{:?}", report.left_out);
    assert!(report.left_out[0].contains("128 views"), "{}", report.left_out[0]);
    assert!(lit.iter().all(|lit| (lit - 1.0).abs() < 1e-5));
}

#[test]
fn a_lamp_does_not_shadow_its_own_light() {
    let mut world = floor();
    let bulb = Mesh::from(shapes::uv_sphere(0.1, 16, 8));
    let lamp = light(&mut world, Light::point(Vec3::splat(30.0)), DVec3::new(0.0, 3.0, 0.0), DVec3::ZERO);
    world.entity_mut(lamp).insert((bulb, Material::emissive(Vec3::ONE)));
    let Drawn { lit, .. } = draw(&mut Renderer::new(gpu()), &mut world, Shading::Phong);
    let bright = |lit: &[f64]| lit.iter().filter(|lit| (**lit - 1.0).abs() < 1e-6).count();
    assert_eq!(bright(&lit), lit.len());
    // The same bulb as a separate object around the light.
    let bulb = world.entity_mut(lamp).take::<Mesh>().unwrap();
    let place = Transform::from_xyz(0.0, 3.0, 0.0);
    let glowing = world.spawn((bulb, Material::emissive(Vec3::ONE), place)).id();
    let Drawn { lit, .. } = draw(&mut Renderer::new(gpu()), &mut world, Shading::Phong);
    assert_eq!(bright(&lit), lit.len());
    // A bulb that does not glow hides the light.
    world.entity_mut(glowing).insert(Material::matt(Vec3::ONE));
    let Drawn { lit, .. } = draw(&mut Renderer::new(gpu()), &mut world, Shading::Phong);
    assert!(bright(&lit) < lit.len() / 10, "{}", bright(&lit));
}
