//! Decals: alpha-blended surfaces in the plane of another surface, against the closed form α I + (1 - α) I_below.

mod support;

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{AlphaMode, Light, Material, Surface};
use lumbre_scene::{EmissiveLight, Medium, Mesh, Quadric, QuadricShape, Transform};
use lumbre_trace::{Branch, Kind, Picture, TraceOptions};

use support::*;

const WALL: Vec3 = Vec3::new(0.8, 0.6, 0.1);
/// The decals' colours and opacities, the oldest first.
const DECALS: [(Vec3, f32); 3] =
    [(Vec3::new(0.9, 0.1, 0.2), 0.7), (Vec3::new(0.1, 0.9, 0.3), 0.25), (Vec3::new(0.2, 0.1, 0.9), 0.5)];

/// A surface that emits a colour, or reflects it.
fn painted(color: Vec3, emits: bool) -> Material {
    let (diffuse, emission) = if emits { (Vec3::ZERO, color) } else { (color, Vec3::ZERO) };
    let front = Surface { diffuse, ambient: Vec3::ZERO, emission, ..Surface::default() };
    Material { front, ..Material::default() }
}

fn decal((color, alpha): (Vec3, f32), emits: bool) -> Material {
    Material { alpha, alpha_mode: AlphaMode::Blend, ..painted(color, emits) }
}

/// The colour of the decals over each other and over what is below them.
fn mixed(decals: &[(Vec3, f32)], below: DVec3) -> DVec3 {
    decals.iter().fold(below, |below, (color, alpha)| below.lerp(color.as_dvec3(), f64::from(*alpha)))
}

/// A tilted, slightly enlarged place, whose corners f32 cannot represent exactly.
fn place() -> Transform {
    let turn = DQuat::from_rotation_z(0.7) * DQuat::from_rotation_x(0.4);
    Transform::from_xyz(0.1, 0.2, 0.3).with_rotation(turn).with_scale(DVec3::splat(1.1))
}

/// Returns a point of the tilted plane, in metres along its axes and above it.
fn at(x: f64, y: f64, z: f64) -> DVec3 {
    let place = place();
    place.translation + place.rotation * (1.1 * DVec3::new(x, y, z))
}

fn sheet(world: &mut World, side: f32, steps: u32, material: Material) -> Entity {
    world.spawn((Mesh(Arc::new(shapes::plane(side, side, steps, steps))), material, place())).id()
}

/// A wall of 4 m with decals in its plane, each in other triangles than the one below it.
fn wall(below: Material, decals: &[(Vec3, f32)], emits: bool) -> World {
    let mut world = World::new();
    sheet(&mut world, 4.0, 1, below);
    for (steps, own) in (3..).zip(decals) {
        sheet(&mut world, 2.0, steps, decal(*own, emits));
    }
    world
}

fn look(world: &mut World) {
    camera(world, at(0.3, 3.0, 0.4), at(0.05, 0.0, -0.1), 0.4);
}

fn assert_all(picture: &Picture, expected: DVec3, within: f64) {
    for (number, pixel) in picture.radiance.iter().enumerate() {
        assert!((*pixel - expected).abs().max_element() < within, "pixel {number}: {pixel} for {expected}");
    }
}

/// Asserts that the mean of a picture of paths is the expected one to within five of its standard errors, and
/// that this would find a difference of 1 %.
fn assert_mean(picture: &Picture, expected: DVec3) {
    let count = picture.radiance.len() as f64;
    let mean = picture.radiance.iter().sum::<DVec3>() / count;
    let variance: DVec3 = picture.radiance.iter().map(|pixel| (*pixel - mean).powf(2.0)).sum::<DVec3>();
    let sigma = (variance / (count * (count - 1.0))).map(f64::sqrt);
    let apart = (mean - expected).abs();
    assert!(apart.cmple(5.0 * sigma + 1e-12).all(), "{mean} for {expected}, sigma {sigma}");
    assert!((5.0 * sigma).max_element() < 0.02 * expected.max_element(), "the test sees nothing: {sigma}");
}

