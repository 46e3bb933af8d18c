//! Cases of single functions, run on the device.

use glam::DVec3;
use lumbre_optics::*;
use lumbre_tests::kernel::{Kernel, Type};

use crate::adapter::gpu;
use crate::case::Outcome;

crate::cases! {
    "normal of length 0" { a_zero_vector_stays_zero, a_cancelled_normal_takes_the_faces }
    "light at the surface, d = 0 and a = b = 0" { attenuation_at_the_light, attenuation_by_its_square_alone }
    "l = -v, half vector 0" {
        a_half_vector_of_opposites, a_highlight_of_opposites, microfacets_of_opposites, a_highlight_of_nearly_opposites,
        microfacets_of_nearly_opposites, a_half_vector_of_nearly_opposites,
    }
    "pow(0, 0), pow(negative, n), n = 0" {
        zero_to_the_zero, a_negative_cosine, exponent_zero_is_a_step, exponent_zero_behind_the_surface,
    }
    "n = 1 to 10^6" { exponent_1, exponent_128, exponent_8192, exponent_a_million, exponent_four_million }
    "specular aliasing" { a_filtered_mirror, a_plane_is_not_filtered }
    "grazing v, Fresnel at 90 degrees, the critical angle" {
        masking_at_grazing_light_and_viewer, fresnel_at_ninety_degrees, fresnel_of_a_metal_at_ninety_degrees,
        just_inside_the_critical_angle, beyond_the_critical_angle, nothing_is_transmitted_beyond_it,
    }
    "spot cutoff 0, 90, 180; inner = outer; exponent 0, 128; direction 0" {
        cutoff_0_on_the_axis, cutoff_90_at_its_edge, cutoff_180_behind, inner_equals_outer, exponent_0_inside,
        exponent_128_off_the_axis,
    }
    "fog" { fog_of_no_length, fog_a_light_year_away }
}

const VECTORS: [Type; 4] = [Type::Vector, Type::Vector, Type::Vector, Type::Number];
/// One rounding of f32.
const U: f64 = 5.960_464_477_539_063e-8;

fn run(
    module: &str,
    function: &str,
    features: &[&str],
    arguments: &[Type],
    result: Type,
    input: &[f32],
) -> Vec<f64> {
    let kernel = Kernel::of(module, function, features, arguments, result);
    kernel.run(gpu(), input).into_iter().map(f64::from).collect()
}

fn one(module: &str, function: &str, features: &[&str], arguments: &[Type], input: &[f32]) -> f64 {
    run(module, function, features, arguments, Type::Number, input)[0]
}

fn numbers(module: &str, function: &str, input: &[f32]) -> f64 {
    one(module, function, &[], &vec![Type::Number; input.len()], input)
}

fn a_zero_vector_stays_zero() -> Outcome {
    let got = run("normalization", "safe_normalize", &[], &[Type::Vector], Type::Vector, &[0.0; 3]);
    Outcome::worst(got.iter().map(|x| (0.0, *x)), 0.0, "0 times 1e15 is 0")
}

