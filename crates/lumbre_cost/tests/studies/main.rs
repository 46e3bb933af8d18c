//! Whole studies on scenes whose answer is known, the pictures that a report keeps, and reports that are
//! interrupted.

#![allow(clippy::unwrap_used, reason = "helpers of tests, which clippy does not count as tests")]

mod changed;
mod counts;
mod documents;
mod few_bakes;
mod kept_pictures;
mod live;
mod planted;
mod shadows;
mod tour;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_cost::{
    CostError, CostOptions, CostReport, PAGE, Point, REPORT, TABLE, measure, read_report, studies_named,
};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{BakeMode, Light, Material, Surface};
use lumbre_render::Gpu;
use lumbre_scene::{Camera, DynamicObject, Mesh, Name, StaticObject, Transform, save};

fn options(studies: &[&str], files: Vec<PathBuf>) -> CostOptions {
    let names: Vec<String> = studies.iter().map(|name| (*name).to_owned()).collect();
    CostOptions {
        files,
        studies: studies_named(&names).unwrap(),
        quick: true,
        counts_only: false,
        size: (48, 32),
        seed: 1,
        resume: false,
    }
}

fn measured(options: &CostOptions, folder: &Path) -> CostReport {
    let gpu = Gpu::headless().expect("a Vulkan driver; the software one will do");
    measure(&gpu, options, folder, &|_| ControlFlow::Continue(())).unwrap()
}

fn saved(folder: &Path, name: &str, mut world: World) -> PathBuf {
    let path = folder.join(name);
    save(&mut world, &path).unwrap();
    path
}

fn point<'a>(report: &'a CostReport, study: &str, series: &'a str) -> &'a Point {
    report.study(study).unwrap().of_series(series).next().unwrap()
}

#[test]
fn gouraud_is_phong_on_a_matt_plane_under_a_distant_light() {
    let folder = tempfile::tempdir().unwrap();
    let mut world = World::new();
    let plane = Mesh(Arc::new(shapes::plane(40.0, 40.0, 2, 2)));
    world.spawn((Name::new("plane"), plane, Material::matt(Vec3::new(0.7, 0.5, 0.3))));
    let above = Transform::from_xyz(1.0, 2.0, 0.5).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Name::new("sun"), Light::directional(Vec3::ONE), above));
    let eye = Transform::from_xyz(0.0, 6.0, 2.0).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Name::new("eye"), Camera::default(), eye));
    let path = saved(folder.path(), "plane.glb", world);
    let report = measured(&options(&["shading"], vec![path]), &folder.path().join("report"));
    for series in ["flat", "Gouraud", "Phong"] {
        let error = point(&report, "shading", series).error.unwrap();
        // The unit in the last place of f32 is 6e-8, and a cosine takes a handful of roundings.
        assert!(error.relative_rmse < 1e-6, "{series}: {error:?}");
        assert!(error.flip.unwrap() < 1e-3, "{series}: {error:?}");
    }
    let phong = point(&report, "shading", "Phong");
    let time = phong.milliseconds.unwrap();
    assert!(time.rounds >= 3 && time.lower <= time.median && time.median <= time.upper, "{time:?}");
    assert!(phong.counts["fragment invocations"] >= 48.0 * 32.0, "{:?}", phong.counts);
}

/// A closed box whose sides all glow with the same radiance and reflect half of what they receive: inside,
/// every direction is equally bright.
fn furnace() -> World {
    let outward = shapes::cuboid(Vec3::splat(2.0), 1);
    let turned = |triangle: &[u32; 3]| [triangle[0], triangle[2], triangle[1]];
    let inward = TriangleMesh {
        normals: outward.normals.iter().map(|normal| -*normal).collect(),
        indices: outward.indices.as_chunks::<3>().0.iter().flat_map(turned).collect(),
        tangents: Vec::new(),
        ..outward
    };
    let front = Surface { diffuse: Vec3::splat(0.5), emission: Vec3::ONE, ..Surface::default() };
    let mut world = World::new();
    let material = Material { front, ..Material::default() };
    world.spawn((Name::new("furnace"), Mesh(Arc::new(inward)), material, StaticObject));
    world.spawn((Name::new("eye"), Camera::default(), Transform::from_xyz(0.0, 0.0, 0.5)));
    world
}