#[test]
fn decals_are_mixed_over_their_wall_in_the_order_of_their_age() {
    for count in 0..=DECALS.len() {
        let decals = &DECALS[..count];
        let expected = mixed(decals, WALL.as_dvec3());
        let mut world = wall(painted(WALL, true), decals, true);
        look(&mut world);
        let (picture, _) = draw(&mut world, &options(48));
        assert_all(&picture, expected, 1e-6);
        let (picture, _) = draw(&mut world, &paths(24, 64));
        assert_mean(&picture, expected);
        // Negative control: in the opposite order the colour is another one.
        let reversed: Vec<_> = decals.iter().rev().copied().collect();
        assert!(count < 2 || (mixed(&reversed, WALL.as_dvec3()) - expected).abs().max_element() > 0.05);
    }
}

#[test]
fn the_tree_prints_decals_with_their_weights() {
    let mut world = wall(painted(WALL, true), &DECALS[..2], true);
    look(&mut world);
    let tree = tree(&mut world, &options(8));
    let below = next(&tree, Kind::Behind).expect("what the upper decal covers");
    let lowest = next(below, Kind::Behind).expect("what the lower decal covers");
    let weight = |branch: &Branch| branch.weight.x;
    assert!((weight(below) - 0.75).abs() < 1e-7 && (weight(lowest) - 0.75 * 0.3).abs() < 1e-7);
    let points: Vec<_> = [&tree, below, lowest].map(|branch| branch.point.as_ref().expect("a hit")).into();
    assert!(points[1].distance == 0.0 && points[2].distance == 0.0, "they are in one plane");
    assert!(points.windows(2).all(|pair| pair[0].object != pair[1].object), "{points:?}");
    assert!(lowest.branches.is_empty(), "nothing is visible behind the wall");
}

#[test]
fn a_mirror_shows_decals() {
    // The mirror faces the wall; the eye between them looks into it.
    let mut world = wall(painted(WALL, true), &DECALS, true);
    let facing = place().with_rotation(place().rotation * DQuat::from_rotation_x(std::f64::consts::PI));
    let facing = Transform { translation: at(0.0, 4.0, 0.0), ..facing };
    world.spawn((Mesh(Arc::new(shapes::plane(4.0, 4.0, 1, 1))), mirror(0.5), facing));
    camera(&mut world, at(0.1, 1.0, 0.05), at(0.0, 4.0, 0.0), 0.1);
    let expected = 0.5 * mixed(&DECALS, WALL.as_dvec3());
    assert_all(&draw(&mut world, &options(24)).0, expected, 1e-6);
    assert_mean(&draw(&mut world, &paths(24, 128)).0, expected);
}

#[test]
fn decals_do_not_shadow_their_own_wall_nor_each_other() {
    let mut world = wall(painted(WALL, false), &DECALS, false);
    world.spawn((Light::point(Vec3::splat(4.0)), Transform::from_translation(at(0.5, 1.5, 0.2))));
    look(&mut world);
    let (lit, _) = draw(&mut world, &options(48));
    let (open, _) = draw(&mut world, &TraceOptions { shadows: false, ..options(48) });
    assert_eq!(lit.radiance, open.radiance);
    // The light is that of a plain wall of the mixed colour.
    let mut plain = wall(painted(Vec3::ONE, false), &[], false);
    plain.spawn((Light::point(Vec3::splat(4.0)), Transform::from_translation(at(0.5, 1.5, 0.2))));
    look(&mut plain);
    let (white, _) = draw(&mut plain, &options(48));
    let color = mixed(&DECALS, WALL.as_dvec3());
    for (lit, white) in lit.radiance.iter().zip(&white.radiance) {
        assert!((*lit - color * *white).abs().max_element() < 1e-6 * white.x, "{lit} for {}", color * *white);
    }
    let (scattered, _) = draw(&mut world, &TraceOptions { depth: Some(0), ..paths(24, 128) });
    let (whole, _) = draw(&mut plain, &TraceOptions { depth: Some(0), ..paths(24, 4) });
    let ratios = scattered.radiance.iter().zip(&whole.radiance).map(|(lit, white)| *lit / *white);
    assert_mean(&Picture { radiance: ratios.collect(), ..scattered.clone() }, color);
}

