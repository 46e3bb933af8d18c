//! Bakes a room lit by a quadrilateral lamp, by spheres of many triangles, by neon letters and by many point lights, and prints
//! what each costs: `many_emitters [--error X] [--map-size N]`.

#![allow(clippy::print_stdout, reason = "a program whose result is text")]

use std::error::Error;
use std::ops::ControlFlow;
use std::sync::Arc;

use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_bake::{BakeOptions, Density, bake};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{Attenuation, BakeMode, Light, Material, Surface};
use lumbre_scene::{Mesh, StaticObject, Transform};

fn matt(reflectance: f32, emission: f32) -> Material {
    let front =
        Surface { diffuse: Vec3::splat(reflectance), emission: Vec3::splat(emission), ..Surface::default() };
    Material { front, ..Material::default() }
}

/// A room of 4 x 3 x 4 m with two blocks.
fn room() -> World {
    let mut world = World::new();
    let mut mesh = shapes::cuboid(Vec3::new(4.0, 3.0, 4.0), 1);
    mesh.indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
    mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
    world.spawn((Mesh(Arc::new(mesh)), matt(0.6, 0.0), StaticObject));
    for (size, at) in
        [(Vec3::new(0.9, 1.6, 0.9), [-0.9, -0.7, -0.8]), (Vec3::new(1.1, 0.7, 0.8), [0.9, -1.15, 0.7])]
    {
        let block = Mesh(Arc::new(shapes::cuboid(size, 1)));
        world.spawn((block, matt(0.5, 0.0), StaticObject, Transform::from_xyz(at[0], at[1], at[2])));
    }
    world
}

/// Adds an emissive mesh of so much power, whatever its area.
fn lamp(world: &mut World, mesh: TriangleMesh, power: f32, at: DVec3) {
    let area: f32 = mesh
        .triangle_positions()
        .unwrap_or_default()
        .iter()
        .map(|[a, b, c]| 0.5 * (*b - *a).cross(*c - *a).length())
        .sum();
    let material = matt(0.0, power / (area * std::f32::consts::PI));
    world.spawn((Mesh(Arc::new(mesh)), material, StaticObject, Transform::from_xyz(at.x, at.y, at.z)));
}

fn quad() -> TriangleMesh {
    let mut mesh = shapes::plane(0.6, 0.6, 1, 1);
    mesh.indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
    mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
    mesh
}

fn scene(name: &str) -> World {
    let mut world = room();
    let middle = DVec3::new(0.3, 1.1, -0.2);
    match name {
        "quad lamp" => lamp(&mut world, quad(), 10.0, middle),
        "sphere of 2,000" => lamp(&mut world, shapes::uv_sphere(0.15, 44, 24), 10.0, middle),
        "sphere of 10,000" => lamp(&mut world, shapes::uv_sphere(0.15, 100, 51), 10.0, middle),
        "100 balls of 100" => {
            let mut balls = TriangleMesh::default();
            for i in 0..100u8 {
                let at = Vec3::new(0.36 * f32::from(i % 10) - 1.6, 1.2, 0.36 * f32::from(i / 10) - 1.6);
                let ball = shapes::uv_sphere(0.03, 10, 6);
                let first = balls.positions.len() as u32;
                balls.positions.extend(ball.positions.iter().map(|position| *position + at));
                balls.normals.extend(ball.normals);
                balls.indices.extend(ball.indices.iter().map(|index| first + index));
            }
            lamp(&mut world, balls, 10.0, DVec3::ZERO);
        }
        "1 point light" => {
            let light = Light { bake: BakeMode::Static, ..Light::point(Vec3::ONE) };
            world.spawn((light, Transform::from_xyz(middle.x, middle.y, middle.z)));
        }
        _ => {
            let range = if name.contains("range") { 1.0 } else { f32::INFINITY };
            for i in 0..1024 {
                let [x, y, z] = [0, 1, 2].map(|axis| f64::from((i >> (axis * 10 / 3)) % 10) / 10.0 - 0.45);
                let attenuation = Attenuation { range, ..Attenuation::INVERSE_SQUARE };
                let light = Light { bake: BakeMode::Static, attenuation, ..Light::point(Vec3::splat(1e-3)) };
                world.spawn((light, Transform::from_xyz(3.8 * x, 2.8 * y, 3.8 * z)));
            }
        }
    }
    world
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut options = BakeOptions { density: Density::MapSize(128), ..BakeOptions::default() };
    let mut arguments = std::env::args().skip(1);
    let mut only = None;
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or_else(|| format!("{argument} needs a value"));
        match argument.as_str() {
            "--error" => options.error = value()?.parse()?,
            "--map-size" => options.density = Density::MapSize(value()?.parse()?),
            "--only" => only = Some(value()?),
            _ => return Err(format!("{argument} is no option").into()),
        }
    }
    let names = [
        "quad lamp",
        "sphere of 2,000",
        "sphere of 10,000",
        "100 balls of 100",
        "1 point light",
        "1024 point lights of 1 m range",
        "1024 point lights",
    ];
    for name in names.into_iter().filter(|name| only.as_ref().is_none_or(|only| name.contains(only.as_str())))
    {
        let mut world = scene(name);
        let report = bake(&mut world, &options, &mut |_| ControlFlow::Continue(()))?;
        let direct =
            report.stages.iter().find(|stage| stage.stage == "direct light").map_or(0.0, |s| s.seconds);
        println!(
            "{name:<32} {:>7.2} s ({direct:>6.2} s direct), {:>6.1} million rays, error {:.2} %, mean {:.4}",
            report.seconds,
            report.rays as f64 * 1e-6,
            100.0 * report.estimated_error,
            report.mean_irradiance[0]
        );
    }
    Ok(())
}
