//! The examples run and do what they say.

use std::path::PathBuf;
use std::process::Command;

/// Returns the path of an example that cargo built next to this test.
fn example(name: &str) -> PathBuf {
    let mut path = std::env::current_exe().expect("this test is a file");
    path.pop();
    path.set_file_name("examples");
    path.join(name).with_extension(std::env::consts::EXE_EXTENSION)
}

#[test]
fn first_frame_draws_a_lit_ball() {
    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("frame.png");
    let output = Command::new(example("first_frame")).arg(&picture).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let frame = image::open(&picture).unwrap().to_rgb8();
    let middle = frame.get_pixel(frame.width() / 2, frame.height() / 2).0;
    assert!(middle[0] > 60 && middle[0] > 2 * middle[2], "the ball is red: {middle:?}");
    assert_eq!(frame.get_pixel(2, 2).0, [0, 0, 0], "and the background black");
}

#[test]
fn the_first_example_stays_short() {
    let source = include_str!("../examples/first_frame.rs");
    assert!(source.lines().count() < 40, "a World, a Renderer, a target: under 40 lines");
}
