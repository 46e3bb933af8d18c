//! Properties that hold for all inputs: finite, monotone, linear, symmetric, reciprocal.

#[path = "properties/energy.rs"]
mod energy;

use glam::{DVec3, Vec3};
use lumbre_optics::*;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// Every finite f64, including denormals and the largest numbers.
fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -10.0..10.0f64,
        2 => proptest::num::f64::NORMAL | proptest::num::f64::SUBNORMAL | proptest::num::f64::ZERO,
        1 => prop::sample::select(vec![0.0, -0.0, 1.0, -1.0, f64::MIN_POSITIVE, f64::MAX, f64::MIN, 1e-300]),
    ]
}

fn any_float() -> impl Strategy<Value = f32> {
    prop_oneof![
        2 => -10.0..10.0f32,
        2 => proptest::num::f32::NORMAL | proptest::num::f32::SUBNORMAL | proptest::num::f32::ZERO,
        1 => prop::sample::select(vec![0.0, 1.0, f32::MIN_POSITIVE, f32::MAX, f32::MIN, std::f32::consts::FRAC_PI_2, std::f32::consts::PI]),
    ]
}

fn any_vector() -> impl Strategy<Value = DVec3> {
    [any_number(), any_number(), any_number()].prop_map(DVec3::from)
}

fn color() -> impl Strategy<Value = Vec3> {
    [0.0..1.0f32, 0.0..1.0f32, 0.0..1.0f32].prop_map(Vec3::from)
}

/// Unit vectors, uniform over the sphere, and the zero vector.
fn unit() -> impl Strategy<Value = DVec3> {
    prop_oneof![
        20 => (-1.0..1.0f64, 0.0..std::f64::consts::TAU).prop_map(|(z, azimuth)| {
            let radius = (1.0 - z * z).sqrt();
            DVec3::new(radius * azimuth.cos(), radius * azimuth.sin(), z)
        }),
        1 => Just(DVec3::ZERO),
        2 => prop::sample::select(vec![DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z]),
    ]
}

/// Unit vectors above the plane with normal +Z.
fn above() -> impl Strategy<Value = DVec3> {
    (0.001..1.0f64, 0.0..std::f64::consts::TAU).prop_map(|(z, azimuth)| {
        let radius = (1.0 - z * z).sqrt();
        DVec3::new(radius * azimuth.cos(), radius * azimuth.sin(), z)
    })
}

fn shininess() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), 0.0..1.0f64, 1.0..500.0f64, 500.0..1e6f64]
}

fn model() -> impl Strategy<Value = ReflectionModel> {
    prop::sample::select(ReflectionModel::ALL.to_vec())
}

fn any_light() -> impl Strategy<Value = Light> {
    let kind = prop::sample::select(vec![LightKind::Ambient, LightKind::Directional, LightKind::Point]);
    let attenuation = ([any_float(), any_float(), any_float()], any::<bool>(), any_float()).prop_map(
        |([constant, linear, quadratic], clamp, range)| Attenuation {
            constant,
            linear,
            quadratic,
            clamp,
            range,
        },
    );
    let cone = prop_oneof![
        Just(None),
        (any_float(), any_float())
            .prop_map(|(cutoff, exponent)| Some(SpotCone::Exponent { cutoff, exponent })),
        (any_float(), any_float()).prop_map(|(inner, outer)| Some(SpotCone::Smooth { inner, outer })),
    ];
    (kind, [color(), color(), color()], attenuation, cone).prop_map(
        |(kind, [ambient, diffuse, specular], attenuation, spot)| Light {
            kind,
            ambient,
            diffuse,
            specular,
            attenuation,
            spot,
            ..Light::point(Vec3::ONE)
        },
    )
}

