//! Light must not leak: mostly scenes of two closed rooms with a thin wall between them and a lamp in one of them.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::common;
use crate::common::shapes::inside_out;
use crate::scene_parts::grey;
use bevy_ecs::entity::Entity;
use bevy_ecs::world::World;
use glam::{DQuat, DVec2, DVec3, Vec3};
use lumbre_bake::{Bake, BakeOptions, BakeReport, Density, Quality, TexelErrors};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{BakeMode, Light, Material};
use lumbre_scene::{Lightmap, Mesh, StaticObject, Transform};

/// The side of a texel in metres.
const TEXEL: f64 = 0.05;

/// The transform of all objects. It is rotated, so that the coordinates of walls are rounded.
fn place() -> Transform {
    let rotation = DQuat::from_axis_angle(DVec3::new(0.3, 0.9, -0.2).normalize(), 0.7);
    Transform { rotation, ..Transform::from_xyz(3.1, -1.7, 5.3) }
}

fn spawn(world: &mut World, mesh: TriangleMesh, material: Material) -> Entity {
    world.spawn((Mesh(Arc::new(mesh)), material, StaticObject, place())).id()
}

/// A box between two corners whose sides look inward or outward. `keep` decides by the outward normal of a side whether
/// it is part of the mesh.
fn sides(low: Vec3, high: Vec3, inward: bool, keep: impl Fn(Vec3) -> bool) -> TriangleMesh {
    let mut mesh = shapes::cuboid(high - low, 1);
    // Boxes that share a corner must have exactly the same coordinates there.
    mesh.positions.iter_mut().for_each(|p| *p = Vec3::select(p.cmpgt(Vec3::ZERO), high, low));
    let mut indices = Vec::new();
    for side in mesh.indices.chunks_exact(6) {
        let of_side: Vec<Vec3> = side.iter().map(|&v| mesh.positions[v as usize]).collect();
        let normal = (of_side[1] - of_side[0]).cross(of_side[2] - of_side[0]).normalize();
        if keep(normal) {
            indices.extend_from_slice(side);
        }
    }
    mesh.indices = indices;
    if inward { inside_out(mesh) } else { mesh }
}

/// The corners of the lit room.
const LOW: Vec3 = Vec3::new(-2.0, 0.0, -1.0);
const HIGH: Vec3 = Vec3::new(0.0, 1.5, 1.0);

/// The corners of the dark room behind a wall of this thickness.
fn dark_room(thickness: f32) -> (Vec3, Vec3) {
    (Vec3::new(thickness, LOW.y, LOW.z), Vec3::new(thickness + 1.5, HIGH.y, HIGH.z))
}

/// Adds a lamp under the ceiling near the wall, and a point light low beside the wall.
fn add_light(world: &mut World, reflectance: f32) {
    let lamp = sides(Vec3::new(-0.6, 1.3, -0.3), Vec3::new(-0.2, 1.35, 0.3), false, |_| true);
    spawn(world, lamp, grey(reflectance, 8.0));
    let light = Light { bake: BakeMode::Static, ..Light::point(Vec3::splat(0.2)) };
    let place = place();
    let at = place.rotation * DVec3::new(-0.15, 0.2, 0.4) + place.translation;
    world.spawn((light, Transform::from_xyz(at.x, at.y, at.z)));
}

fn run(world: &mut World) -> BakeReport {
    run_with(world, Quality::Draft)
}

fn run_with(world: &mut World, quality: Quality) -> BakeReport {
    let options =
        BakeOptions { density: Density::TexelsPerMeter(1.0 / TEXEL), quality, ..BakeOptions::default() };
    Bake::new(&options).run(world).expect("the scene bakes")
}

/// A point of a surface in object space, its irradiance by bilinear look-up, and the largest stated error of the four
/// texels that are read.
struct Sample {
    position: DVec3,
    irradiance: f64,
    stated: f64,
}

