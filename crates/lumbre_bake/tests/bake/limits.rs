//! Limits of a bake: time, memory, and the size of maps.

#![allow(clippy::unwrap_used, reason = "helpers of tests, which clippy does not count as tests")]

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use bevy_ecs::world::World;
use glam::Vec3;
use lumbre_bake::{Bake, BakeError, BakeOptions, BakeReport, Density, Ended, Progress, Quality, TexelErrors};
use lumbre_optics::{BakeMode, Light, Material};
use lumbre_scene::{Lightmap, Mesh, Name, StaticObject, Transform};

use crate::common;
use crate::corner::corner;

fn options() -> BakeOptions {
    BakeOptions { density: Density::MapSize(48), quality: Quality::Final, ..BakeOptions::default() }
}

fn baked(
    options: &BakeOptions,
    progress: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
) -> (World, BakeReport) {
    let mut world = corner();
    let report = Bake::new(options).progress(progress).run(&mut world).unwrap();
    (world, report)
}

/// The mean of the channels and the stated error of every texel that shows a surface.
fn texels(world: &mut World) -> Vec<(f32, f32)> {
    let mut maps = world.query::<(&Lightmap, &TexelErrors)>();
    let mut found: Vec<_> = maps.iter(world).collect();
    found.sort_by(|a, b| a.0.image.name.cmp(&b.0.image.name));
    let texels = found.iter().flat_map(|(map, errors)| map.image.texels.iter().zip(errors.0.iter()));
    texels.filter(|(_, error)| !error.is_nan()).map(|(e, error)| (e.element_sum() / 3.0, *error)).collect()
}

/// Checks that the maps of a bake whose time ran out are complete, and that the stated error covers the true one.
fn assert_complete_and_honest(world: &mut World, report: &BakeReport, what: &str) {
    assert_eq!((report.ended, report.error_reached), (Ended::Time, false), "{what}");
    let (mut better, _) = baked(&options(), &mut |_| ControlFlow::Continue(()));
    let (found, expected) = (texels(world), texels(&mut better));
    assert_eq!(found.len(), expected.len(), "{what}");
    let mean = expected.iter().map(|(e, _)| f64::from(*e)).sum::<f64>() / expected.len() as f64;
    // Outer faces see only a sliver of the floor, which all of the few rays of a patch may miss.
    let lit = |e: f32| f64::from(e) > 0.05 * mean;
    let dark =
        found.iter().zip(&expected).filter(|(found, expected)| found.0 <= 0.0 && lit(expected.0)).count();
    assert_eq!(dark, 0, "{what}: texels without light that have some");
    // The error of the better bake, 1 % of the mean, is far smaller.
    let square = |(a, b): (&(f32, f32), &(f32, f32))| f64::from(a.0 - b.0).powi(2);
    let error = (found.iter().zip(&expected).map(square).sum::<f64>() / found.len() as f64).sqrt() / mean;
    assert!(error <= 2.0 * report.estimated_error, "{what}: {error} of {}", report.estimated_error);
    assert!(report.estimated_error > options().error, "{what}: {}", report.estimated_error);
}

#[test]
fn without_any_time_there_is_a_complete_map() {
    let options = BakeOptions { time: Some(Duration::from_nanos(1)), ..options() };
    let (mut world, report) = baked(&options, &mut |_| ControlFlow::Continue(()));
    assert_complete_and_honest(&mut world, &report, "no time");
}

#[test]
fn wherever_the_time_runs_out_the_map_is_complete() {
    let time = Duration::from_millis(400);
    for stage in ["direct light", "form factors", "radiosity", "final gather"] {
        let begun = Instant::now();
        // Makes the time run out in this stage on a machine of any speed.
        let mut wait = |progress: Progress| {
            if progress.stage == stage && progress.stage_fraction > 0.0 {
                std::thread::sleep(time.saturating_sub(begun.elapsed()));
            }
            ControlFlow::Continue(())
        };
        let (mut world, report) = baked(&BakeOptions { time: Some(time), ..options() }, &mut wait);
        assert_complete_and_honest(&mut world, &report, stage);
    }
}

