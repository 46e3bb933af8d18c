//! Rebakes: after a change, only what it can have affected is baked again. The result must agree with a full bake
//! within the stated errors, unaffected samples must be reused, and the report must say so. The scene has two rooms
//! joined by a doorway, one of them lit.

#![allow(clippy::print_stdout, reason = "the shares are the result that a reader of the output wants")]

use std::ops::ControlFlow;
use std::sync::Arc;

use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_bake::{
    Bake, BakeOptions, BakeReport, Checkpoint, Density, Probes, Samples, SamplesError, TexelErrors,
};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{BakeMode, Light, Material};
use lumbre_scene::{Lightmap, Mesh, Name, StaticObject, Transform};

use crate::common::shapes::room;

fn matt(reflectance: Vec3, emission: f32) -> Material {
    crate::scene_parts::matt(reflectance, Vec3::splat(emission))
}

fn place(world: &mut World, name: &str, mesh: TriangleMesh, material: Material, at: Vec3) {
    let transform = Transform::from_xyz(at.x.into(), at.y.into(), at.z.into());
    world.spawn((Name::new(name.to_owned()), Mesh(Arc::new(mesh)), material, transform, StaticObject));
}

/// The position of a crate and its reflectance.
type Crate = (Vec3, Vec3);

const WHITE: Vec3 = Vec3::new(0.7, 0.7, 0.7);
const RED: Vec3 = Vec3::new(0.8, 0.2, 0.2);

/// Rooms of 4 x 3 x 4 m at x = 2 and x = -2 with a doorway in the wall between them, a lamp in the first, and crates of
/// 60 cm.
fn rooms(lamp: Vec3, crates: &[Crate]) -> World {
    let mut world = World::new();
    place(&mut world, "shell", room(Vec3::new(8.0, 3.0, 4.0)), matt(WHITE, 0.0), Vec3::ZERO);
    let wall = |z: f32| shapes::cuboid(Vec3::new(0.2, 2.98, z), 1);
    place(&mut world, "wall", wall(2.9), matt(WHITE, 0.0), Vec3::new(0.0, 0.0, -0.54));
    place(&mut world, "lamp", shapes::cuboid(Vec3::new(0.8, 0.05, 0.8), 1), matt(Vec3::ZERO, 10.0), lamp);
    for (index, (at, reflectance)) in crates.iter().enumerate() {
        let mesh = shapes::cuboid(Vec3::splat(0.6), 1);
        place(&mut world, &format!("crate {index}"), mesh, matt(*reflectance, 0.0), *at);
    }
    world
}

const LAMP: Vec3 = Vec3::new(2.5, 0.8, 0.0);
const IN_THE_DARK: Crate = (Vec3::new(-3.2, -1.19, -1.2), RED);
const IN_THE_LIGHT: Crate = (Vec3::new(2.8, -1.19, 1.0), RED);

fn options() -> BakeOptions {
    BakeOptions {
        density: Density::TexelsPerMeter(6.0),
        error: 0.02,
        resolution_error: false,
        probes: Probes::Never,
        ..BakeOptions::default()
    }
}

/// The value and the stated error of every texel, with the maps sorted by name.
fn texels(world: &mut World) -> (Vec<DVec3>, Vec<f32>) {
    let mut query = world.query::<(&Lightmap, &TexelErrors)>();
    let mut maps: Vec<_> =
        query.iter(world).map(|(map, error)| (map.image.clone(), error.0.clone())).collect();
    maps.sort_by(|a, b| a.0.name.cmp(&b.0.name));
    let light = maps.iter().flat_map(|(map, _)| map.texels.iter().map(|texel| texel.as_dvec3())).collect();
    (light, maps.iter().flat_map(|(_, errors)| errors.iter().copied()).collect())
}

fn baked(mut world: World, former: Option<&Samples>, options: &BakeOptions) -> (World, BakeReport, Samples) {
    let mut samples = None;
    let bake = Bake::new(options).former(former).keep_samples(&mut samples);
    let report = bake.run(&mut world).expect("the rooms bake");
    (world, report, samples.expect("there is light"))
}

