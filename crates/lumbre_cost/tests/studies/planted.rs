//! `tune` on levels whose best settings are known: for each choice, one level where it costs much without any
//! gain, and one where it is needed.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_cost::{DrawSettings, Goal, TuneOptions, Tuned, read_report, tune};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{Light, Material, Shading, SpotCone, Surface};
use lumbre_render::Gpu;
use lumbre_scene::{Camera, Lightmap, LightmapEncoding, LightmapImage, Mesh, Name, ShadowFilter, Transform};

use super::saved;

fn tuning_of(world: World, goal: Goal, report: Option<&Path>) -> Tuned {
    let folder = tempfile::tempdir().unwrap();
    let file = saved(folder.path(), "level.glb", world);
    let gpu = Gpu::headless().expect("a Vulkan driver; the software one will do");
    let options = TuneOptions { file, goal, quick: true, size: (192, 120) };
    tune(&gpu, &options, report, &|_| ControlFlow::Continue(())).unwrap()
}

/// How often a level is tuned before its settings are taken for wrong.
const TRIALS: usize = 4;

/// Returns the first tuning of a level within an error that chooses the planted settings.
///
/// Of settings that keep the error, times decide. While the machine does something else, those of a few rounds can be in
/// the wrong order, so that one wrong choice proves nothing; settings that do not keep the error are wrong in any trial.
fn cheapest_within(
    error: f64,
    tune: impl Fn(Goal) -> Tuned,
    is_planted: impl Fn(&DrawSettings) -> bool,
) -> Tuned {
    let mut findings = Vec::new();
    for _ in 0..TRIALS {
        let tuned = tune(Goal { milliseconds: None, error: Some(error) });
        let chosen = tuned.chosen.expect("some settings keep the error");
        let found = tuned.study.points[chosen].error.unwrap().relative_rmse;
        assert!(found <= error, "{found}: {:?}", tuned.study.findings);
        if is_planted(&tuned.settings[chosen]) {
            return tuned;
        }
        findings.push(tuned.study.findings);
    }
    panic!("{findings:#?}");
}

fn error_of(tuned: &Tuned, which: impl Fn(&DrawSettings) -> bool) -> f64 {
    let place = tuned.settings.iter().position(which).expect("it was tried");
    tuned.study.points[place].error.unwrap().relative_rmse
}

fn seen_from_above(world: &mut World) {
    let eye = Transform::from_xyz(0.0, 6.0, 0.5).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Name::new("eye"), Camera::default(), eye));
}

fn floor(world: &mut World, pieces: u32) {
    let plane = Mesh(Arc::new(shapes::plane(24.0, 24.0, pieces, pieces)));
    world.spawn((Name::new("floor"), plane, Material::matt(Vec3::splat(0.6))));
}

/// A matt plane of 16 x 16 squares that fills the frame, under lamps that are far away compared with its
/// squares. There are more than a hundred pixels per vertex, and between vertices the light is almost linear.
fn smooth_light() -> World {
    let mut world = World::new();
    floor(&mut world, 16);
    for lamp in 0..24 {
        let (x, z) = (f64::from(lamp % 6) - 2.5, f64::from(lamp / 6) - 1.5);
        let light = Light { radius: 0.0, ..Light::point(Vec3::splat(4.0)) };
        world.spawn((Name::new("lamp"), light, Transform::from_xyz(3.0 * x, 5.0, 3.0 * z)));
    }
    seen_from_above(&mut world);
    world
}

