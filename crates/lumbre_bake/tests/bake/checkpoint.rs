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

/// Written at every chance.
fn checkpoint(path: &Path, resume: bool) -> Checkpoint {
    Checkpoint { interval: Duration::ZERO, ..Checkpoint::new(path, resume) }
}

/// More than there is.
const NEVER: f32 = 2.0;

/// Bakes until so much of the whole is done.
fn interrupted(
    kept: &Checkpoint,
    options: &BakeOptions,
    fraction: f32,
) -> (World, Result<BakeReport, BakeError>) {
    let mut world = corner();
    let result = Bake::new(options)
        .checkpoint(kept)
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
    // In every stage, and in the midst of the long ones.
    for stop in [0.0, 0.1, 0.3, 0.38, 0.42, 0.6, 0.95] {
        let (mut world, result) = interrupted(&checkpoint(&path, false), &options(), stop);
        assert!(matches!(result, Err(BakeError::Cancelled { .. })), "{stop}: {result:?}");
        assert!(bits(&mut world).is_empty(), "an interrupted bake leaves the world as it was");
        // On another number of threads, and interrupted once more.
        let fewer = BakeOptions { threads: Some(1), ..options() };
        // Blocks are as long as the machine is fast: this may already be the end.
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
    let kept = checkpoint(&path, true);
    kept.remove().unwrap();
    kept.remove().unwrap();
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "nothing is left beside it");
}

#[test]
fn every_stage_may_be_interrupted_in_its_midst() {
    // Where the callback is asked, by stage: the n-th time is one chance to end it.
    let mut asked = Vec::new();
    Bake::new(&options())
        .progress(|progress| {
            asked.push(progress.stage);
            ControlFlow::Continue(())
        })
        .run(&mut corner())
        .unwrap();
    let times = |stage: &str| asked.iter().filter(|own| **own == stage).count();
    // The beginning of a stage asks, and every chunk: of a scene as small as this one there may be a single one, except where a stage
    // has several parts.
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
        for wanted in 0..times(stage) {
            let (mut world, mut seen) = (corner(), 0);
            let result = Bake::new(&options())
                .progress(|progress| {
                    seen += usize::from(progress.stage == stage);
                    if seen > wanted { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
                })
                .run(&mut world);
            // How many chunks there are depends on the machine: the last of them may be missing.
            match result {
                Err(BakeError::Cancelled { stage: found }) => assert_eq!(found, stage),
                other => assert!(stage == "final gather" && other.is_ok(), "{stage} {wanted}: {other:?}"),
            }
            assert!(bits(&mut world).is_empty() || stage == "final gather");
            if stage == "final gather" && wanted > 6 {
                break;
            }
        }
    }
}

#[test]
fn a_complete_checkpoint_holds_all_the_long_work() {
    let folder = tempfile::tempdir().unwrap();
    let kept = checkpoint(&folder.path().join("checkpoint"), true);
    let (mut world, result) = interrupted(&kept, &options(), NEVER);
    let first = result.unwrap();
    assert!(first.warnings.iter().any(|warning| warning.contains("there is no such checkpoint")));
    let length = fs::metadata(&kept.path).unwrap().len();
    let (mut again, result) = interrupted(&kept, &options(), NEVER);
    let second = result.unwrap();
    assert!(bits(&mut world) == bits(&mut again));
    assert!(second.resumed_seconds > 0.0 && second.seconds > second.resumed_seconds);
    assert_eq!(fs::metadata(&kept.path).unwrap().len(), length, "nothing was computed that had to be kept");
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
    let said = |warnings: &[String], what: &str| {
        assert!(warnings.iter().any(|warning| warning.contains(what)), "{what}: {warnings:?}");
    };
    // Cut short: in the magic, in the header, in a block's length, in blocks.
    for end in [0, 5, 20, 76, 80, 100, sound.len() / 3, sound.len() / 2, sound.len() - 1] {
        let warnings = resumed(&sound[..end], &format!("cut at {end}"));
        assert!(end == 76 || warnings.iter().any(|w| w.contains("cut short")), "{end}: {warnings:?}");
    }
    // A bit that has changed: in the identity, in a length, in values, in the last checksum.
    for at in [30, 79, 81, 200, sound.len() / 2, sound.len() - 1] {
        let mut bytes = sound.clone();
        bytes[at] ^= 0x10;
        let warnings = resumed(&bytes, &format!("a bit at {at}"));
        assert_eq!(warnings.len(), 1, "{at}: {warnings:?}");
    }
    let mut bytes = sound.clone();
    bytes[8] = 200;
    said(&resumed(&bytes, "version"), "version 200");
    // Rubbish after the end: nobody reads it.
    assert!(resumed(&[&sound[..], &[0xff; 100]].concat(), "rubbish").is_empty());
    // An absurd length allocates nothing.
    let mut bytes = sound.clone();
    bytes[76..84].copy_from_slice(&u64::MAX.to_le_bytes());
    said(&resumed(&bytes, "length"), "cut short");
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
fn what_cannot_be_a_checkpoint_is_an_error_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| checkpoint(&folder.path().join(name), true);
    let refused = |kept: &Checkpoint| match interrupted(kept, &options(), NEVER).1 {
        Err(BakeError::Checkpoint { path, source }) => {
            assert_eq!(path, kept.path);
            source
        }
        other => panic!("{other:?}"),
    };
    fs::write(at("letter").path, b"Dear Sir").unwrap();
    for resume in [true, false] {
        let kept = Checkpoint { resume, ..at("letter") };
        assert_eq!(refused(&kept), CheckpointError::Foreign);
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
