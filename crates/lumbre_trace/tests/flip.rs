//! FLIP against its authors' published results, and against properties that any difference of pictures must
//! have.

use glam::DVec3;
use lumbre_trace::flip::{PIXELS_PER_DEGREE, Picture, flip};

fn picture(width: usize, height: usize, color: impl Fn(usize, usize) -> DVec3) -> Picture {
    let pixels = (0..width * height).map(|i| color(i % width, i / width)).collect();
    Picture { width, pixels }
}

fn mean(reference: &Picture, test: &Picture) -> f64 {
    let map = flip(reference, test, PIXELS_PER_DEGREE);
    assert!(map.iter().all(|value| (0.0..=1.0).contains(value)), "{map:?}");
    map.iter().sum::<f64>() / map.len() as f64
}

fn noise(x: usize, y: usize) -> DVec3 {
    let hash =
        |salt: usize| ((x * 374_761_393 + y * 668_265_263 + salt * 982_451_653) % 1009) as f64 / 1009.0;
    DVec3::new(hash(1), hash(2), hash(3))
}

#[test]
fn a_monitor_of_the_paper_has_67_pixels_a_degree() {
    assert!((PIXELS_PER_DEGREE - 67.0206).abs() < 1e-4, "{PIXELS_PER_DEGREE}");
}

#[test]
fn what_is_the_same_differs_by_nothing() {
    let one = picture(40, 30, noise);
    assert_eq!(mean(&one, &one), 0.0);
}

#[test]
fn even_pictures_by_hand() {
    // No edges and no blur: HyAB to the power 0.7 in Hunt-adjusted CIELAB, then mapped to [0, 1]. Black to
    // white is 100^0.7 = 25.119 of the 41.27 between green and blue: 0.95 + 0.05 (25.119 - 16.51)/(41.27 -
    // 16.51) = 0.967. Green to blue is 1 by definition.
    let even = |color: DVec3| picture(24, 24, |_, _| color);
    let black_white = mean(&even(DVec3::ZERO), &even(DVec3::ONE));
    assert!((black_white - 0.967).abs() < 1e-3, "{black_white}");
    let green_blue = mean(&even(DVec3::Y), &even(DVec3::Z));
    assert!((green_blue - 1.0).abs() < 1e-9, "{green_blue}");
    // A grey of L* 50 is sRGB 0.4663. 50^0.7 = 15.462 is below the knee, where the factor is 0.95/16.51.
    let grey = mean(&even(DVec3::ZERO), &even(DVec3::splat(0.466_3)));
    assert!((grey - 0.95 * 50f64.powf(0.7) / (0.4 * 41.27)).abs() < 1e-3, "{grey}");
}

#[test]
fn either_picture_may_be_the_reference() {
    let (a, b) = (picture(40, 30, noise), picture(40, 30, |x, y| noise(y, x)));
    assert!((mean(&a, &b) - mean(&b, &a)).abs() < 1e-12);
}

#[test]
fn more_noise_is_more_and_fine_noise_is_less_than_coarse() {
    let grey = picture(96, 96, |_, _| DVec3::splat(0.5));
    let noisy = |strength: f64, size: usize| {
        picture(96, 96, |x, y| {
            let sign = if (x / size + y / size).is_multiple_of(2) { 1.0 } else { -1.0 };
            // Red against green of nearly the same luminance: a difference in colour, but no feature.
            DVec3::new(0.5 + strength * sign, 0.5 - 0.5 * strength * sign, 0.5)
        })
    };
    let [weak, strong] = [0.05, 0.2].map(|strength| mean(&grey, &noisy(strength, 1)));
    assert!(0.0 < weak && weak < strong, "{weak} {strong}");
    let coarse = mean(&grey, &noisy(0.05, 24));
    assert!(coarse > 2.0 * weak, "an eye does not resolve single pixels: {weak}, {coarse}");
}

#[test]
fn an_edge_that_comes_and_goes_is_seen() {
    // A line one pixel wide: its feature difference raises what the blurred colours alone would give.
    let grey = picture(96, 96, |_, _| DVec3::splat(0.5));
    let line = picture(96, 96, |x, _| DVec3::splat(if x == 48 { 0.8 } else { 0.5 }));
    let map = flip(&grey, &line, PIXELS_PER_DEGREE);
    let row = &map[48 * 96..49 * 96];
    assert!(row[48] > 0.15 && row[10] < 1e-6, "{} {}", row[48], row[10]);
}

#[test]
fn the_published_implementation_finds_the_same() {
    // LDR-FLIP of the same pictures by flip-evaluator 1.7 (PyPI), which computes in f32.
    let bytes = |color: [usize; 3]| DVec3::from(color.map(|byte| byte as f64 / 255.0));
    let ramp = |x: usize, y: usize| bytes([4 * x % 256, 5 * y % 256, 2 * (x + y) % 256]);
    let grain = |x: usize, y: usize| {
        bytes([1, 2, 3].map(|salt| (x * 374_761_393 + y * 668_265_263 + salt * 982_451_653) % 251))
    };
    let grey = |_: usize, _: usize| bytes([128; 3]);
    let marked = |x: usize, y: usize| if x == 20 || y > 40 { bytes([200, 180, 60]) } else { bytes([128; 3]) };
    let of = |color: &dyn Fn(usize, usize) -> DVec3| picture(64, 48, color);
    let found = [
        (mean(&of(&ramp), &of(&|x, y| ramp(x + 3, y))), 0.209_837_14),
        (mean(&of(&grain), &of(&|x, y| grain(y, x))), 0.180_859_92),
        (mean(&of(&grey), &of(&marked)), 0.216_059_37),
    ];
    for (found, published) in found {
        assert!((found - published).abs() < 2e-5 * published, "{found} is not {published}");
    }
}