#[test]
fn tuning_finds_a_planted_optimum() {
    let folder = tempfile::tempdir().unwrap();
    let tuned = |goal: Goal, report: Option<&Path>| tuning_of(smooth_light(), goal, report);
    let report = folder.path().join("report");
    let is_planted = |chosen: &DrawSettings| chosen.shading == Shading::Gouraud && !chosen.multisample;
    let cheap = cheapest_within(0.01, |goal| tuned(goal, Some(&report)), is_planted);
    let flat = cheap.settings.iter().position(|settings| settings.shading == Shading::Flat).unwrap();
    assert!(cheap.study.points[flat].error.unwrap().relative_rmse > 0.01, "{:?}", cheap.study.points[flat]);
    // No lamp asks for a shadow.
    assert!(cheap.settings.iter().all(|settings| settings.shadows));
    assert_eq!(read_report(&report).unwrap().study("tune"), Some(&cheap.study));
    let exact = tuned(Goal { milliseconds: Some(1e6), error: Some(1e-4) }, None);
    // Shading by need may choose Phong shading too, and is then as good.
    let shading = exact.settings[exact.chosen.unwrap()].shading;
    assert!(matches!(shading, Shading::Phong | Shading::Auto { .. }), "{:?}", exact.study.findings);
    let none = tuned(Goal { milliseconds: Some(1e-6), error: None }, None);
    assert!(
        none.chosen.is_none() && none.study.findings[0].contains("No settings keep"),
        "{:?}",
        none.study.findings
    );
}

/// Adds glowing slats, which cost nothing to shade: only their edges can be wrong. They are one mesh, so that they
/// cost little to draw, too.
fn add_slats(world: &mut World, at: DVec3) {
    let front = Surface { emission: Vec3::ONE, ..Surface::default() };
    let material = Material { front, ..Material::matt(Vec3::ZERO) };
    let slat = shapes::plane(0.05, 8.0, 1, 1);
    let mut slats = TriangleMesh::default();
    for number in 0..60_u8 {
        let first = slats.positions.len() as u32;
        let beside = Vec3::X * (0.13 * f32::from(number) - 3.9);
        slats.positions.extend(slat.positions.iter().map(|corner| *corner + beside));
        slats.normals.extend(&slat.normals);
        slats.indices.extend(slat.indices.iter().map(|index| first + index));
    }
    world.spawn((Name::new("slats"), Mesh(Arc::new(slats)), material, Transform::from_translation(at)));
}

fn glowing_slats() -> World {
    let mut world = World::new();
    add_slats(&mut world, DVec3::ZERO);
    let lamp = Transform::from_xyz(0.0, 3.0, 0.0);
    world.spawn((Name::new("lamp"), Light::point(Vec3::splat(0.01)), lamp));
    seen_from_above(&mut world);
    world
}

#[test]
fn samples_are_taken_where_edges_want_them() {
    let tuned =
        cheapest_within(0.05, |goal| tuning_of(glowing_slats(), goal, None), |chosen| chosen.multisample);
    let one = error_of(&tuned, |settings| !settings.multisample && settings.shading == Shading::Phong);
    assert!(one > 0.05, "without them it is off by {one}");
}

/// Number of objects that are drawn and not seen.
const PEBBLES: u32 = 400;

/// A floor under lamps that takes longest, slats far from it that need four samples a pixel, and two cameras that see
/// nothing.
fn floor_and_slats_apart() -> World {
    let mut world = smooth_light();
    // Hundreds of draws that the floor hides: even where it is shaded most crudely it takes several times as long as
    // the slats, whatever else the machine does.
    let pebble = Mesh(Arc::new(shapes::plane(0.02, 0.02, 1, 1)));
    for number in 0..PEBBLES {
        let (x, z) = (f64::from(number % 20) - 9.5, f64::from(number / 20) - 9.5);
        let place = Transform::from_xyz(0.2 * x, -0.5, 0.2 * z);
        world.spawn((Name::new("pebble"), pebble.clone(), Material::matt(Vec3::ONE), place));
    }
    let away = DVec3::new(500.0, 0.0, 0.0);
    add_slats(&mut world, away);
    for (name, eye, target) in [
        ("nothing", DVec3::Y * 50.0, DVec3::Y * 90.0),
        ("slats", away + DVec3::new(0.0, 6.0, 0.5), away),
        ("nothing else", DVec3::Y * 60.0, DVec3::Y * 90.0),
    ] {
        let up = if name == "slats" { DVec3::Y } else { DVec3::X };
        let place = Transform::from_translation(eye).looking_at(target, up);
        world.spawn((Name::new(name), Camera::default(), place));
    }
    world
}

