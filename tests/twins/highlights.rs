//! Highlights: powers of cosines, the lobes of Phong and Blinn, their filtered forms, and roughness.

use glam::{DVec3, Vec3};
use lumbre_optics::*;
use lumbre_tests::kernel::{Kernel, Type};

use crate::bounds::Allowed;
use crate::bounds::lobes::{self, OffVector};
use crate::bounds::powers::{self, Off};
use crate::inputs::{EXPONENTS, Sequence, crossed, hard_directions, product};
use crate::judge::Twin;
use crate::vectors::vector;

const LOBE: [Type; 4] = [Type::Vector, Type::Vector, Type::Vector, Type::Number];

/// Random directions and an exponent.
pub fn lobe(sequence: &mut Sequence) -> Vec<f32> {
    let directions = sequence.directions();
    let mut numbers: Vec<f32> = directions.iter().flat_map(|v| v.to_array()).collect();
    numbers.push(sequence.shininess());
    numbers
}

/// Hard directions, each with every exponent.
pub fn hard_lobes() -> Vec<Vec<f32>> {
    let directions: Vec<Vec<f32>> = hard_directions().iter().map(|numbers| numbers.to_vec()).collect();
    crossed(&directions, &product(&[&EXPONENTS]))
}

fn base_and_exponent(sequence: &mut Sequence) -> Vec<f32> {
    // For half of them the power is neither 0 nor 1.
    let exponent = sequence.shininess();
    let base =
        if sequence.next() < 0.5 { sequence.next() } else { (-sequence.decades(-3.0, 1.0) / exponent).exp() };
    vec![base, exponent]
}

fn powers_of_cosines() -> [Twin; 3] {
    [
        Twin::new("power", "safe_pow", &[], &[Type::Number, Type::Number], Type::Number)
            .expect(|x| safe_pow(x[0], x[1]))
            .within(|x| powers::safe_pow(Off::exact(x[0]), Off::exact(x[1])))
            .random(base_and_exponent)
            .corners(product(&[
                &[-1.0, -0.0, 0.0, 1e-38, 1e-30, 1e-20, 0.1, 0.5, 0.9, 0.999_999, 1.0, 2.0],
                &EXPONENTS,
            ]))
            .range(0.0, 1.0),
        Twin::new("power", "logarithm_of_one_minus", &[], &[Type::Number], Type::Number)
            .expect(|x| (-x[0]).ln_1p())
            .within(|x| powers::logarithm_of_one_minus(x[0]))
            .random(|s| vec![0.25 * s.next().powi(2)])
            .corners(product(&[&[0.0, 1e-38, 1e-30, 1e-12, 1e-6, 1e-3, 0.1, 0.19, 0.249_999]])),
        Twin::new("power", "power_of_cosine", &[], &[Type::Number; 3], Type::Number)
            .expect(|x| power_of_cosine(x[0], x[1], x[2]))
            .within(|x| powers::power_of_cosine(Off::exact(x[0]), Off::exact(x[1]), Off::exact(x[2])))
            .random(|s| {
                let angle = f64::from(s.decades(-6.0, 0.19));
                let exponent = f64::from(s.decades(-2.0, 1.3)) / angle.powi(2);
                vec![angle.cos() as f32, angle.sin().powi(2) as f32, exponent.min(1e6) as f32]
            })
            .corners(product(&[
                &[-1.0, 0.0, 0.5, 0.899_999, 0.9, 0.900_001, 0.999, 1.0],
                &[0.0, 1e-30, 1e-12, 1e-6, 1e-3, 0.19, 0.25, 1.0],
                &EXPONENTS,
            ]))
            .range(0.0, 1.0),
    ]
}

/// A cosine lobe around exact vectors, with random inputs near its peak.
fn bare_lobe(sharp: bool) -> Twin {
    let arguments = [Type::Vector, Type::Vector, Type::Number];
    let corners: Vec<Vec<f32>> = hard_directions().iter().map(|numbers| numbers[3..].to_vec()).collect();
    Twin::new("power", "cosine_lobe", features(sharp), &arguments, Type::Number)
        .named(suffix(sharp))
        .expect(|x| cosine_lobe(vector(x, 0), vector(x, 3), x[6]))
        .within(move |x| {
            let [axis, direction] = [0, 3].map(|at| OffVector::exact(vector(x, at)));
            lobes::cosine_lobe(axis, direction, Off::exact(x[6]), sharp)
        })
        .random(move |s| {
            let axis = s.unit();
            let away = s.decades(-6.0, 0.3);
            let direction =
                (axis.as_dvec3() + f64::from(away) * s.unit().as_dvec3()).normalize_or_zero().as_vec3();
            let exponent = plain(s.shininess(), sharp);
            [&axis.to_array()[..], &direction.to_array(), &[exponent]].concat()
        })
        .corners(crossed(&corners, &product(&[&exponents(sharp)])))
        .range_up_to(0.0, 1.0, 1e9)
}

fn features(sharp: bool) -> &'static [&'static str] {
    if sharp { &["SHARP_HIGHLIGHTS"] } else { &[] }
}

fn suffix(sharp: bool) -> &'static str {
    if sharp { "sharp" } else { "plain" }
}

/// The plain form is only used for exponents up to [`SHARP_SHININESS`].
fn plain(exponent: f32, sharp: bool) -> f32 {
    if sharp || exponent <= SHARP_SHININESS { exponent } else { exponent.rem_euclid(SHARP_SHININESS) }
}

fn exponents(sharp: bool) -> Vec<f32> {
    EXPONENTS.iter().copied().filter(|exponent| sharp || *exponent <= SHARP_SHININESS).collect()
}

type Model = fn(DVec3, DVec3, DVec3, f64) -> f64;
type Bound = fn(DVec3, DVec3, DVec3, f64, bool) -> Allowed;