/// Looks up random points of an entity's surface, including edges and corners. The points are the same for the same
/// mesh.
fn look_up(world: &World, entity: Entity) -> Vec<Sample> {
    let mesh = &world.get::<Mesh>(entity).expect("it was baked").0;
    let map = &world.get::<Lightmap>(entity).expect("it was baked").image;
    let errors = &world.get::<TexelErrors>(entity).expect("it was baked").0;
    let mut state = 7u64;
    let mut random = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let triangles: Vec<[u32; 3]> = mesh.triangles().collect();
    let mut found = Vec::new();
    for index in 0..20_000 {
        let triangle = triangles[index % triangles.len()];
        let (mut u, mut v) = (random(), random());
        match index / triangles.len() % 8 {
            0 => u = 0.0,
            1 => v = 0.0,
            2 => v = 1.0 - u,
            3 => (u, v) = (u.round(), 0.0),
            // Within a hundredth of the triangle's size from an edge.
            4 => u *= 0.01,
            5 => v *= 0.01,
            _ => {}
        }
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let at = |p: [DVec3; 3]| p[0] + (p[1] - p[0]) * u + (p[2] - p[0]) * v;
        let position = at(triangle.map(|vertex| mesh.positions[vertex as usize].as_dvec3()));
        let uv = at(triangle.map(|vertex| mesh.uv1[vertex as usize].as_dvec2().extend(0.0)));
        let uv = DVec2::new(uv.x, uv.y);
        let low = (uv * DVec2::new(f64::from(map.width), f64::from(map.height)) - 0.5).floor();
        let mut stated = 0.0f64;
        for step in [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE] {
            let texel = (low + step).max(DVec2::ZERO);
            let (x, y) = ((texel.x as u32).min(map.width - 1), (texel.y as u32).min(map.height - 1));
            // `max` ignores the NaN of a texel without a surface.
            stated = stated.max(f64::from(errors[(y * map.width + x) as usize]) * PI);
        }
        found.push(Sample { position, irradiance: common::bilinear(map, uv).max_element() * PI, stated });
    }
    found
}

fn brightest(world: &World, entity: Entity) -> f64 {
    look_up(world, entity).iter().map(|found| found.irradiance).fold(0.0, f64::max)
}

/// Compares a room with the same room baked alone. Returns the share of points that differ by at most twice the stated
/// errors, and the RMS difference over the RMS of the stated errors.
fn compare_with_alone(world: &World, room: Entity, alone: &World, same: Entity) -> (f64, f64) {
    let (mut within, mut count, mut squares, mut expected) = (0u32, 0u32, 0.0, 0.0);
    for (a, b) in look_up(world, room).iter().zip(look_up(alone, same)) {
        assert_eq!(a.position, b.position);
        let (apart, stated) = ((a.irradiance - b.irradiance).abs(), a.stated.hypot(b.stated));
        within += u32::from(apart <= 2.0 * stated);
        count += 1;
        squares += apart * apart;
        expected += stated * stated;
    }
    (f64::from(within) / f64::from(count), (squares / expected).sqrt())
}

/// Bakes the lit room alone. `keep` decides which sides the room itself has; `wall` is an additional object.
fn alone(keep: impl Fn(Vec3) -> bool, wall: Option<(TriangleMesh, Material)>) -> (World, Entity) {
    let mut world = World::new();
    let room = spawn(&mut world, sides(LOW, HIGH, true, keep), grey(0.6, 0.0));
    if let Some((mesh, material)) = wall {
        spawn(&mut world, mesh, material);
    }
    add_light(&mut world, 0.5);
    run(&mut world);
    (world, room)
}

