//! Highlights: powers of cosines, Phong's and Blinn's lobes, their filtered forms, roughness.

use lumbre_optics::*;

use crate::inputs::{EXPONENTS, Sequence, crossed, hard_directions, product};
use crate::judge::{Kind, Twin};
use crate::vectors::vector;

const LOBE: [Kind; 4] = [Kind::Vector, Kind::Vector, Kind::Vector, Kind::Number];

/// Directions and an exponent.
pub fn lobe(sequence: &mut Sequence) -> Vec<f32> {
    let directions = sequence.directions();
    let mut numbers: Vec<f32> = directions.iter().flat_map(|v| v.to_array()).collect();
    numbers.push(sequence.shininess());
    numbers
}

/// Hard directions with each exponent.
pub fn hard_lobes() -> Vec<Vec<f32>> {
    let directions: Vec<Vec<f32>> = hard_directions().iter().map(|numbers| numbers.to_vec()).collect();
    crossed(&directions, &product(&[&EXPONENTS]))
}

/// Powers of the cosine keep the length that rounding gives to unit vectors, powers of the sine ignore it; the twin does the latter
/// near the peak. That is n times the relative length, of at most 1 altogether. `turns` is how often the normal's length counts.
fn lengths(x: &[f64], exponent: f64, turns: f64) -> f64 {
    let off = |at| (0.5 * vector(x, at).length_squared().max(1e-30).ln()).abs();
    let relative = turns * off(0) + off(3) + off(6);
    if relative > 1e-3 {
        // No unit vectors: the two are other functions then, and both in [0, 1].
        return 1.0;
    }
    (exponent * relative).exp_m1().min(1.0)
}

/// The series of the logarithm stops at 2e-7 of it up to sin² = .19; x e^-x is at most 1/e.
const SERIES: f64 = 2e-7 / std::f64::consts::E;

type Model = fn(glam::DVec3, glam::DVec3, glam::DVec3, f64) -> f64;

fn highlight(module: &str, name: &str, model: Model, scale: f64, turns: f64, sharp: bool) -> Twin {
    let features: &[&str] = if sharp { &["SHARP_HIGHLIGHTS"] } else { &[] };
    let suffix = if sharp { "sharp" } else { "plain" };
    Twin::new(module, name, features, &LOBE, Kind::Number)
        .named(suffix)
        .expect(move |x| vec![model(vector(x, 0), vector(x, 3), vector(x, 6), x[9])])
        .random(move |s| {
            let mut input = lobe(s);
            if !sharp {
                // The plain form is for exponents up to this.
                input[9] = input[9].min(SHARP_SHININESS);
            }
            input
        })
        .corners(hard_lobes())
        .method(move |x, _| {
            let lengths = lengths(x, scale * x[9], turns);
            if sharp { SERIES + lengths } else { lengths }
        })
        .range(0.0, 1.0)
}

pub fn twins() -> Vec<Twin> {
    let mut all = vec![
        Twin::new("power", "safe_pow", &[], &[Kind::Number, Kind::Number], Kind::Number)
            .expect(|x| vec![safe_pow(x[0], x[1])])
            .random(|s| vec![s.next(), s.shininess()])
            .corners(product(&[
                &[-1.0, -0.0, 0.0, 1e-30, 1e-20, 0.1, 0.5, 0.9, 0.999_999, 1.0, 2.0],
                &EXPONENTS,
            ]))
            // Bases under 1e-30 count as that, which matters to exponents under 1 only.
            .method(|x, _| if x[0] < 2e-30 && x[0] > 0.0 && x[1] < 2.0 { 1.0 } else { 0.0 })
            .range(0.0, 1.0),
        Twin::new("power", "power_of_cosine", &[], &[Kind::Number; 3], Kind::Number)
            .expect(|x| vec![power_of_cosine(x[0], x[1], x[2])])
            .random(|s| {
                let angle = f64::from(s.decades(-6.0, 0.19));
                vec![angle.cos() as f32, angle.sin().powi(2) as f32, s.shininess()]
            })
            .corners(product(&[
                &[-1.0, 0.0, 0.5, 0.899_999, 0.900_001, 0.999, 1.0],
                &[0.0, 1e-30, 1e-12, 1e-6, 1e-3, 0.19],
                &EXPONENTS,
            ]))
            .method(|_, _| SERIES)
            .range(0.0, 1.0),
        Twin::new("roughness", "shininess_from_roughness", &[], &[Kind::Number], Kind::Number)
            .expect(|x| {
                let alpha = x[0].clamp(0.0, 1.0).powi(2).max(1e-6);
                vec![(2.0 / (alpha * alpha) - 2.0).clamp(0.0, MAX_SHININESS.into())]
            })
            .random(|s| vec![s.next()])
            .corners(product(&[&[-1.0, 0.0, 1e-3, 0.0316, 0.1, 0.5, 0.999, 1.0, 2.0]]))
            .range(0.0, 1e6),
        Twin::with_call(
            "filtered_lobe",
            "specular_antialiasing",
            &["filtered_lobe"],
            &[],
            (3, 2),
            "let r = filtered_lobe(x[0], x[1], x[2]); return array<f32, 2>(r.shininess, r.peak);",
        )
        .expect(|x| {
            let lobe = filtered_lobe(x[0], x[1], x[2]);
            vec![lobe.shininess, lobe.peak]
        })
        .random(|s| vec![s.shininess(), 1.0 + 3.0 * s.next().round(), 0.18 * s.next() * s.next()])
        .corners(product(&[&EXPONENTS, &[1.0, 4.0], &[-1.0, 0.0, 1e-12, 1e-6, 1e-3, 0.18]])),
        Twin::new("specular_antialiasing", "lobe_widening", &[], &[Kind::Number; 2], Kind::Number)
            .expect(|x| vec![lobe_widening(x[0], x[1])])
            .random(|s| vec![s.decades(-12.0, 0.6), s.decades(-12.0, 0.6)])
            .corners(product(&[&[0.0, 1e-30, 1e-6, 0.1, 0.36, 4.0], &[0.0, 1e-30, 1e-6, 0.1, 0.36, 4.0]]))
            .range(0.0, 0.18001),
        Twin::new("phong", "reflected_direction", &[], &[Kind::Vector, Kind::Vector], Kind::Vector)
            .expect(|x| reflected_direction(vector(x, 0), vector(x, 3)).to_array().to_vec())
            .random(|s| lobe(s)[..6].to_vec())
            .corners(hard_directions().iter().map(|numbers| numbers[..6].to_vec()).collect()),
    ];
    for sharp in [false, true] {
        all.push(highlight("phong", "phong", phong, 1.0, 2.0, sharp));
        all.push(highlight("blinn_phong", "blinn_phong", blinn_phong, 1.0, 1.0, sharp));
        all.push(highlight("blinn_phong", "blinn_phong_4n", blinn_phong_4n, 4.0, 1.0, sharp));
        all.push(highlight("blinn_phong", "blinn_phong_matched", blinn_phong_matched, 4.0, 1.0, sharp));
    }
    all
}
