//! Frames whose lights are found by clusters or by lists per object, compared with brute force over all lights: the
//! same up to rounding, for any lights, view and frame size.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{
    AlphaMode, Attenuation, BakeMode, Light, Material, ReflectionModel, Shading, SpotCone, Surface,
};
use lumbre_render::{FrameOptions, FrameReport, LightLists, Measure, PassLights, RenderingPath};
use lumbre_scene::{Camera, Mesh, Projection, SceneSettings, Transform};

use crate::adapter::{draw, linear};

/// The largest accepted difference of a pixel, relative to its brightest channel plus a hundredth: the sums are in
/// another order, and the inverse square is computed from 1/range² and the squared distance instead of their roots.
/// A step of a display is 4e-3.
const ROUNDING: f64 = 2e-5;

struct Random(u64);

impl Random {
    fn within(&mut self, least: f64, most: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        least + (most - least) * ((self.0 >> 11) as f64 / (1_u64 << 53) as f64)
    }

    fn place(&mut self, half: f64) -> DVec3 {
        DVec3::from([0; 3].map(|_| self.within(-half, half)))
    }

    fn color(&mut self) -> Vec3 {
        Vec3::from([0; 3].map(|_| self.within(0.1, 1.0) as f32))
    }
}

/// A floor and balls between which lights are placed, and a camera.
fn room(random: &mut Random, projection: Projection, eye: DVec3) -> World {
    let mut world = World::new();
    let material = |random: &mut Random| {
        let front = Surface {
            ambient: Vec3::splat(0.3),
            diffuse: random.color(),
            specular: random.color(),
            emission: Vec3::ZERO,
            shininess: random.within(1.0, 200.0) as f32,
        };
        Material { front, ..Material::default() }
    };
    let floor = Arc::new(shapes::plane(24.0, 24.0, 3, 3));
    world.spawn((Mesh(floor), material(random), Transform::from_xyz(0.0, -1.0, 0.0)));
    let ball = Arc::new(shapes::uv_sphere(1.0, 24, 12));
    for _ in 0..12 {
        let at = random.place(6.0) * DVec3::new(1.0, 0.2, 1.0);
        world.spawn((Mesh(ball.clone()), material(random), Transform::from_translation(at)));
    }
    let place = Transform::from_translation(eye).looking_at(DVec3::new(0.3, 0.1, -0.2), DVec3::Y);
    world.spawn((Camera { projection, exposure: 1.0 }, place));
    world
}

/// Adds a light of any kind: point lights and spotlights of every form, with ranges from a centimetre to a
/// kilometre and without one, black, static, in front of the camera, around it and behind it.
fn any_light(random: &mut Random, world: &mut World) {
    let color = random.color() * 0.5;
    let range = match random.within(0.0, 12.0) as u32 {
        0 => f32::INFINITY,
        1 => 1e3,
        2 => 0.01,
        3 => 30.0,
        _ => random.within(0.3, 4.0) as f32,
    };
    let attenuation = match random.within(0.0, 5.0) as u32 {
        0 => Attenuation { range, constant: 0.5, linear: 0.2, quadratic: 0.1, clamp: false },
        1 => Attenuation { range, clamp: true, ..Attenuation::INVERSE_SQUARE },
        2 => Attenuation { range, constant: 1.0, linear: 0.0, quadratic: 1.2, clamp: false },
        _ => Attenuation { range, ..Attenuation::INVERSE_SQUARE },
    };
    let cone = match random.within(0.0, 5.0) as u32 {
        0 => Some(SpotCone::Exponent {
            cutoff: random.within(0.05, 1.57) as f32,
            exponent: random.within(0.0, 20.0) as f32,
        }),
        1 => Some(SpotCone::Smooth { inner: 0.1, outer: random.within(0.15, 1.5) as f32 }),
        _ => None,
    };
    let ambient = if random.within(0.0, 1.0) < 0.1 { color * 0.1 } else { Vec3::ZERO };
    let specular = if random.within(0.0, 1.0) < 0.1 { random.color() } else { color };
    let bake = if random.within(0.0, 1.0) < 0.3 { BakeMode::Static } else { BakeMode::Dynamic };
    let place = random.place(14.0) * DVec3::new(1.0, 0.2, 1.0) + DVec3::Y * 0.5;
    let aim = place + random.place(1.0);
    let shadow = random.within(0.0, 1.0) < 0.05;
    let light = Light { ambient, specular, attenuation, spot: cone, bake, shadow, ..Light::point(color) };
    world.spawn((light, Transform::from_translation(place).looking_at(aim, DVec3::Y)));
}