#[test]
fn two_closed_boxes_share_a_wall() {
    for thickness in [0.0, 0.01] {
        let mut world = World::new();
        let room = spawn(&mut world, sides(LOW, HIGH, true, |_| true), grey(0.6, 0.0));
        let (low, high) = dark_room(thickness);
        let dark = spawn(&mut world, sides(low, high, true, |_| true), grey(0.6, 0.0));
        add_light(&mut world, 0.5);
        let report = run(&mut world);
        assert!(brightest(&world, room) > 1.0);
        assert_eq!(brightest(&world, dark), 0.0, "{thickness}");
        assert_eq!(report.leaked_rays, 0, "{thickness}");
        let (single, same) = alone(|_| true, None);
        let (share, ratio) = compare_with_alone(&world, room, &single, same);
        println!("{thickness}: {share:.4} within two stated errors; difference over stated: {ratio:.2}");
        assert!(share >= 0.95 && ratio <= 1.0, "{share} {ratio}");
    }
}

/// Keeps all sides except the one towards the other room; normals are those of a box seen from outside.
fn but_towards(x: f32) -> impl Fn(Vec3) -> bool {
    move |normal: Vec3| normal.x * x < 0.5
}

#[test]
fn a_wall_of_zero_thickness_and_two_sides() {
    let mut world = World::new();
    let room = spawn(&mut world, sides(LOW, HIGH, true, but_towards(1.0)), grey(0.6, 0.0));
    let (low, high) = dark_room(0.0);
    let dark = spawn(&mut world, sides(low, high, true, but_towards(-1.0)), grey(0.6, 0.0));
    // The wall's front, whose irradiance its map shows, looks into the dark room.
    let wall = || {
        let mesh = sides(LOW, HIGH, false, |normal| normal.x > 0.5);
        (mesh, Material { double_sided: true, ..grey(0.6, 0.0) })
    };
    let (mesh, material) = wall();
    let wall_between = spawn(&mut world, mesh, material);
    add_light(&mut world, 0.5);
    let report = run(&mut world);
    assert!(brightest(&world, room) > 1.0);
    assert_eq!((brightest(&world, dark), brightest(&world, wall_between)), (0.0, 0.0));
    assert_eq!(report.leaked_rays, 0);
    let (single, same) = alone(but_towards(1.0), Some(wall()));
    let (share, ratio) = compare_with_alone(&world, room, &single, same);
    println!("{share:.4} within two stated errors; difference over stated: {ratio:.2}");
    assert!(share >= 0.95 && ratio <= 1.0, "{share} {ratio}");
}

#[test]
fn a_wall_a_centimetre_thick_between_texels_of_five() {
    let thickness = 0.01;
    let mut world = World::new();
    let room = spawn(&mut world, sides(LOW, HIGH, true, but_towards(1.0)), grey(0.6, 0.0));
    let (low, high) = dark_room(thickness);
    let dark = spawn(&mut world, sides(low, high, true, but_towards(-1.0)), grey(0.6, 0.0));
    let wall = || sides(Vec3::new(0.0, LOW.y, LOW.z), Vec3::new(thickness, HIGH.y, HIGH.z), false, |_| true);
    let wall_between = spawn(&mut world, wall(), grey(0.6, 0.0));
    add_light(&mut world, 0.5);
    run(&mut world);
    assert!(brightest(&world, room) > 1.0);
    assert_eq!(brightest(&world, dark), 0.0);
    // The side of the wall that looks into the dark room.
    let towards_dark =
        |found: &&Sample| found.position.x > 0.9 * f64::from(thickness) && inside(&found.position);
    let found = look_up(&world, wall_between);
    assert!(found.iter().filter(towards_dark).count() > 1000);
    assert!(found.iter().filter(towards_dark).all(|found| found.irradiance == 0.0));
    let (single, same) = alone(but_towards(1.0), Some((wall(), grey(0.6, 0.0))));
    let (share, ratio) = compare_with_alone(&world, room, &single, same);
    println!("{share:.4} within two stated errors; difference over stated: {ratio:.2}");
    assert!(share >= 0.95 && ratio <= 1.0, "{share} {ratio}");
}