/// The RMS difference of two bakes relative to the mean, and the share of texels that differ by at most twice the
/// stated errors of both.
fn difference(mut a: World, mut b: World) -> (f64, f64) {
    let ((a, of_a), (b, of_b)) = (texels(&mut a), texels(&mut b));
    assert_eq!(a.len(), b.len(), "the maps have the same texels");
    let (mut squares, mut within, mut mean, mut count) = (0.0, 0.0, 0.0, 0.0);
    for ((a, b), (of_a, of_b)) in a.iter().zip(&b).zip(of_a.iter().zip(&of_b)) {
        if !(of_a.is_finite() && of_b.is_finite()) {
            continue;
        }
        let difference = (*a - *b).length() / 3f64.sqrt();
        squares += difference * difference;
        within += f64::from(u8::from(difference <= 2.0 * f64::from(of_a.hypot(*of_b))));
        mean += b.element_sum() / 3.0;
        count += 1.0;
    }
    ((squares / count).sqrt() * count / mean, within / count)
}

/// Bakes a scene, and then a changed scene twice: with the samples of the first bake and from scratch. Checks that both
/// agree within the stated errors, and returns the report of the rebake.
fn rebake(before: World, after: impl Fn() -> World) -> BakeReport {
    let (_, first, samples) = baked(before, None, &options());
    assert!(first.rebake.is_none(), "there was nothing to keep from");
    let (again, report, _) = baked(after(), Some(&samples), &options());
    let (whole, of_whole, _) = baked(after(), None, &options());
    let (difference, within) = difference(again, whole);
    let rebake = report.rebake.as_ref().expect("it says what was kept");
    println!("{rebake}");
    println!(
        "  states {:.3} %, whole {:.3} %, apart {:.3} %, {:.2} % within; {} rays instead of {}",
        100.0 * report.estimated_error,
        100.0 * of_whole.estimated_error,
        100.0 * difference,
        100.0 * within,
        report.rays,
        of_whole.rays
    );
    assert_eq!(rebake.whole, "");
    assert!(
        report.estimated_error <= options().error && of_whole.estimated_error <= options().error,
        "the error asked for holds with what is neglected: {}, {:?}, {:?}",
        report.estimated_error,
        report.ended,
        report.error_parts
    );
    assert!(difference <= report.estimated_error.hypot(of_whole.estimated_error), "{difference}");
    assert!(within >= 0.95, "{within}");
    report
}

fn share(report: &BakeReport, of: impl Fn(&lumbre_bake::RebakeReport) -> usize) -> f64 {
    let rebake = report.rebake.as_ref().expect("it says what was kept");
    of(rebake) as f64 / rebake.texels as f64
}

#[test]
fn a_crate_that_moves_in_the_dark_room_leaves_the_lit_one_alone() {
    let moved = (IN_THE_DARK.0 + Vec3::new(0.4, 0.0, 0.3), RED);
    let report = rebake(rooms(LAMP, &[IN_THE_DARK, IN_THE_LIGHT]), || rooms(LAMP, &[moved, IN_THE_LIGHT]));
    assert_eq!(report.rebake.as_ref().map(|r| r.changed.clone()), Some(vec!["crate 0 (changed)".to_owned()]));
    assert!(share(&report, |r| r.gathered) < 0.5, "{:?}", report.rebake);
    assert!(share(&report, |r| r.relit) < 0.5, "{:?}", report.rebake);
}

#[test]
#[ignore = "slow: scripts/test --all runs it"]
fn a_light_that_changes_only_its_hue_is_not_missed() {
    let lit = |color: Vec3| {
        let mut world = rooms(LAMP, &[IN_THE_DARK]);
        let light = Light { bake: BakeMode::Static, ..Light::point(color) };
        world.spawn((light, Transform::from_xyz(2.0, 0.0, -1.0)));
        world
    };
    // The same amount of light in another channel.
    let report = rebake(lit(Vec3::new(3.0, 0.0, 0.0)), || lit(Vec3::new(0.0, 3.0, 0.0)));
    assert!(share(&report, |r| r.gathered) > 0.5, "{:?}", report.rebake);
}