fn by(lists: LightLists) -> FrameOptions {
    // Forward shading rounds as brute force does; rendering_paths.rs tests the other path.
    let rendering_path = RenderingPath::Forward;
    FrameOptions { light_lists: lists, rendering_path, shading: Some(Shading::Phong), ..linear() }
}

/// Returns the largest difference of two frames, for each pixel relative to its brightest channel plus a hundredth.
fn apart(expected: &[DVec3], got: &[DVec3]) -> f64 {
    assert!(expected.iter().any(|pixel| pixel.max_element() > 0.01), "the frame is black");
    let of = |(a, b): (&DVec3, &DVec3)| (*a - *b).abs().max_element() / (a.max_element() + 0.01);
    expected.iter().zip(got).map(of).fold(0.0, f64::max)
}

/// Returns the difference from brute force, and the report of the frame with lists.
fn difference(world: &mut World, size: (u32, u32), lists: LightLists) -> (f64, FrameReport) {
    let (expected, _) = draw(world, size.0, size.1, &by(LightLists::Everything));
    let (got, report) = draw(world, size.0, size.1, &by(lists));
    (apart(&expected, &got), report)
}

fn perspective(degrees: f64, near: f64) -> Projection {
    Projection::Perspective { vertical_fov: degrees.to_radians(), aspect: None, near, far: None }
}

#[test]
fn clusters_and_objects_agree_with_brute_force() {
    // Odd sizes, one tile, one column, one row; cameras among the lights, far away, and orthographic, mirrored too.
    let upright =
        |half_width: f64| Projection::Orthographic { half_width, half_height: 5.0, near: 0.5, far: 40.0 };
    let views = [
        (perspective(50.0, 0.1), DVec3::new(0.0, 4.0, 13.0), (97, 61), 300),
        (perspective(100.0, 1e-3), DVec3::new(1.0, 0.5, 1.5), (131, 33), 500),
        (perspective(1.0, 1.0), DVec3::new(300.0, 200.0, 300.0), (64, 64), 200),
        (perspective(160.0, 0.05), DVec3::new(-2.0, 3.0, 0.0), (31, 257), 200),
        (perspective(60.0, 0.1), DVec3::new(0.0, 9.0, 0.1), (1, 100), 100),
        (upright(7.0), DVec3::new(5.0, 8.0, 12.0), (99, 65), 300),
        (upright(-7.0), DVec3::new(5.0, 8.0, 12.0), (99, 65), 300),
    ];
    for (number, (projection, eye, size, lights)) in views.into_iter().enumerate() {
        let mut random = Random(number as u64 + 1);
        let mut world = room(&mut random, projection, eye);
        (0..lights).for_each(|_| any_light(&mut random, &mut world));
        let (clusters, report) = difference(&mut world, size, LightLists::Clusters);
        let listing = report.statistics.light_lists;
        let (objects, _) = difference(&mut world, size, LightLists::Objects);
        println!("view {number}: clusters {clusters:.1e}, objects {objects:.1e}, {:?}", listing.clusters);
        assert!(listing.clustered && listing.entries > 0, "{listing:?}");
        assert!(clusters < ROUNDING, "view {number}: clusters are {clusters} off");
        assert!(objects < ROUNDING, "view {number}: objects are {objects} off");
    }
}

