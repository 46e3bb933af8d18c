//! Glass in glass, beside glass and against walls, and an eye inside glass.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::Material;
use lumbre_scene::{Medium, Mesh, Quadric, QuadricShape, SceneSettings, Transform};
use lumbre_trace::{Branch, Kind, TraceOptions};

use crate::case::Outcome;
use crate::support::*;

crate::cases! {
    "coplanar glass" {
        two_blocks_of_one_glass_are_one, a_block_between_others_bends_light_by_its_own_index,
        faces_that_overlap_in_part, a_block_that_stands_on_a_floor, a_floor_made_before_the_block,
        a_thin_pane_on_a_wall,
        nothing_is_lost_where_blocks_touch,
    }
    "media inside media" {
        three_shells_keep_bouguers_product, absorption_of_each_shell_by_its_own_way,
        solids_that_overlap_are_left_in_any_order, four_hundred_shells,
    }
    "a camera inside glass" {
        an_eye_in_a_ball_sees_straight, an_eye_in_a_bubble_in_glass, an_eye_in_a_tinted_block,
        an_eye_a_hair_below_a_face, parallel_rays_that_start_inside_and_outside,
    }
}

fn block(world: &mut World, size: Vec3, middle: DVec3, ior: f32) -> Entity {
    let mesh = Mesh(Arc::new(shapes::cuboid(size, 1)));
    world.spawn((mesh, glass(ior), fresnel(), Transform::from_translation(middle))).id()
}

/// Returns the chain of transmitted rays of a tree, beginning with the camera ray.
fn chain(tree: &Branch) -> Vec<&Branch> {
    let mut chain = vec![tree];
    while let Some(branch) = next(chain[chain.len() - 1], Kind::Transmitted) {
        chain.push(branch);
    }
    chain
}

fn deep(side: u32) -> TraceOptions {
    TraceOptions { depth: Some(200), weight: 0.0, ..options(side) }
}

/// Switches Fresnel reflection off, so that a tree has no mirrored rays and is a chain.
fn clear(world: &mut World) {
    let mut media = world.query::<&mut Medium>();
    media.iter_mut(world).for_each(|mut medium| medium.fresnel = false);
}

fn two_blocks_of_one_glass_are_one() -> Outcome {
    let mut pairs = Vec::new();
    // Sizes that f32 can represent exactly, and others.
    for unit in [0.25_f32, 0.1, 7.3] {
        for slant in [0.0, 0.3, 2.0] {
            let mut world = World::new();
            let size = Vec3::new(90.0, 90.0, unit);
            for number in [0.5, 1.5] {
                block(&mut world, size, DVec3::NEG_Z * (number * f64::from(unit)), 1.5);
            }
            clear(&mut world);
            camera(&mut world, DVec3::new(slant, 0.0, 1.0), DVec3::ZERO, 1e-3);
            let tree = tree(&mut world, &deep(8));
            let chain = chain(&tree);
            let sine = slant / slant.hypot(1.0);
            let angle = (sine / 1.5_f64).asin();
            let last = chain[chain.len() - 1];
            // Where it leaves: both blocks shift it as one block does, by 2 d tan φ.
            let aside = -last.origin.x / (2.0 * f64::from(unit)) - angle.tan();
            pairs.push((0.0, aside));
        }
    }
    Outcome::worst(
        pairs,
        3e-7,
        "shift through both over their thickness, less tan φ of Snell's law; the blocks' corners are f32",
    )
}

fn a_block_between_others_bends_light_by_its_own_index() -> Outcome {
    let mut pairs = Vec::new();
    let indices = [1.33_f32, 1.8, 1.5, 2.4];
    for slant in [0.1, 0.7, 3.0] {
        let mut world = World::new();
        for (number, ior) in indices.into_iter().enumerate() {
            block(&mut world, Vec3::new(90.0, 90.0, 0.1), DVec3::NEG_Z * (0.05 + 0.1 * number as f64), ior);
        }
        clear(&mut world);
        camera(&mut world, DVec3::new(slant, 0.0, 1.0), DVec3::ZERO, 1e-3);
        let tree = tree(&mut world, &deep(8));
        let sine = slant / f64::hypot(slant, 1.0);
        let inside = &chain(&tree)[1..=indices.len()];
        let found = inside.iter().zip(indices);
        pairs.extend(found.map(|(branch, ior)| (sine, -branch.direction.x * f64::from(ior))));
    }
    Outcome::worst(pairs, 1e-6, "n sin φ is the same in all of them; the f32 normals of the faces")
}

