//! The benchmark runs. Its figures are not judged: times are never asserted.

use std::process::Command;

#[test]
fn rays_throughput_prints_its_figures() {
    // Cargo builds examples beside the tests.
    let mut example = std::env::current_exe().unwrap();
    example.pop();
    example.set_file_name("examples");
    let example = example.join("rays_throughput").with_extension(std::env::consts::EXE_EXTENSION);
    let ran = Command::new(example).output().unwrap();
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    let printed = String::from_utf8_lossy(&ran.stdout);
    assert!(printed.contains("hall of boxes"), "{printed}");
}
