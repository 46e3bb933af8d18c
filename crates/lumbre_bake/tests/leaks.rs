//! Light does not leak: two rooms with a thin wall between them and no opening, a lamp in one of them.

use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::sync::Arc;

use bevy_ecs::entity::Entity;
use bevy_ecs::world::World;
use glam::{DQuat, DVec2, DVec3, Vec3};
use lumbre_bake::{BakeOptions, BakeReport, Density, LightmapError, Quality, bake};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{BakeMode, Light, Material, Surface};
use lumbre_scene::{GlobalTransform, Lightmap, Mesh, StaticObject, Transform};

mod common;

/// Side of a texel, metres.
const TEXEL: f64 = 0.05;

fn matt(reflectance: f32, emission: f32) -> Material {
    let front =
        Surface { diffuse: Vec3::splat(reflectance), emission: Vec3::splat(emission), ..Surface::default() };
    Material { front, ..Material::default() }
}

/// Turned, so that no wall lies on numbers that are exact.
fn place() -> Transform {
    let rotation = DQuat::from_axis_angle(DVec3::new(0.3, 0.9, -0.2).normalize(), 0.7);
    Transform { rotation, ..Transform::from_xyz(3.1, -1.7, 5.3) }
}

fn spawn(world: &mut World, mesh: TriangleMesh, material: Material) -> Entity {
    world.spawn((Mesh(Arc::new(mesh)), material, StaticObject, place())).id()
}

/// A box between two corners; its sides look inward or outward. Those whose middle `keep` refuses are left out.
fn sides(low: Vec3, high: Vec3, inward: bool, keep: impl Fn(Vec3) -> bool) -> TriangleMesh {
    let mut mesh = shapes::cuboid(high - low, 1);
    // Corners of neighbours are the same number.
    mesh.positions.iter_mut().for_each(|p| *p = Vec3::select(p.cmpgt(Vec3::ZERO), high, low));
    let mut indices = Vec::new();
    for side in mesh.indices.chunks_exact(6) {
        let middle = (0.5 * (low + high)
            - side.iter().map(|&v| mesh.positions[v as usize]).sum::<Vec3>() / 6.0)
            .signum();
        let of_side: Vec<Vec3> = side.iter().map(|&v| mesh.positions[v as usize]).collect();
        let normal = (of_side[1] - of_side[0]).cross(of_side[2] - of_side[0]).normalize();
        let _ = middle;
        if keep(normal) {
            indices.extend_from_slice(side);
        }
    }
    mesh.indices = indices;
    if inward {
        mesh.indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
        mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
    }
    mesh
}

const LOW: Vec3 = Vec3::new(-2.0, 0.0, -1.0);
const HIGH: Vec3 = Vec3::new(0.0, 1.5, 1.0);

/// The other room's corners, the wall being so thick.
fn beyond(thickness: f32) -> (Vec3, Vec3) {
    (Vec3::new(thickness, LOW.y, LOW.z), Vec3::new(thickness + 1.5, HIGH.y, HIGH.z))
}

/// A lamp under the ceiling near the wall, and a point light low beside it.
fn add_light(world: &mut World) {
    let lamp = sides(Vec3::new(-0.6, 1.3, -0.3), Vec3::new(-0.2, 1.35, 0.3), false, |_| true);
    spawn(world, lamp, matt(0.5, 8.0));
    let light = Light { bake: BakeMode::Static, ..Light::point(Vec3::splat(0.2)) };
    let place = place();
    let at = place.rotation * DVec3::new(-0.15, 0.2, 0.4) + place.translation;
    world.spawn((light, Transform::from_xyz(at.x, at.y, at.z)));
}

fn run(world: &mut World) -> BakeReport {
    let options = BakeOptions {
        density: Density::TexelsPerMeter(1.0 / TEXEL),
        quality: Quality::Draft,
        ..BakeOptions::default()
    };
    bake(world, &options, &mut |_| ControlFlow::Continue(())).expect("the scene bakes")
}

/// Irradiance by bilinear look-up at random points of an entity's surface, edges and corners among them, with the points
/// as the scene was modelled.
fn look_up(world: &World, entity: Entity) -> Vec<(DVec3, f64)> {
    let mesh = &world.get::<Mesh>(entity).unwrap().0;
    let map = &world.get::<Lightmap>(entity).unwrap().image;
    assert!(world.get::<GlobalTransform>(entity).is_some());
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
            // Within a hundredth of an edge.
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
        found.push((position, common::bilinear(map, DVec2::new(uv.x, uv.y)).max_element() * PI));
    }
    found
}

