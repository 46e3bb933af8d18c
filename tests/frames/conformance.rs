//! OpenGL's fixed-function pictures, where they lie beside the checkout: Gouraud frames with `--display clamp` equal them.

use bevy_ecs::world::World;
use glam::DVec3;
use lumbre_render::{Display, FrameOptions};
use lumbre_tests::shared_files::shared_file;

use crate::adapter::{draw, linear};

/// Largest difference per channel inside one surface: one code of eight bits.
const LARGEST: f64 = 1.0 / 255.0;
/// Mean absolute difference there.
const MEAN: f64 = 1e-4;

#[test]
fn gouraud_frames_equal_opengl() {
    for case in 0.. {
        let Some(model) = shared_file(&format!("conformance/opengl/case_{case}.glb")) else {
            // The first file that is missing ends the list; with none at all the test is skipped, which is said.
            break;
        };
        let reference = image::open(model.with_extension("exr")).unwrap().to_rgb32f();
        let (width, height) = reference.dimensions();
        let mut world = World::new();
        lumbre_scene::load(&mut world, &model).unwrap();
        let options = FrameOptions { display: Display::Clamp, ..linear() };
        let (got, _) = draw(&mut world, width, height, &options);
        let expected: Vec<DVec3> =
            reference.pixels().map(|p| DVec3::new(p.0[0].into(), p.0[1].into(), p.0[2].into())).collect();
        let (largest, mean, compared, outliers) = smooth_difference(&got, &expected, width as usize);
        println!(
            "case {case}: largest {largest:.5}, mean {mean:.2e} over {compared} pixels, {outliers} beyond"
        );
        assert!(compared > expected.len() / 2, "case {case}: {compared} pixels are too few to compare");
        assert!(mean <= MEAN, "case {case}: mean {mean}");
        assert!(largest <= LARGEST, "case {case}: largest {largest}");
    }
}

/// Differences at pixels whose 3x3 neighbourhood in the reference is smooth, which is how one surface shows in a picture alone:
/// (largest, mean, pixels, pixels beyond `LARGEST`).
fn smooth_difference(got: &[DVec3], expected: &[DVec3], width: usize) -> (f64, f64, usize, usize) {
    let height = expected.len() / width;
    let (mut largest, mut sum, mut count, mut outliers) = (0.0_f64, 0.0, 0_usize, 0);
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let center = expected[y * width + x];
            // A step between neighbours above this is an edge between surfaces or the rim of a spot.
            let smooth = (y - 1..=y + 1).all(|j| {
                (x - 1..=x + 1).all(|i| (expected[j * width + i] - center).abs().max_element() < 0.02)
            });
            if smooth {
                let apart = (got[y * width + x] - center).abs();
                outliers += usize::from(apart.max_element() > LARGEST);
                largest = largest.max(apart.max_element());
                sum += apart.element_sum() / 3.0;
                count += 1;
            }
        }
    }
    (largest, sum / count.max(1) as f64, count, outliers)
}
