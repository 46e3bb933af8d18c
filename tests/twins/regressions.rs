//! Single inputs that once showed a weakness, with the correct results. The inputs that came nearest to a bound are
//! in `worst_inputs`.

use glam::DVec3;
use lumbre_optics as optics;

use crate::bounds::{Numbers, U};
use crate::{gpu, twin};

/// Returns the device's result for one input of a function.
pub fn got(name: &str, input: &[f32]) -> Vec<f64> {
    twin(name).kernel.run(gpu(), input).into_iter().map(f64::from).collect()
}

/// Checks that a result with one number is within this many u, and that the twin is nearer.
fn is_near(name: &str, input: &[f32], expected: f64, roundings: f64) {
    let device = got(name, input)[0];
    let (asked, _) = twin(name).asked(input);
    assert!((asked[0] / expected - 1.0).abs() < 1e-7, "{name}: the twin gives {} for {expected}", asked[0]);
    let bound = roundings * U * expected.abs();
    assert!((device - expected).abs() <= bound, "{name}: {device} for {expected} within {bound:e}");
}

#[test]
fn light_that_grazes_equal_media_goes_straight_on() {
    // Computed from the sine, the f32 direction was zero here, "totally reflected", an error of 1. Computed from
    // the cosine the error is a rounding.
    let normal = DVec3::new(0.48, 0.6, 0.64);
    for height in [1e-2, 1e-4, 1e-6] {
        let light = (normal.cross(DVec3::X).normalize() + height * normal).normalize().as_vec3();
        let normal = normal.as_vec3();
        let input = [&normal.to_array()[..], &light.to_array(), &[1.0]].concat();
        let direction = DVec3::from_slice(&got("transmitted_direction", &input));
        // |n| is off by up to 2 u, which bends the light by as much; the rest is the bound.
        let (_, allowed) = twin("transmitted_direction").asked(&input);
        assert!(
            (direction + light.as_dvec3()).length() <= 2.0 * allowed.error[0] + 4.0 * U,
            "{height}: {direction}"
        );
        assert!(allowed.error[0] < 3e-6);
    }
}

#[test]
fn the_half_value_angle_of_a_lobe_that_is_hardly_one() {
    // acos(2^(-1/n)): computed from 1 - sin² it was off by 1.7e-4 where cos² is a few roundings.
    for exponent in [0.05f32, 0.08, 0.1, 1.0] {
        let expected = (-std::f64::consts::LN_2 / f64::from(exponent)).exp().acos();
        is_near("half_value_angle", &[exponent], expected, 16.0);
    }
}

#[test]
fn an_exponent_whose_fourfold_overflows() {
    // 4 n was infinite, and infinity times log2(1) is NaN. At l = v = n the lobe is 1.
    let up = [0.0, 1.0, 0.0];
    for name in ["blinn_phong_4n (plain)", "blinn_phong_4n (sharp)", "blinn_phong_matched (sharp)"] {
        let input = [&up[..], &up, &up, &[2e38]].concat();
        assert_eq!(got(name, &input), [1.0], "{name}");
    }
}

#[test]
fn bases_and_exponents_near_nothing() {
    // 10⁻³⁸ to the power .001 was computed as 10⁻³⁰ to that power in the shader and as itself in the twin: .933 and
    // .916.
    for input in [[1e-38, 1e-3], [-0.0, 1e-3], [0.0, 1e-29], [f32::from_bits(1), 0.5]] {
        assert_eq!(got("safe_pow", &input), [0.0]);
        assert_eq!(optics::safe_pow(input[0].into(), input[1].into()), 0.0);
    }
    for input in [[0.0, 0.0], [0.0, f32::from_bits(1)], [-1.0, -1.0], [0.5, 1e-38]] {
        assert_eq!(got("safe_pow", &input), [1.0]);
        assert_eq!(optics::safe_pow(input[0].into(), input[1].into()), 1.0);
    }
    is_near("safe_pow", &[1.1e-30, 1e-3], 1.1e-30f64.powf(1e-3), 30.0);
}

#[test]
fn fog_thinner_than_numbers_divide() {
    // A denormal span was divided by; a device that flushes it to 0 computed 0/0.
    let thin = f32::from_bits(3);
    for (distance, fraction) in [(0.0, 0.0), (1e-20, 1.0), (1.0, 1.0)] {
        assert_eq!(got("fog_fraction", &[0.0, 1e-36, distance]), [fraction], "{distance}");
    }
    assert_eq!(got("fog_fraction", &[0.0, thin, 1.0]), [1.0]);
    assert_eq!(got("fog_linear", &[5.0, 5.0, 4.999]), [1.0]);
}

#[test]
fn a_light_ends_where_its_range_does() {
    // The window is 1 minus a quotient that may be 2.5 units in the last place too large, and must not become
    // negative.
    for range in [0.1f32, 0.3, 7.0, 1e-20, 33.3] {
        for distance in [range, range.next_up(), 2.0 * range] {
            let factor = got("attenuate", &[0.0, 0.0, 1.0, 0.0, range, distance])[0];
            let strongest = optics::attenuate(DVec3::Z, false, 1e30, distance.into());
            assert!((0.0..=28.0 * U * strongest).contains(&factor), "{range} {distance}: {factor}");
        }
    }
}

#[test]
fn indices_that_no_medium_has() {
    // At 10⁻⁴ the direction was noise, with errors of 2. Indices under .01 are clamped to that.
    let input = [0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 1e-4];
    let (expected, allowed) = twin("transmitted_direction").asked(&input);
    assert_eq!(expected, Numbers::from_slice(&[0.0, -1.0, 0.0]));
    let device = got("transmitted_direction", &input);
    assert!(device.iter().zip(&expected).zip(&allowed.error).all(|((a, b), bound)| (a - b).abs() <= *bound));
    assert!(allowed.error.iter().all(|bound| *bound < 1e-2), "{:?}", allowed.error);
}

#[test]
fn a_polygon_with_an_edge_on_the_horizon() {
    // A distant triangle with an edge in the horizon's plane: its contour went below the horizon and never came
    // back up, which made it twelve times too bright. To first order F = A cos cos / (pi d^2).
    let input = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0, 100.0, -30.0, 1.0, 0.0, 0.0];
    for turned in [3e-45, 0.0, -4e-45] {
        let mut input = input;
        input[15] = turned;
        let (expected, allowed) = twin("polygon_form_factor").asked(&input);
        assert!((expected[0] / 4.45e-8 - 1.0).abs() < 1e-3, "{expected:?}");
        let device = got("polygon_form_factor", &input)[0];
        assert!((device - expected[0]).abs() <= allowed.error[0] && allowed.error[0] < 1e-9, "{device:e}");
    }
}