fn highlight(module: &str, name: &str, model: Model, bound: Bound, sharp: bool) -> Twin {
    let directions: Vec<Vec<f32>> = hard_directions().iter().map(|numbers| numbers.to_vec()).collect();
    Twin::new(module, name, features(sharp), &LOBE, Type::Number)
        .named(suffix(sharp))
        .expect(move |x| model(vector(x, 0), vector(x, 3), vector(x, 6), x[9]))
        .within(move |x| bound(vector(x, 0), vector(x, 3), vector(x, 6), x[9], sharp))
        .random(move |s| {
            let mut input = lobe(s);
            input[9] = plain(input[9], sharp);
            input
        })
        .corners(crossed(&directions, &product(&[&exponents(sharp)])))
        .range_up_to(0.0, 1.0, 1e6)
}

fn filtered() -> [Twin; 3] {
    let call = "let r = filtered_lobe(x[0], x[1], x[2]); return array<f32, 2>(r.shininess, r.peak);";
    let kernel = Kernel::new("specular_antialiasing", &["filtered_lobe"], &[], 3, 2, call);
    let changes: [f32; 7] = [0.0, 1e-30, 1e-6, 0.1, 0.359_999, 0.36, 4.0];
    [
        Twin::around("filtered_lobe", kernel)
            .expect(|x| {
                let lobe = filtered_lobe(x[0], x[1], x[2]);
                [lobe.shininess, lobe.peak]
            })
            .within(|x| Allowed::from(&lobes::filtered_lobe(x[0], x[1], x[2])[..]))
            .random(|s| vec![s.shininess(), 1.0 + 3.0 * s.next().round(), 0.18 * s.next() * s.next()])
            .corners(product(&[&EXPONENTS, &[1.0, 4.0], &[-1.0, 0.0, 1e-12, 1e-6, 1e-3, 0.18]])),
        Twin::new("specular_antialiasing", "lobe_widening", &[], &[Type::Number; 2], Type::Number)
            .expect(|x| lobe_widening(x[0], x[1]))
            .within(|x| lobes::lobe_widening(x[0], x[1]))
            .random(|s| vec![s.decades(-12.0, 0.6), s.decades(-12.0, 0.6)])
            .corners(product(&[&changes, &changes]))
            .range(0.0, 0.180_001),
        Twin::new("roughness", "shininess_from_roughness", &[], &[Type::Number], Type::Number)
            .expect(|x| {
                let alpha = x[0].clamp(0.0, 1.0).powi(2).max(1e-6);
                (2.0 / (alpha * alpha) - 2.0).clamp(0.0, MAX_SHININESS.into())
            })
            .within(|x| {
                let alpha = x[0].clamp(0.0, 1.0).powi(2).max(1e-6);
                lobes::shininess_from_roughness(
                    (2.0 / (alpha * alpha) - 2.0).clamp(0.0, MAX_SHININESS.into()),
                )
            })
            .random(|s| vec![s.next()])
            .corners(product(&[&[-1.0, 0.0, 1e-3, 0.0316, 0.0376, 0.1, 0.5, 0.999, 1.0, 2.0]]))
            .range(0.0, 1e6),
    ]
}

fn normalizations() -> [Twin; 2] {
    let constant = |name: &str, value: fn(f64) -> f64, bound: fn(f64) -> f64| {
        Twin::new("normalized_highlight", name, &[], &[Type::Number], Type::Number)
            .expect(move |x| value(x[0]))
            .within(move |x| bound(x[0]))
            .random(|s| vec![s.decades(-3.0, 6.0)])
            .corners(product(&[&[&EXPONENTS[..], &[-1.0, 199.9, 200.0, 200.1, 4e6]].concat()]))
    };
    [
        constant("phong_normalization", phong_normalization, lobes::phong_normalization).range(1.0, 1.8e38),
        constant("blinn_phong_normalization", blinn_phong_normalization, lobes::blinn_phong_normalization)
            .range(0.0, 1.8e38),
    ]
}

pub fn twins() -> Vec<Twin> {
    let mut all: Vec<Twin> = powers_of_cosines().into_iter().chain(filtered()).collect();
    all.extend(normalizations());
    for sharp in [false, true] {
        all.push(bare_lobe(sharp));
        all.push(highlight("phong", "phong", phong, lobes::phong, sharp));
        all.push(highlight("blinn_phong", "blinn_phong", blinn_phong, lobes::blinn_phong, sharp));
        all.push(highlight("blinn_phong", "blinn_phong_4n", blinn_phong_4n, lobes::blinn_phong_4n, sharp));
        let matched =
            ("blinn_phong_matched", blinn_phong_matched as Model, lobes::blinn_phong_matched as Bound);
        all.push(highlight("blinn_phong", matched.0, matched.1, matched.2, sharp));
        let module = "normalized_highlight";
        let blinn = (normalized_blinn_phong as Model, lobes::normalized_blinn_phong as Bound);
        for (name, model, bound) in [
            ("normalized_phong", normalized_phong as Model, lobes::normalized_phong as Bound),
            ("normalized_blinn_phong", blinn.0, blinn.1),
        ] {
            // The results are at most the constant of the largest exponent.
            all.push(highlight(module, name, model, bound, sharp).range_up_to(0.0, 500_001.0, 1e6));
        }
    }
    all
}

/// Returns the first three vectors of an input.
pub fn directions(x: &[f64]) -> [DVec3; 3] {
    [vector(x, 0), vector(x, 3), vector(x, 6)]
}

/// Returns the first three numbers as an f32 vector.
pub fn leading(x: &[f32]) -> Vec3 {
    Vec3::from_slice(&x[..3])
}