#[test]
fn a_furnace_is_baked_without_error() {
    let folder = tempfile::tempdir().unwrap();
    let path = saved(folder.path(), "furnace.glb", furnace());
    let report = measured(&options(&["bake"], vec![path]), &folder.path().join("report"));
    let study = report.study("bake").unwrap();
    assert!(study.points.len() >= 5 && study.of_series("without bounces").count() == 1);
    for point in &study.points {
        // A bake without bounces does not state how much light it leaves out.
        let stated = point.figures.get("error stated, % of the mean").copied().unwrap_or(0.0);
        let error = point.error.unwrap();
        // E = π (1 + 1/2 + 1/4 + …): the remaining error is that of the solver's residual and of f32, and the
        // one that the bake states.
        let bound = 1e-3 + stated / 100.0 + error.uncertainty;
        // Without bounces only the first term is left, half of the light.
        let expected = if point.series == "without bounces" { 0.5 } else { 0.0 };
        assert!(
            (error.relative_rmse - expected).abs() <= bound,
            "{}, {}: {error:?}, stated {stated} %",
            point.series,
            point.label
        );
        assert!(point.counts["texels"] > 100.0);
    }
}

/// Rays that a final bake casts for the form factors of a level with few texels.
const FORM_FACTOR_RAYS: f64 = 1.5e6;

/// Two closed rooms apart from each other, each with a lamp; one of them contains a box and the camera.
fn two_rooms() -> World {
    let mut world = World::new();
    let mut inward = shapes::cuboid(Vec3::new(4.0, 2.5, 4.0), 1);
    inward.indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
    inward.normals.iter_mut().for_each(|normal| *normal = -*normal);
    let room = Mesh(Arc::new(inward));
    for (name, x) in [("near room", 0.0), ("far room", 9.0)] {
        let place = Transform::from_xyz(x, 1.25, 0.0);
        let walls = Material::matt(Vec3::new(0.8, 0.7, 0.5));
        world.spawn((Name::new(name), room.clone(), walls, StaticObject, place));
        let lamp = Light { bake: BakeMode::Static, ..Light::point(Vec3::splat(2.0)) };
        world.spawn((Name::new("lamp"), lamp, Transform::from_xyz(x + 0.4, 1.3, 0.3)));
    }
    let cuboid = Mesh(Arc::new(shapes::cuboid(Vec3::splat(0.5), 1)));
    let at = Transform::from_xyz(-0.5, 0.25, -0.5);
    world.spawn((Name::new("small box"), cuboid, Material::matt(Vec3::splat(0.4)), StaticObject, at));
    let eye = Transform::from_xyz(1.5, 1.4, 1.5).looking_at(DVec3::new(-0.5, 0.5, -0.5), DVec3::Y);
    world.spawn((Name::new("eye"), Camera::default(), eye));
    world
}

#[test]
fn lightmaps_beat_ambient_light_and_a_far_room_is_not_baked_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = saved(folder.path(), "rooms.glb", two_rooms());
    let report = measured(&options(&["preprocessing"], vec![path]), &folder.path().join("report"));
    let study = report.study("preprocessing").unwrap();
    let error = |label: &str| {
        let point = study.of_series("frame").find(|point| point.label == label).unwrap();
        point.error.unwrap().relative_rmse
    };
    let (alone, ambient, lightmaps) =
        (error("by lamps alone"), error("with the best ambient light"), error("with lightmaps"));
    assert!(lightmaps < ambient && ambient < 0.8 * alone, "{alone} {ambient} {lightmaps}");
    let bakes: Vec<&Point> = study.of_series("bake after a change").collect();
    let [whole, changed] = bakes[..] else { panic!("{bakes:?}") };
    assert!(changed.label.contains("small box"), "{}", changed.label);
    // Half of the level is another room. Form factors take the same rays in any case, and direct light is
    // computed again.
    let by_light = |bake: &Point| bake.counts["rays"] - FORM_FACTOR_RAYS;
    assert!(by_light(whole) > 0.0 && by_light(changed) < 0.85 * by_light(whole), "{changed:?} {whole:?}");
    assert!(study.findings.len() == 4 && study.notes.len() == 1, "{:?} {:?}", study.findings, study.notes);
    // Each bounce leaves less of the error, and a few of them nearly what the baker leaves with all.
    let bounces =
        ["0 bounces", "1 bounce", "2 bounces"].map(|count| error(&format!("with lightmaps of {count}")));
    assert!(bounces[0] > 1.2 * bounces[1] && bounces[1] > 1.2 * bounces[2], "{bounces:?}");
    assert!(bounces[2] > lightmaps, "{bounces:?} {lightmaps}");
}

