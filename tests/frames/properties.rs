//! Properties of frames with any materials and lights: the three shadings agree where they must, light adds up, and
//! lights may be in any order and number, switched off, moved and carried.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{Light, LightKind, Material, ReflectionModel, Shading, SpotCone, Surface};
use lumbre_render::FrameOptions;
use lumbre_scene::{Camera, ChildOf, Mesh, SceneSettings, Transform};
use lumbre_tests::compare::compare;
use lumbre_tests::scenes::{ball_of, every_light};
use lumbre_tests::twin::{self, TwinOptions};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use crate::adapter::{Canvas, draw, linear};

const SIZE: u32 = 32;
/// Half of f32's step at 1.
const ROUNDING: f64 = 5.960_464_5e-8;

/// Never entirely black, so that everything that adds to a frame is visible.
fn color() -> impl Strategy<Value = Vec3> {
    [0.05..1.0f32, 0.05..1.0f32, 0.05..1.0f32].prop_map(Vec3::from)
}

fn surface() -> impl Strategy<Value = Surface> {
    (color(), color(), color(), color(), 1.0..100.0f32).prop_map(
        |(ambient, diffuse, specular, emission, shininess)| Surface {
            ambient,
            diffuse,
            specular,
            emission: emission * 0.1,
            shininess,
        },
    )
}

fn model() -> impl Strategy<Value = ReflectionModel> {
    prop::sample::select(ReflectionModel::ALL.to_vec())
}

/// A position on the viewer's side, two to four metres from the origin.
fn place() -> impl Strategy<Value = DVec3> {
    ([-1.0..1.0f64, -1.0..1.0f64, 0.2..1.0f64], 2.0..4.0f64)
        .prop_map(|(direction, distance)| DVec3::from(direction).normalize() * distance)
}

/// Any kind of light, aimed at the origin.
fn light() -> impl Strategy<Value = (Light, DVec3)> {
    (0..every_light().len(), color(), color(), color(), place()).prop_map(
        |(kind, ambient, diffuse, specular, place)| {
            let (_, light) = every_light().swap_remove(kind);
            let bright = light.diffuse.max_element().max(light.ambient.max_element());
            let dark = light.diffuse == Vec3::ZERO;
            let of = |color: Vec3| if dark { Vec3::ZERO } else { color * bright };
            (Light { ambient: ambient * 0.1, diffuse: of(diffuse), specular: of(specular), ..light }, place)
        },
    )
}

fn add_light(world: &mut World, (light, place): &(Light, DVec3)) -> Entity {
    let place = Transform::from_translation(*place).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((light.clone(), place)).id()
}

/// A ball with a material under these lights.
fn ball(surface: Surface, model: ReflectionModel, lights: &[(Light, DVec3)]) -> World {
    let mut world = ball_of(shapes::uv_sphere(1.0, 16, 8), Light::ambient(Vec3::ZERO));
    let only = world.query_filtered::<Entity, With<Light>>().single(&world).unwrap();
    world.despawn(only);
    for mut material in world.query::<&mut Material>().iter_mut(&mut world) {
        material.front = surface;
    }
    world.resource_mut::<SceneSettings>().reflection = model;
    for light in lights {
        add_light(&mut world, light);
    }
    world
}

/// A plane that fills the frame, tilted about two axes, seen by a viewer infinitely far away.
fn plane(surface: Surface, model: ReflectionModel, tilt: [f64; 2], lights: &[(Light, DVec3)]) -> World {
    let mut world = World::new();
    let turn =
        DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2 + tilt[0]) * DQuat::from_rotation_z(tilt[1]);
    let plane = Mesh(Arc::new(shapes::plane(12.0, 12.0, 7, 5)));
    world.spawn((plane, Material { front: surface, ..Material::default() }, Transform::from_rotation(turn)));
    for light in lights {
        add_light(&mut world, light);
    }
    world.spawn((Camera::default(), Transform::from_xyz(0.0, 0.0, 4.0)));
    world.insert_resource(SceneSettings {
        local_viewer: false,
        reflection: model,
        ambient: Vec3::splat(0.2),
        ..SceneSettings::default()
    });
    world
}