#[test]
#[ignore = "slow: scripts/test --all runs it"]
fn the_back_of_a_screen_hides_what_is_behind_it() {
    let screened = |screen: bool| {
        let mut world = rooms(LAMP, &[]);
        if screen {
            // Its only face looks away from the doorway into the dark room.
            let mut sheet = shapes::plane(3.8, 2.9, 1, 1);
            for (position, normal) in sheet.positions.iter_mut().zip(&mut sheet.normals) {
                (*position, *normal) = (Vec3::new(0.0, position.z, position.x), Vec3::NEG_X);
            }
            let [a, b, c] = [0, 1, 2].map(|i| sheet.positions[sheet.indices[i] as usize]);
            if (b - a).cross(c - a).x > 0.0 {
                sheet.indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
            }
            place(&mut world, "screen", sheet, matt(WHITE, 0.0), Vec3::new(-1.0, 0.0, 0.0));
        }
        world
    };
    rebake(screened(false), || screened(true));
    rebake(screened(true), || screened(false));
}

#[test]
#[ignore = "slow: scripts/test --all runs it"]
fn a_crate_that_moves_in_the_lit_room_leaves_the_dark_ones_far_end_alone() {
    let moved = (IN_THE_LIGHT.0 + Vec3::new(-0.3, 0.0, -0.2), RED);
    let report = rebake(rooms(LAMP, &[IN_THE_DARK, IN_THE_LIGHT]), || rooms(LAMP, &[IN_THE_DARK, moved]));
    assert!(share(&report, |r| r.gathered) < 0.95, "{:?}", report.rebake);
}

#[test]
#[ignore = "slow: scripts/test --all runs it"]
fn crates_come_and_go() {
    let report = rebake(rooms(LAMP, &[IN_THE_LIGHT]), || rooms(LAMP, &[IN_THE_LIGHT, IN_THE_DARK]));
    assert_eq!(report.rebake.map(|r| r.changed), Some(vec!["crate 1 (new)".to_owned()]));
    let report = rebake(rooms(LAMP, &[IN_THE_LIGHT, IN_THE_DARK]), || rooms(LAMP, &[IN_THE_LIGHT]));
    assert_eq!(report.rebake.map(|r| r.changed), Some(vec!["crate 1 (gone)".to_owned()]));
}

#[test]
#[ignore = "slow: scripts/test --all runs it"]
fn a_crate_that_is_painted_changes_light_by_bounces_only() {
    let painted = (IN_THE_DARK.0, WHITE);
    let report = rebake(rooms(LAMP, &[IN_THE_DARK]), || rooms(LAMP, &[painted]));
    assert!(share(&report, |r| r.gathered) < 0.5, "{:?}", report.rebake);
}

#[test]
#[ignore = "slow: scripts/test --all runs it"]
fn a_lamp_that_moves_lights_everything_anew() {
    let moved = LAMP + Vec3::new(0.5, 0.0, 0.3);
    let report = rebake(rooms(LAMP, &[IN_THE_DARK]), || rooms(moved, &[IN_THE_DARK]));
    assert!(share(&report, |r| r.relit) > 0.999, "{:?}", report.rebake);
}

#[test]
fn an_unchanged_scene_keeps_everything() {
    let scene = || rooms(LAMP, &[IN_THE_DARK]);
    let (first, _, samples) = baked(scene(), None, &options());
    let (again, report, _) = baked(scene(), Some(&samples), &options());
    let rebake = report.rebake.expect("it says what was kept");
    assert_eq!((rebake.relit, rebake.gathered, rebake.neglected), (0, 0, 0.0), "{rebake:?}");
    let (mut first, mut again) = (first, again);
    assert!(texels(&mut first).0 == texels(&mut again).0, "the same bits");
    // The same holds after a bake that reused a part of the samples.
    let moved = || rooms(LAMP, &[(IN_THE_DARK.0 + Vec3::X * 0.3, RED)]);
    let (mut second, _, samples) = baked(moved(), Some(&samples), &options());
    let (mut again, report, _) = baked(moved(), Some(&samples), &options());
    assert_eq!(report.rebake.map(|r| (r.relit, r.gathered)), Some((0, 0)));
    assert!(texels(&mut second).0 == texels(&mut again).0, "the same bits");
}

