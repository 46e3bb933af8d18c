//! Small scenes and what is read of them, for the cases. Not the cases.

use std::f64::consts::{FRAC_1_PI, PI};
use std::sync::Arc;

use bevy_ecs::entity::Entity;
use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_bake::{Bake, BakeOptions, BakeReport, Density, Quality};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{BakeMode, Light, Material, Surface};
use lumbre_scene::{Lightmap, Mesh, Name, StaticObject, Transform};

use crate::common::{self, ReferencePoint};

pub fn draft(side: u32) -> BakeOptions {
    BakeOptions { density: Density::MapSize(side), quality: Quality::Draft, ..BakeOptions::default() }
}

pub fn run(world: &mut World, options: &BakeOptions) -> BakeReport {
    Bake::new(options).run(world).expect("the scene bakes")
}

pub fn matt(reflectance: f32, emission: f32) -> Material {
    let front =
        Surface { diffuse: Vec3::splat(reflectance), emission: Vec3::splat(emission), ..Surface::default() };
    Material { front, ..Material::default() }
}

pub fn spawn(world: &mut World, name: &'static str, mesh: TriangleMesh, material: Material) -> Entity {
    world.spawn((Name::new(name), Mesh(Arc::new(mesh)), material, StaticObject)).id()
}

/// A horizontal square of a side about the y axis at a height, looking up or down.
pub fn square(side: f32, y: f32, up: bool) -> TriangleMesh {
    let h = 0.5 * side;
    let positions = [[-h, -h], [h, -h], [h, h], [-h, h]].map(|[x, z]| Vec3::new(x, y, z)).to_vec();
    let indices = if up { vec![0, 2, 1, 0, 3, 2] } else { vec![0, 1, 2, 0, 2, 3] };
    TriangleMesh { positions, indices, ..TriangleMesh::default() }
}

/// A box seen from inside.
pub fn room(size: Vec3) -> TriangleMesh {
    let mut mesh = shapes::cuboid(size, 1);
    mesh.indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
    mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
    mesh
}

/// A sun that stands at the zenith and gives a floor an irradiance of 1.
pub fn zenith(world: &mut World) {
    let light = Light { bake: BakeMode::Static, ..Light::directional(Vec3::splat(FRAC_1_PI as f32)) };
    world.spawn((light, Transform::from_xyz(0.0, 5.0, 0.0).looking_at(DVec3::ZERO, DVec3::X)));
}

/// A point light of an intensity that gives π · intensity at 1 m.
pub fn lamp(world: &mut World, intensity: f32, at: DVec3) {
    let light = Light { bake: BakeMode::Static, ..Light::point(Vec3::splat(intensity)) };
    world.spawn((light, Transform::from_translation(at)));
}

/// The irradiance that the maps show at points of surfaces that face `normal`, in the red.
pub fn irradiance(world: &mut World, normal: DVec3, points: impl IntoIterator<Item = DVec3>) -> Vec<f64> {
    let surfaces = common::lightmapped(world);
    let look_up = |position| {
        let point = ReferencePoint { position, normal, irradiance: DVec3::ZERO };
        common::look_up(&surfaces, &point).expect("there is a surface with a map").x
    };
    points.into_iter().map(look_up).collect()
}

/// Mean irradiance over the texels of an entity that hold any.
pub fn mean_of(world: &World, entity: Entity) -> f64 {
    let map = &world.get::<Lightmap>(entity).expect("the entity was baked").image;
    let lit: Vec<f64> = map.texels.iter().map(|texel| f64::from(texel.x) * PI).filter(|&e| e > 0.0).collect();
    lit.iter().sum::<f64>() / lit.len().max(1) as f64
}

/// Texels of all maps that are NaN, infinite or below zero.
pub fn bad_texels(world: &mut World) -> f64 {
    let maps = common::maps(world);
    let texels = maps.iter().flat_map(|(_, map)| map.texels.iter());
    texels.filter(|texel| !texel.is_finite() || texel.min_element() < 0.0).count() as f64
}

/// How many of two worlds' texels differ in any bit.
pub fn different(a: &mut World, b: &mut World) -> f64 {
    let (a, b) = (common::bits(a), common::bits(b));
    assert!(a.len() == b.len() && a.iter().any(|&bits| bits != 0), "maps of the same size, with light");
    a.iter().zip(&b).filter(|(a, b)| a != b).count() as f64
}

/// The warning that holds some words.
pub fn warning(report: &BakeReport, words: &str) -> String {
    report.warnings.iter().find(|line| line.contains(words)).cloned().unwrap_or_default()
}