fn faces_that_overlap_in_part() -> Outcome {
    // A smaller block on a larger one of the same glass: beside the smaller one the ray leaves into air, and
    // below it the ray stays in glass.
    let mut pairs = Vec::new();
    for (x, faces) in [(0.0, 2.0), (0.7, 2.0), (0.499_99, 2.0), (0.500_01, 2.0)] {
        let mut world = World::new();
        block(&mut world, Vec3::new(2.0, 1.0, 2.0), DVec3::NEG_Y * 0.5, 1.5);
        block(&mut world, Vec3::new(1.0, 1.0, 1.0), DVec3::Y * 0.5, 1.5);
        camera(&mut world, DVec3::new(x, 4.0, 0.2), DVec3::new(x, 0.0, 0.2), 1e-6);
        let tree = tree(&mut world, &deep(8));
        let mirrors = chain(&tree)
            .into_iter()
            .filter(|branch| next(branch, Kind::Mirrored).is_some_and(|mirrored| mirrored.factor.x > 1e-9));
        pairs.push((faces, mirrors.count() as f64));
    }
    Outcome::worst(pairs, 0.0, "faces that mirror: the first and the last, wherever the ray passes")
}

fn on_a_floor(floor_first: bool) -> Outcome {
    let mut pairs = Vec::new();
    for height in [0.25_f32, 0.1, 1.7] {
        let mut world = World::new();
        let floor = |world: &mut World| {
            world.spawn((Mesh(Arc::new(shapes::plane(20.0, 20.0, 1, 1))), glowing(1.0, 0.0)));
        };
        let half = Material { transmission: Vec3::splat(0.5), ior: 1.5, ..black() };
        if floor_first {
            floor(&mut world);
        }
        let mesh = Mesh(Arc::new(shapes::cuboid(Vec3::new(4.0, height, 4.0), 1)));
        world.spawn((mesh, half, Transform::from_xyz(0.0, 0.5 * f64::from(height), 0.0)));
        if !floor_first {
            floor(&mut world);
        }
        camera(&mut world, DVec3::new(0.4, 3.0, 0.3), DVec3::ZERO, 0.2);
        let (picture, _) = draw(&mut world, &options(32));
        pairs.extend(picture.radiance.iter().map(|pixel| (0.5, pixel.x)));
    }
    Outcome::worst(
        pairs,
        0.0,
        "a glowing floor of 1 through a block of k_t = 1/2 that stands on it: through its upper face; the lower one lies in the floor, which wins",
    )
}

fn a_block_that_stands_on_a_floor() -> Outcome {
    on_a_floor(false)
}

fn a_floor_made_before_the_block() -> Outcome {
    on_a_floor(true)
}

fn a_thin_pane_on_a_wall() -> Outcome {
    let mut world = World::new();
    let pane = Material { transmission: Vec3::splat(0.5), ior: 1.5, ..black() };
    let thin = Medium { thin: true, ..Medium::default() };
    let turned = Transform::from_xyz(0.1, 0.2, 0.3).with_rotation(glam::DQuat::from_rotation_z(0.7));
    world.spawn((Mesh(Arc::new(shapes::plane(2.0, 2.0, 3, 3))), pane, thin, turned));
    world.spawn((Mesh(Arc::new(shapes::plane(9.0, 9.0, 1, 1))), glowing(1.0, 0.0), turned));
    camera(&mut world, DVec3::new(0.0, 3.0, 0.3), DVec3::new(0.1, 0.2, 0.3), 0.3);
    let (picture, _) = draw(&mut world, &options(32));
    Outcome::worst(
        picture.radiance.iter().map(|pixel| (1.0, pixel.x)),
        0.0,
        "a glowing wall of 1 in whose plane a sheet lies: what is opaque wins, at every pixel",
    )
}

fn nothing_is_lost_where_blocks_touch() -> Outcome {
    let mut world = World::new();
    for (number, ior) in [1.5, 1.5, 1.33, 1.8].into_iter().enumerate() {
        block(&mut world, Vec3::new(2.0, 2.0, 0.3), DVec3::NEG_Z * (0.15 + 0.3 * number as f64), ior);
    }
    furnace(&mut world, 1.0);
    camera(&mut world, DVec3::new(0.5, 0.4, 3.0), DVec3::NEG_Z * 0.5, 0.6);
    let asked = TraceOptions { depth: Some(60), weight: 1e-5, ..options(24) };
    let (picture, report) = draw(&mut world, &asked);
    assert!(report.cut.largest_weight > 0.0);
    let bound = report.cut.bound.unwrap_or(f64::INFINITY);
    assert!(picture.radiance.iter().all(|pixel| (pixel.x - 1.0).abs() <= bound + 1e-12), "{bound}");
    Outcome::worst(
        picture.radiance.iter().map(|pixel| (1.0, pixel.x)),
        1e-3,
        "four blocks that touch, in a furnace of 1; every pixel is within the bound that the report states for what was cut off below 10^-5",
    )
}