fn frame(world: &mut World) -> Vec<DVec3> {
    draw(world, SIZE, SIZE, &linear()).0
}

fn largest(pixels: &[DVec3]) -> f64 {
    pixels.iter().map(|pixel| pixel.max_element()).fold(0.0, f64::max)
}

/// Returns the largest difference of any channel.
fn apart(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f64::max)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, rng_seed: RngSeed::Fixed(5), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn flat_gouraud_and_phong_are_one_on_a_plane_under_a_distant_light_and_viewer(
        surface in surface(),
        model in model(),
        lights in prop::collection::vec((color(), place()), 1..4),
        tilt in [-0.45..0.45f64, -0.45..0.45f64],
    ) {
        let lights: Vec<(Light, DVec3)> = lights
            .into_iter()
            .map(|(color, place)| (Light { ambient: color * 0.1, ..Light::directional(color) }, place))
            .collect();
        let mut world = plane(surface, model, tilt, &lights);
        let mut canvas = Canvas::new(SIZE, SIZE);
        let [flat, gouraud, phong] = [Shading::Flat, Shading::Gouraud, Shading::Phong]
            .map(|shading| canvas.draw(&mut world, &FrameOptions { shading: Some(shading), ..linear() }).0);
        let size = largest(&phong);
        prop_assert!(size > 0.0 && flat.iter().all(|pixel| pixel.max_element() > 0.0), "the plane fills the frame");
        // The same normal computed in three ways: from the vertices, interpolated, and from the corners. Their
        // roundings of some 2^-23 affect the cosine of the lobe, whose power multiplies them by n; interpolating
        // equal numbers adds a few more roundings.
        let bound = (4.0 * f64::from(surface.shininess) + 16.0) * ROUNDING * size * 4.0;
        prop_assert!(apart(&gouraud, &phong) < bound, "Gouraud and Phong: {} > {bound}", apart(&gouraud, &phong));
        prop_assert!(apart(&flat, &phong) < bound, "flat and Phong: {} > {bound}", apart(&flat, &phong));
        // A flat plane under distant light has one colour.
        let first = flat[0];
        prop_assert!(apart(&flat, &vec![first; flat.len()]) < bound);
    }

    #[test]
    fn a_frame_is_linear_in_the_colour_of_each_light(
        surface in surface(),
        model in model(),
        lights in prop::collection::vec(light(), 2..5),
        which in 0..2usize,
        factor in 0.1..8.0f32,
    ) {
        let with = |factor: f32| {
            let mut lights = lights.clone();
            let light = &mut lights[which].0;
            light.ambient *= factor;
            light.diffuse *= factor;
            light.specular *= factor;
            frame(&mut ball(surface, model, &lights))
        };
        let (none, one, more) = (with(0.0), with(1.0), with(factor));
        let expected: Vec<DVec3> =
            none.iter().zip(&one).map(|(none, one)| *none + (*one - *none) * f64::from(factor)).collect();
        // Each of the three frames is a rounded sum of a dozen terms; the first two are multiplied by the factor.
        let size = largest(&more).max(largest(&one));
        let bound = 12.0 * ROUNDING * size * (2.0 + f64::from(factor));
        prop_assert!(apart(&more, &expected) < bound, "{} > {bound}", apart(&more, &expected));
        // All light together times a power of two is exact.
        let mut twice = lights.clone();
        for (light, _) in &mut twice {
            light.ambient *= 2.0;
            light.diffuse *= 2.0;
            light.specular *= 2.0;
        }
        let mut doubled = ball(Surface { emission: surface.emission * 2.0, ..surface }, model, &twice);
        doubled.resource_mut::<SceneSettings>().ambient *= 2.0;
        let doubled = frame(&mut doubled);
        prop_assert!(doubled.iter().zip(&one).all(|(doubled, one)| *doubled == *one * 2.0));
    }

    #[test]
    fn lights_add_up_in_any_order(
        surface in surface(),
        model in model(),
        lights in prop::collection::vec(light(), 2..7),
        turn in 1..6usize,
    ) {
        let together = frame(&mut ball(surface, model, &lights));
        let mut order = lights.clone();
        order.reverse();
        order.rotate_left(turn % lights.len());
        let other = frame(&mut ball(surface, model, &order));
        // A sum of the same terms, rounded in another order.
        let size = largest(&together);
        let bound = (2.0 * lights.len() as f64 + 2.0) * ROUNDING * size;
        prop_assert!(apart(&together, &other) <= bound, "{} > {bound}", apart(&together, &other));
        // Also for the sum of the lights one by one, each minus the frame without any.
        let none = frame(&mut ball(surface, model, &[]));
        let mut sum = none.clone();
        for light in &lights {
            let alone = frame(&mut ball(surface, model, std::slice::from_ref(light)));
            for ((sum, alone), none) in sum.iter_mut().zip(&alone).zip(&none) {
                *sum += *alone - *none;
            }
        }
        prop_assert!(apart(&together, &sum) <= 2.0 * bound, "{} > {}", apart(&together, &sum), 2.0 * bound);
        // Negative control: without one of them.
        let fewer = frame(&mut ball(surface, model, &lights[1..]));
        prop_assert!(fewer != together);
    }

    #[test]
    fn a_light_switched_off_is_a_light_that_is_not_there(
        surface in surface(),
        model in model(),
        lights in prop::collection::vec(light(), 1..6),
        off in 0..6usize,
    ) {
        let off = off % lights.len();
        let mut switched = lights.clone();
        switched[off].0.enabled = false;
        let mut absent = lights.clone();
        absent.remove(off);
        let absent = frame(&mut ball(surface, model, &absent));
        prop_assert!(frame(&mut ball(surface, model, &switched)) == absent);
        // Switched on again in the same world.
        let mut world = ball(surface, model, &switched);
        let mut canvas = Canvas::new(SIZE, SIZE);
        prop_assert!(canvas.draw(&mut world, &linear()).0 == absent);
        for mut light in world.query::<&mut Light>().iter_mut(&mut world) {
            light.enabled = true;
        }
        let on = canvas.draw(&mut world, &linear()).0;
        prop_assert!(on == frame(&mut ball(surface, model, &lights)) && on != absent);
    }
}