#[test]
fn a_light_that_no_list_has_is_seen() {
    // Negative control: without one of its lights the same scene differs by far more than rounding, if the light
    // reaches anything visible, which most of them do not.
    let scene = || {
        let mut random = Random(3);
        let mut world = room(&mut random, perspective(50.0, 0.1), DVec3::new(0.0, 4.0, 13.0));
        (0..200).for_each(|_| any_light(&mut random, &mut world));
        world
    };
    let (expected, _) = draw(&mut scene(), 97, 61, &by(LightLists::Everything));
    let mut world = scene();
    let all: Vec<Entity> = world.query_filtered::<Entity, With<Light>>().iter(&world).collect();
    let mut seen = 0;
    for lost in all.iter().step_by(8) {
        let mut light = world.get_mut::<Light>(*lost).unwrap();
        light.enabled = false;
        let (got, _) = draw(&mut world, 97, 61, &by(LightLists::Clusters));
        world.get_mut::<Light>(*lost).unwrap().enabled = true;
        seen += usize::from(apart(&expected, &got) > 10.0 * ROUNDING);
    }
    println!("of 25 lights {seen} are missed");
    assert!(seen >= 8, "of 25 lights that were left out only {seen} are missed");
}

#[test]
fn lights_on_the_borders_of_tiles_and_slices() {
    // Ranges that end exactly on the planes between tiles, and lights in the camera's plane: at every border of a
    // frame of three by two tiles.
    let mut random = Random(9);
    let mut world = room(&mut random, perspective(60.0, 0.1), DVec3::new(0.0, 0.0, 8.0));
    let half_height = 30.0_f64.to_radians().tan();
    for column in 0..=3 {
        for row in 0..=2 {
            let [x, y] = [f64::from(column) / 1.5 - 1.0, 1.0 - f64::from(row)];
            for depth in [0.0, 0.5, 4.0, 7.0, 8.0, 9.5] {
                let at = DVec3::new(x * half_height * 1.5 * depth, y * half_height * depth, 8.0 - depth);
                for range in [0.25_f32, 1.0] {
                    let attenuation = Attenuation { range, ..Attenuation::INVERSE_SQUARE };
                    let aside = DVec3::X * f64::from(range);
                    for place in [at, at + aside, at - aside] {
                        let light = Light { attenuation, ..Light::point(random.color() * 0.2) };
                        world.spawn((light, Transform::from_translation(place)));
                    }
                }
            }
        }
    }
    let (apart, report) = difference(&mut world, (96, 64), LightLists::Clusters);
    println!("borders: {apart:.1e}, {:?}", report.statistics.light_lists);
    assert!(apart < ROUNDING, "{apart}");
}

#[test]
fn a_hundred_thousand_lights() {
    // More lights than 16 bits can number, of which each pixel has a few. The reference is the sum over objects'
    // lists, which another test compares with brute force, as brute force would take an hour here.
    let mut random = Random(11);
    let mut world = room(&mut random, perspective(60.0, 0.1), DVec3::new(0.0, 3.0, 9.0));
    for _ in 0..100_000 {
        let place = random.place(12.0) * DVec3::new(1.0, 0.1, 1.0);
        let attenuation = Attenuation { range: 0.2, ..Attenuation::INVERSE_SQUARE };
        let light = Light { attenuation, ..Light::point(random.color() * 1e-3) };
        world.spawn((light, Transform::from_translation(place)));
    }
    let (expected, _) = draw(&mut world, 40, 30, &by(LightLists::Objects));
    let (got, report) = draw(&mut world, 40, 30, &by(LightLists::Auto));
    let listing = report.statistics.light_lists;
    assert!(listing.clustered && listing.other_ranged_lights > 30_000, "{listing:?}");
    let apart = apart(&expected, &got);
    println!("a hundred thousand: {apart:.1e}, {listing:?}");
    assert!(apart < ROUNDING, "{apart}");
}