#[test]
fn a_file_with_nothing_to_bake_is_said_to_have_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let dark = |is_static: bool| {
        let mut world = two_rooms();
        let objects: Vec<_> = world.query_filtered::<Entity, With<StaticObject>>().iter(&world).collect();
        world.query::<&mut Light>().iter_mut(&mut world).for_each(|mut light| light.bake = BakeMode::Dynamic);
        if !is_static {
            for object in objects {
                world.entity_mut(object).remove::<StaticObject>().insert(DynamicObject);
            }
        }
        world
    };
    for (name, is_static, why) in [
        ("lamps.glb", true, "has no baked lights"),
        ("moving.glb", false, "Everything in moving moves, is hidden or is unlit"),
    ] {
        let path = saved(folder.path(), name, dark(is_static));
        let asked = options(&["bake", "preprocessing", "lightmaps", "transport"], vec![path]);
        let report = measured(&asked, &folder.path().join("report"));
        for study in &report.studies {
            assert!(study.notes.iter().any(|note| note.contains(why)), "{}: {:?}", study.name, study.notes);
            // Paths and lamps need no bake; the other studies have nothing to measure.
            let is_empty = study.points.is_empty() && study.findings.is_empty();
            assert_eq!(is_empty, study.name != "transport", "{}: {:?}", study.name, study.findings);
            assert!(!study.points.iter().any(|point| point.label.contains("lightmaps")), "{}", study.name);
        }
    }
}

#[test]
fn a_report_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let asked = options(&["shading", "reflection"], Vec::new());
    let report = measured(&asked, folder.path());

    // Finer meshes have smaller errors with every shading.
    let shading = report.study("shading").unwrap();
    for series in ["flat", "Gouraud", "Phong"] {
        let errors: Vec<f64> =
            shading.of_series(series).map(|point| point.error.unwrap().relative_rmse).collect();
        assert!(errors.len() == 8 && errors[7] < 0.1 * errors[0], "{series}: {errors:?}");
    }
    assert!(!shading.findings.is_empty());
    let table = std::fs::read_to_string(folder.path().join(TABLE)).unwrap();
    let points: usize = report.studies.iter().map(|study| study.points.len()).sum();
    assert_eq!(table.lines().count(), points + 1);
    let page = std::fs::read_to_string(folder.path().join(PAGE)).unwrap();
    assert!(page.contains("<section id=\"shading\">") && page.contains("<section id=\"reflection\">"));

    // Existing studies are kept to the bit, and requested ones are added.
    let again = CostOptions { resume: true, ..options(&["shading", "reflection", "precision"], Vec::new()) };
    let more = measured(&again, folder.path());
    assert_eq!(more.studies[..2], report.studies[..]);
    assert_eq!(more.studies.len(), 3);
    assert_eq!(read_report(folder.path()).unwrap(), more);
    // Studies that are not requested this time are kept in their place on the page.
    let one = CostOptions { studies: studies_named(&["precision".into()]).unwrap(), ..again.clone() };
    assert_eq!(measured(&one, folder.path()), more);
    // Studies that another method or another program has measured are measured again, and only those.
    let altered = |alter: &dyn Fn(&mut CostReport)| {
        let mut old = more.clone();
        alter(&mut old);
        std::fs::write(folder.path().join(REPORT), serde_json::to_string(&old).unwrap()).unwrap();
        let found = measured(&one, folder.path());
        assert_eq!(found.studies.len(), 3);
        assert_eq!(
            (&found.studies[0].name, &found.studies[1].name),
            (&old.studies[0].name, &old.studies[1].name)
        );
        assert_eq!(
            (&found.studies[2].method, &found.studies[2].version),
            (&more.studies[2].method, &more.studies[2].version)
        );
        found.studies[2].seconds == more.studies[2].seconds
    };
    assert!(altered(&|_| {}), "nothing has changed");
    assert!(!altered(&|old| old.studies[2].method += 1));
    assert!(!altered(&|old| old.studies[2].version = "another program".into()));
    // With other settings nothing is kept.
    let other = CostOptions { seed: 2, studies: studies_named(&["reflection".into()]).unwrap(), ..again };
    let measured_again = measured(&other, folder.path());
    assert_eq!(measured_again.studies.len(), 1);
    assert_ne!(measured_again.studies[0].seconds, report.studies[1].seconds);
}

#[test]
fn an_interruption_keeps_the_studies_that_are_finished() {
    let folder = tempfile::tempdir().unwrap();
    let gpu = Gpu::headless().expect("a Vulkan driver; the software one will do");
    let asked = options(&["reflection", "precision"], Vec::new());
    let told = AtomicUsize::new(0);
    let ended = measure(&gpu, &asked, folder.path(), &|progress| {
        told.fetch_add(1, Ordering::Relaxed);
        match progress.study {
            "precision" => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        }
    });
    assert!(matches!(ended, Err(CostError::Interrupted)), "{ended:?}");
    assert!(told.load(Ordering::Relaxed) > 10);
    let kept = read_report(folder.path()).unwrap();
    assert_eq!(kept.studies.iter().map(|study| study.name.as_str()).collect::<Vec<_>>(), ["reflection"]);
    assert!(folder.path().join(PAGE).exists());
}

#[test]
fn a_study_that_there_is_none_of_is_refused_by_name() {
    let error = studies_named(&["shading".into(), "shadnig".into()]).unwrap_err().to_string();
    assert!(error.contains("`shadnig`") && error.contains("shading, scan, need, lamps"), "{error}");
}
