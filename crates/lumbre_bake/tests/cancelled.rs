//! A bake answers to a cancel within a moment, whatever it is doing: making charts, building the hierarchy, looking for hidden texels, smoothing.
//! How long a moment is on this machine is printed; what is asserted is what a loaded one keeps.

#![allow(clippy::print_stdout, reason = "the times are what one wants to see of it")]

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use bevy_ecs::world::World;
use glam::Vec3;
use lumbre_bake::{Bake, BakeError, BakeOptions, CancelToken, Density, Progress};
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
    let watching = |progress: Progress| {
        let gap = gaps.entry(stage).or_default();
        *gap = (*gap).max(last.elapsed());
        (last, stage) = (Instant::now(), progress.stage);
        ControlFlow::Continue(())
    };
    let report = Bake::new(&options()).progress(watching).run(&mut room()).expect("the room bakes");
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
        let ended = Bake::new(&options())
            .progress(|_| {
                if begun.elapsed() < at {
                    return ControlFlow::Continue(());
                }
                asked.get_or_insert_with(Instant::now);
                ControlFlow::Break(())
            })
            .run(&mut world);
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

#[test]
fn a_token_ends_a_bake_from_another_thread() {
    let (mut world, token) = (room(), CancelToken::default());
    let (begun, its) = (Instant::now(), token.clone());
    let canceller = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(200));
        its.cancel();
    });
    let ended = Bake::new(&options()).cancel(&token).run(&mut world);
    assert!(matches!(ended, Err(BakeError::Cancelled { .. })), "{ended:?}");
    assert!(begun.elapsed() < Duration::from_millis(200) + MOMENT, "{:?}", begun.elapsed());
    assert_eq!(world.query::<&Lightmap>().iter(&world).count(), 0);
    canceller.join().unwrap();
    // Cancelled it stays.
    let again = Bake::new(&options()).cancel(&token).run(&mut world);
    assert_eq!(again, Err(BakeError::Cancelled { stage: "layout" }));
}