fn any_surface() -> impl Strategy<Value = Surface> {
    ([color(), color(), color(), color()], shininess()).prop_map(
        |([ambient, diffuse, specular, emission], shininess)| Surface {
            ambient,
            diffuse,
            specular,
            emission,
            shininess: shininess as f32,
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_function_is_finite_for_every_finite_input(
        (a, b, c) in (any_vector(), unit(), unit()),
        (x, y, z, w) in (any_number(), any_number(), any_number(), any_number()),
        flag in any::<bool>(),
    ) {
        prop_assert!(safe_normalize(a).is_finite());
        prop_assert!(safe_normalize(a).length() <= 1.0 + 1e-15);
        prop_assert!((0.0..=1.0).contains(&safe_pow(x, y)));
        prop_assert!((0.0..=1.0).contains(&power_of_cosine(x, y, z)));
        prop_assert!((0.0..=1.0).contains(&lambert(b, c)));
        prop_assert!((0.0..=1.0).contains(&spot_factor(flag, x, y, z)));
        prop_assert!((0.0..=1e30).contains(&attenuate(a, flag, x, y)));
        prop_assert!(fresnel_schlick(x, b).is_finite());
        prop_assert!(transmitted_direction(b, c, x).is_finite());
        prop_assert!((0.0..=1.0).contains(&transmitted_cosine(x, y)));
        prop_assert!((0.0..=1.0).contains(&transmitted_highlight(b, c, -b, x, y)));
        prop_assert!((0.0..=1.0).contains(&half_value_sine_squared(x)));
        prop_assert!((0.0..=1.0).contains(&distribution_gaussian(x, y, z)));
        prop_assert!((0.0..=1.0).contains(&distribution_trowbridge_reitz(x, y)));
        prop_assert!((0.0..=1e4).contains(&geometric_attenuation(x, y, z, w)));
        prop_assert!((0.0..=1.0).contains(&fog_linear(x, y, z)) || !(y - x).is_finite());
        prop_assert!((0.0..=1.0).contains(&fog_exponential(x, y)));
        prop_assert!((0.0..=1.0).contains(&fog_exponential_squared(x, y)));
    }

    #[test]
    fn a_light_on_a_surface_is_finite_and_not_negative(
        model in model(), light in any_light(), surface in any_surface(),
        (position, point) in (any_vector(), any_vector()), (axis, normal, viewer) in (unit(), unit(), unit()),
    ) {
        let sample = evaluate_light(&light, position, axis, point);
        prop_assert!((0.0..=1.0).contains(&sample.spot), "{:?}", sample);
        prop_assert!(sample.attenuation.is_finite() && sample.attenuation >= 0.0, "{:?}", sample);
        prop_assert!(sample.direction.is_finite());
        let lit = light_contribution(model, &surface, &sample, normal, viewer);
        for part in [lit.ambient, lit.diffuse, lit.specular] {
            prop_assert!(part.is_finite() && part.min_element() >= 0.0, "{:?}", lit);
        }
    }

    #[test]
    fn attenuation_never_rises_with_the_distance(
        coefficients in [0.0..10.0f64, 0.0..10.0f64, 0.0..10.0f64], clamp in any::<bool>(),
        range in prop_oneof![Just(f64::INFINITY), 0.1..1e4f64], (near, far) in (0.0..1e4f64, 0.0..1e4f64),
    ) {
        let factor = |distance: f64| attenuate(DVec3::from(coefficients), clamp, range, distance);
        prop_assert!(factor(near.min(far)) >= factor(near.max(far)));
    }

    #[test]
    fn nothing_reaches_beyond_its_reach(
        [constant, linear, quadratic] in [0.0..10.0f32, 0.0..10.0f32, 0.01..10.0f32], threshold in 1e-6..10.0f64,
    ) {
        let attenuation = Attenuation { constant, linear, quadratic, ..Attenuation::NONE };
        let reach = attenuation.reach(threshold);
        // One or two roundings in either formula.
        prop_assert!(attenuation.factor(reach * (1.0 + 1e-12) + 1e-12) <= threshold * (1.0 + 1e-12));
    }

    #[test]
    fn light_is_linear_in_its_colour(
        model in model(), surface in any_surface(), (normal, viewer, axis) in (unit(), unit(), unit()), color in color(),
    ) {
        let lit = |color: Vec3| {
            let light = Light { ambient: color, ..Light::directional(color) };
            let sample = evaluate_light(&light, DVec3::ZERO, axis, DVec3::ZERO);
            light_contribution(model, &surface, &sample, normal, viewer).total()
        };
        // Powers of two scale exactly.
        prop_assert_eq!(lit(color * 4.0), lit(color) * 4.0);
        // Channels do not mix.
        prop_assert_eq!(lit(color * Vec3::X), lit(color) * DVec3::X);
    }

    #[test]
    fn the_order_of_the_lights_does_not_matter(
        model in model(), surface in any_surface(), (normal, viewer) in (unit(), unit()),
        lights in prop::collection::vec((color(), unit()), 0..8),
    ) {
        let samples: Vec<LightSample> = lights
            .iter()
            .map(|(color, axis)| evaluate_light(&Light::directional(*color), DVec3::ZERO, *axis, DVec3::ZERO))
            .collect();
        let there = shade(model, &surface, DVec3::ONE, samples.iter().copied(), normal, viewer).total();
        let back = shade(model, &surface, DVec3::ONE, samples.iter().rev().copied(), normal, viewer).total();
        // Eight additions of non-negative numbers, each rounded to 2⁻⁵³ of the sum.
        prop_assert!((there - back).abs().max_element() <= 2e-15 * (1.0 + there.max_element()));
    }

    #[test]
    fn phong_and_blinn_are_reciprocal((light, viewer) in (above(), above()), shininess in 0.0..500.0f64) {
        for model in [phong, blinn_phong, blinn_phong_4n] {
            let there = model(DVec3::Z, light, viewer, shininess);
            let back = model(DVec3::Z, viewer, light, shininess);
            // The cosine's rounding, a few 2⁻⁵³, times an exponent of up to 2000.
            prop_assert!((there - back).abs() < 2e-12, "{} {}", there, back);
        }
    }

    #[test]
    fn torrance_sparrow_is_reciprocal_as_a_reflectance(
        (light, viewer) in (above(), above()), shininess in shininess(), ior in 1.0..3.0f64,
    ) {
        let there = torrance_sparrow(DVec3::Z, light, viewer, shininess, ior) * viewer.z;
        let back = torrance_sparrow(DVec3::Z, viewer, light, shininess, ior) * light.z;
        // Relative: D's slope is at most the square root of n times the angle's rounding, 10³ · 2⁻⁵³.
        prop_assert!((there - back).abs() <= 1e-12 * there.max(1e-30), "{} {}", there, back);
    }

    #[test]
    fn what_is_reflected_and_transmitted_is_all(angle in 0.0..1.57f64, eta in 0.3..3.0f64) {
        // Light in the opposite direction is reflected by the same fraction.
        let (sine, cosine) = angle.sin_cos();
        prop_assume!((sine / eta - 1.0).abs() > 1e-9);
        let there = fresnel_dielectric(cosine, eta);
        if is_totally_reflected(sine, eta) {
            prop_assert_eq!(there, 1.0);
        } else {
            let back = fresnel_dielectric(transmitted_cosine(sine, eta), 1.0 / eta);
            // The transmitted cosine is a root: its error is 2⁻⁵³ over its value, which is 4·10⁻⁵ at the assumed
            // bound.
            prop_assert!((there - back).abs() < 1e-10, "{} {}", there, back);
        }
    }

    #[test]
    fn transmitted_light_obeys_snell(normal in unit(), light in unit(), eta in 0.3..3.0f64) {
        let light = if normal.dot(light) < 0.0 { -light } else { light };
        prop_assume!(normal.dot(light) > 1e-3);
        if let Some(direction) = try_transmitted_direction(normal, light, eta) {
            let (before, after) = (normal.cross(light), normal.cross(direction));
            // n × l = -eta n × t: the coplanarity and Snell's law in one equation.
            prop_assert!((before + eta * after).length() < 1e-14);
            prop_assert!(normal.dot(direction) <= 0.0 && (direction.length() - 1.0).abs() < 1e-15);
        } else {
            prop_assert!(normal.cross(light).length() > eta);
        }
    }

    #[test]
    fn fog_never_lifts_with_the_distance(
        (near, far) in (0.0..1e3f64, 0.0..1e3f64), (start, depth) in (0.0..100.0f32, 0.0..100.0f32), density in 0.0..1.0f32,
    ) {
        let end = start + depth;
        for mode in [
            FogMode::Linear { start, end },
            FogMode::Exponential { density },
            FogMode::ExponentialSquared { density },
            FogMode::DepthCue { start, end, near_weight: 0.9, far_weight: 0.2 },
        ] {
            prop_assert!(fog_weight(&mode, near.min(far)) >= fog_weight(&mode, near.max(far)));
        }
    }

    #[test]
    fn light_is_linear_in_each_of_its_colours(
        (light, viewer) in (above(), above()),
        surface in any_surface(),
        model in model(),
        (a, b) in (color(), color()),
        part in 0..3usize,
    ) {
        // L(a) + L(b) = L(a + b), separately for the ambient, the diffuse and the specular colour.
        let lit = |color: Vec3| {
            let mut sample = LightSample { direction: light, attenuation: 0.5, spot: 0.75, ..LightSample::DARK };
            let parts = [&mut sample.ambient, &mut sample.diffuse, &mut sample.specular];
            *parts.into_iter().nth(part).expect("one of three") = color.as_dvec3();
            light_contribution(model, &surface, &sample, DVec3::Z, viewer).total()
        };
        let (sum, whole) = (lit(a) + lit(b), lit(a + b));
        // Colours are f32, so their sum is rounded.
        prop_assert!((sum - whole).abs().max_element() <= 1e-6 * (1.0 + whole.max_element()), "{sum} {whole}");
    }

    #[test]
    fn microfacets_are_reciprocal_with_every_choice(
        (light, viewer) in (above(), above()),
        shininess in 0.0..500.0f64,
        distribution in prop::sample::select(Distribution::ALL.to_vec()),
        fresnel in prop::sample::select(vec![
            Fresnel::Dielectric,
            Fresnel::NormalReflectance,
            Fresnel::Conductor { eta: Vec3::new(0.2, 0.9, 1.4), absorption: Vec3::new(3.0, 2.5, 2.0) },
        ]),
    ) {
        // Multiplied by n·v it is symmetric: G and D are, and F depends on h alone. The directions are above the
        // minimum view cosine.
        let reflect = |l: DVec3, v: DVec3| {
            let kind = (distribution, fresnel);
            microfacet_reflection(kind, DVec3::Z, l, v, shininess, DVec3::new(0.9, 0.5, 0.04), 1.5) * v.z
        };
        let (there, back) = (reflect(light, viewer), reflect(viewer, light));
        prop_assert!((there - back).abs().max_element() <= 1e-9 * (1.0 + there.max_element()), "{there} {back}");
    }

    #[test]
    fn microfacets_reflect_no_more_than_fresnel_allows(
        incident in 0.0..1.4f64,
        shininess in 1.0..200.0f64,
        distribution in prop::sample::select(Distribution::ALL.to_vec()),
    ) {
        // In the mirror direction of a mirror k_s D G F/(n·v) with D = 1 is at most 1/(n·v), so times n·v at most
        // 1.
        let light = DVec3::new(incident.sin(), 0.0, incident.cos());
        let kind = (distribution, Fresnel::NormalReflectance);
        for azimuth in [0.0f64, 0.3, 3.0] {
            let viewer = DVec3::new(-light.x * azimuth.cos(), light.x * azimuth.sin(), light.z);
            let sent = microfacet_reflection(kind, DVec3::Z, light, viewer, shininess, DVec3::ONE, 1.5) * viewer.z;
            prop_assert!(sent.max_element() <= 1.0 + 1e-12, "{sent}");
        }
    }

    #[test]
    fn a_nearer_light_lights_no_less(
        model in model(), surface in any_surface(), (normal, toward, viewer) in (above(), above(), above()),
        (near, far) in (0.0..100.0f64, 0.0..100.0f64), colors in [color(), color(), color()],
        [constant, linear, quadratic] in [0.0..2.0f32, 0.0..2.0f32, 0.01..2.0f32],
        (clamp, range) in (any::<bool>(), prop_oneof![Just(f32::INFINITY), 1.0..100.0f32]),
    ) {
        let attenuation = Attenuation { constant, linear, quadratic, clamp, range };
        let [ambient, diffuse, specular] = colors;
        let light = Light { ambient, diffuse, specular, attenuation, ..Light::point(Vec3::ONE) };
        // The same direction at every distance.
        let lit = |distance: f64| {
            let sample = evaluate_light(&light, toward * distance.max(1e-3), DVec3::ZERO, DVec3::ZERO);
            let sample = LightSample { direction: toward, ..sample };
            light_contribution(model, &surface, &sample, normal, viewer).total()
        };
        prop_assert!((lit(near.min(far)) - lit(near.max(far))).min_element() >= 0.0);
    }

    #[test]
    fn the_fallible_twins_agree_where_they_have_a_value(
        (a, b, point) in (any_vector(), any_vector(), any_vector()), (x, y) in (any_number(), any_number()),
        (eta, absorption) in (any_vector(), any_vector()), light in any_light(), axis in unit(), flag in any::<bool>(),
    ) {
        if let Some(direction) = try_reflected_direction(a, b) {
            prop_assert!((direction.length() - 1.0).abs() < 1e-14);
        }
        if let Some(reflectance) = try_fresnel_dielectric(x, y) {
            prop_assert_eq!(reflectance, fresnel_dielectric(x, y));
        }
        if let Some(reflectance) = try_fresnel_conductor(x, eta, absorption) {
            prop_assert_eq!(reflectance, fresnel_conductor(x, eta, absorption));
        }
        if let Some(reflectance) = try_fresnel_normal_reflectance(x, eta) {
            prop_assert_eq!(reflectance, fresnel_normal_reflectance(x, eta));
        }
        if let Some(cosine) = try_transmitted_cosine(x, y) {
            prop_assert_eq!(cosine, transmitted_cosine(x, y));
        }
        if let Some(factor) = try_attenuate(a, flag, x, y) {
            prop_assert_eq!(factor, attenuate(a, flag, x, y));
        }
        if let Some(direction) = try_viewer_direction(flag, a, b, point) {
            prop_assert!((direction.length() - 1.0).abs() < 1e-14);
        }
        if let Ok(sample) = try_evaluate_light(&light, a, axis, point) {
            prop_assert_eq!(sample, evaluate_light(&light, a, axis, point));
        }
    }
}
