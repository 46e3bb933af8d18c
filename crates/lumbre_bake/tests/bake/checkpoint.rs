//! A bake that is interrupted and resumed, at any moment and with whatever has become of its checkpoint.

#![allow(clippy::unwrap_used, reason = "helpers of tests, which clippy does not count as tests")]

use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Duration;

use bevy_ecs::world::World;
use lumbre_bake::{Bake, BakeError, BakeOptions, BakeReport, Checkpoint, CheckpointError, Density, Quality};

use crate::common::bits;
use crate::corner::corner;

fn options() -> BakeOptions {
    BakeOptions {
        density: Density::MapSize(24),
        error: 0.01,
        quality: Quality::Final,
        threads: Some(2),
        ..BakeOptions::default()
    }
}

/// A checkpoint that is written as often as possible.
fn checkpoint(path: &Path, resume: bool) -> Checkpoint {
    Checkpoint { interval: Duration::ZERO, ..Checkpoint::new(path, resume) }
}

/// A fraction of the bake that is never reached.
const NEVER: f32 = 2.0;

/// Bakes with a checkpoint until this fraction of the whole bake is done.
fn interrupted(
    saved: &Checkpoint,
    options: &BakeOptions,
    fraction: f32,
) -> (World, Result<BakeReport, BakeError>) {
    let mut world = corner();
    let result = Bake::new(options)
        .checkpoint(saved)
        .progress(|progress| {
            if progress.fraction >= fraction { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
        .run(&mut world);
    (world, result)
}

fn whole(options: &BakeOptions) -> (Vec<u32>, BakeReport) {
    let mut world = corner();
    let report = Bake::new(options).run(&mut world).unwrap();
    (bits(&mut world), report)
}

#[test]
fn resumed_after_any_interruption_it_ends_with_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("checkpoint");
    let (expected, report) = whole(&options());
    assert!(!expected.is_empty());
    // These fractions interrupt every stage, and the long ones in their middle.
    for stop in [0.0, 0.1, 0.3, 0.38, 0.42, 0.6, 0.95] {
        let (mut world, result) = interrupted(&checkpoint(&path, false), &options(), stop);
        assert!(matches!(result, Err(BakeError::Cancelled { .. })), "{stop}: {result:?}");
        assert!(bits(&mut world).is_empty(), "an interrupted bake leaves the world as it was");
        // Resume with another number of threads, and interrupt once more. The length of a block of work depends on the
        // machine's speed, so that this bake may already complete.
        let fewer = BakeOptions { threads: Some(1), ..options() };
        let (_, result) = interrupted(&checkpoint(&path, true), &fewer, stop + 0.1);
        assert!(matches!(result, Ok(_) | Err(BakeError::Cancelled { .. })), "{stop}: {result:?}");
        let (mut world, result) = interrupted(&checkpoint(&path, true), &options(), NEVER);
        let resumed = result.unwrap();
        assert!(bits(&mut world) == expected, "other bits after an interruption at {stop}");
        assert_eq!(resumed.warnings, report.warnings);
        assert_eq!(
            (resumed.rays, resumed.patches, resumed.form_factors, resumed.iterations),
            (report.rays, report.patches, report.form_factors, report.iterations)
        );
        assert_eq!(resumed.estimated_error.to_bits(), report.estimated_error.to_bits());
    }
    let saved = checkpoint(&path, true);
    saved.remove().unwrap();
    saved.remove().unwrap();
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "nothing is left beside it");
}

#[test]
fn what_a_time_limit_has_decided_is_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("checkpoint");
    // Time for everything, but direct light takes its goals one after the other.
    let timed = BakeOptions { time: Some(Duration::from_secs(3600)), ..options() };
    let (expected, report) = whole(&timed);
    for stop in [0.1, 0.2, 0.3, 0.42, 0.6] {
        let (_, result) = interrupted(&checkpoint(&path, false), &timed, stop);
        assert!(matches!(result, Err(BakeError::Cancelled { .. })), "{stop}: {result:?}");
        let (mut world, result) = interrupted(&checkpoint(&path, true), &timed, NEVER);
        // A checkpoint that does not fit would be named in a warning.
        assert_eq!(result.unwrap().warnings, report.warnings, "{stop}");
        assert!(bits(&mut world) == expected, "other bits after an interruption at {stop}");
    }
}

