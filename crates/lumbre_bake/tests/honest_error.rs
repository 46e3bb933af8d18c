//! The error that a bake states of itself, against a converged bake of the same map.

use std::ops::ControlFlow;
use std::sync::Arc;

use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_bake::{BakeOptions, BakeReport, Density, LightmapError, Quality, bake};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{BakeMode, Light, Material, Surface};
use lumbre_scene::{Lightmap, Mesh, StaticObject, Transform};

fn matt(reflectance: Vec3, emission: Vec3) -> Material {
    Material {
        front: Surface { diffuse: reflectance, emission, ..Surface::default() },
        ..Material::default()
    }
}

/// A box seen from inside.
fn room(size: Vec3) -> Arc<TriangleMesh> {
    let mut mesh = shapes::cuboid(size, 1);
    mesh.indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
    mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
    Arc::new(mesh)
}

/// A coloured room with a lamp under its ceiling, two blocks and a small light behind one of them: penumbrae, contact shadows,
/// corners, and a part that only bounces light.
fn lit_room() -> World {
    let mut world = World::new();
    world.spawn((
        Mesh(room(Vec3::new(4.0, 3.0, 4.0))),
        matt(Vec3::new(0.7, 0.6, 0.5), Vec3::ZERO),
        StaticObject,
    ));
    let lamp = Mesh(Arc::new(shapes::cuboid(Vec3::new(1.0, 0.05, 0.6), 1)));
    world.spawn((
        lamp,
        matt(Vec3::splat(0.5), Vec3::new(10.0, 9.0, 7.0)),
        StaticObject,
        Transform::from_xyz(0.4, 1.0, -0.3),
    ));
    for (size, at) in
        [(Vec3::new(0.9, 1.6, 0.9), [-0.9, -0.7, -0.8]), (Vec3::new(1.1, 0.7, 0.8), [0.9, -1.15, 0.7])]
    {
        let block = Mesh(Arc::new(shapes::cuboid(size, 1)));
        world.spawn((
            block,
            matt(Vec3::new(0.3, 0.6, 0.4), Vec3::ZERO),
            StaticObject,
            Transform::from_xyz(at[0], at[1], at[2]),
        ));
    }
    let light = Light { bake: BakeMode::Static, ..Light::point(Vec3::splat(0.4)) };
    world.spawn((light, Transform::from_xyz(-1.6, -1.0, -1.5)));
    world
}

struct Texels {
    values: Vec<DVec3>,
    errors: Vec<f32>,
}

fn baked(options: &BakeOptions) -> (BakeReport, Texels) {
    let mut world = lit_room();
    let report = bake(&mut world, options, &mut |_| ControlFlow::Continue(())).expect("the scene bakes");
    let mut query = world.query::<(&Lightmap, &LightmapError)>();
    let mut maps: Vec<_> =
        query.iter(&world).map(|(map, error)| (map.image.clone(), error.0.clone())).collect();
    maps.sort_by(|a, b| a.0.name.cmp(&b.0.name));
    let values = maps.iter().flat_map(|(map, _)| map.texels.iter().map(|texel| texel.as_dvec3())).collect();
    let errors = maps.iter().flat_map(|(_, errors)| errors.iter().copied()).collect();
    (report, Texels { values, errors })
}

#[test]
fn the_stated_error_is_honest() {
    let reference_options = BakeOptions {
        density: Density::MapSize(48),
        quality: Quality::Reference,
        error: 2e-3,
        seed: 99,
        denoise: false,
        ..BakeOptions::default()
    };
    let (reference, expected) = baked(&reference_options);
    println!("reference: {:.1} s, states {:.3} %", reference.seconds, 100.0 * reference.estimated_error);
    for (quality, error) in [(Quality::Draft, 0.05), (Quality::Final, 0.03), (Quality::Final, 0.01)] {
        let options = BakeOptions { density: Density::MapSize(48), quality, error, ..BakeOptions::default() };
        let (report, found) = baked(&options);
        let (mut within, mut count, mut squares, mut mean) = (0u32, 0u32, 0.0, 0.0);
        let both = found.values.iter().zip(&expected.values).zip(found.errors.iter().zip(&expected.errors));
        for ((value, truth), (stated, also)) in both.filter(|(_, (a, b))| a.is_finite() && b.is_finite()) {
            let apart = (*value - *truth).length() / 3f64.sqrt();
            // The reference has an error too, and says so.
            let stated = f64::from(*stated).hypot(f64::from(*also));
            within += u32::from(apart <= 2.0 * stated);
            count += 1;
            squares += apart * apart;
            mean += truth.element_sum() / 3.0;
        }
        let (share, mean) = (f64::from(within) / f64::from(count), mean / f64::from(count));
        let true_error = (squares / f64::from(count)).sqrt() / mean;
        println!(
            "{quality:?} {error}: stated {:.3} %, true {:.3} %, {:.2} % of {count} texels within twice theirs, {:.2} s",
            100.0 * report.estimated_error,
            100.0 * true_error,
            100.0 * share,
            report.seconds
        );
        // Measured: 90 to 94 of a hundred; the rest lies on the ceiling around the lamp, where patches are too coarse one bounce later.
        assert!(
            share >= 0.85,
            "{quality:?} {error}: only {share} of the texels are within twice the stated error"
        );
        assert!(true_error <= report.estimated_error, "{quality:?} {error}: the whole is worse than stated");
        // Modest, too: an estimate of everything would be honest and useless.
        assert!(report.estimated_error <= 4.0 * true_error, "{quality:?} {error}: far too pessimistic");
    }
}