fn brightest(world: &World, entity: Entity) -> f64 {
    look_up(world, entity).iter().map(|(_, value)| *value).fold(0.0, f64::max)
}

/// The share of texels of a room that are within two stated errors of the same room baked alone, and the worst in such errors.
fn compare_with_alone(world: &World, room: Entity, alone: &World, same: Entity) -> (f64, f64) {
    let maps = [(world, room), (alone, same)].map(|(world, entity)| {
        let image = world.get::<Lightmap>(entity).unwrap().image.clone();
        (image, world.get::<LightmapError>(entity).unwrap().0.clone())
    });
    let [(a, a_error), (b, b_error)] = &maps;
    assert_eq!((a.width, a.height), (b.width, b.height));
    let (mut within, mut count, mut worst) = (0u32, 0u32, 0.0f64);
    for index in 0..a.texels.len() {
        let stated = f64::from(a_error[index]).hypot(f64::from(b_error[index]));
        if stated.is_finite() && stated > 0.0 {
            let apart = f64::from((a.texels[index] - b.texels[index]).length()) / 3f64.sqrt() / stated;
            within += u32::from(apart <= 2.0);
            count += 1;
            worst = worst.max(apart);
        }
    }
    (f64::from(within) / f64::from(count), worst)
}

/// The lit room by itself: `walls` says which sides it has of its own.
fn alone(keep: impl Fn(Vec3) -> bool, wall: Option<(TriangleMesh, Material)>) -> (World, Entity) {
    let mut world = World::new();
    let room = spawn(&mut world, sides(LOW, HIGH, true, keep), matt(0.6, 0.0));
    if let Some((mesh, material)) = wall {
        spawn(&mut world, mesh, material);
    }
    add_light(&mut world);
    run(&mut world);
    (world, room)
}

#[test]
fn two_closed_boxes_share_a_wall() {
    for thickness in [0.0, 0.01] {
        let mut world = World::new();
        let room = spawn(&mut world, sides(LOW, HIGH, true, |_| true), matt(0.6, 0.0));
        let (low, high) = beyond(thickness);
        let dark = spawn(&mut world, sides(low, high, true, |_| true), matt(0.6, 0.0));
        add_light(&mut world);
        let report = run(&mut world);
        assert!(brightest(&world, room) > 1.0);
        assert_eq!(brightest(&world, dark), 0.0, "{thickness}");
        assert_eq!(report.leaked_rays, 0, "{thickness}");
        let (single, same) = alone(|_| true, None);
        let (share, worst) = compare_with_alone(&world, room, &single, same);
        println!("{thickness}: {share:.4} within two stated errors, the worst at {worst:.1}");
        assert!(share >= 0.95, "{share} {worst}");
    }
}

/// All sides but the one towards the other room; normals as a box seen from outside has them.
fn but_towards(x: f32) -> impl Fn(Vec3) -> bool {
    move |normal: Vec3| normal.x * x < 0.5
}

#[test]
fn a_wall_of_zero_thickness_and_two_sides() {
    let mut world = World::new();
    let room = spawn(&mut world, sides(LOW, HIGH, true, but_towards(1.0)), matt(0.6, 0.0));
    let (low, high) = beyond(0.0);
    let dark = spawn(&mut world, sides(low, high, true, but_towards(-1.0)), matt(0.6, 0.0));
    // Its front looks into the dark room: a map shows fronts.
    let wall = || {
        let mesh = sides(LOW, HIGH, false, |normal| normal.x > 0.5);
        (mesh, Material { double_sided: true, ..matt(0.6, 0.0) })
    };
    let (mesh, material) = wall();
    let wall_between = spawn(&mut world, mesh, material);
    add_light(&mut world);
    let report = run(&mut world);
    assert!(brightest(&world, room) > 1.0);
    assert_eq!((brightest(&world, dark), brightest(&world, wall_between)), (0.0, 0.0));
    assert_eq!(report.leaked_rays, 0);
    let (single, same) = alone(but_towards(1.0), Some(wall()));
    let (share, worst) = compare_with_alone(&world, room, &single, same);
    println!("{share:.4} within two stated errors, the worst at {worst:.1}");
    assert!(share >= 0.95, "{share} {worst}");
}