#[test]
fn a_baked_world_can_be_baked_again_repeatedly() {
    let options = options();
    let before = lumbre_bake::content_hash(&mut rooms(LAMP, &[IN_THE_DARK]), &options).unwrap();
    let (mut world, first, samples) = baked(rooms(LAMP, &[IN_THE_DARK]), None, &options);
    assert_eq!(lumbre_bake::content_hash(&mut world, &options).unwrap(), before);
    // Nothing has changed.
    let (world, report, samples) = baked(world, Some(&samples), &options);
    let rebake = report.rebake.as_ref().unwrap();
    assert!(rebake.whole.is_empty() && rebake.changed.is_empty(), "{rebake}");
    assert_eq!((rebake.relit, rebake.gathered), (0, 0), "{rebake}");
    assert_eq!(report.mean_irradiance, first.mean_irradiance);
    // A crate moves.
    let named = |world: &mut World, name: &str| {
        let mut names = world.query::<(bevy_ecs::entity::Entity, &Name)>();
        names.iter(world).find(|(_, found)| found.as_str() == name).unwrap().0
    };
    let mut world = world;
    let moved = named(&mut world, "crate 0");
    world.get_mut::<Transform>(moved).unwrap().translation.x += 0.1;
    let (mut world, report, samples) = baked(world, Some(&samples), &options);
    let rebake = report.rebake.as_ref().unwrap();
    assert_eq!(rebake.changed, ["crate 0 (changed)".to_owned()], "{rebake}");
    assert!(rebake.gathered < rebake.texels, "{rebake}");
    // Its mesh is replaced by another one; then the mesh that a bake has made from that is modified in place.
    world.get_mut::<Mesh>(moved).unwrap().0 = Arc::new(shapes::cuboid(Vec3::new(0.5, 0.7, 0.5), 1));
    let (mut world, report, samples) = baked(world, Some(&samples), &options);
    assert_eq!(report.rebake.unwrap().changed, ["crate 0 (changed)".to_owned()]);
    Arc::make_mut(&mut world.get_mut::<Mesh>(moved).unwrap().0).positions[0].y += 0.01;
    let (_, report, _) = baked(world, Some(&samples), &options);
    assert_eq!(report.rebake.unwrap().changed, ["crate 0 (changed)".to_owned()]);
}

#[test]
#[ignore = "slow: scripts/test --all runs it"]
fn the_errors_of_many_small_steps_stay_within_the_stated_error() {
    let at = |step: i32| (IN_THE_DARK.0 + Vec3::new(0.1 * step as f32, 0.0, 0.0), RED);
    let (_, _, mut samples) = baked(rooms(LAMP, &[at(0)]), None, &options());
    let mut last = None;
    for step in 1..=5 {
        let (world, report, next) = baked(rooms(LAMP, &[at(step)]), Some(&samples), &options());
        println!("{}", report.rebake.as_ref().expect("it says what was kept"));
        samples = next;
        last = Some((world, report));
    }
    let (world, report) = last.expect("there were steps");
    let (whole, of_whole, _) = baked(rooms(LAMP, &[at(5)]), None, &options());
    let (difference, within) = difference(world, whole);
    assert!(difference <= report.estimated_error.hypot(of_whole.estimated_error), "{difference}");
    assert!(within >= 0.95, "{within}");
}

