//! A small scene that involves every stage of a bake: an emissive lamp, a point light, bounces, shadows. It has no
//! closed form; tests compare bakes of it with each other.

use std::sync::Arc;

use bevy_ecs::world::World;
use glam::Vec3;
use lumbre_mesh::shapes::cuboid;
use lumbre_optics::{BakeMode, Light, Material, Surface};
use lumbre_scene::{Mesh, Name, StaticObject, Transform};

/// A floor, two walls, a box, a lamp panel and a static point light.
pub fn corner() -> World {
    let mut world = World::new();
    let mut add = |name: &str, size: Vec3, at: [f64; 3], material: Material| {
        let mesh = Mesh(Arc::new(cuboid(size, 1)));
        let place = Transform::from_xyz(at[0], at[1], at[2]);
        world.spawn((Name::new(name.to_owned()), mesh, material, StaticObject, place));
    };
    add("floor", Vec3::new(4.0, 0.2, 4.0), [0.0, -0.1, 0.0], Material::matt(Vec3::new(0.7, 0.7, 0.6)));
    add("left", Vec3::new(0.2, 3.0, 4.0), [-2.1, 1.5, 0.0], Material::matt(Vec3::new(0.8, 0.2, 0.1)));
    add("back", Vec3::new(4.0, 3.0, 0.2), [0.0, 1.5, -2.1], Material::matt(Vec3::splat(0.75)));
    add("box", Vec3::new(0.8, 1.0, 0.8), [0.3, 0.5, -0.4], Material::matt(Vec3::new(0.2, 0.6, 0.3)));
    let front = Surface { emission: Vec3::new(9.0, 8.0, 6.0), ..Surface::default() };
    let emissive = Material { front, ..Material::default() };
    add("lamp", Vec3::new(0.6, 0.1, 0.6), [0.5, 2.8, 0.2], emissive);
    let light = Light { bake: BakeMode::Static, ..Light::point(Vec3::splat(0.4)) };
    world.spawn((light, Transform::from_xyz(-1.0, 2.0, 1.0)));
    world
}
