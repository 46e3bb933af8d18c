//! OpenGL's fixed-function pictures, if they are beside the checkout: Gouraud frames with `--display clamp` equal
//! them.

use bevy_ecs::world::World;
use glam::DVec3;
use lumbre_tests::compare::{Difference, compare};
use lumbre_tests::device::least_compared;
use lumbre_tests::shared_files::shared_file;
use lumbre_tests::twin::{self, TwinOptions};

use crate::adapter::draw;
use crate::opengl::{equal, opengl_options};

/// Number of cases in the folder.
const CASES: usize = 6;

#[test]
fn gouraud_frames_equal_opengl() {
    for case in 0..CASES {
        // `shared_file` prints a message if the file is missing.
        let Some(model) = shared_file(&format!("conformance/opengl/case_{case}.glb")) else { return };
        let reference = image::open(model.with_extension("exr")).unwrap().to_rgb32f();
        let (width, height) = reference.dimensions();
        let mut world = World::new();
        lumbre_scene::load(&mut world, &model).unwrap();
        // The pictures do not tell which surface a pixel shows; the twin's rasterizer does.
        let interior = twin::draw(&mut world, width as usize, height as usize, TwinOptions::default())
            .interior(false)
            .into_iter()
            .zip(reference.pixels())
            .map(|(inside, pixel)| inside.map(|_| DVec3::from(pixel.0.map(f64::from))))
            .collect::<Vec<_>>();
        let size = [width as usize, height as usize];
        let moved = twin::by_moved_corners(&mut world, size[0], size[1], TwinOptions::default(), 1.0);
        let (got, _) = draw(&mut world, width, height, &opengl_options());
        let got: Vec<_> = got.into_iter().zip(moved).map(|(color, moved)| Some(color - moved)).collect();
        let difference = compare(&got, &interior);
        let Difference { largest, mean, pixels, .. } = difference;
        println!("case {case}: largest {largest:.2e}, mean {mean:.2e} over {pixels} pixels");
        // Edges are a few per cent of the pixels.
        assert!(
            pixels > least_compared(interior.len() * 9 / 10),
            "case {case}: {pixels} pixels are too few to compare"
        );
        assert!(equal(&difference), "case {case}: {difference:?}");
        // Both are f32 on the same kind of rasterizer: measured 1.9e-5 and 9.1e-8.
        assert!(largest <= 1e-4 && mean <= 1e-6, "case {case}: {difference:?}");
    }
}