#[test]
fn few_lights_keep_the_simple_path_and_gouraud_its_own() {
    let mut random = Random(5);
    let mut world = room(&mut random, perspective(50.0, 0.1), DVec3::new(0.0, 4.0, 13.0));
    world.insert_resource(SceneSettings { reflection: ReflectionModel::Blinn, ..SceneSettings::default() });
    let ranged = Attenuation { range: 3.0, ..Attenuation::INVERSE_SQUARE };
    let mut add = |world: &mut World| {
        let light = Light { attenuation: ranged, ..Light::point(random.color()) };
        world.spawn((light, Transform::from_translation(random.place(4.0))));
    };
    add(&mut world);
    let clustered = |world: &mut World, shading| {
        let options = FrameOptions { shading: Some(shading), ..linear() };
        draw(world, 40, 30, &options).1.statistics.light_lists.clustered
    };
    assert!(!clustered(&mut world, Shading::Phong), "one light is listed by objects");
    (0..40).for_each(|_| add(&mut world));
    assert!(clustered(&mut world, Shading::Phong));
    assert!(!clustered(&mut world, Shading::Gouraud), "a vertex is in no cluster");
    let (apart, _) = difference(&mut world, (40, 30), LightLists::Auto);
    assert!(apart < ROUNDING, "{apart}");
}

#[test]
fn explain_says_how_lights_are_found_and_why() {
    let mut random = Random(7);
    let mut world = room(&mut random, perspective(50.0, 0.1), DVec3::new(0.0, 4.0, 13.0));
    let told = |world: &mut World, options: &FrameOptions| {
        lumbre_scene::update_transforms(world);
        lumbre_render::explain(world, options, 40, 30).unwrap().light_lists
    };
    let phong = by(LightLists::Auto);
    assert_eq!(told(&mut world, &phong), ["none: the scene has no lights but ambient ones"]);
    let ranged = Attenuation { range: 3.0, ..Attenuation::INVERSE_SQUARE };
    let lamp = Light { attenuation: ranged, ..Light::point(Vec3::ONE) };
    world.spawn((lamp.clone(), Transform::IDENTITY));
    world.spawn((Light::directional(Vec3::ONE), Transform::IDENTITY));
    assert_eq!(told(&mut world, &phong), ["objects: 2 lights, 1 with a range: fewer than 3"]);
    world.spawn_batch((0..10).map(|_| (lamp.clone(), Transform::IDENTITY)));
    let lines = told(&mut world, &phong);
    assert!(lines[0].starts_with("clusters: 11 lights with a range"), "{lines:?}");
    assert!(lines[0].contains("11 inverse-square") && lines[0].contains("13 objects"), "{lines:?}");
    assert!(lines[1].starts_with("objects: 1 lights without a range"), "{lines:?}");
    let gouraud = FrameOptions { shading: Some(Shading::Gouraud), ..phong.clone() };
    assert_eq!(told(&mut world, &gouraud), ["objects: 12 lights: no object is under Phong shading"]);
    // The frame is drawn as explained.
    let (_, report) = draw(&mut world, 40, 30, &phong);
    let listing = report.statistics.light_lists;
    assert_eq!((listing.clustered, listing.inverse_square_lights, listing.unbounded_lights), (true, 11, 1));
    assert!(report.statistics.cpu.total_ms > 0.0);
}

