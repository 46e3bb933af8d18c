//! Materials and a bake with an expected success, which several modules use. Meshes are in `common::shapes`.

use bevy_ecs::world::World;
use glam::Vec3;
use lumbre_bake::{Bake, BakeOptions, BakeReport};
use lumbre_optics::{Material, Surface};

/// A diffuse material whose front side also emits.
pub fn matt(reflectance: Vec3, emission: Vec3) -> Material {
    let front = Surface { diffuse: reflectance, emission, ..Surface::default() };
    Material { front, ..Material::default() }
}

/// A diffuse, emissive material whose channels are all equal.
pub fn grey(reflectance: f32, emission: f32) -> Material {
    matt(Vec3::splat(reflectance), Vec3::splat(emission))
}

/// A black, double-sided material: it hides light and shows its own irradiance on the front.
pub fn black_sheet() -> Material {
    Material { double_sided: true, ..grey(0.0, 0.0) }
}

/// Bakes a World and panics on an error.
pub fn run(world: &mut World, options: &BakeOptions) -> BakeReport {
    Bake::new(options).run(world).expect("the scene bakes")
}
