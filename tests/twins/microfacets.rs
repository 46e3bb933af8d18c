//! Microfacets: the three distributions, their half-value angles, Torrance and Sparrow's factor.

use std::f32::consts::FRAC_1_SQRT_2;

use glam::DVec3;
use lumbre_optics::*;
use lumbre_tests::kernel::{Kernel, Type};

use crate::bounds::microfacets as bound;
use crate::bounds::powers::{self, Off};
use crate::highlights::{directions, hard_lobes, lobe};
use crate::inputs::{EXPONENTS, Sequence, crossed, product};
use crate::judge::Twin;
use crate::vectors::vector;

/// Random cos, sin² and an exponent for which the distribution is mostly neither 0 nor 1.
fn distribution(sequence: &mut Sequence) -> Vec<f32> {
    let angle = f64::from(sequence.decades(-5.0, 0.19));
    let exponent = f64::from(sequence.decades(-2.0, 1.0)) / angle.powi(2);
    vec![angle.cos() as f32, angle.sin().powi(2) as f32, exponent.min(1e6) as f32]
}

fn hard_distributions() -> Vec<Vec<f32>> {
    let angles = [0.0f64, 1e-6, 1e-3, 0.1, 0.44, 0.46, 0.8, 1.2, 1.57];
    let angles: Vec<Vec<f32>> = angles.iter().map(|a| vec![a.cos() as f32, a.sin().powi(2) as f32]).collect();
    crossed(&angles, &product(&[&EXPONENTS]))
}

fn angles() -> [Twin; 4] {
    // 8 ln 2 = 5.545, where the series takes over from the exponential.
    let exponents = [&EXPONENTS[..], &[5.5, 5.545_177, 5.6]].concat();
    [
        Twin::new("angle", "quarter_angle", &[], &[Type::Number; 2], Type::Number)
            .expect(|x| quarter_angle(x[0], x[1]))
            // Two numbers that are both almost 0 have no meaningful angle.
            .within(|x| match x[0].max(x[1]) < 1e-29 {
                true => std::f64::consts::FRAC_PI_2,
                false => bound::quarter_angle(x[0].max(0.0), x[1].max(0.0)),
            })
            .random(|s| {
                let angle = f64::from(s.decades(-5.0, 0.196));
                vec![angle.sin() as f32, angle.cos().max(0.0) as f32]
            })
            .corners(product(&[
                &[0.0, 1e-20, 1e-7, 0.5, FRAC_1_SQRT_2, 1.0],
                &[0.0, 1e-20, 1e-7, 0.5, FRAC_1_SQRT_2, 1.0],
            ])),
        Twin::new("microfacets", "one_minus_exp", &[], &[Type::Number], Type::Number)
            .expect(|x| -(-x[0]).exp_m1())
            .within(|x| bound::one_minus_exp(Off::exact(x[0])))
            .random(|s| vec![s.decades(-6.0, 1.9)])
            .corners(product(&[&[0.0, 1e-30, 1e-6, 0.249_999, 0.25, 0.250_001, 1.0, 79.999, 80.0]])),
        Twin::new("microfacets", "half_value_sine_squared", &[], &[Type::Number], Type::Number)
            .expect(|x| half_value_sine_squared(x[0]))
            .within(|x| bound::half_value_sine_squared(x[0]))
            .random(|s| vec![s.decades(-2.0, 6.0)])
            .corners(product(&[&exponents]))
            .range(0.0, 1.0),
        Twin::new("microfacets", "half_value_angle", &[], &[Type::Number], Type::Number)
            .expect(|x| half_value_angle(x[0]))
            .within(|x| bound::half_value_angle(x[0]))
            .random(|s| vec![s.decades(-2.0, 6.0)])
            .corners(product(&[&exponents]))
            .range(0.0, 1.571),
    ]
}

fn distributions() -> [Twin; 3] {
    [
        Twin::new("microfacets", "distribution_cosine_power", &[], &[Type::Number; 3], Type::Number)
            .expect(|x| distribution_cosine_power(x[0], x[1], x[2]))
            .within(|x| powers::power_of_cosine(Off::exact(x[0]), Off::exact(x[1]), Off::exact(x[2])))
            .random(distribution)
            .corners(hard_distributions())
            .range(0.0, 1.0),
        Twin::new("microfacets", "distribution_gaussian", &[], &[Type::Number; 3], Type::Number)
            .expect(|x| distribution_gaussian(x[0], x[1], x[2]))
            .within(|x| bound::distribution_gaussian(Off::exact(x[0]), Off::exact(x[1]), x[2]))
            .random(distribution)
            .corners(hard_distributions())
            .range(0.0, 1.0),
        Twin::new("microfacets", "distribution_trowbridge_reitz", &[], &[Type::Number; 2], Type::Number)
            .expect(|x| distribution_trowbridge_reitz(x[0], x[1]))
            .within(|x| bound::distribution_trowbridge_reitz(Off::exact(x[0]), x[1]))
            .random(|s| distribution(s)[1..].to_vec())
            .corners(hard_distributions().iter().map(|numbers| numbers[1..].to_vec()).collect())
            .range(0.0, 1.0),
    ]
}

