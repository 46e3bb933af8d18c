//! Small worlds for the tests, and functions that trace them.

#![allow(dead_code, reason = "every test uses its own part of this module")]

use std::ops::ControlFlow;
use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec2, DVec3, Vec3};
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{Material, Surface};
use lumbre_scene::{Camera, Medium, Mesh, Projection, Quadric, SceneSettings, Transform};
use lumbre_trace::{Branch, Integrator, Kind, Picture, TraceOptions, TraceReport, Tracer, trace};

/// A material that reflects and emits nothing.
pub fn black() -> Material {
    Material::matt(Vec3::ZERO)
}

/// A mirror that reflects this fraction of the light.
pub fn mirror(weight: f32) -> Material {
    Material { mirror: Vec3::splat(weight), ..black() }
}

/// Clear glass.
pub fn glass(ior: f32) -> Material {
    Material { transmission: Vec3::ONE, ior, ..black() }
}

/// Makes glass follow Fresnel's equations.
pub fn fresnel() -> Medium {
    Medium { fresnel: true, ..Medium::default() }
}

/// An emissive material that also reflects diffusely.
pub fn glowing(emission: f32, reflectance: f32) -> Material {
    let front = Surface {
        diffuse: Vec3::splat(reflectance),
        ambient: Vec3::ZERO,
        emission: Vec3::splat(emission),
        ..Surface::default()
    };
    Material { front, ..Material::default() }
}

/// Spawns an exact surface with a transform. Its mesh would be drawn by the rasterizer, and rays do not read
/// it.
pub fn exact(world: &mut World, quadric: Quadric, material: Material, place: Transform) -> Entity {
    world.spawn((Mesh(Arc::new(TriangleMesh::default())), quadric, material, place)).id()
}

/// Spawns a camera at `eye` that looks at `target`, with a vertical field of view in radians.
pub fn camera(world: &mut World, eye: DVec3, target: DVec3, vertical_fov: f64) {
    let up = if (target - eye).cross(DVec3::Y).length() < 1e-9 { DVec3::Z } else { DVec3::Y };
    let projection = Projection::Perspective { vertical_fov, aspect: None, near: 1e-6, far: None };
    let place = Transform::from_translation(eye).looking_at(target, up);
    world.spawn((Camera { projection, exposure: 1.0 }, place));
}

/// Replaces all cameras by a new one.
pub fn look_from(world: &mut World, eye: DVec3, target: DVec3, vertical_fov: f64) {
    let mut cameras = world.query_filtered::<Entity, With<Camera>>();
    let old: Vec<Entity> = cameras.iter(world).collect();
    for entity in old {
        world.despawn(entity);
    }
    camera(world, eye, target, vertical_fov);
}

/// Sets a uniform sky.
pub fn furnace(world: &mut World, radiance: f32) {
    world.insert_resource(SceneSettings { sky: Vec3::splat(radiance), ..SceneSettings::default() });
}

/// Options for a small square picture.
pub fn options(side: u32) -> TraceOptions {
    TraceOptions { size: (side, side), ..TraceOptions::default() }
}

/// Options for path tracing a small square picture.
pub fn paths(side: u32, samples: u32) -> TraceOptions {
    TraceOptions { integrator: Integrator::Path, samples: Some(samples), ..options(side) }
}

/// Traces a whole picture.
pub fn draw(world: &mut World, options: &TraceOptions) -> (Picture, TraceReport) {
    trace(world, options, &|_| ControlFlow::Continue(())).expect("the world can be traced")
}

/// Traces the ray tree through the centre of the picture.
pub fn tree(world: &mut World, options: &TraceOptions) -> Branch {
    let tracer = Tracer::new(world, options).expect("the world can be traced");
    tracer.tree(0.5 * DVec2::new(f64::from(options.size.0), f64::from(options.size.1)))
}

/// Returns the branch of a kind that was not cut off, if there is one.
pub fn next(branch: &Branch, kind: Kind) -> Option<&Branch> {
    branch.branches.iter().find(|branch| branch.kind == kind && !branch.cut)
}

/// Follows the transmitted rays and returns the last of them.
pub fn through(branch: &Branch) -> &Branch {
    let mut last = branch;
    while let Some(branch) = next(last, Kind::Transmitted) {
        last = branch;
    }
    last
}