fn shells(world: &mut World, radii: &[(f64, f32)]) {
    for (radius, ior) in radii {
        let entity = exact(world, Quadric::sphere(*radius), glass(*ior), Transform::IDENTITY);
        world.entity_mut(entity).insert(Medium::default());
    }
}

fn three_shells_keep_bouguers_product() -> Outcome {
    let mut world = World::new();
    shells(&mut world, &[(3.0, 1.33), (2.0, 1.5), (1.0, 2.4), (0.5, 1.0)]);
    let offset = 0.31;
    camera(&mut world, DVec3::new(offset, 0.0, 9.0), DVec3::new(offset, 0.0, 0.0), 1e-3);
    let tree = tree(&mut world, &deep(8));
    let chain = chain(&tree);
    assert_eq!(chain.len(), 9, "into four and out of four");
    let product = |branch: &&Branch| {
        let index = branch.point.as_ref().map_or(1.0, |point| point.index);
        (offset, branch.origin.cross(branch.direction).length() * index)
    };
    Outcome::worst(chain.iter().map(product), 1e-12, "n r sin φ is the same in every shell, in and out")
}

fn absorption_of_each_shell_by_its_own_way() -> Outcome {
    let mut world = World::new();
    let tints = [(3.0, 0.2_f32), (2.0, 0.5), (1.0, 0.8)];
    for (radius, tint) in tints {
        let medium =
            Medium { attenuation_color: Vec3::splat(tint), attenuation_distance: 1.0, ..Medium::default() };
        let entity = exact(&mut world, Quadric::sphere(radius), glass(1.0), Transform::IDENTITY);
        world.entity_mut(entity).insert(medium);
    }
    furnace(&mut world, 1.0);
    let offset = 0.4_f64;
    camera(&mut world, DVec3::new(offset, 0.0, 9.0), DVec3::new(offset, 0.0, 0.0), 1e-9);
    let (picture, _) = draw(&mut world, &deep(1));
    let half = |radius: f64| (radius * radius - offset * offset).sqrt();
    let ways = [half(3.0) - half(2.0), half(2.0) - half(1.0), half(1.0)];
    let expected: f64 =
        ways.iter().zip(tints).map(|(way, (_, tint))| f64::from(tint).powf(2.0 * way)).product();
    Outcome::number(expected, picture.radiance[0].x, 1e-9, "product of a_i^(way through the shell alone)")
}

fn solids_that_overlap_are_left_in_any_order() -> Outcome {
    // A reaches from 0 to -2, B from -1 to -3: the ray leaves A inside B, although it entered B last.
    let mut world = World::new();
    for (middle, tint) in [(-1.0, 0.5_f32), (-2.0, 0.25)] {
        let medium =
            Medium { attenuation_color: Vec3::splat(tint), attenuation_distance: 1.0, ..Medium::default() };
        let mesh = Mesh(Arc::new(shapes::cuboid(Vec3::new(4.0, 4.0, 2.0), 1)));
        world.spawn((mesh, glass(1.5), medium, Transform::from_xyz(0.0, 0.0, middle)));
    }
    furnace(&mut world, 1.0);
    camera(&mut world, DVec3::Z, DVec3::ZERO, 1e-9);
    let (picture, _) = draw(&mut world, &deep(1));
    Outcome::number(
        0.5 * 0.25 * 0.25,
        picture.radiance[0].x,
        1e-6,
        "a metre of the first, then two of the second, which was entered last: it is the innermost until it is left",
    )
}

fn four_hundred_shells() -> Outcome {
    let mut world = World::new();
    let radii: Vec<(f64, f32)> = (0..400)
        .map(|number| (1.0 - 0.002 * f64::from(number), if number % 2 == 0 { 1.5 } else { 1.2 }))
        .collect();
    shells(&mut world, &radii);
    camera(&mut world, DVec3::new(0.05, 0.0, 9.0), DVec3::new(0.05, 0.0, 0.0), 1e-3);
    let tree = tree(&mut world, &TraceOptions { depth: Some(1000), weight: 0.0, ..options(8) });
    let last = through(&tree);
    assert!(last.point.is_none());
    Outcome::number(
        0.05,
        last.origin.cross(last.direction).length(),
        1e-11,
        "400 balls in each other, 800 faces: the ray leaves as far from the middle as it came",
    )
}

fn an_eye_in_a_ball_sees_straight() -> Outcome {
    let mut world = World::new();
    shells(&mut world, &[(1.0, 1.5)]);
    let mut pairs = Vec::new();
    for target in [DVec3::X, DVec3::new(0.3, -0.7, 0.2), DVec3::NEG_Y, DVec3::splat(1.0)] {
        look_from(&mut world, DVec3::ZERO, target, 0.1);
        let tree = tree(&mut world, &options(8));
        assert_eq!(tree.point.as_ref().map(|point| point.index), Some(1.5));
        pairs.push((0.0, (through(&tree).direction - target.normalize()).length()));
    }
    Outcome::worst(pairs, 1e-15 * 8.0, "from its middle no ray is bent: some ulps")
}

