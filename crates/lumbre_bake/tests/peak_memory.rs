//! Compares the memory that a bake estimates before it starts with the peak that the operating system measures. Each
//! bake is a process of its own (the example `peak_memory`), since the peak is that of the whole process.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "helpers of tests, which clippy does not count as tests")]

use std::process::Command;

/// Runs the example `peak_memory` and returns the JSON object that it prints.
fn peak_memory(arguments: &[&str]) -> serde_json::Value {
    // Cargo builds examples into a folder beside that of the tests.
    let mut example = std::env::current_exe().unwrap();
    example.pop();
    example.set_file_name("examples");
    let output = Command::new(example.join("peak_memory")).args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn the_estimate_is_an_upper_bound_within_a_factor_of_four() {
    for (triangles_per_edge, map_size) in [("24", "256"), ("40", "64")] {
        let measured = peak_memory(&[triangles_per_edge, map_size]);
        let number = |key: &str| measured[key].as_u64().unwrap();
        let used = number("after") - number("before");
        assert!(used <= number("estimate"), "{measured}");
        // The estimate includes some 32 MiB for allocations that are not counted one by one.
        assert!(number("estimate") <= 4 * used + (32 << 20), "{measured}");
    }
}

#[test]
fn the_estimate_counts_emitters() {
    let measured = |arguments: &[&str]| {
        let measured = peak_memory(arguments);
        let number = |key: &str| measured[key].as_u64().unwrap();
        assert!(number("after") - number("before") <= number("estimate"), "{measured}");
        number("estimate")
    };
    let [dark, glowing] = [measured(&["60", "64"]), measured(&["60", "64", "--glowing"])];
    // The corners of an emitter alone, in single and in double precision, take this many bytes.
    let emitters = 6 * 2 * 60 * 60;
    assert!(glowing - dark >= emitters * (36 + 72), "{dark}, {glowing}");
}

#[test]
#[ignore = "slow: scripts/test --all runs it"]
fn two_hundred_thousand_patches_fit_in_four_gibibytes() {
    let measured = peak_memory(&["130", "128", "--apart", "--memory", "4294967296"]);
    assert!(measured["patches"].as_u64().unwrap() >= 200_000, "{measured}");
    assert!(
        measured["after"].as_u64().unwrap() <= 4 << 30 && measured["estimate"].as_u64().unwrap() <= 4 << 30,
        "{measured}"
    );
}

#[test]
#[ignore = "slow: scripts/test --all runs it"]
fn a_million_triangles_share_patches_and_stay_within_the_estimate() {
    let measured = peak_memory(&["300", "64"]);
    let number = |key: &str| measured[key].as_u64().unwrap();
    assert!(number("patches") < 10_000, "{measured}");
    assert!(number("after") - number("before") <= number("estimate"), "{measured}");
}