#[test]
fn the_shadings_differ_on_a_plane_under_a_near_light_or_a_near_viewer() {
    // Negative control of the property above.
    let surface = Surface { specular: Vec3::splat(0.5), shininess: 20.0, ..Surface::default() };
    let shaded = |world: &mut World| {
        [Shading::Flat, Shading::Gouraud, Shading::Phong]
            .map(|shading| draw(world, SIZE, SIZE, &FrameOptions { shading: Some(shading), ..linear() }).0)
    };
    let above = DVec3::new(0.3, 0.2, 2.0);
    let near_light = plane(surface, ReflectionModel::Phong, [0.0; 2], &[(Light::point(Vec3::ONE), above)]);
    let mut near_viewer =
        plane(surface, ReflectionModel::Phong, [0.0; 2], &[(Light::directional(Vec3::ONE), above)]);
    near_viewer.resource_mut::<SceneSettings>().local_viewer = true;
    for mut world in [near_light, near_viewer] {
        let [flat, gouraud, phong] = shaded(&mut world);
        assert!(apart(&gouraud, &phong) > 0.01 && apart(&flat, &phong) > 0.01);
    }
}

#[test]
fn gouraud_becomes_phong_at_order_two_when_the_sphere_is_subdivided() {
    // Linear interpolation of a smooth function is off by h^2 / 8 of its second derivative, so halving the edges
    // quarters the error. The light is near the viewer, so that the terminator, where the function has a kink, is
    // not part of the comparison.
    const WIDE: u32 = 192;
    let surface = Surface {
        ambient: Vec3::splat(0.1),
        diffuse: Vec3::splat(0.5),
        specular: Vec3::splat(0.5),
        emission: Vec3::ZERO,
        shininess: 8.0,
    };
    let mut before: Option<[f64; 2]> = None;
    let mut canvas = Canvas::new(WIDE, WIDE);
    let mut last = [0.0; 2];
    println!("depth triangles     largest  order     rms     order");
    for depth in 2..8 {
        let mut world = ball(surface, ReflectionModel::Phong, &[]);
        let mesh = shapes::tetrahedral_sphere(1.0, depth, false);
        let triangles = mesh.triangle_count();
        for mut of_ball in world.query::<&mut Mesh>().iter_mut(&mut world) {
            *of_ball = Mesh(Arc::new(mesh.clone()));
        }
        for mut place in world.query_filtered::<&mut Transform, With<Mesh>>().iter_mut(&mut world) {
            // Rotated so that neither a vertex nor an edge of the first tetrahedron faces the camera.
            place.rotation = DQuat::from_rotation_y(0.4) * DQuat::from_rotation_x(0.9);
        }
        add_light(&mut world, &(Light::directional(Vec3::ONE), DVec3::new(0.2, 0.4, 3.0)));
        let [gouraud, phong] = [Shading::Gouraud, Shading::Phong]
            .map(|shading| canvas.draw(&mut world, &FrameOptions { shading: Some(shading), ..linear() }).0);
        // The middle of the ball, within 0.8 of its radius: 3.6 m away, seen at an angle of 0.9 across the frame.
        let radius = 0.8 / 3.6 / (0.45f64).tan() * 0.5 * f64::from(WIDE);
        let inside = |index: &usize| {
            let offset = |i: usize| i as f64 + 0.5 - 0.5 * f64::from(WIDE);
            offset(index % WIDE as usize).hypot(offset(index / WIDE as usize)) < radius
        };
        let errors: Vec<f64> = (0..phong.len())
            .filter(inside)
            .map(|index| (gouraud[index] - phong[index]).abs().max_element())
            .collect();
        let mean = (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt();
        let now = [errors.iter().copied().fold(0.0, f64::max), mean];
        let order = before.map_or([f64::NAN; 2], |before| [0, 1].map(|i| (before[i] / now[i]).log2()));
        println!(
            "{depth:5} {triangles:9} {:11.3e} {:6.2} {:9.3e} {:6.2}",
            now[0], order[0], now[1], order[1]
        );
        assert!(errors.len() > 5000, "{} pixels are too few", errors.len());
        (before, last) = (Some(now), order);
    }
    // The order in the limit; the largest error moves from triangle to triangle and needs more tolerance.
    assert!((last[1] - 2.0).abs() < 0.15, "order of the mean: {}", last[1]);
    assert!((last[0] - 2.0).abs() < 0.5, "order of the largest: {}", last[0]);
}

#[test]
fn any_number_of_lights() {
    // OpenGL has eight lights; one more and many more must work equally. The reference is the twin, which has no
    // lists of lights.
    let surface = Surface { specular: Vec3::splat(0.4), shininess: 30.0, ..Surface::default() };
    let kinds = every_light();
    for count in [0usize, 1, 8, 9, 64] {
        let lights: Vec<(Light, DVec3)> = (0..count)
            .map(|number| {
                let turn = number as f64 * 2.399_963; // The golden angle distributes them.
                let place = DVec3::new(2.5 * turn.cos(), 2.5 * turn.sin(), 1.0 + (number % 5) as f64 * 0.5);
                let (_, mut light) = kinds[number % kinds.len()].clone();
                let share = Vec3::new(0.5 + 0.5 * turn.cos() as f32, 0.5, 0.5 + 0.5 * turn.sin() as f32)
                    / count as f32;
                light.ambient *= share;
                light.diffuse *= share;
                light.specular *= share;
                (light, place)
            })
            .collect();
        let mut world = ball(surface, ReflectionModel::Phong, &lights);
        let expected = twin::draw(&mut world, 96, 96, TwinOptions::default()).inside_surfaces(false);
        let (got, report) = draw(&mut world, 96, 96, &linear());
        // Ambient lights are not in any list: they are one sum for the whole frame.
        let placed = lights.iter().filter(|(light, _)| light.kind != LightKind::Ambient).count();
        assert_eq!(report.statistics.lights as usize, placed);
        let difference = compare(&got.iter().copied().map(Some).collect::<Vec<_>>(), &expected);
        println!("{count:3} lights: {difference:?}");
        assert!(difference.pixels > 1000, "{difference:?}");
        // As in balls.rs, for lights that are together as bright as one.
        assert!(difference.largest < 1e-4, "{count} lights: {difference:?}");
        if count > 0 {
            // Negative control: the last one is seen.
            let fewer = ball(surface, ReflectionModel::Phong, &lights[..count - 1]);
            let (fewer, _) = draw(&mut { fewer }, 96, 96, &linear());
            assert!(apart(&fewer, &got) > 1e-4, "the last of {count} lights does nothing");
        }
    }
}

#[test]
fn a_light_carried_by_an_object_moves_with_it() {
    // A lamp on an arm of a moving body, compared with a free lamp at the same position.
    let surface = Surface { specular: Vec3::splat(0.4), shininess: 20.0, ..Surface::default() };
    let lamp = Light::spot(Vec3::splat(12.0), SpotCone::Exponent { cutoff: 0.5, exponent: 8.0 });
    let arm = Transform::from_xyz(0.3, 0.2, -0.1).with_rotation(DQuat::from_rotation_y(0.2));
    let mut world = ball(surface, ReflectionModel::Phong, &[]);
    let body = world.spawn(Transform::IDENTITY).id();
    let carried = world.spawn((lamp.clone(), arm, ChildOf(body))).id();
    let mut canvas = Canvas::new(64, 64);
    let mut frames: Vec<Vec<DVec3>> = Vec::new();
    for step in 0..5 {
        let turn = 0.5 * f64::from(step) - 1.0;
        let place = DVec3::new(3.0 * turn.sin(), 0.5 * turn, 3.0 * turn.cos());
        let place = Transform::from_translation(place).looking_at(DVec3::ZERO, DVec3::Y);
        *world.get_mut::<Transform>(body).unwrap() = place;
        let (moved, report) = canvas.draw(&mut world, &linear());
        assert_eq!(report.statistics.lights, 1);
        let (alone, plain) = Transform::from_affine(place.affine() * arm.affine());
        assert!(plain);
        let mut free = ball(surface, ReflectionModel::Phong, &[]);
        free.spawn((lamp.clone(), alone));
        let (expected, _) = draw(&mut free, 64, 64, &linear());
        // The position is a product in f64 in both cases, in another order: some rounding to f32 may differ.
        assert!(apart(&moved, &expected) < 1e-5, "step {step}: {}", apart(&moved, &expected));
        assert!(largest(&moved) > 0.3, "step {step}: the lamp shines on the ball");
        assert!(frames.iter().all(|before| apart(before, &moved) > 0.05), "step {step}: it moved");
        frames.push(moved);
    }
    // Without its parent it stays where it is in its own coordinates: near the origin, inside the ball.
    world.entity_mut(carried).remove::<ChildOf>();
    let (dropped, _) = canvas.draw(&mut world, &linear());
    assert!(apart(&dropped, &frames[4]) > 0.05);
    // It is despawned with the body that carries it.
    world.entity_mut(carried).insert(ChildOf(body));
    world.despawn(body);
    let (dark, report) = canvas.draw(&mut world, &linear());
    assert_eq!(report.statistics.lights, 0);
    assert!(dark == draw(&mut ball(surface, ReflectionModel::Phong, &[]), 64, 64, &linear()).0);
}
