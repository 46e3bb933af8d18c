//! A ball under every kind of light, in every shading and reflection model, compared with the f64 twin.

use glam::DVec3;
use lumbre_optics::{Light, ReflectionModel, Shading};
use lumbre_render::FrameOptions;
use lumbre_tests::compare::{Difference, compare};
use lumbre_tests::scenes::{ball, every_light};
use lumbre_tests::twin::{self, TwinOptions};

use crate::adapter::{draw, linear};

/// Large enough for the interiors of the ball's 990 triangles to be compared too.
const SIZE: usize = 256;

/// f32 compared with f64. The longest chain of roundings is the specular power, n·(a few ulp) relative (n = 20
/// here: 20·4·2^-24 = 5e-6). The rest is of the order of the position's rounding, 2^-24·4 m, over the 3 mm that a
/// pixel covers at most, times the gradient of the highlight. Together that is under 1e-4 of a radiance near 1;
/// measured at most 1.4e-5.
const LARGEST: f64 = 1e-4;
/// The mean of the same roundings: measured at most 3.1e-6.
const RELATIVE_L2: f64 = 1e-5;

fn against_twin(light: Light, shading: Shading, model: ReflectionModel) -> Difference {
    let mut world = ball(light);
    let options = TwinOptions { shading: Some(shading), reflection: Some(model), ..TwinOptions::default() };
    let expected = twin::draw(&mut world, SIZE, SIZE, options).inside_surfaces(shading == Shading::Flat);
    let options = FrameOptions { shading: Some(shading), reflection: Some(model), ..linear() };
    let (got, _) = draw(&mut world, SIZE as u32, SIZE as u32, &options);
    let got: Vec<Option<DVec3>> = got.into_iter().map(Some).collect();
    let difference = compare(&got, &expected);
    // The ball fills about a quarter of the frame; of flat triangles only those are compared that contain nine
    // pixels in a square.
    let least = SIZE * SIZE / if shading == Shading::Flat { 24 } else { 8 };
    assert!(difference.pixels > least, "{} pixels are too few to compare", difference.pixels);
    difference
}

#[test]
fn every_shading_and_light_agrees_with_the_twin() {
    for (name, light) in every_light() {
        for shading in Shading::ALL {
            let difference = against_twin(light.clone(), *shading, ReflectionModel::Phong);
            println!("{name:16} {:8} {difference:?}", shading.name());
            assert!(difference.largest < LARGEST, "{name}, {}: {difference:?}", shading.name());
            assert!(difference.relative_l2 < RELATIVE_L2, "{name}, {}: {difference:?}", shading.name());
        }
    }
}

#[test]
fn every_reflection_model_agrees_with_the_twin() {
    let (_, light) = every_light().swap_remove(2);
    for model in ReflectionModel::ALL {
        let difference = against_twin(light.clone(), Shading::Phong, *model);
        println!("{:16} {difference:?}", model.name());
        assert!(difference.largest < LARGEST, "{}: {difference:?}", model.name());
        assert!(difference.relative_l2 < RELATIVE_L2, "{}: {difference:?}", model.name());
    }
}

#[test]
fn the_comparison_sees_a_wrong_light_a_shift_and_a_nan() {
    let (_, light) = every_light().swap_remove(2);
    let mut world = ball(light.clone());
    let expected = twin::draw(&mut world, SIZE, SIZE, TwinOptions::default()).inside_surfaces(false);
    let (got, _) = draw(&mut world, SIZE as u32, SIZE as u32, &linear());
    let some = |pixels: &[DVec3]| pixels.iter().copied().map(Some).collect::<Vec<_>>();

    let mut dimmer = light.clone();
    dimmer.diffuse *= 0.99;
    let (dim, _) = draw(&mut ball(dimmer), SIZE as u32, SIZE as u32, &linear());
    assert!(compare(&some(&dim), &expected).largest > LARGEST);

    let mut shifted = got.clone();
    shifted.rotate_right(1);
    assert!(compare(&some(&shifted), &expected).largest > LARGEST);

    let mut poisoned = got;
    poisoned[SIZE * SIZE / 2 + SIZE / 2].x = f64::NAN;
    assert_eq!(compare(&some(&poisoned), &expected).largest, f64::INFINITY);
}

#[test]
fn shadings_differ_as_they_should() {
    // As in the documents, flat shading shows polygons, Gouraud shading loses the highlight between vertices, and
    // Phong shading keeps it.
    let (_, light) = every_light().swap_remove(2);
    let brightest = |shading| {
        let options = FrameOptions { shading: Some(shading), ..linear() };
        let (pixels, _) = draw(&mut ball(light.clone()), SIZE as u32, SIZE as u32, &options);
        pixels.iter().map(|pixel| pixel.x).fold(0.0, f64::max)
    };
    let (flat, gouraud, phong) =
        (brightest(Shading::Flat), brightest(Shading::Gouraud), brightest(Shading::Phong));
    assert!(gouraud < phong, "Gouraud {gouraud} loses part of Phong's highlight {phong}");
    assert!(flat < phong, "flat {flat} loses part of Phong's highlight {phong}");
}