#[test]
fn the_same_bits_on_any_number_of_threads_from_a_file_and_after_an_interruption() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("rooms.samples");
    let moved = (IN_THE_DARK.0 + Vec3::new(0.4, 0.0, 0.0), RED);
    let (_, _, samples) = baked(rooms(LAMP, &[IN_THE_DARK]), None, &options());
    samples.write(&path).expect("samples can be written");
    let read = Samples::read(&path).expect("and read");
    assert_eq!((read.identity(), read.texels()), (samples.identity(), samples.texels()));
    let (mut one, ..) =
        baked(rooms(LAMP, &[moved]), Some(&samples), &BakeOptions { threads: Some(1), ..options() });
    let (mut eight, ..) =
        baked(rooms(LAMP, &[moved]), Some(&read), &BakeOptions { threads: Some(8), ..options() });
    let expected = texels(&mut one).0;
    assert!(texels(&mut eight).0 == expected, "threads and the file leave the bits as they are");

    let checkpoint = |resume| Checkpoint {
        interval: std::time::Duration::ZERO,
        ..Checkpoint::new(folder.path().join("checkpoint"), resume)
    };
    let mut world = rooms(LAMP, &[moved]);
    let interrupted = Bake::new(&options())
        .former(&read)
        .checkpoint(&checkpoint(false))
        .progress(|progress| match progress.stage == "final gather" && progress.stage_fraction > 0.3 {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        })
        .keep_samples(&mut None)
        .run(&mut world);
    assert!(interrupted.is_err());
    let report = Bake::new(&options())
        .former(&read)
        .checkpoint(&checkpoint(true))
        .keep_samples(&mut None)
        .run(&mut world)
        .expect("the bake resumes");
    assert!(report.resumed_seconds > 0.0);
    assert_eq!(report.warnings, Vec::<String>::new());
    assert!(texels(&mut world).0 == expected, "the interruption leaves the bits as they are");
    // A full bake of the same scene does not resume from the checkpoint of a rebake.
    let report = Bake::new(&options())
        .checkpoint(&checkpoint(true))
        .keep_samples(&mut None)
        .run(&mut rooms(LAMP, &[moved]))
        .expect("it bakes");
    assert!(report.warnings.iter().any(|w| w.contains("another")), "{:?}", report.warnings);
}

#[test]
fn samples_that_cannot_be_reused_lead_to_a_full_bake_with_a_reason() {
    let (_, _, samples) = baked(rooms(LAMP, &[IN_THE_DARK]), None, &options());
    let other = BakeOptions { error: 0.03, ..options() };
    let (again, report, _) = baked(rooms(LAMP, &[IN_THE_DARK]), Some(&samples), &other);
    assert!(report.rebake.is_some_and(|r| r.whole.contains("other options")));
    let mut whole = rooms(LAMP, &[IN_THE_DARK]);
    Bake::new(&other).run(&mut whole).expect("it bakes");
    let (mut a, mut b) = (again, whole);
    assert!(texels(&mut a).0 == texels(&mut b).0, "then it is the bake that it always was");
    let far = (Vec3::new(60.0, 0.0, 0.0), RED);
    let (_, report, _) = baked(rooms(LAMP, &[IN_THE_DARK, far]), Some(&samples), &options());
    assert!(report.rebake.is_some_and(|r| r.whole.contains("larger or smaller")));
}

#[test]
fn damaged_samples_are_refused_by_name() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("rooms.samples");
    let coarse = BakeOptions { density: Density::TexelsPerMeter(2.0), error: 0.1, ..options() };
    let (_, _, samples) = baked(rooms(LAMP, &[]), None, &coarse);
    samples.write(&path).expect("samples can be written");
    let whole = std::fs::read(&path).expect("they can be read");
    assert!(Samples::read(&folder.path().join("none")).is_err_and(|e| matches!(e, SamplesError::Io(_))));
    assert!(Samples::read(folder.path()).is_err_and(|e| matches!(e, SamplesError::Foreign)));
    let refused = |bytes: &[u8]| {
        std::fs::write(&path, bytes).expect("a file");
        Samples::read(&path).expect_err("it is damaged")
    };
    for end in [0, 4, 8, 11, 12, 40, 44, 100, whole.len() / 2, whole.len() - 1] {
        assert!(
            matches!(refused(&whole[..end]), SamplesError::Damaged | SamplesError::Foreign),
            "cut off at {end}"
        );
    }
    for at in [13, 50, 200, whole.len() / 3, whole.len() - 1] {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x10;
        assert!(matches!(refused(&bytes), SamplesError::Damaged), "changed at {at}");
    }
    let mut other = whole.clone();
    other[8] = 200;
    assert!(matches!(refused(&other), SamplesError::Version { found: 200 }));
    assert!(matches!(refused(b"LUMBRECP and so on"), SamplesError::Foreign));
}