/// Whether a point lies off the wall's narrow sides, which share edges with the large ones.
fn inside(p: &DVec3) -> bool {
    p.y > 1e-6 && p.y < 1.5 - 1e-6 && p.z.abs() < 1.0 - 1e-6
}

/// Bakes two rooms whose common floor continues under the wall. Returns the largest irradiance of the floor on the dark
/// side for each interval of distance from the wall (in texels), and the largest irradiance of the dark walls; both are
/// relative to the mean of the floor on the lit side.
fn under_a_wall(thickness: f32, reflectance: f32, steps: &[f64]) -> (Vec<f64>, f64) {
    let mut world = World::new();
    let no_floor = |normal: Vec3| normal.y > -0.5;
    let lit = move |normal: Vec3| no_floor(normal) && normal.x < 0.5;
    let other = move |normal: Vec3| no_floor(normal) && normal.x > -0.5;
    spawn(&mut world, sides(LOW, HIGH, true, lit), grey(reflectance, 0.0));
    let (low, high) = dark_room(thickness);
    let dark = spawn(&mut world, sides(low, high, true, other), grey(reflectance, 0.0));
    let below = Vec3::new(high.x, LOW.y + 1.0, high.z);
    let floor = spawn(&mut world, sides(LOW, below, true, |normal| normal.y < -0.5), grey(reflectance, 0.0));
    if thickness > 0.0 {
        let corner = Vec3::new(thickness, HIGH.y, HIGH.z);
        spawn(&mut world, sides(LOW.with_x(0.0), corner, false, |_| true), grey(reflectance, 0.0));
    } else {
        let wall = sides(LOW, HIGH, false, |normal| normal.x > 0.5);
        spawn(&mut world, wall, Material { double_sided: true, ..grey(reflectance, 0.0) });
    }
    add_light(&mut world, reflectance);
    run_with(&mut world, Quality::Final);
    let found = look_up(&world, floor);
    let lit_side = found.iter().filter(|found| found.position.x < 0.0);
    let (sum, count) = lit_side.fold((0.0, 0.0), |(s, n), found| (s + found.irradiance, n + 1.0));
    let mean = sum / count;
    let within = |pair: &[f64]| {
        let texels = |p: &DVec3| (p.x - f64::from(thickness)) / TEXEL;
        let there = found.iter().filter(|found| (pair[0]..pair[1]).contains(&texels(&found.position)));
        there.map(|found| found.irradiance / mean).fold(0.0, f64::max)
    };
    (steps.windows(2).map(within).collect(), brightest(&world, dark) / mean)
}

#[test]
fn a_floor_that_runs_through_under_the_wall_leaks_a_texel_at_most() {
    let steps = [0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 6.0, 12.0, 40.0];
    for thickness in [0.0, 0.01] {
        let (direct, walls) = under_a_wall(thickness, 0.0, &steps);
        println!("{thickness}, direct: {direct:.4?}; walls {walls:.4}");
        // A texel that the wall crosses ends at most a texel beyond it, and filtering reads it from half a texel
        // further on; on the border of the chart, its neighbour is extrapolated from it.
        assert!(direct[5..].iter().all(|&leak| leak == 0.0) && walls == 0.0, "{direct:?} {walls}");
        let (all, walls) = under_a_wall(thickness, 0.6, &steps);
        println!("{thickness}, with bounces: {all:.4?}; walls {walls:.4}");
        // Patches are split along the wall, and a texel that the wall crosses passes no light on to others. What
        // remains is the value of such a texel, which filtering and denoising spread to its neighbours.
        assert!(all[5..].iter().all(|&leak| leak < 0.002) && all[7] < 1e-4, "{all:?} {walls}");
        // Walls receive light only in the corner, in the texel where wall and floor meet.
        assert!(walls < 0.04, "{walls}");
    }
}

