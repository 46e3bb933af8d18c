//! A bake answers to a cancel within a moment, whatever it is doing: making charts, building the hierarchy, looking for hidden texels, smoothing.
//! How long a moment is on this machine is printed; what is asserted is what a loaded one keeps.

#![allow(clippy::print_stdout, reason = "the times are what one wants to see of it")]

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use bevy_ecs::world::World;
use glam::Vec3;
use lumbre_bake::{BakeError, BakeOptions, Density, Progress, bake};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{BakeMode, Light, Material, Surface};
use lumbre_scene::{Lightmap, Mesh, StaticObject, Transform};

/// Longest time from a cancel to the end: two tenths of a second on an idle machine, and some patience with others.
const MOMENT: Duration = Duration::from_secs(2);

/// A room with a fine ball, a lamp and a light.
fn room() -> World {
    let mut world = World::new();
    let matt = |emission: f32| Material {
        front: Surface { diffuse: Vec3::splat(0.7), emission: Vec3::splat(emission), ..Surface::default() },
        ..Material::default()
    };
    let mut add = |mesh: TriangleMesh, at: [f64; 3], emission: f32| {
        let place = Transform::from_xyz(at[0], at[1], at[2]);
        world.spawn((Mesh(Arc::new(mesh)), matt(emission), StaticObject, place));
    };
    let mut shell = shapes::cuboid(Vec3::new(5.0, 3.0, 5.0), 1);
    shell.indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
    shell.normals.iter_mut().for_each(|normal| *normal = -*normal);
    add(shell, [0.0, 1.5, 0.0], 0.0);
    add(shapes::uv_sphere(0.7, 120, 60), [0.6, 0.7, 0.3], 0.0);
    add(shapes::cuboid(Vec3::new(0.8, 0.05, 0.8), 1), [-1.0, 2.8, 0.0], 9.0);
    let light = Light { bake: BakeMode::Static, ..Light::point(Vec3::splat(1.0)) };
    world.spawn((light, Transform::from_xyz(1.5, 2.0, 1.5)));
    world
}

fn options() -> BakeOptions {
    BakeOptions { density: Density::TexelsPerMeter(25.0), error: 0.02, ..BakeOptions::default() }
}

#[test]
fn a_cancel_is_answered_within_a_moment_at_any_time() {
    // How long it takes, and how long the caller is not asked in each stage.
    let (begun, mut last) = (Instant::now(), Instant::now());
    let mut gaps: BTreeMap<&str, Duration> = BTreeMap::new();
    let mut stage = "layout";
    let mut watching = |progress: Progress| {
        let gap = gaps.entry(stage).or_default();
        *gap = (*gap).max(last.elapsed());
        (last, stage) = (Instant::now(), progress.stage);
        ControlFlow::Continue(())
    };
    let report = bake(&mut room(), &options(), &mut watching).expect("the room bakes");
    let whole = begun.elapsed();
    println!("{report}");
    println!("{whole:?}; longest time in which nobody was asked: {gaps:?}");
    for stage in [
        "layout",
        "hierarchy",
        "direct light",
        "form factors",
        "radiosity",
        "final gather",
        "texels",
        "seams",
    ] {
        assert!(gaps.contains_key(stage), "{stage} is not among {:?}", gaps.keys());
    }
    assert!(gaps.values().all(|gap| *gap < MOMENT), "{gaps:?}");
    // Cancelled at times spread over all of that.
    const TIMES: u32 = 12;
    for time in 0..TIMES {
        let (mut world, at) = (room(), whole * time / TIMES);
        let (begun, mut asked) = (Instant::now(), None);
        let ended = bake(&mut world, &options(), &mut |_| {
            if begun.elapsed() < at {
                return ControlFlow::Continue(());
            }
            asked.get_or_insert_with(Instant::now);
            ControlFlow::Break(())
        });
        let answered = asked.map(|asked| asked.elapsed()).unwrap_or_default();
        match ended {
            Err(BakeError::Cancelled { stage }) => println!("{at:?}: {stage} ended after {answered:?}"),
            // It was quicker than the first.
            Ok(_) => continue,
            Err(error) => panic!("{error}"),
        }
        assert!(answered < MOMENT, "{answered:?} at {at:?}");
        assert_eq!(world.query::<&Lightmap>().iter(&world).count(), 0);
    }
}