#[test]
fn lamps_with_a_range_that_reach_nothing_in_view_lend_no_light_of_others() {
    let projection = Projection::Perspective {
        vertical_fov: std::f64::consts::FRAC_PI_4,
        aspect: None,
        near: 0.1,
        far: None,
    };
    let mut world = room(&mut Random(5), projection, DVec3::new(0.0, 4.0, 9.0));
    // The first light has no range; those with one are behind the camera.
    world.spawn((
        Light::directional(Vec3::ONE),
        Transform::from_xyz(0.0, 5.0, 1.0).looking_at(DVec3::ZERO, DVec3::Y),
    ));
    for x in [-2.0, 0.0, 2.0] {
        let lamp = Light::spot(Vec3::splat(5.0), SpotCone::Smooth { inner: 0.3, outer: 0.8 }).with_range(3.0);
        world.spawn((lamp, Transform::from_xyz(x, 4.0, 40.0)));
    }
    let [clusters, everything] = [LightLists::Clusters, LightLists::Everything].map(|light_lists| {
        let options = FrameOptions { light_lists, shading: Some(Shading::Phong), ..linear() };
        draw(&mut world, 48, 32, &options)
    });
    assert!(clusters.1.statistics.light_lists.clustered && clusters.1.statistics.light_lists.entries == 0);
    for (clustered, all) in clusters.0.iter().zip(&everything.0) {
        assert!((*clustered - *all).abs().max_element() <= ROUNDING * all.max_element().max(0.01));
    }
}

#[test]
fn each_pass_counts_its_own_lights() {
    let mut random = Random(23);
    let mut world = World::new();
    let ball = shapes::uv_sphere(0.4, 8, 4);
    let glass = Material { alpha: 0.5, alpha_mode: AlphaMode::Blend, ..Material::matt(Vec3::ONE) };
    let mut balls = [Vec::new(), Vec::new()];
    for number in 0..24 {
        let place = random.place(5.0);
        let material = if number % 3 == 0 { glass.clone() } else { Material::matt(Vec3::ONE) };
        balls[usize::from(number % 3 == 0)].push(place);
        world.spawn((Mesh::from(ball.clone()), material, Transform::from_translation(place)));
    }
    let mut lamps = Vec::new();
    for _ in 0..40 {
        let (place, range) = (random.place(7.0), random.within(0.5, 4.0) as f32);
        let lamp = Light::point(Vec3::ONE).with_range(range);
        world.spawn((lamp, Transform::from_translation(place)));
        lamps.push((place, f64::from(range)));
    }
    world.spawn((
        Camera { projection: Projection::orthographic(20.0, 20.0, 80.0), exposure: 1.0 },
        Transform::from_xyz(0.0, 0.0, 40.0),
    ));
    // By brute force: the lamps that reach the bounding box of a ball.
    let half_size = ball.positions.iter().fold(Vec3::ZERO, |half, at| half.max(at.abs())).as_dvec3();
    let reaching = |place: &DVec3| -> Vec<usize> {
        let reaches = |(lamp, range): &(DVec3, f64)| {
            ((*lamp - *place).abs() - half_size).max(DVec3::ZERO).length() < *range
        };
        (0..lamps.len()).filter(|lamp| reaches(&lamps[*lamp])).collect()
    };
    for lists in [LightLists::Objects, LightLists::Everything] {
        let options = FrameOptions { measure: Measure::Time, ..by(lists) };
        let (_, report) = draw(&mut world, 32, 32, &options);
        let passes = report.statistics.lit_passes;
        assert_eq!(passes.lightmap, PassLights::default());
        for (counted, balls) in [passes.forward, passes.transparent].iter().zip(&balls) {
            let lists: Vec<Vec<usize>> = match lists {
                LightLists::Everything => vec![(0..lamps.len()).collect(); balls.len()],
                _ => balls.iter().map(reaching).collect(),
            };
            let different: std::collections::BTreeSet<usize> = lists.iter().flatten().copied().collect();
            let mean = lists.iter().map(Vec::len).sum::<usize>() as f32 / balls.len() as f32;
            assert_eq!((counted.objects, counted.lights as usize), (balls.len(), different.len()));
            assert!((counted.lights_per_object - mean).abs() < 1e-4, "{counted:?}: {mean}");
        }
    }
}
