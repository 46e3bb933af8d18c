//! Writes a small scene of mirrors, glass and exact surfaces to be traced: `cargo run -p lumbre_trace
//! --example glass_scene -- glass.glb`.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{Light, Material, Surface};
use lumbre_scene::{Camera, Medium, Mesh, Name, Quadric, QuadricShape, SceneSettings, Transform, save};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("say where the scene goes, like glass.glb")?;
    let mut world = World::new();
    world.insert_resource(SceneSettings {
        ambient: Vec3::splat(0.06),
        background: Vec3::new(0.25, 0.4, 0.65),
        sky: Vec3::new(0.25, 0.4, 0.65),
        ..SceneSettings::default()
    });
    // A chequered floor: one mesh for the squares of each colour.
    for (parity, color) in [(0, Vec3::splat(0.75)), (1, Vec3::new(0.2, 0.25, 0.3))] {
        let name = Name::new(format!("floor {parity}"));
        world.spawn((name, Mesh(Arc::new(chequers(parity))), Material::matt(color)));
    }
    let shiny = |color: Vec3, shininess: f32| {
        let front = Surface {
            ambient: color,
            diffuse: color,
            specular: Vec3::splat(0.4),
            shininess,
            ..Surface::default()
        };
        Material { front, ..Material::default() }
    };
    let clear = Material { transmission: Vec3::ONE, ior: 1.5, ..shiny(Vec3::ZERO, 400.0) };
    let fresnel = Medium { fresnel: true, ..Medium::default() };
    let green = Medium { attenuation_color: Vec3::new(0.3, 0.9, 0.5), attenuation_distance: 0.8, ..fresnel };
    let ball = Arc::new(shapes::uv_sphere(1.0, 48, 24));
    let sphere = |name: &'static str, radius: f64, at: DVec3| {
        let place = Transform::from_translation(at).with_scale(DVec3::splat(radius));
        (Name::new(name), Mesh(ball.clone()), Quadric::sphere(1.0), place)
    };
    world.spawn((sphere("glass ball", 0.8, DVec3::new(0.3, 0.8, 1.2)), clear.clone(), fresnel));
    world.spawn((sphere("green glass ball", 0.5, DVec3::new(1.9, 0.5, 0.9)), clear.clone(), green));
    world.spawn((
        sphere("mirror ball", 1.0, DVec3::new(-1.9, 1.0, 0.0)),
        Material { mirror: Vec3::new(0.85, 0.85, 0.8), ..shiny(Vec3::splat(0.05), 300.0) },
    ));
    let cone = Quadric::new(QuadricShape::Cone { radius: 0.6, height: 1.6, closed: true });
    let place = Transform::from_xyz(1.4, 0.8, -1.0);
    let mesh = Mesh(Arc::new(shapes::cone(0.6, 1.6, 48)));
    world.spawn((Name::new("cone"), mesh, cone, shiny(Vec3::new(0.8, 0.25, 0.15), 40.0), place));
    let cylinder = Quadric::new(QuadricShape::Cylinder { radius: 0.35, height: 1.2, closed: true });
    let place = Transform::from_xyz(-0.4, 0.6, -1.2);
    let mesh = Mesh(Arc::new(shapes::cylinder(0.35, 1.2, 48)));
    world.spawn((Name::new("cylinder"), mesh, cylinder, shiny(Vec3::new(0.9, 0.7, 0.2), 60.0), place));
    // A mirror at the back, and a sheet of tinted glass at the side.
    let mirror = Material { mirror: Vec3::splat(0.9), ..Material::matt(Vec3::ZERO) };
    let place = Transform::from_xyz(0.0, 1.6, -3.0).with_rotation(DQuat::from_rotation_x(1.5));
    world.spawn((Name::new("mirror"), Mesh(Arc::new(shapes::plane(5.0, 3.0, 1, 1))), mirror, place));
    let sheet =
        Material { transmission: Vec3::new(0.9, 0.5, 0.4), double_sided: true, ..Material::matt(Vec3::ZERO) };
    let thin = Medium { thin: true, fresnel: true, ..Medium::default() };
    let place = Transform::from_xyz(3.0, 0.9, 0.2)
        .with_rotation(DQuat::from_rotation_y(-0.6) * DQuat::from_rotation_x(1.57));
    world.spawn((Name::new("sheet"), Mesh(Arc::new(shapes::plane(1.6, 1.8, 1, 1))), sheet, thin, place));
    let lamp = |color: Vec3, radius: f32| Light { radius, ..Light::point(color) };
    world.spawn((Name::new("lamp"), lamp(Vec3::splat(9.0), 0.2), Transform::from_xyz(2.5, 4.5, 3.0)));
    world.spawn((
        Name::new("fill"),
        lamp(Vec3::new(3.0, 2.6, 2.0), 0.2),
        Transform::from_xyz(-4.0, 3.0, 2.5),
    ));
    let place = Transform::from_xyz(0.4, 1.9, 6.2).looking_at(DVec3::new(0.1, 0.85, 0.0), DVec3::Y);
    world.spawn((Name::new("view"), Camera::default(), place));
    save(&mut world, std::path::Path::new(&path))?;
    Ok(())
}

/// Returns every other square of a floor 16 metres wide.
fn chequers(parity: i32) -> lumbre_mesh::TriangleMesh {
    let mut mesh = lumbre_mesh::TriangleMesh::default();
    for row in -8..8 {
        for column in -8..8 {
            if (row + column) & 1 != parity {
                continue;
            }
            let first = mesh.positions.len() as u32;
            for (x, z) in [(0, 0), (0, 1), (1, 1), (1, 0)] {
                mesh.positions.push(Vec3::new((column + x) as f32, 0.0, (row + z) as f32));
                mesh.normals.push(Vec3::Y);
            }
            mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
        }
    }
    mesh
}