#[test]
fn decals_without_a_wall_cover_what_is_behind_and_shadow_it_all_together() {
    // Two panes in one plane hang before a wall that is lit through them.
    let mut world = wall(painted(WALL, true), &[], true);
    let hung = Transform { translation: at(0.0, 1.0, 0.0), ..place() };
    for own in &DECALS[..2] {
        world.spawn((Mesh(Arc::new(shapes::plane(2.0, 2.0, 2, 2))), decal(*own, true), hung));
    }
    look(&mut world);
    let expected = mixed(&DECALS[..2], WALL.as_dvec3());
    assert_all(&draw(&mut world, &options(32)).0, expected, 1e-6);
    assert_mean(&draw(&mut world, &paths(24, 64)).0, expected);

    let lit = |panes: &[(Vec3, f32)]| {
        let mut world = wall(painted(Vec3::ONE, false), &[], false);
        let steps = 1..;
        for (own, steps) in panes.iter().zip(steps) {
            world.spawn((Mesh(Arc::new(shapes::plane(0.5, 0.5, steps, steps))), decal(*own, false), hung));
        }
        world.spawn((Light::point(Vec3::ONE), Transform::from_translation(at(0.0, 1.2, 0.0))));
        // Past the panes, at what they shadow.
        camera(&mut world, at(1.5, 0.5, 0.0), at(0.0, 0.0, 0.0), 0.05);
        draw(&mut world, &options(16)).0
    };
    let (shadowed, open) = (lit(&DECALS), lit(&[]));
    let left: f64 = DECALS.iter().map(|(_, alpha)| 1.0 - f64::from(*alpha)).product();
    for (shadowed, open) in shadowed.radiance.iter().zip(&open.radiance) {
        assert!((shadowed.x / open.x / left - 1.0).abs() < 1e-6, "{} for {left}", shadowed.x / open.x);
    }
}

#[test]
fn a_label_on_glass_lies_over_its_face() {
    // A block of glass with k_t = 1/2 before a sky of 1, with labels in the plane of its upper face.
    let block = |labels: &[(Vec3, f32)]| {
        let mut world = World::new();
        let half = Material { transmission: Vec3::splat(0.5), ior: 1.5, ..black() };
        let below = Transform { translation: at(0.0, -0.25, 0.0), ..place() };
        world.spawn((Mesh(Arc::new(shapes::cuboid(Vec3::new(4.0, 0.5, 4.0), 1))), half, below));
        for (own, steps) in labels.iter().zip(1..) {
            sheet(&mut world, 2.0, steps, decal(*own, true));
        }
        furnace(&mut world, 1.0);
        look(&mut world);
        world
    };
    for count in 0..=DECALS.len() {
        let expected = mixed(&DECALS[..count], DVec3::splat(0.25));
        let mut world = block(&DECALS[..count]);
        assert_all(&draw(&mut world, &options(32)).0, expected, 1e-6);
        assert_mean(&draw(&mut world, &paths(24, 64)).0, expected);
    }
}

#[test]
fn decals_seen_from_behind_are_not_over_the_other_side() {
    // A wall that is visible from both sides, with a decal on its front alone.
    let both = Material { double_sided: true, ..painted(WALL, true) };
    let mut world = wall(both, &DECALS[..1], true);
    camera(&mut world, at(0.3, -3.0, 0.4), at(0.05, 0.0, -0.1), 0.4);
    let (picture, _) = draw(&mut world, &options(32));
    assert_all(&picture, picture.radiance[0], 1e-12);
    let mut bare = wall(Material { double_sided: true, ..painted(WALL, true) }, &[], true);
    camera(&mut bare, at(0.3, -3.0, 0.4), at(0.05, 0.0, -0.1), 0.4);
    assert_all(&draw(&mut bare, &options(32)).0, picture.radiance[0], 1e-12);
    // Negative control: a decal with two sides is visible through the wall, in a frame too.
    for mut material in world.query::<&mut Material>().iter_mut(&mut world) {
        material.double_sided = true;
    }
    let (through, _) = draw(&mut world, &options(32));
    assert_all(&through, mixed(&DECALS[..1], WALL.as_dvec3()), 1e-6);
}