#[test]
fn a_wall_a_centimetre_thick_between_texels_of_five() {
    let thickness = 0.01;
    let mut world = World::new();
    let room = spawn(&mut world, sides(LOW, HIGH, true, but_towards(1.0)), matt(0.6, 0.0));
    let (low, high) = beyond(thickness);
    let dark = spawn(&mut world, sides(low, high, true, but_towards(-1.0)), matt(0.6, 0.0));
    let wall = || sides(Vec3::new(0.0, LOW.y, LOW.z), Vec3::new(thickness, HIGH.y, HIGH.z), false, |_| true);
    let wall_between = spawn(&mut world, wall(), matt(0.6, 0.0));
    add_light(&mut world);
    run(&mut world);
    assert!(brightest(&world, room) > 1.0);
    assert_eq!(brightest(&world, dark), 0.0);
    // Of the wall, the side that looks into the dark.
    let leaked = look_up(&world, wall_between).into_iter().filter(|(p, _)| p.x > 0.9 * f64::from(thickness));
    let towards_dark: Vec<_> = leaked.filter(|(p, _)| inside(p)).collect();
    assert!(towards_dark.len() > 1000);
    assert!(towards_dark.iter().all(|(_, value)| *value == 0.0));
    let (single, same) = alone(but_towards(1.0), Some((wall(), matt(0.6, 0.0))));
    let (share, worst) = compare_with_alone(&world, room, &single, same);
    println!("{share:.4} within two stated errors, the worst at {worst:.1}");
    assert!(share >= 0.95, "{share} {worst}");
}

/// Off the wall's narrow sides, which share their edges with the big ones.
fn inside(p: &DVec3) -> bool {
    p.y > 1e-6 && p.y < 1.5 - 1e-6 && p.z.abs() < 1.0 - 1e-6
}

#[test]
fn a_floor_that_runs_through_under_the_wall_leaks_a_texel_at_most() {
    for thickness in [0.0f32, 0.01] {
        let mut world = World::new();
        let no_floor = |normal: Vec3| normal.y > -0.5;
        let lit = move |normal: Vec3| no_floor(normal) && normal.x < 0.5;
        let other = move |normal: Vec3| no_floor(normal) && normal.x > -0.5;
        spawn(&mut world, sides(LOW, HIGH, true, lit), matt(0.6, 0.0));
        let (low, high) = beyond(thickness);
        let dark = spawn(&mut world, sides(low, high, true, other), matt(0.6, 0.0));
        let floor = spawn(
            &mut world,
            sides(LOW, Vec3::new(high.x, LOW.y + 1.0, high.z), true, |normal| normal.y < -0.5),
            matt(0.6, 0.0),
        );
        if thickness > 0.0 {
            let wall =
                sides(Vec3::new(0.0, LOW.y, LOW.z), Vec3::new(thickness, HIGH.y, HIGH.z), false, |_| true);
            spawn(&mut world, wall, matt(0.6, 0.0));
        } else {
            let wall = sides(LOW, HIGH, false, |normal| normal.x > 0.5);
            spawn(&mut world, wall, Material { double_sided: true, ..matt(0.6, 0.0) });
        }
        add_light(&mut world);
        run(&mut world);
        let found = look_up(&world, floor);
        let lit_side = found.iter().filter(|(p, _)| p.x < -0.1 && p.x > -0.3);
        let (sum, count) = lit_side.fold((0.0, 0.0), |(s, n), (_, value)| (s + value, n + 1.0));
        let beside = sum / count;
        let in_the_dark = |from: f64, to: f64| {
            let edge = f64::from(thickness);
            let there = found.iter().filter(move |(p, _)| (from..to).contains(&((p.x - edge) / TEXEL)));
            there.map(|(_, value)| value / beside).fold(0.0, f64::max)
        };
        let steps = [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 40.0];
        for pair in steps.windows(2) {
            println!("{thickness}: {} to {} texels: {:.5}", pair[0], pair[1], in_the_dark(pair[0], pair[1]));
        }
        println!("dark walls: {:.3e} of {beside}", brightest(&world, dark));
        // A texel that straddles the wall reaches half a texel beyond its own border, and filtering a texel on.
        assert_eq!(in_the_dark(2.0, 40.0), 0.0, "{thickness}");
    }
}
