//! Shaders with a deliberate mistake, each of which the comparison has to detect.

use crate::twin;

/// Number of random inputs that suffice to detect a mistake.
const ENOUGH: usize = 20_000;

/// Checks that a twin with a mistake in its shader fails by more than `factor` bounds.
fn is_seen(name: &str, module: &str, from: &str, to: &str, factor: f64) {
    let mutated = twin(name).mutated(module, from, to);
    let verdict = mutated.judge_some(crate::gpu(), ENOUGH);
    println!("{:>12.3e} bounds: {}", verdict.worst().ratio, mutated.name);
    assert!(!verdict.passes() && verdict.worst().ratio > factor, "{verdict}");
}

#[test]
fn a_wrong_factor_of_the_exponent() {
    is_seen("blinn_phong_4n (sharp)", "blinn_phong", "4.0 * shininess);", "4.001 * shininess);", 10.0);
    is_seen("blinn_phong_matched (plain)", "blinn_phong", "4.0 * shininess *", "4.01 * shininess *", 10.0);
}

#[test]
fn a_missing_clamp() {
    is_seen("attenuate", "attenuation", "min(factor, 1.0)", "factor", 10.0);
    is_seen("lambert", "lambert", "clamp(dot(normal, light), 0.0, 1.0)", "dot(normal, light)", 10.0);
    is_seen(
        "fog_fraction",
        "fog",
        "clamp((distance - start) / span, 0.0, 1.0)",
        "(distance - start) / span",
        10.0,
    );
    is_seen(
        "geometric_attenuation",
        "torrance_sparrow",
        "max(v_half, MINIMUM_VIEW_COSINE)",
        "(v_half + 1e-30)",
        10.0,
    );
}

#[test]
fn a_logarithm_of_half_the_digits() {
    // 11 bits, as in f16.
    let from = "pow(clamp(base, SMALLEST_BASE, 1.0), clamp(exponent, 0.0, LARGEST_EXPONENT))";
    let to = "exp2(exponent * floor(log2(clamp(base, SMALLEST_BASE, 1.0)) * 2048.0) / 2048.0)";
    for name in ["safe_pow", "phong (plain)", "spot_factor (exponent)"] {
        is_seen(name, "power", from, to, 10.0);
    }
}

#[test]
fn highlights_without_the_sine() {
    // This is what SHARP_HIGHLIGHTS is for.
    is_seen("cosine_lobe (sharp)", "power", "if cosine > NEARLY_PARALLEL {", "if cosine > 2.0 {", 10.0);
}

#[test]
fn a_series_one_term_short() {
    is_seen("logarithm_of_one_minus", "power", " + z_squared * (1.0 / 5.0)", "", 10.0);
    is_seen("one_minus_exp", "microfacets", " - x * x * (1.0 / 720.0)", "", 2.0);
    is_seen("quarter_angle", "angle", " + x * 0.0028662257", "", 10.0);
}

#[test]
fn cancellation_that_the_shaders_avoid() {
    // The half vector's length computed from 2 + 2 l.v.
    let from = "safe_normalize(light + viewer)";
    let to = "(light + viewer) * inverseSqrt(max(2.0 + 2.0 * dot(light, viewer), 1e-30))";
    is_seen("half_vector", "half_vector", from, to, 10.0);
    // 1 - exp(-x) computed directly.
    is_seen("half_value_sine_squared", "microfacets", "x < 0.25", "x < 0.0", 10.0);
    // v.h near l = -v.
    let from = "0.5 * sqrt(max(squared_length(sum), TINY_LENGTH_SQUARED))";
    is_seen("cosine_to_half", "torrance_sparrow", from, "0.5 * sqrt(squared_length(sum) + 1e-7)", 10.0);
    // The refracted direction computed from the sine, as in an earlier version: nothing is left of it at grazing
    // angles.
    let from = "(index - 1.0) * (index + 1.0) + cos_incident * cos_incident";
    let to = "index * index - squared_length(cross(normal, light))";
    is_seen("transmitted_direction", "snell", from, to, 10.0);
}

#[test]
fn conditions_on_the_wrong_side() {
    is_seen("phong (plain)", "phong", "dot(normal, light) > 0.0", "dot(normal, light) > 1e-5", 10.0);
    is_seen("spot_factor (exponent)", "spot", "outer < clamped", "outer <= clamped", 10.0);
    is_seen("transmitted_direction", "snell", "g_squared < 0.0", "g_squared < -1e-5", 10.0);
    is_seen("is_totally_reflected", "snell", "sin_incident > max", "sin_incident >= max", 10.0);
}

#[test]
fn a_contour_that_does_not_close() {
    // An earlier version: where a corner is on the horizon, rounding let the contour go below it without coming
    // back up.
    let from = "select(height + dot(normal, end), first, index == 3u)";
    is_seen("polygon_form_factor", "polygon_light", from, "height + dot(normal, end)", 10.0);
}

#[test]
fn parts_and_channels_mixed_up() {
    is_seen(
        "light_contribution (phong)",
        "shade",
        "specular * light.specular * factor",
        "specular * light.diffuse * factor",
        10.0,
    );
    is_seen("fog_depth_cue", "fog", "near_weight * (1.0 - far)", "far_weight * (1.0 - far)", 10.0);
    is_seen(
        "torrance_sparrow",
        "torrance_sparrow",
        "ratio * max(n_light, 0.0)",
        "ratio * max(n_viewer, 0.0)",
        10.0,
    );
}

#[test]
fn what_is_not_finite() {
    // 1 / 0 at the light, and 0 * infinity.
    let twin = twin("attenuate").mutated(
        "attenuation",
        "max(max(full, floor_at_light), MINIMUM_DENOMINATOR)",
        "full",
    );
    let verdict = twin.judge_some(crate::gpu(), ENOUGH);
    assert!(verdict.wild.0 > 0 && !verdict.passes(), "{verdict}");
}
