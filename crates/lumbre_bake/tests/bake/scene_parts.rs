//! Materials, and the plain bake, that the tests of several subjects use.

use bevy_ecs::world::World;
use glam::Vec3;
use lumbre_bake::{Bake, BakeOptions, BakeReport};
use lumbre_optics::{Material, Surface};

/// A diffuse material that shines by itself, both faces.
pub fn matt(reflectance: Vec3, emission: Vec3) -> Material {
    let front = Surface { diffuse: reflectance, emission, ..Surface::default() };
    Material { front, ..Material::default() }
}

/// The same in grey.
pub fn grey(reflectance: f32, emission: f32) -> Material {
    matt(Vec3::splat(reflectance), Vec3::splat(emission))
}

/// A bake of a World that can be baked.
pub fn run(world: &mut World, options: &BakeOptions) -> BakeReport {
    Bake::new(options).run(world).expect("the scene bakes")
}