#[test]
fn every_camera_has_a_say_though_few_are_timed() {
    // The most accurate frame has the slats' edges; the floor alone would do with one sample. The shading is left
    // open: where lamps end early, the objects that are not seen cost as much as light.
    let tuned = cheapest_within(
        0.01,
        |goal| tuning_of(floor_and_slats_apart(), goal, None),
        |chosen| chosen.multisample,
    );
    let said =
        tuned.study.findings.iter().find(|said| said.contains("Of the 4 cameras")).expect("it is said");
    assert!(said.contains("frames take longest at \"eye\""), "{said}");
    // Flat shading errs most on the floor, one sample on the slats.
    assert!(said.ends_with("the largest of \"eye\" and \"slats\"."), "{said}");
    let one = error_of(&tuned, |settings| !settings.multisample && settings.shading == Shading::Gouraud);
    assert!(one > 0.05, "the slats do not need four samples: {one}");
}

/// Lamps that do not end: some with this brightness over the visible floor, and many faint ones far beside
/// it.
fn lamps_afar((near, color): (u32, f32), far: u32) -> World {
    let mut world = World::new();
    // The floor has few vertices, so that only lighting per fragment is accurate.
    floor(&mut world, 1);
    let lamp = |color: f32| Light { radius: 0.0, ..Light::point(Vec3::splat(color)) };
    for number in 0..near {
        let x = 0.5 * f64::from(number) - 0.25 * f64::from(near);
        world.spawn((Name::new("near lamp"), lamp(color), Transform::from_xyz(x, 5.0, 0.0)));
    }
    for number in 0..far {
        let around = f64::from(number);
        let place = Transform::from_xyz(60.0 * around.cos(), 4.0, 60.0 * around.sin());
        world.spawn((Name::new("far lamp"), lamp(0.05), place));
    }
    seen_from_above(&mut world);
    world
}

#[test]
fn lamps_end_where_they_bring_nothing_and_go_on_where_they_do() {
    // 120 lamps of 0.05 / 60² each: together they contribute a hundredth of what one lamp does.
    cheapest_within(
        0.05,
        |goal| tuning_of(lamps_afar((1, 4.0), 120), goal, None),
        |chosen| chosen.light_threshold > 0.0,
    );
    // Lamps that contribute 0.4 % of white each, and all of the light together: wherever they end, it is
    // visible.
    let tuned = cheapest_within(
        0.05,
        |goal| tuning_of(lamps_afar((20, 0.1), 0), goal, None),
        |chosen| chosen.light_threshold == 0.0,
    );
    assert!(error_of(&tuned, |settings| settings.light_threshold > 0.0) > 0.05);
}

/// A block under a spotlight whose shadow is inside or outside of the picture.
fn block_in_the_light(beside: f64, radius: f32) -> World {
    let mut world = World::new();
    floor(&mut world, 1);
    let block = Mesh(Arc::new(shapes::cuboid(Vec3::new(2.2, 0.4, 1.4), 1)));
    world.spawn((
        Name::new("block"),
        block,
        Material::matt(Vec3::splat(0.4)),
        Transform::from_xyz(beside, 1.0, 0.0),
    ));
    let cone = SpotCone::Smooth { inner: 1.0, outer: 1.1 };
    let lamp = Light { shadow: true, radius, ..Light::spot(Vec3::splat(20.0), cone) };
    let above =
        Transform::from_xyz(beside + 1.0, 5.0, 1.0).looking_at(DVec3::new(0.6 * beside, 0.0, 0.0), DVec3::Z);
    world.spawn((Name::new("lamp"), lamp, above));
    seen_from_above(&mut world);
    world
}