fn a_cancelled_normal_takes_the_faces() -> Outcome {
    let input = [0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let got = run("two_sided", "shading_normal", &[], &[Type::Vector, Type::Vector], Type::Vector, &input);
    Outcome::worst([0.0, 1.0, 0.0].into_iter().zip(got), 0.0, "the face's normal is copied")
}

const ATTENUATE: [Type; 4] = [Type::Vector, Type::Flag, Type::Number, Type::Number];

fn attenuation_at_the_light() -> Outcome {
    let got = one("attenuation", "attenuate", &[], &ATTENUATE, &[0.0, 0.0, 1.0, 0.0, 1e30, 0.0]);
    Outcome::number(1e4, got, 1e4 * 16.0 * U, "1/d^2 at a centimetre, the documented floor; 10 roundings")
}

fn attenuation_by_its_square_alone() -> Outcome {
    let got = one("attenuation", "attenuate", &[], &ATTENUATE, &[0.0, 0.0, 0.25, 0.0, 1e30, 4.0]);
    Outcome::number(0.25, got, 0.25 * 16.0 * U, "1/(d^2/4); 10 roundings")
}

fn opposite(function: &str, module: &str) -> f64 {
    one(module, function, &[], &VECTORS, &[0.0, 1.0, 0.0, 0.6, 0.8, 0.0, -0.6, -0.8, 0.0, 20.0])
}

fn a_half_vector_of_opposites() -> Outcome {
    let input = [0.6, 0.8, 0.0, -0.6, -0.8, 0.0];
    let got = run("half_vector", "half_vector", &[], &[Type::Vector, Type::Vector], Type::Vector, &input);
    Outcome::worst(got.iter().map(|x| (0.0, *x)), 0.0, "the sum is exactly 0")
}

fn a_highlight_of_opposites() -> Outcome {
    Outcome::number(0.0, opposite("blinn_phong", "blinn_phong"), 0.0, "n.h is 0, and 0^20 too")
}

fn microfacets_of_opposites() -> Outcome {
    let got = opposite("torrance_sparrow_geometry", "torrance_sparrow");
    Outcome::number(0.0, got, 0.0, "the viewer is behind the surface")
}

/// Light and viewer graze the surface from opposite sides: their sum is 2e along the normal, so h is the normal
/// itself however small e is.
const NEARLY_OPPOSITE: [f32; 3] = [1e-2, 1e-6, 1e-12];

fn nearly_opposite(function: &str, module: &str, shininess: f32) -> Vec<f64> {
    let of =
        |e: f32| one(module, function, &[], &VECTORS, &[0.0, 0.0, 1.0, 1.0, 0.0, e, -1.0, 0.0, e, shininess]);
    NEARLY_OPPOSITE.map(of).to_vec()
}

fn a_half_vector_of_nearly_opposites() -> Outcome {
    let of = |e: f32| {
        run("half_vector", "half_vector", &[], &[Type::Vector; 2], Type::Vector, &[1.0, 0.0, e, -1.0, 0.0, e])
    };
    let got = NEARLY_OPPOSITE.map(of).concat();
    let pairs = [0.0, 0.0, 1.0].into_iter().cycle().zip(got);
    Outcome::worst(
        pairs,
        9.0 * U,
        "the sum comes first and is exact; |l + v|^2 is not taken from 2 + 2 l.v: 9 u",
    )
}

fn a_highlight_of_nearly_opposites() -> Outcome {
    let got = nearly_opposite("blinn_phong", "blinn_phong", 128.0);
    // 1 - 9 u to the 128th power, and pow's own 4.2e-5.
    Outcome::worst(
        got.into_iter().map(|x| (1.0, x)),
        4.4e-5,
        "n.h = 1 however near to opposite: pow at n = 128",
    )
}

fn microfacets_of_nearly_opposites() -> Outcome {
    let got = nearly_opposite("torrance_sparrow_geometry", "torrance_sparrow", 20.0);
    let expected = NEARLY_OPPOSITE.map(|e| {
        let (light, viewer) = (DVec3::new(1.0, 0.0, e.into()), DVec3::new(-1.0, 0.0, e.into()));
        torrance_sparrow_geometry(DVec3::Z, light, viewer, 20.0)
    });
    let pairs = expected.into_iter().zip(got).map(|(expected, got)| (1.0, got / expected));
    Outcome::worst(pairs, 40.0 * U, "relative: G/(n.v) = 100, 2 n.l 10^8 below its floors; 40 roundings")
}

fn zero_to_the_zero() -> Outcome {
    Outcome::number(1.0, numbers("power", "safe_pow", &[0.0, 0.0]), 0.0, "chosen")
}

fn a_negative_cosine() -> Outcome {
    Outcome::number(0.0, numbers("power", "safe_pow", &[-0.5, 3.0]), 0.0, "chosen")
}

fn exponent_zero_is_a_step() -> Outcome {
    let got = one("phong", "phong", &[], &VECTORS, &[0.0, 1.0, 0.0, 0.6, 0.8, 0.0, 0.6, 0.8, 0.0, 0.0]);
    Outcome::number(1.0, got, 0.0, "OpenGL: a step on n.l > 0")
}

fn exponent_zero_behind_the_surface() -> Outcome {
    let got = one("phong", "phong", &[], &VECTORS, &[0.0, 1.0, 0.0, 0.6, -0.8, 0.0, 0.6, 0.8, 0.0, 0.0]);
    Outcome::number(0.0, got, 0.0, "gated on n.l")
}

/// The lobe at about 1/2, with the sine off by 5 roundings: the logarithm's series is off by 1e-7, exp by about
/// 1e-6.
fn sharp_lobe(exponent: f64) -> Outcome {
    let angle = (2.0 * std::f64::consts::LN_2 / exponent).sqrt().min(1.0);
    let axis = DVec3::Y.as_vec3();
    let direction = DVec3::new(angle.sin(), angle.cos(), 0.0).as_vec3();
    let input = [&axis.to_array()[..], &direction.to_array(), &[exponent as f32]].concat();
    let arguments = [Type::Vector, Type::Vector, Type::Number];
    let got = one("power", "cosine_lobe", &["SHARP_HIGHLIGHTS"], &arguments, &input);
    let expected = cosine_lobe(axis.as_dvec3(), direction.as_dvec3(), f64::from(exponent as f32));
    Outcome::number(expected, got, 2e-6, "from the sine: the series and exp, whatever n")
}

fn exponent_1() -> Outcome {
    sharp_lobe(1.0)
}

fn exponent_128() -> Outcome {
    sharp_lobe(128.0)
}

fn exponent_8192() -> Outcome {
    sharp_lobe(8192.0)
}

fn exponent_a_million() -> Outcome {
    sharp_lobe(1e6)
}

fn exponent_four_million() -> Outcome {
    sharp_lobe(4e6)
}

fn filtered(exponent: f32, widening: f32) -> Vec<f64> {
    let call = "let r = filtered_lobe(x[0], 4.0, x[1]); return array<f32, 2>(r.shininess, r.peak);";
    let kernel = Kernel::new("specular_antialiasing", &["filtered_lobe"], &[], 2, 2, call);
    kernel.run(gpu(), &[exponent, widening]).into_iter().map(f64::from).collect()
}

fn a_filtered_mirror() -> Outcome {
    let expected = filtered_lobe(1e6, 4.0, f64::from(0.18f32));
    let got = filtered(1e6, 0.18);
    let pairs = [(1.0, got[0] / expected.shininess), (1.0, got[1] / expected.peak)];
    Outcome::worst(pairs, 40.0 * U, "relative: 10 roundings and two divisions")
}

fn a_plane_is_not_filtered() -> Outcome {
    let got = filtered(200.0, 0.0);
    Outcome::worst([(200.0, got[0]), (1.0, got[1])], 200.0 * 40.0 * U, "2/a^2 - 2 and back")
}

fn masking_at_grazing_light_and_viewer() -> Outcome {
    let got = numbers("torrance_sparrow", "geometric_attenuation", &[1e-7, 1e-7, 1.0, 1.0]);
    Outcome::number(2e-3, got, 2e-3 * 16.0 * U, "2 n.h n.l / (v.h 1e-4), n.v raised to its floor")
}

fn fresnel_at_ninety_degrees() -> Outcome {
    let got = numbers("fresnel", "fresnel_dielectric", &[0.0, 1.5]);
    Outcome::number(1.0, got, 8.0 * U, "(0 - g)/(0 + g) squared")
}

fn fresnel_of_a_metal_at_ninety_degrees() -> Outcome {
    let arguments = [Type::Number, Type::Vector, Type::Vector];
    let input = [0.0, 0.2, 0.4, 1.4, 3.0, 2.5, 2.0];
    let got = run("fresnel", "fresnel_conductor", &[], &arguments, Type::Vector, &input);
    Outcome::worst(got.iter().map(|x| (1.0, *x)), 40.0 * U, "both quotients are 1; 20 roundings")
}

fn just_inside_the_critical_angle() -> Outcome {
    // A thousandth below the critical sine of glass to air.
    let (eta, sine) = (1.0f32 / 1.5, (1.0f32 / 1.5) * 0.999);
    let got = numbers("snell", "transmitted_cosine", &[sine, eta]);
    let expected = transmitted_cosine(sine.into(), eta.into());
    // The quotient's 5 roundings over 2 cos.
    Outcome::number(expected, got, 8.0 * U / expected, "(1 - s)(1 + s): 5 roundings of s over the cosine")
}

fn beyond_the_critical_angle() -> Outcome {
    // The cosine of 60 degrees, inside glass: sin .87 > 1/1.5.
    let got = numbers("fresnel", "fresnel_dielectric", &[0.5, 1.0 / 1.5]);
    Outcome::number(1.0, got, 0.0, "total reflection is a branch of its own")
}

fn nothing_is_transmitted_beyond_it() -> Outcome {
    let arguments = [Type::Vector, Type::Vector, Type::Number];
    let input = [0.0, 1.0, 0.0, 0.8, 0.6, 0.0, 0.666_666_7];
    let got = run("snell", "transmitted_direction", &[], &arguments, Type::Vector, &input);
    Outcome::worst(got.iter().map(|x| (0.0, *x)), 0.0, "no direction: the zero vector")
}

const SPOT: [Type; 4] = [Type::Flag, Type::Number, Type::Number, Type::Number];

fn spot(cone: SpotCone, cosine: f32) -> f64 {
    let SpotCosines { smooth_cone, outer, inner_or_exponent } = cone.cosines();
    let input = [f32::from(u8::from(smooth_cone)), outer as f32, inner_or_exponent as f32, cosine];
    one("spot", "spot_factor", &[], &SPOT, &input)
}

fn cutoff_0_on_the_axis() -> Outcome {
    let got = spot(SpotCone::Exponent { cutoff: 0.0, exponent: 1.0 }, 1.0);
    Outcome::number(0.0, got, 0.0, "strictly inside the cone, as Mesa")
}

fn cutoff_90_at_its_edge() -> Outcome {
    let got = spot(SpotCone::Exponent { cutoff: std::f32::consts::FRAC_PI_2, exponent: 0.0 }, 0.0);
    Outcome::number(0.0, got, 0.0, "a cosine of 0 is outside")
}

fn cutoff_180_behind() -> Outcome {
    let got = spot(SpotCone::Exponent { cutoff: std::f32::consts::PI, exponent: 5.0 }, -1.0);
    Outcome::number(1.0, got, 0.0, "180 degrees is a point light")
}

fn inner_equals_outer() -> Outcome {
    let cone = SpotCone::Smooth { inner: 0.5, outer: 0.5 };
    let cosine = (0.5f64.cos() + 0.0005) as f32;
    let outer = f64::from(0.5f64.cos() as f32);
    let expected = ((f64::from(cosine) - outer) / 0.001).powi(2);
    // A cosine's rounding over a width of .001, doubled by the square.
    Outcome::number(expected, spot(cone, cosine), 4.0 * U / 0.001, "half way over the least width of .001")
}

fn exponent_0_inside() -> Outcome {
    let got = spot(SpotCone::Exponent { cutoff: 1.5, exponent: 0.0 }, 0.1);
    Outcome::number(1.0, got, 0.0, "x^0")
}

fn exponent_128_off_the_axis() -> Outcome {
    let cosine = 0.99f32;
    let got = spot(SpotCone::Exponent { cutoff: 1.0, exponent: 128.0 }, cosine);
    let expected = f64::from(cosine).powi(128);
    // log2 is good to 2^-21 there, which is multiplied by 128 ln 2.
    Outcome::number(expected, got, expected * 5e-5, "pow: 128 times the error of log2, 2^-21")
}

fn fog_of_no_length() -> Outcome {
    let got = numbers("fog", "fog_linear", &[5.0, 5.0, 5.0]);
    Outcome::number(0.0, got, 0.0, "a step at the end")
}

fn fog_a_light_year_away() -> Outcome {
    let got = numbers("fog", "fog_exponential_squared", &[10.0, 9.46e15]);
    Outcome::number(0.0, got, 2e-35, "exp(-80), clamped before the square overflows")
}
