//! Checks that the example draws the documents' tables and that the documentation shows them as they are drawn.

use std::path::{Path, PathBuf};
use std::process::Command;

use image::RgbImage;

/// Returns the path of an example that cargo built beside this test.
fn example(name: &str) -> PathBuf {
    let mut path = std::env::current_exe().expect("this test is a file");
    path.pop();
    path.set_file_name("examples");
    path.join(name).with_extension(std::env::consts::EXE_EXTENSION)
}

/// Returns the fraction of pixels in which two pictures differ by more than software rasterizers do: 3 codes.
fn differing(a: &RgbImage, b: &RgbImage) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let apart =
        |(a, b): &(&image::Rgb<u8>, &image::Rgb<u8>)| a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > 3);
    a.pixels().zip(b.pixels()).filter(apart).count() as f64 / f64::from(a.width() * a.height())
}

#[test]
fn the_documentation_shows_the_tables_as_they_are_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let output = Command::new(example("documents_tables")).arg(folder.path()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let images = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/images"));
    let [first, second] = ["table-1.1.png", "table-2.1.png"].map(|name| {
        let drawn = image::open(folder.path().join(name)).unwrap().to_rgb8();
        let shown = image::open(images.join(name)).unwrap().to_rgb8();
        // Pixels on edges may differ with another driver.
        let part = differing(&drawn, &shown);
        assert!(part < 0.01, "{name}: {part} of the pixels differ; run scripts/pictures");
        assert!(std::fs::metadata(images.join(name)).unwrap().len() < 150_000, "{name} is small");
        drawn
    });
    // Control: another cell of the same table.
    let side = first.height();
    let cell = |index: u32| image::imageops::crop_imm(&first, index * (side + 4), 0, side, side).to_image();
    assert!(differing(&cell(0), &cell(1)) > 0.1 && second.width() == second.height());
}
