//! A hard case of size: a lamp far below a texel, against the balance of power.

use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::sync::Arc;

use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_bake::{BakeOptions, BakeReport, Density, bake};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{Material, Surface};
use lumbre_scene::{Mesh, StaticObject, Transform};

mod common;

fn run(world: &mut World, side: u32) -> BakeReport {
    let options = BakeOptions { density: Density::MapSize(side), ..BakeOptions::default() };
    bake(world, &options, &mut |_| ControlFlow::Continue(())).expect("the scene bakes")
}

fn matt(reflectance: f32, emission: f32) -> Material {
    let front =
        Surface { diffuse: Vec3::splat(reflectance), emission: Vec3::splat(emission), ..Surface::default() };
    Material { front, ..Material::default() }
}

/// A box seen from inside.
fn room(size: Vec3) -> TriangleMesh {
    let mut mesh = shapes::cuboid(size, 1);
    mesh.indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
    mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
    mesh
}

fn spawn(world: &mut World, mesh: TriangleMesh, material: Material, at: DVec3) {
    world.spawn((Mesh(Arc::new(mesh)), material, StaticObject, Transform::from_translation(at)));
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Irradiance, in the red, at a grid over the faces of a cube seen from inside: by face (-x, x, -y, y, -z, z).
fn on_the_walls(world: &mut World, half: f64) -> [Vec<f64>; 6] {
    const POINTS: i32 = 20;
    let surfaces = common::lightmapped(world);
    std::array::from_fn(|face| {
        let axis = [DVec3::X, DVec3::Y, DVec3::Z][face / 2] * if face % 2 == 0 { -1.0 } else { 1.0 };
        let (right, up) =
            ([DVec3::Y, DVec3::Z, DVec3::X][face / 2], [DVec3::Z, DVec3::X, DVec3::Y][face / 2]);
        let at = |i: i32| half * (f64::from(2 * i + 1) / f64::from(POINTS) - 1.0);
        let points = (0..POINTS * POINTS).map(|i| axis * half + right * at(i % POINTS) + up * at(i / POINTS));
        points
            .map(|position| {
                let point = common::ReferencePoint { position, normal: -axis, irradiance: DVec3::ZERO };
                common::look_up(&surfaces, &point).expect("the wall has a map").x
            })
            .collect()
    })
}

#[test]
fn a_lamp_a_thousandth_of_the_room_gives_all_its_light_and_no_sparks() {
    // Emitted and absorbed power are equal: the mean of E over the walls is Φ / (A (1 - ρ)), Φ = π L a².
    const REFLECTANCE: f32 = 0.5;
    let mut world = World::new();
    spawn(&mut world, room(Vec3::splat(2.0)), matt(REFLECTANCE, 0.0), DVec3::ZERO);
    let side = 2e-3f32;
    let lamp = shapes::cuboid(Vec3::splat(side), 1);
    spawn(&mut world, lamp, matt(0.0, 1e6), DVec3::new(0.1, 0.2, -0.15));
    run(&mut world, 64);
    let walls = on_the_walls(&mut world, 1.0);
    let all: Vec<f64> = walls.iter().flatten().copied().collect();
    let expected = PI * 1e6 * 6.0 * f64::from(side).powi(2) / (24.0 * 0.5);
    // A grid of twenty points and texels of 1/10 m over a function like cos³/d²: well under one per cent; draft's patches another.
    assert!((mean(&all) / expected - 1.0).abs() < 0.02, "{} instead of {expected}", mean(&all));
    // Beside its neighbours nothing stands out: along rows the change is that of the cosine and distance.
    for wall in &walls {
        for row in wall.chunks(20) {
            for three in row.windows(3) {
                let between = 0.5 * (three[0] + three[2]);
                assert!((three[1] / between - 1.0).abs() < 0.1, "a spark: {three:?}");
            }
        }
    }
}