/// A block stands on another one, which stands on the floor: the faces by which they touch are dark, whatever lies
/// behind the surface that they stand on.
#[test]
fn stacked_blocks_are_dark_between_each_other() {
    let mut world = World::new();
    spawn(&mut world, sides(LOW, HIGH, true, |_| true), grey(0.6, 0.0));
    let lower = (Vec3::new(-1.6, 0.0, -0.5), Vec3::new(-0.9, 0.3, 0.4));
    let upper = (Vec3::new(-1.5, 0.3, -0.3), Vec3::new(-1.1, HIGH.y, 0.3));
    let [lower, upper] = [lower, upper]
        .map(|(low, high)| (spawn(&mut world, sides(low, high, false, |_| true), grey(0.6, 0.0)), low, high));
    add_light(&mut world, 0.5);
    let report = run(&mut world);
    for ((entity, low, high), heights) in [(lower, vec![0.0]), (upper, vec![0.3, f64::from(HIGH.y)])] {
        let (mut dark, mut lit) = (0, 0);
        for found in look_up(&world, entity) {
            // Points near the rim are excluded: there, bilinear filtering may read texels of the open side.
            let [x, _, z] = found.position.to_array();
            let rim = 1.5 * TEXEL;
            let within = (f64::from(low.x) + rim..=f64::from(high.x) - rim).contains(&x)
                && (f64::from(low.z) + rim..=f64::from(high.z) - rim).contains(&z);
            let touches = heights.iter().any(|height| (found.position.y - height).abs() < 1e-5);
            if touches && within {
                assert_eq!(
                    found.irradiance,
                    0.0,
                    "{} {:?}",
                    found.position,
                    place().rotation * found.position + place().translation
                );
                dark += 1;
            } else if !touches {
                lit += usize::from(found.irradiance > 0.1);
            }
        }
        assert!(dark > 500 && lit > 5000, "{dark} {lit}");
    }
    // Few points at rims may be misclassified: of 16 rays for each texel, fewer than one in a thousand may leak.
    let covered = report.coverage * report.texels as f64 * 16.0;
    assert!((report.leaked_rays as f64) < 1e-3 * covered, "{} of {covered}", report.leaked_rays);
}

/// A room and the house around it with coincident walls: the inside of the house is not the inside of a solid, and the
/// sun shines on its outside.
#[test]
fn a_house_of_zero_thickness_is_lit_on_both_sides() {
    let mut world = World::new();
    let room = spawn(&mut world, sides(LOW, HIGH, true, |_| true), grey(0.6, 0.0));
    let house = spawn(&mut world, sides(LOW, HIGH, false, |_| true), grey(0.6, 0.0));
    add_light(&mut world, 0.5);
    let report = run(&mut world);
    assert!(brightest(&world, room) > 1.0 && report.leaked_rays < 1000, "{}", report.leaked_rays);
    assert_eq!(brightest(&world, house), 0.0);
    let (place, from) = (place(), place().rotation * DVec3::new(3.0, 5.0, 2.0));
    let at = place.translation + from;
    let sun = Light { bake: BakeMode::Static, ..Light::directional(Vec3::ONE) };
    world.spawn((sun, Transform::from_xyz(at.x, at.y, at.z).looking_at(place.translation, DVec3::Y)));
    run(&mut world);
    // The roof without its rim has E = π n·l.
    let expected = PI * 5.0 / 38f64.sqrt();
    let is_roof = |at: DVec3| {
        let rim = 2.0 * TEXEL;
        let within =
            |axis: usize| (f64::from(LOW[axis]) + rim..=f64::from(HIGH[axis]) - rim).contains(&at[axis]);
        (at.y - f64::from(HIGH.y)).abs() < 1e-5 && within(0) && within(2)
    };
    let found = look_up(&world, house);
    let roof: Vec<f64> =
        found.iter().filter(|found| is_roof(found.position)).map(|found| found.irradiance).collect();
    let lit = roof.iter().filter(|light| (**light / expected - 1.0).abs() < 0.01).count();
    assert!(roof.len() > 1000 && lit as f64 > 0.98 * roof.len() as f64, "{lit} of {}", roof.len());
}