#[test]
fn every_stage_can_be_interrupted_in_its_middle() {
    // The stage of each progress call; each call is a chance to interrupt the bake.
    let mut calls = Vec::new();
    Bake::new(&options())
        .progress(|progress| {
            calls.push(progress.stage);
            ControlFlow::Continue(())
        })
        .run(&mut corner())
        .unwrap();
    let times = |stage: &str| calls.iter().filter(|other| **other == stage).count();
    // There is a call at the beginning of a stage and one for every chunk of it. In a scene this small, a stage may
    // have a single chunk, unless it consists of several parts.
    for (stage, least) in [
        ("direct light", 2),
        ("form factors", 2),
        ("radiosity", 3),
        ("final gather", 3),
        ("texels", 3),
        ("seams", 3),
    ] {
        assert!(times(stage) >= least, "{stage} is asked {} times", times(stage));
    }
    for stage in ["final gather", "texels", "seams"] {
        for stop in 0..times(stage) {
            let (mut world, mut count) = (corner(), 0);
            let result = Bake::new(&options())
                .progress(|progress| {
                    count += usize::from(progress.stage == stage);
                    if count > stop { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
                })
                .run(&mut world);
            // The number of chunks depends on the machine's speed: the last of them may not occur in this bake.
            match result {
                Err(BakeError::Cancelled { stage: cancelled }) => assert_eq!(cancelled, stage),
                other => assert!(stage == "final gather" && other.is_ok(), "{stage} {stop}: {other:?}"),
            }
            assert!(bits(&mut world).is_empty() || stage == "final gather");
            if stage == "final gather" && stop > 6 {
                break;
            }
        }
    }
}

#[test]
fn a_complete_checkpoint_contains_all_the_expensive_work() {
    let folder = tempfile::tempdir().unwrap();
    let saved = checkpoint(&folder.path().join("checkpoint"), true);
    let (mut world, result) = interrupted(&saved, &options(), NEVER);
    let first = result.unwrap();
    assert!(first.warnings.iter().any(|warning| warning.contains("there is no such checkpoint")));
    let length = fs::metadata(&saved.path).unwrap().len();
    let (mut again, result) = interrupted(&saved, &options(), NEVER);
    let second = result.unwrap();
    assert!(bits(&mut world) == bits(&mut again));
    assert!(second.resumed_seconds > 0.0 && second.seconds > second.resumed_seconds);
    assert_eq!(fs::metadata(&saved.path).unwrap().len(), length, "nothing was computed that had to be kept");
}

#[test]
fn whatever_became_of_the_file_the_bits_are_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("checkpoint");
    let (expected, _) = whole(&options());
    interrupted(&checkpoint(&path, false), &options(), NEVER).1.unwrap();
    let sound = fs::read(&path).unwrap();
    let resumed = |bytes: &[u8], what: &str| {
        fs::write(&path, bytes).unwrap();
        let (mut world, result) = interrupted(&checkpoint(&path, true), &options(), NEVER);
        let report = result.unwrap_or_else(|error| panic!("{what}: {error}"));
        assert!(bits(&mut world) == expected, "{what}: other bits");
        let (_, again) = interrupted(&checkpoint(&path, true), &options(), NEVER);
        let again = again.unwrap();
        assert!(again.warnings.is_empty() && again.resumed_seconds > 0.0, "{what}: the file is whole again");
        report.warnings
    };
    let expect_warning = |warnings: &[String], what: &str| {
        assert!(warnings.iter().any(|warning| warning.contains(what)), "{what}: {warnings:?}");
    };
    // Files that are cut off in the magic number, in the header, in a block's length, and in blocks.
    for end in [0, 5, 20, 76, 80, 100, sound.len() / 3, sound.len() / 2, sound.len() - 1] {
        let warnings = resumed(&sound[..end], &format!("cut at {end}"));
        assert!(end == 76 || warnings.iter().any(|w| w.contains("cut short")), "{end}: {warnings:?}");
    }
    // Files with one flipped bit in the identity, in a length, in values, and in the last checksum.
    for at in [30, 79, 81, 200, sound.len() / 2, sound.len() - 1] {
        let mut bytes = sound.clone();
        bytes[at] ^= 0x10;
        let warnings = resumed(&bytes, &format!("a bit at {at}"));
        assert_eq!(warnings.len(), 1, "{at}: {warnings:?}");
    }
    let mut bytes = sound.clone();
    bytes[8] = 200;
    expect_warning(&resumed(&bytes, "version"), "version 200");
    // Garbage after the end is not read.
    assert!(resumed(&[&sound[..], &[0xff; 100]].concat(), "rubbish").is_empty());
    // An absurd length must not be allocated.
    let mut bytes = sound.clone();
    bytes[76..84].copy_from_slice(&u64::MAX.to_le_bytes());
    expect_warning(&resumed(&bytes, "length"), "cut short");
}

#[test]
fn a_checkpoint_of_another_bake_is_not_continued() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("checkpoint");
    let other = BakeOptions { seed: 5, ..options() };
    let (expected, _) = whole(&options());
    interrupted(&checkpoint(&path, false), &other, 0.3).1.unwrap_err();
    let (mut world, result) = interrupted(&checkpoint(&path, true), &options(), NEVER);
    let warnings = result.unwrap().warnings;
    assert!(warnings.iter().any(|warning| warning.contains("other options")), "{warnings:?}");
    assert!(bits(&mut world) == expected);
}

#[test]
fn an_unusable_checkpoint_is_an_error_before_the_bake() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| checkpoint(&folder.path().join(name), true);
    let refused = |saved: &Checkpoint| match interrupted(saved, &options(), NEVER).1 {
        Err(BakeError::Checkpoint { path, source }) => {
            assert_eq!(path, saved.path);
            source
        }
        other => panic!("{other:?}"),
    };
    fs::write(at("letter").path, b"Dear Sir").unwrap();
    for resume in [true, false] {
        let saved = Checkpoint { resume, ..at("letter") };
        assert_eq!(refused(&saved), CheckpointError::Foreign);
    }
    assert_eq!(fs::read(at("letter").path).unwrap(), b"Dear Sir", "somebody else's file is left alone");
    fs::create_dir(at("folder").path).unwrap();
    assert_eq!(refused(&at("folder")), CheckpointError::Foreign);
    assert!(matches!(refused(&at("no/such/folder")), CheckpointError::Unusable { .. }));

    interrupted(&at("used"), &options(), 0.1).1.unwrap_err();
    let other = fs::File::open(at("used").path).unwrap();
    other.lock().unwrap();
    assert_eq!(refused(&at("used")), CheckpointError::InUse);
}