/// A box that is sunk into a floor hides a quarter of it: many more texels than can be tested exactly when there is no
/// time.
#[test]
fn hidden_texels_of_a_large_map_are_found_without_any_time() {
    let shown = |time| {
        let mut world = World::new();
        let mut add = |size: Vec3, height: f64, name: &str| {
            let mesh = Mesh(Arc::new(lumbre_mesh::shapes::cuboid(size, 1)));
            let place = Transform::from_xyz(0.0, height, 0.0);
            world.spawn((Name::new(name.to_owned()), mesh, Material::default(), StaticObject, place));
        };
        add(Vec3::new(4.0, 0.2, 4.0), -0.1, "floor");
        add(Vec3::new(2.0, 1.0, 2.0), 0.0, "box");
        let light = Light { bake: BakeMode::Static, ..Light::point(Vec3::ONE) };
        world.spawn((light, Transform::from_xyz(1.5, 2.0, 1.0)));
        let options = BakeOptions {
            density: Density::TexelsPerMeter(50.0),
            quality: Quality::Draft,
            error: 0.01,
            time,
            ..options()
        };
        let report = Bake::new(&options).run(&mut world).unwrap();
        (texels(&mut world).len(), report)
    };
    let (exact, report) = shown(None);
    assert!(report.hidden_texels > 9_000, "{}", report.hidden_texels);
    let (rough, report) = shown(Some(Duration::from_nanos(1)));
    assert_eq!(report.ended, Ended::Time);
    // Only texels at the box's outline on the floor may differ.
    let difference = exact.abs_diff(rough);
    assert!(difference < 800, "{exact} texels show something, or {rough}");
}

#[test]
fn the_report_states_why_the_bake_ended() {
    let end = |options: BakeOptions| baked(&options, &mut |_| ControlFlow::Continue(())).1;
    let reached = end(BakeOptions { error: 0.1, time: Some(Duration::from_secs(3600)), ..options() });
    assert_eq!((reached.ended, reached.error_reached), (Ended::Reached, true));
    let most = end(BakeOptions { error: 1e-6, quality: Quality::Draft, ..options() });
    assert_eq!((most.ended, most.error_reached), (Ended::MostRays, false));
    assert!(most.to_string().contains("most rays"), "{most}");
    let json =
        serde_json::to_value([Ended::Reached, Ended::Time, Ended::MostRays, Ended::NoFurtherGain]).unwrap();
    assert_eq!(json, serde_json::json!(["reached", "time", "most rays", "no further gain"]));
}

#[test]
fn less_memory_means_fewer_patches_and_too_little_is_an_error() {
    let within = |memory| {
        let mut world = corner();
        Bake::new(&BakeOptions { memory, ..options() }).run(&mut world)
    };
    let free = within(None).unwrap();
    let enough = within(Some(free.memory_bytes)).unwrap();
    assert_eq!((enough.patches, enough.memory_bytes), (free.patches, free.memory_bytes));
    assert!(enough.warnings.is_empty());
    // The smallest possible amount; then the middle between that and what the bake takes without a limit.
    let least = match within(Some(1 << 20)) {
        Err(error @ BakeError::Memory { needed, texels, limit, .. }) => {
            assert!(limit == 1 << 20 && needed > texels && texels > 0);
            let text = error.to_string();
            assert!(text.contains("1 MiB") && text.contains("lower the density"), "{text}");
            needed
        }
        other => panic!("{other:?}"),
    };
    let limit = u64::midpoint(least, free.memory_bytes);
    let tight = within(Some(limit)).unwrap();
    assert!(
        tight.patches < free.patches && tight.memory_bytes <= limit,
        "{} of {}",
        tight.patches,
        free.patches
    );
    assert!(
        tight.warnings.iter().any(|warning| warning.contains("patches instead of")),
        "{:?}",
        tight.warnings
    );
    // Fewer patches lose detail, but no light.
    let apart = (tight.mean_irradiance[1] / free.mean_irradiance[1] - 1.0).abs();
    assert!(apart < 3.0 * (tight.estimated_error + free.estimated_error), "{apart}");
}