#[test]
fn shadows_go_where_nobody_sees_them_and_lose_what_they_do_not_need() {
    cheapest_within(
        0.01,
        |goal| tuning_of(block_in_the_light(9.0, 0.3), goal, None),
        |chosen| !chosen.shadows,
    );
    // The penumbra of a lamp of a millimetre is too small to be worth computing.
    let is_sharp = |chosen: &DrawSettings| chosen.shadows && chosen.shadow_filter != ShadowFilter::Soft;
    let tuned = cheapest_within(0.08, |goal| tuning_of(block_in_the_light(0.0, 0.001), goal, None), is_sharp);
    assert!(error_of(&tuned, |settings| !settings.shadows) > 0.08);
    // Without the penumbra of a wide lamp, the picture is wrong.
    let is_soft = |chosen: &DrawSettings| chosen.shadows && chosen.shadow_filter == ShadowFilter::Soft;
    cheapest_within(0.02, |goal| tuning_of(block_in_the_light(0.0, 0.3), goal, None), is_soft);
}

/// A floor whose baked light, in a map of 256 x 256 texels, is this over the map's columns.
fn baked_floor(light: impl Fn(usize) -> f32) -> World {
    const SIDE: usize = 256;
    let mut world = World::new();
    let mut plane = shapes::plane(24.0, 24.0, 1, 1);
    plane.uv1 = plane.uv0.clone();
    let texels = (0..SIDE * SIDE).map(|at| Vec3::splat(light(at % SIDE))).collect();
    let (width, height) = (SIDE as u32, SIDE as u32);
    let encoding = LightmapEncoding::Rgb16Float;
    let image = Arc::new(LightmapImage { name: "floor.exr".into(), width, height, texels, encoding });
    world.spawn((
        Name::new("floor"),
        Mesh(Arc::new(plane)),
        Material::matt(Vec3::splat(0.6)),
        Lightmap { image },
    ));
    seen_from_above(&mut world);
    world
}

#[test]
fn lightmaps_lose_the_texels_that_their_light_does_not_need() {
    let bytes = |tuned: &Tuned, place: usize| tuned.study.points[place].counts["bytes of lightmaps"];
    // Light that changes little over eight texels.
    let smooth = || baked_floor(|column| 0.5 + 0.3 * (column as f32 / 40.0).sin());
    for goal in
        [Goal { milliseconds: None, error: Some(0.01) }, Goal { milliseconds: Some(1e6), error: None }]
    {
        let tuned = tuning_of(smooth(), goal, None);
        let chosen = tuned.chosen.unwrap();
        let reduction = tuned.settings[chosen].lightmap_reduction;
        assert_eq!(reduction, 8, "{:?}", tuned.study.findings);
        let full = tuned.settings.iter().position(|settings| settings.lightmap_reduction == 1).unwrap();
        assert_eq!(bytes(&tuned, full), 8.0 * 256.0 * 256.0);
        // RGB9E5 is as good, with half of the bytes.
        assert_eq!(tuned.settings[chosen].lightmap_format, LightmapEncoding::Rgb9E5);
        assert_eq!(bytes(&tuned, chosen), 4.0 * 32.0 * 32.0);
        assert!(tuned.front.contains(&chosen), "{:?}", tuned.front);
        let says = |words: &str| tuned.study.findings.iter().any(|finding| finding.contains(words));
        assert!(says("the lightmaps take 0.524 MB"), "{:?}", tuned.study.findings);
    }
    // A shadow every other two texels, across those of half the density: they show one grey.
    let sharp = || baked_floor(|column| if column.div_ceil(2).is_multiple_of(2) { 0.1 } else { 0.9 });
    for goal in
        [Goal { milliseconds: None, error: Some(0.05) }, Goal { milliseconds: Some(1e6), error: None }]
    {
        let tuned = tuning_of(sharp(), goal, None);
        assert_eq!(tuned.settings[tuned.chosen.unwrap()].lightmap_reduction, 1, "{:?}", tuned.study.findings);
        assert!(error_of(&tuned, |settings| settings.lightmap_reduction == 2) > 0.3);
    }
    // 0.1 and 0.9 are off by more than 0.03 % as RGB9E5, so that within that half floats are taken.
    let tuned = tuning_of(sharp(), Goal { milliseconds: None, error: Some(3e-4) }, None);
    let chosen = tuned.settings[tuned.chosen.unwrap()];
    let maps = (chosen.lightmap_reduction, chosen.lightmap_format);
    assert_eq!(maps, (1, LightmapEncoding::Rgb16Float), "{:?}", tuned.study.findings);
}
