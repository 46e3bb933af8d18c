//! The memory that a bake states beforehand against what it takes, as the system counts it, in a process of its own.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "helpers of tests, which clippy does not count as tests")]

use std::process::Command;

/// Runs the example; its numbers.
fn peak_memory(arguments: &[&str]) -> serde_json::Value {
    // Cargo builds examples beside the tests.
    let mut example = std::env::current_exe().unwrap();
    example.pop();
    example.set_file_name("examples");
    let ran = Command::new(example.join("peak_memory")).args(arguments).output().unwrap();
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    serde_json::from_slice(&ran.stdout).unwrap()
}

#[test]
fn the_estimate_is_an_upper_bound_and_not_a_wild_one() {
    for (along, side) in [("24", "256"), ("40", "64")] {
        let found = peak_memory(&[along, side]);
        let number = |key: &str| found[key].as_u64().unwrap();
        let taken = number("after") - number("before");
        assert!(taken <= number("estimate"), "{found}");
        // Of what a bake of this size is stated to take, some 32 MiB are for what nothing counts.
        assert!(number("estimate") <= 4 * taken + (32 << 20), "{found}");
    }
}

#[test]
#[ignore = "slow: scripts/test --all runs it"]
fn two_hundred_thousand_patches_fit_in_four_gibibytes() {
    let found = peak_memory(&["130", "128", "--memory", "4294967296"]);
    assert!(found["patches"].as_u64().unwrap() >= 200_000, "{found}");
    assert!(
        found["after"].as_u64().unwrap() <= 4 << 30 && found["estimate"].as_u64().unwrap() <= 4 << 30,
        "{found}"
    );
}
