//! The tour renders without a display, and its pictures show lit rooms.

use std::path::{Path, PathBuf};

fn level() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/demo.glb")
}

#[test]
fn the_tour_shows_different_lit_rooms() {
    let folder = tempfile::tempdir().unwrap();
    let pictures = lumbre_demo::tour(&level(), &folder.path().join("tour"), 4, (160, 90)).unwrap();
    assert_eq!(pictures.len(), 4);
    let mut means = Vec::new();
    for path in &pictures {
        let image = image::open(path).unwrap().to_rgb8();
        assert_eq!(image.dimensions(), (160, 90));
        let values: Vec<f64> =
            image.pixels().map(|p| p.0.iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let spread = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt();
        // Even unbaked, no picture is black, overexposed or of a single colour.
        assert!((5.0..235.0).contains(&mean), "{path:?}: mean {mean}");
        assert!(spread > 4.0, "{path:?}: spread {spread}");
        means.push(mean);
    }
    assert!(means.windows(2).any(|pair| (pair[0] - pair[1]).abs() > 1.0), "{means:?}");
}

#[test]
fn a_missing_level_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let error = lumbre_demo::tour(Path::new("no/such/level.glb"), folder.path(), 1, (16, 16)).unwrap_err();
    assert!(format!("{error:#}").contains("level.glb"), "{error:#}");
}
