//! A bake stops soon after it is cancelled, whatever it is doing: computing charts, building the hierarchy, finding
//! hidden texels, smoothing. The measured delays are printed; the asserted limit is one that a heavily loaded machine
//! keeps, too.

#![allow(clippy::print_stdout, reason = "the delays are the result that a reader of the output wants")]

#[path = "common/shapes.rs"]
mod test_shapes;

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

/// The longest accepted delay between a cancellation and the end of the bake: an idle machine takes two tenths of a
/// second; the rest is a margin for loaded ones.
const MAX_DELAY: Duration = Duration::from_secs(2);

/// A room with a finely tessellated ball, a lamp and a point light.
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
    add(test_shapes::room(Vec3::new(5.0, 3.0, 5.0)), [0.0, 1.5, 0.0], 0.0);
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
fn a_bake_stops_soon_after_it_is_cancelled_at_any_time() {
    // First measure how long the whole bake takes, and the longest time between two progress calls in each stage.
    let (begun, mut last) = (Instant::now(), Instant::now());
    let mut gaps: BTreeMap<&str, Duration> = BTreeMap::new();
    let mut stage = "layout";
    let record_gap = |progress: Progress| {
        let gap = gaps.entry(stage).or_default();
        *gap = (*gap).max(last.elapsed());
        (last, stage) = (Instant::now(), progress.stage);
        ControlFlow::Continue(())
    };
    let report = Bake::new(&options()).progress(record_gap).run(&mut room()).expect("the room bakes");
    let total = begun.elapsed();
    println!("{report}");
    println!("{total:?}; longest time between two progress calls: {gaps:?}");
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
    assert!(gaps.values().all(|gap| *gap < MAX_DELAY), "{gaps:?}");
    // Then cancel at times spread evenly over the whole bake.
    const TIMES: u32 = 12;
    for time in 0..TIMES {
        let (mut world, at) = (room(), total * time / TIMES);
        let (begun, mut cancelled) = (Instant::now(), None);
        let result = Bake::new(&options())
            .progress(|_| {
                if begun.elapsed() < at {
                    return ControlFlow::Continue(());
                }
                cancelled.get_or_insert_with(Instant::now);
                ControlFlow::Break(())
            })
            .run(&mut world);
        let delay = cancelled.map(|cancelled| cancelled.elapsed()).unwrap_or_default();
        match result {
            Err(BakeError::Cancelled { stage }) => println!("{at:?}: {stage} ended after {delay:?}"),
            // This bake was faster than the measured one and ended before it could be cancelled.
            Ok(_) => continue,
            Err(error) => panic!("{error}"),
        }
        assert!(delay < MAX_DELAY, "{delay:?} at {at:?}");
        assert_eq!(world.query::<&Lightmap>().iter(&world).count(), 0);
    }
}

#[test]
fn a_token_ends_a_bake_from_another_thread() {
    let (mut world, token) = (room(), CancelToken::default());
    let (begun, canceller_token) = (Instant::now(), token.clone());
    let canceller = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(200));
        canceller_token.cancel();
    });
    let result = Bake::new(&options()).cancel(&token).run(&mut world);
    assert!(matches!(result, Err(BakeError::Cancelled { .. })), "{result:?}");
    assert!(begun.elapsed() < Duration::from_millis(200) + MAX_DELAY, "{:?}", begun.elapsed());
    assert_eq!(world.query::<&Lightmap>().iter(&world).count(), 0);
    canceller.join().unwrap();
    // A cancelled token stays cancelled.
    let again = Bake::new(&options()).cancel(&token).run(&mut world);
    assert_eq!(again, Err(BakeError::Cancelled { stage: "layout" }));
}
