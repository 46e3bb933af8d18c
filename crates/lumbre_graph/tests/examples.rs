//! Checks that the examples run and print what they are documented to print.

use std::process::Command;

#[test]
fn sobel_finds_the_edge_of_a_disc() {
    // Cargo builds examples next to the tests.
    let mut example = std::env::current_exe().unwrap();
    example.pop();
    example.set_file_name("examples");
    let example = example.join("sobel").with_extension(std::env::consts::EXE_EXTENSION);
    let ran = Command::new(example).output().unwrap();
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    let printed = String::from_utf8(ran.stdout).unwrap();
    assert!(printed.starts_with("disc -> sobel -> read back\n"), "{printed}");
    let texels: u32 = printed.lines().nth(1).and_then(|line| line.split(' ').next()?.parse().ok()).unwrap();
    // The circumference is 126 texels, and the edge is two to three texels wide.
    assert!((200..420).contains(&texels), "{printed}");
}