/// What lies between a floor and a panel that lights it.
#[derive(Clone, Copy)]
enum Between {
    Nothing,
    /// A thin sheet that transmits half of the light.
    Sheet,
    /// A black pane with an alpha of one half.
    Pane,
}

/// Returns the light of a floor under a panel that emits 1, with decals in the panel's plane. Masked emitters are
/// not `sampled`, so that paths hit them by chance.
fn under_a_panel(decals: &[(Vec3, f32)], between: Between, sampled: bool) -> Picture {
    let mut world = World::new();
    let floor = Quadric::new(QuadricShape::Plane);
    exact(&mut world, floor, painted(Vec3::splat(0.5), false), Transform::IDENTITY);
    let down = DQuat::from_rotation_x(std::f64::consts::PI) * DQuat::from_rotation_y(0.3);
    let above = Transform::from_xyz(0.1, 0.7, 0.2).with_rotation(down);
    let alpha_mode = if sampled { AlphaMode::Opaque } else { AlphaMode::Mask { cutoff: 0.5 } };
    let panel = Material { alpha_mode, ..painted(Vec3::ONE, true) };
    world.spawn((Mesh(Arc::new(shapes::plane(1.0, 1.0, 1, 1))), panel, above));
    for (own, steps) in decals.iter().zip(3..) {
        world.spawn((Mesh(Arc::new(shapes::plane(2.0, 2.0, steps, steps))), decal(*own, true), above));
    }
    let half = Mesh(Arc::new(shapes::plane(20.0, 20.0, 1, 1)));
    let half_way = Transform { translation: DVec3::new(0.0, 0.35, 0.0), ..above };
    match between {
        Between::Nothing => {}
        Between::Sheet => {
            let thin = Medium { thin: true, ..Medium::default() };
            world.spawn((half, Material { transmission: Vec3::splat(0.5), ..black() }, thin, half_way));
        }
        Between::Pane => {
            let double_sided = true;
            let pane = Material { double_sided, ..decal((Vec3::ZERO, 0.5), false) };
            world.spawn((half, pane, half_way));
        }
    }
    camera(&mut world, DVec3::new(2.0, 0.3, 0.0), DVec3::new(0.1, 0.0, 0.2), 0.02);
    let depth = Some(1);
    draw(&mut world, &TraceOptions { depth, ..paths(24, if sampled { 256 } else { 2048 }) }).0
}

#[test]
fn an_emitter_under_a_decal_lights_others_by_what_is_left_uncovered() {
    // A black decal of alpha 0.75 covers a panel over a floor: the floor gets a quarter of its light, whether paths
    // find the panel by sampling it or by chance, and half of that through what halves it on the way.
    let mean = |picture: &Picture| picture.radiance.iter().sum::<DVec3>().x / picture.radiance.len() as f64;
    let whole = mean(&under_a_panel(&[], Between::Nothing, true));
    for sampled in [true, false] {
        for (between, left) in [(Between::Nothing, 0.25), (Between::Sheet, 0.125), (Between::Pane, 0.125)] {
            let picture = under_a_panel(&[(Vec3::ZERO, 0.75)], between, sampled);
            assert_mean(&picture, DVec3::splat(left * whole));
        }
    }
}

