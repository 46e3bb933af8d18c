//! Helpers of the cases: materials, lights, bakes, and values read from the baked maps. The cases are in the other
//! modules.

use std::f64::consts::{FRAC_1_PI, PI};
use std::sync::Arc;

use bevy_ecs::entity::Entity;
use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_bake::{Bake, BakeOptions, BakeReport, Density, Quality};
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{BakeMode, Light, Material, Surface};
use lumbre_scene::{Lightmap, Mesh, Name, StaticObject, Transform};

use crate::common::{self, ReferencePoint};

pub fn draft(side: u32) -> BakeOptions {
    BakeOptions { density: Density::MapSize(side), quality: Quality::Draft, ..BakeOptions::default() }
}

pub fn run(world: &mut World, options: &BakeOptions) -> BakeReport {
    Bake::new(options).run(world).expect("the scene bakes")
}

/// A diffuse material whose front side also emits; all channels are equal.
pub fn grey(reflectance: f32, emission: f32) -> Material {
    let front =
        Surface { diffuse: Vec3::splat(reflectance), emission: Vec3::splat(emission), ..Surface::default() };
    Material { front, ..Material::default() }
}

pub fn spawn(world: &mut World, name: &'static str, mesh: TriangleMesh, material: Material) -> Entity {
    world.spawn((Name::new(name), Mesh(Arc::new(mesh)), material, StaticObject)).id()
}

/// Adds a sun at the zenith that gives a floor an irradiance of 1 W/m².
pub fn zenith(world: &mut World) {
    let light = Light { bake: BakeMode::Static, ..Light::directional(Vec3::splat(FRAC_1_PI as f32)) };
    world.spawn((light, Transform::from_xyz(0.0, 5.0, 0.0).looking_at(DVec3::ZERO, DVec3::X)));
}

/// Adds a point light that gives an irradiance of π · intensity at a distance of 1 m.
pub fn point_light(world: &mut World, intensity: f32, at: DVec3) {
    let light = Light { bake: BakeMode::Static, ..Light::point(Vec3::splat(intensity)) };
    world.spawn((light, Transform::from_translation(at)));
}

/// The red channel of the irradiance that the maps show at points of surfaces that face along `normal`.
pub fn irradiance(world: &mut World, normal: DVec3, points: impl IntoIterator<Item = DVec3>) -> Vec<f64> {
    let surfaces = common::lightmapped(world);
    let look_up = |position| {
        let point = ReferencePoint { position, normal, irradiance: DVec3::ZERO };
        common::look_up(&surfaces, &point).expect("there is a surface with a map").x
    };
    points.into_iter().map(look_up).collect()
}

/// The mean irradiance (red channel) over the texels of an entity that are not black.
pub fn mean_of(world: &World, entity: Entity) -> f64 {
    let map = &world.get::<Lightmap>(entity).expect("the entity was baked").image;
    let lit: Vec<f64> = map.texels.iter().map(|texel| f64::from(texel.x) * PI).filter(|&e| e > 0.0).collect();
    lit.iter().sum::<f64>() / lit.len().max(1) as f64
}

/// Counts the texels of all maps that are NaN, infinite or negative.
pub fn bad_texels(world: &mut World) -> f64 {
    let maps = common::maps(world);
    let texels = maps.iter().flat_map(|(_, map)| map.texels.iter());
    texels.filter(|texel| !texel.is_finite() || texel.min_element() < 0.0).count() as f64
}

/// Counts the channel values that differ in any bit between the maps of two worlds.
pub fn differing_values(a: &mut World, b: &mut World) -> f64 {
    let (a, b) = (common::bits(a), common::bits(b));
    assert!(a.len() == b.len() && a.iter().any(|&bits| bits != 0), "maps of the same size, with light");
    a.iter().zip(&b).filter(|(a, b)| a != b).count() as f64
}

/// Returns the first warning that contains some words, or an empty text.
pub fn warning(report: &BakeReport, words: &str) -> String {
    report.warnings.iter().find(|line| line.contains(words)).cloned().unwrap_or_default()
}
