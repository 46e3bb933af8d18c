//! The regression gate: compares the counts of all studies with stored ones, by the code behind `lumbre
//! cost --compare`. Only counts of the CPU are used, which are the same on every machine: triangles, draw
//! calls, uploaded bytes, lamps in lists, rays, texels, patches.

use std::fs;
use std::path::{Path, PathBuf};

use lumbre_cost::{Change, CostOptions, CostReport, STUDIES, What, compare_reports, read_report};

use super::{measured, options};

/// The factor by which a count may grow. The last digits of f32 decide whether a lamp reaches a cluster, and
/// when a bake has enough rays.
const FACTOR: f64 = 1.1;
const RENEWED_BY: &str = "LUMBRE_WRITE_GOLDENS=1 cargo test --workspace --test studies counts";

/// Returns the studies whose counts are compared: all of them.
fn watched() -> Vec<&'static str> {
    STUDIES.iter().map(|study| study.name).collect()
}

fn kept() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/studies/counts.json")
}

/// Returns what is wrong with counts compared with the stored ones: what has grown or is missing, and what is
/// not stored yet.
fn faults(kept: &CostReport, counted: &CostReport) -> Vec<String> {
    let is_fault = |change: &Change| change.is_worse() || change.what == What::New;
    let changes = compare_reports(kept, counted, FACTOR);
    changes.iter().filter(|change| is_fault(change)).map(Change::to_string).collect()
}

#[test]
fn counts_have_not_grown() {
    let folder = tempfile::tempdir().unwrap();
    let asked = CostOptions { counts_only: true, size: (96, 54), ..options(&watched(), Vec::new()) };
    let counted = measured(&asked, folder.path());
    if std::env::var_os("LUMBRE_WRITE_GOLDENS").is_some() {
        fs::copy(folder.path().join(lumbre_cost::REPORT), kept()).unwrap();
    }
    let before = read_report(&kept()).unwrap();
    assert_eq!(before.settings, counted.settings, "the counts that are kept are of something else");
    let better = compare_reports(&before, &counted, FACTOR);
    for change in better.iter().filter(|change| !change.is_worse()) {
        println!("{change}");
    }
    let found = faults(&before, &counted);
    assert!(
        found.is_empty(),
        "{}\nIf it is meant to be so, `{RENEWED_BY}` keeps the new counts.",
        found.join("\n")
    );

    // Every missing or larger count of every point would be found, and every missing point.
    for (place, study) in before.studies.iter().enumerate() {
        for (number, point) in study.points.iter().enumerate() {
            for (name, count) in &point.counts {
                let mut grown = before.clone();
                let planted = if *count > 0.0 { 1.2 * count } else { 1.0 };
                grown.studies[place].points[number].counts.insert(name.clone(), planted);
                let found = faults(&before, &grown);
                assert!(found.len() == 1 && found[0].contains(name.as_str()), "{name}: {found:?}");
            }
            let mut fewer = before.clone();
            fewer.studies[place].points.remove(number);
            assert_eq!(faults(&before, &fewer).len(), 1, "{}", point.label);
            assert_eq!(faults(&fewer, &before).len(), 1, "{}", point.label);
        }
    }
    // No study is empty, and nothing in them is a time or belongs to this machine.
    for name in watched() {
        let study = before.study(name).unwrap();
        assert!(!study.points.is_empty(), "nothing was counted of {name}");
        for point in &study.points {
            assert!(point.milliseconds.is_none() && point.error.is_none() && !point.counts.is_empty());
            assert!(point.counts.keys().all(|name| !name.contains("invocations")), "{:?}", point.counts);
        }
    }
    assert_eq!(before.machine, lumbre_cost::Machine::default());
}

#[test]
fn counts_are_the_same_each_time() {
    let asked = CostOptions { counts_only: true, size: (64, 36), ..options(&["lamps"], Vec::new()) };
    let [first, second] = [0, 1].map(|_| {
        let folder = tempfile::tempdir().unwrap();
        let report = measured(&asked, folder.path());
        let text = fs::read_to_string(folder.path().join(lumbre_cost::REPORT)).unwrap();
        assert!(!folder.path().join("pictures").exists(), "a picture is kept of what is counted");
        (report, text)
    });
    assert_eq!(first, second);
}