#[test]
fn emissive_decals_light_others_as_they_look() {
    // The light of the mixed colour; that of the panel alone is another one.
    let mean = |picture: &Picture| picture.radiance.iter().sum::<DVec3>().x / picture.radiance.len() as f64;
    let decals = [(Vec3::ZERO, 0.5), (Vec3::splat(0.5), 0.5)];
    let color = mixed(&decals, DVec3::ONE);
    assert_eq!(color, DVec3::splat(0.5));
    // The decals are wider than the panel, so that the light is that of a panel of their size.
    let wide = |decals: &[(Vec3, f32)]| {
        let mut world = World::new();
        let floor = Quadric::new(QuadricShape::Plane);
        exact(&mut world, floor, painted(Vec3::splat(0.5), false), Transform::IDENTITY);
        let down = DQuat::from_rotation_x(std::f64::consts::PI);
        let above = Transform::from_xyz(0.1, 0.7, 0.2).with_rotation(down);
        let panel = Mesh(Arc::new(shapes::plane(2.0, 2.0, 1, 1)));
        world.spawn((panel, painted(Vec3::ONE, true), above));
        for (own, steps) in decals.iter().zip(3..) {
            world.spawn((Mesh(Arc::new(shapes::plane(2.0, 2.0, steps, steps))), decal(*own, true), above));
        }
        camera(&mut world, DVec3::new(2.0, 0.3, 0.0), DVec3::new(0.1, 0.0, 0.2), 0.02);
        draw(&mut world, &TraceOptions { depth: Some(1), ..paths(24, 1024) }).0
    };
    let whole = mean(&wide(&[]));
    assert_mean(&wide(&decals), color * whole);
}

#[test]
fn glass_behind_an_opaque_surface_in_its_plane_lights_nothing() {
    // An emissive sheet of glass, and in its plane an opaque one, which is what is visible there.
    let light = |covered: bool, options: &TraceOptions| {
        let mut world = World::new();
        let floor = Quadric::new(QuadricShape::Plane);
        exact(&mut world, floor, painted(Vec3::splat(0.5), false), Transform::IDENTITY);
        let down = Transform::from_xyz(0.1, 0.7, 0.2).with_rotation(DQuat::from_rotation_x(3.1));
        let glowing = Material { transmission: Vec3::splat(0.5), ..painted(Vec3::ONE, true) };
        let thin = Medium { thin: true, ..Medium::default() };
        world.spawn((Mesh(Arc::new(shapes::plane(1.0, 1.0, 1, 1))), glowing, thin, down, EmissiveLight));
        if covered {
            world.spawn((Mesh(Arc::new(shapes::plane(2.0, 2.0, 3, 3))), black(), down));
        }
        camera(&mut world, DVec3::new(2.0, 0.3, 0.0), DVec3::new(0.1, 0.0, 0.2), 0.02);
        draw(&mut world, options).0.radiance.iter().sum::<DVec3>()
    };
    for options in [paths(8, 64), options(8)] {
        assert_eq!(light(true, &options), DVec3::ZERO, "{:?}", options.integrator);
        assert!(light(false, &options).x > 1.0, "it lights the floor where nothing covers it");
    }
}

#[test]
fn a_decal_reaches_into_the_joint_of_its_wall_and_a_box() {
    // A box stands on the wall and on the decals. The picture shows the last hundredths of a millimetre of the wall
    // beside it, where rays cross the side of the box and the wall within the neighbourhood of one point.
    let box_color = Vec3::new(0.3, 0.3, 0.9);
    for place_in_box in [[0.5, 0.0], [0.0, 0.5]] {
        let [x, z] = place_in_box;
        let mut world = wall(painted(WALL, true), &DECALS, true);
        let on_the_wall = Transform { translation: at(x, 0.5, z), ..place() };
        world.spawn((Mesh(Arc::new(shapes::cuboid(Vec3::ONE, 1))), painted(box_color, true), on_the_wall));
        camera(&mut world, at(-3.0 * x + 0.1, 1.2, -3.0 * z + 0.1), at(0.0, 0.0, 0.0), 2e-5);
        let expected = mixed(&DECALS, WALL.as_dvec3());
        let (picture, _) = draw(&mut world, &options(64));
        let is = |pixel: &DVec3, color: DVec3| (*pixel - color).abs().max_element() < 1e-6;
        let of_wall = picture.radiance.iter().filter(|pixel| is(pixel, expected)).count();
        let of_box = picture.radiance.iter().filter(|pixel| is(pixel, box_color.as_dvec3())).count();
        assert!(of_wall > 500 && of_box > 500, "the joint is not in the picture: {of_wall}, {of_box}");
        assert_eq!(of_wall + of_box, picture.radiance.len(), "some rays miss the wall or its decals");
    }
}