fn an_eye_in_a_bubble_in_glass() -> Outcome {
    let mut world = World::new();
    let tinted =
        Medium { attenuation_color: Vec3::splat(0.5), attenuation_distance: 1.0, ..Medium::default() };
    let outer = exact(&mut world, Quadric::sphere(2.0), glass(1.5), Transform::IDENTITY);
    world.entity_mut(outer).insert(tinted);
    exact(&mut world, Quadric::sphere(1.0), glass(1.0), Transform::IDENTITY);
    furnace(&mut world, 1.0);
    camera(&mut world, DVec3::ZERO, DVec3::new(0.2, 0.3, -1.0), 1e-9);
    let (picture, _) = draw(&mut world, &options(1));
    Outcome::number(
        0.5,
        picture.radiance[0].x,
        1e-9,
        "a metre of air, then one of the glass, which halves it",
    )
}

fn an_eye_in_a_tinted_block() -> Outcome {
    let mut pairs = Vec::new();
    for depth in [0.1, 0.5, 1.9] {
        let mut world = World::new();
        let tinted =
            Medium { attenuation_color: Vec3::splat(0.5), attenuation_distance: 1.0, ..Medium::default() };
        let mesh = Mesh(Arc::new(shapes::cuboid(Vec3::splat(2.0), 1)));
        world.spawn((mesh, glass(1.5), tinted, Transform::from_xyz(0.0, 0.0, -1.0)));
        furnace(&mut world, 1.0);
        camera(&mut world, DVec3::NEG_Z * depth, DVec3::Z, 1e-9);
        let (picture, _) = draw(&mut world, &options(1));
        pairs.push((0.5_f64.powf(depth), picture.radiance[0].x));
    }
    Outcome::worst(
        pairs,
        1e-6,
        "1/2 a metre, from the eye, whose rays begin a thousandth of a millimetre before it, to the face",
    )
}

fn an_eye_a_hair_below_a_face() -> Outcome {
    // Beyond the critical angle all light is mirrored, however close the eye is to the face.
    let mut pairs = Vec::new();
    for below in [1e-3, 1e-5, 1e-6] {
        let mut world = World::new();
        exact(&mut world, Quadric::new(QuadricShape::Plane), glass(1.5), Transform::IDENTITY);
        let eye = DVec3::new(0.0, -below, 0.0);
        camera(&mut world, eye, eye + DVec3::new(1.0, 0.3, 0.0), 1e-3);
        let tree = tree(&mut world, &options(8));
        assert_eq!(tree.point.as_ref().map(|point| point.index), Some(1.5), "{below}");
        pairs.push((1.0, next(&tree, Kind::Mirrored).map_or(0.0, |mirrored| mirrored.factor.x)));
    }
    Outcome::worst(pairs, 0.0, "total reflection: the eye knows that it is inside")
}

fn parallel_rays_that_start_inside_and_outside() -> Outcome {
    // A wide parallel view that starts in the plane through a ball's centre: rays that start inside the ball
    // pass through half of it and are absorbed there.
    let mut world = World::new();
    let tinted =
        Medium { attenuation_color: Vec3::splat(0.5), attenuation_distance: 1.0, ..Medium::default() };
    let ball = exact(&mut world, Quadric::sphere(1.0), glass(1.0), Transform::IDENTITY);
    world.entity_mut(ball).insert(tinted);
    world.insert_resource(SceneSettings {
        sky: Vec3::ONE,
        background: Vec3::ONE,
        ..SceneSettings::default()
    });
    let view = lumbre_scene::Camera {
        projection: lumbre_scene::Projection::Orthographic {
            half_height: 2.0,
            half_width: 2.0,
            near: 0.0,
            far: 100.0,
        },
        exposure: 1.0,
    };
    world.spawn((view, Transform::IDENTITY));
    let side = 33;
    let (picture, _) = draw(&mut world, &options(side));
    let pixel = 4.0 / f64::from(side);
    let expected = |at: u32| {
        let place = |at: u32| (f64::from(at) + 0.5) * pixel - 2.0;
        let off = place(at % side).hypot(place(at / side));
        if off < 1.0 { 0.5_f64.powf((1.0 - off * off).sqrt()) } else { 1.0 }
    };
    let pairs = picture.radiance.iter().zip(0..).map(|(pixel, at)| (expected(at), pixel.x));
    Outcome::worst(pairs, 1e-9, "1/2 to the way through the front half of the ball, 1 beside it")
}