/// A mesh of `count` separate triangles, which need as many charts.
fn confetti(count: u32) -> lumbre_mesh::TriangleMesh {
    let corners = (0..count).flat_map(|index| {
        let at = Vec3::new((index % 100) as f32, (index / 100) as f32, 0.0) * 0.1;
        [at, at + Vec3::X * 0.05, at + Vec3::Y * 0.05]
    });
    lumbre_mesh::TriangleMesh {
        positions: corners.collect(),
        indices: (0..3 * count).collect(),
        ..lumbre_mesh::TriangleMesh::default()
    }
}

/// Bakes a mesh under a point light. Returns the report and the side of the mesh's map.
fn baked_alone(
    mesh: lumbre_mesh::TriangleMesh,
    options: &BakeOptions,
) -> (Result<BakeReport, BakeError>, Option<u32>) {
    let mut world = World::new();
    let entity =
        world.spawn((Name::new("confetti"), Mesh(Arc::new(mesh)), Material::default(), StaticObject)).id();
    world.spawn((
        Light { bake: BakeMode::Static, ..Light::point(Vec3::ONE) },
        Transform::from_xyz(5.0, 1.0, 9.0),
    ));
    let report = Bake::new(options).run(&mut world);
    (report, world.get::<Lightmap>(entity).map(|map| map.image.width))
}

#[test]
fn charts_that_do_not_fit_a_map_get_a_larger_one_and_a_warning() {
    let options =
        BakeOptions { density: Density::MapSize(16), quality: Quality::Draft, ..BakeOptions::default() };
    let (report, side) = baked_alone(confetti(500), &options);
    let warnings = report.unwrap().warnings;
    // 500 charts of 2 x 2 texels with 2 between them need 90 x 90.
    assert_eq!(side, Some(128));
    let warned = |warning: &&String| {
        ["confetti", "500 charts", "16 x 16", "128 x 128"].iter().all(|word| warning.contains(word))
    };
    assert_eq!(warnings.iter().filter(warned).count(), 1, "{warnings:?}");
    // Charts that fit get a map of the requested size, without a warning.
    let (report, side) = baked_alone(confetti(12), &options);
    assert_eq!((side, report.unwrap().warnings), (Some(16), Vec::new()));
}

#[test]
fn charts_that_fit_no_map_are_an_error_with_advice() {
    // With a gap of 64 the largest map holds 15,625 charts.
    for density in [Density::MapSize(64), Density::TexelsPerMeter(1.0)] {
        let options = BakeOptions { density, gap: 64, ..options() };
        let (report, _) = baked_alone(confetti(16_000), &options);
        let error = report.unwrap_err();
        assert!(
            matches!(&error, BakeError::TooManyCharts { object, charts: 16_000, limit: 8192 } if object == "confetti"),
            "{error:?}"
        );
        let text = error.to_string();
        assert!(text.contains("confetti") && text.contains("weld its vertices"), "{text}");
    }
}

#[test]
fn the_scanned_bunny_fits_a_larger_map() {
    let Some(model) = common::shared("models/stanford-bunny.glb") else { return };
    let mut world = World::new();
    lumbre_scene::load(&mut world, &model).unwrap();
    let options = BakeOptions { density: Density::MapSize(64), ..options() };
    // The file has no light, so that only the layout is computed.
    let report = Bake::new(&options).run(&mut world).unwrap();
    assert!(
        report.warnings.iter().any(|warning| warning.contains("do not fit a map of 64 x 64")),
        "{:?}",
        report.warnings
    );
}