fn blinn_1977() -> [Twin; 4] {
    let lobe_arguments = [Type::Vector, Type::Vector, Type::Vector, Type::Number, Type::Number];
    [
        Twin::new("torrance_sparrow", "geometric_attenuation", &[], &[Type::Number; 4], Type::Number)
            .expect(|x| geometric_attenuation(x[0], x[1], x[2], x[3]))
            .within(|x| bound::geometric_attenuation(x[0], x[1], x[2], x[3]))
            .random(|s| vec![s.next(), s.decades(-4.0, 0.0), s.next(), s.decades(-4.0, 0.0)])
            .corners(product(&[
                &[-1.0, 0.0, 1e-7, 0.5, 1.0],
                &[0.0, 1e-7, 1e-4, 0.5, 1.0],
                &[-1.0, 0.0, 1e-4, 0.5, 1.0],
                &[0.0, 1e-7, 1e-4, 0.5, 1.0],
            ]))
            .range(0.0, 10_000.01),
        Twin::new("torrance_sparrow", "cosine_to_half", &[], &[Type::Vector], Type::Number)
            .expect(|x| 0.5 * vector(x, 0).length_squared().max(TINY_LENGTH_SQUARED).sqrt())
            .within(|x| bound::cosine_to_half(vector(x, 0)))
            .random(|s| (s.unit() * s.decades(-12.0, 0.3)).to_array().to_vec())
            .corners(product(&[&[0.0, 1e-38, 1e-16, 1e-7, 1.0], &[0.0, 1e-7, -1.0], &[0.0, 1e-20, 1.0]])),
        Twin::new("torrance_sparrow", "torrance_sparrow_geometry", &[], &lobe_arguments[..4], Type::Number)
            .expect(|x| torrance_sparrow_geometry(vector(x, 0), vector(x, 3), vector(x, 6), x[9]))
            .within(|x| bound::microfacet_lobe(Distribution::TrowbridgeReitz, directions(x), x[9]))
            .random(lobe)
            .corners(hard_lobes())
            .range_up_to(0.0, 10_000.01, 1e6),
        Twin::new("torrance_sparrow", "torrance_sparrow", &[], &lobe_arguments, Type::Number)
            .expect(|x| torrance_sparrow(vector(x, 0), vector(x, 3), vector(x, 6), x[9], x[10]))
            .within(|x| bound::torrance_sparrow(directions(x), x[9], x[10]))
            .random(|s| {
                let mut input = lobe(s);
                input.push(s.between(1.0, 3.0));
                input
            })
            .corners(crossed(&hard_lobes(), &product(&[&[1.0, 1.5, 2.42]])))
            .range_up_to(0.0, 10_000.02, 1e6),
    ]
}

fn features(distribution: Distribution) -> &'static [&'static str] {
    match distribution {
        Distribution::CosinePower => &["DISTRIBUTION_COSINE_POWER"],
        Distribution::Gaussian => &["DISTRIBUTION_GAUSSIAN"],
        Distribution::TrowbridgeReitz => &[],
    }
}

fn chosen_lobe(distribution: Distribution) -> Twin {
    let arguments = [Type::Vector, Type::Vector, Type::Vector, Type::Number];
    Twin::new("microfacet_reflection", "microfacet_lobe", features(distribution), &arguments, Type::Number)
        .named(distribution.name())
        .expect(move |x| microfacet_lobe(distribution, vector(x, 0), vector(x, 3), vector(x, 6), x[9]))
        .within(move |x| bound::microfacet_lobe(distribution, directions(x), x[9]))
        .random(lobe)
        .corners(hard_lobes())
        .range_up_to(0.0, 10_000.01, 1e6)
}

/// A metal's constants, which are the same for all inputs, like those of a material.
const GOLD: Fresnel = Fresnel::Conductor {
    eta: glam::Vec3::new(0.17, 0.42, 1.38),
    absorption: glam::Vec3::new(3.15, 2.35, 1.92),
};

fn chosen_fresnel(fresnel: Fresnel, feature: &[&str]) -> Twin {
    let call = "let r = microfacet_reflection(vec3<f32>(x[0], x[1], x[2]), vec3<f32>(x[3], x[4], x[5]),
        vec3<f32>(x[6], x[7], x[8]), x[9], vec3<f32>(x[10], 0.5 * x[10], 1.0), x[11], vec3<f32>(0.17, 0.42, 1.38),
        vec3<f32>(3.15, 2.35, 1.92));
        return array<f32, 3>(r.x, r.y, r.z);";
    let kernel = Kernel::new("microfacet_reflection", &["microfacet_reflection"], feature, 12, 3, call);
    let kind = (Distribution::TrowbridgeReitz, fresnel);
    let specular = |x: &[f64]| DVec3::new(x[10], 0.5 * x[10], 1.0);
    Twin::around("microfacet_reflection", kernel)
        .named(fresnel.name())
        .expect(move |x| {
            let [normal, light, viewer] = directions(x);
            microfacet_reflection(kind, normal, light, viewer, x[9], specular(x), x[11])
        })
        .within(move |x| bound::microfacet_reflection(kind, directions(x), x[9], specular(x), x[11]))
        .random(|s| [lobe(s), vec![s.next(), s.between(1.0, 3.0)]].concat())
        .corners(crossed(&hard_lobes(), &product(&[&[0.0, 0.04, 1.0], &[1.5]])))
}

pub fn twins() -> Vec<Twin> {
    let choices = [
        chosen_fresnel(Fresnel::Dielectric, &[]),
        chosen_fresnel(GOLD, &["FRESNEL_CONDUCTOR"]),
        chosen_fresnel(Fresnel::NormalReflectance, &["FRESNEL_NORMAL_REFLECTANCE"]),
    ];
    let lobes = Distribution::ALL.iter().copied().map(chosen_lobe);
    angles().into_iter().chain(distributions()).chain(blinn_1977()).chain(lobes).chain(choices).collect()
}
