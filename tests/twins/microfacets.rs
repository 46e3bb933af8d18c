//! Microfacets: the three distributions, their half-value angles, Torrance and Sparrow's factor.

use lumbre_optics::*;

use crate::highlights::{hard_lobes, lobe};
use crate::inputs::{EXPONENTS, Sequence, crossed, product};
use crate::judge::{Kind, Twin};
use crate::vectors::vector;

/// cos, sin² and an exponent at which the distribution there is neither 0 nor 1, mostly.
fn distribution(sequence: &mut Sequence) -> Vec<f32> {
    let angle = f64::from(sequence.decades(-5.0, 0.19));
    let exponent = f64::from(sequence.decades(-2.0, 1.0)) / angle.powi(2);
    vec![angle.cos() as f32, angle.sin().powi(2) as f32, exponent.min(1e6) as f32]
}

fn hard_distributions() -> Vec<Vec<f32>> {
    let angles = [0.0f64, 1e-6, 1e-3, 0.1, 0.44, 0.46, 0.8, 1.2, 1.5707];
    let angles: Vec<Vec<f32>> = angles.iter().map(|a| vec![a.cos() as f32, a.sin().powi(2) as f32]).collect();
    crossed(&angles, &product(&[&EXPONENTS]))
}

/// The series of `one_minus_exp` is good to 1e-8 of its value; the distributions' logarithms are at most as far off, times 2.
const SERIES: f64 = 2e-8;

pub fn twins() -> Vec<Twin> {
    let with_ior = |lobes: Vec<Vec<f32>>| crossed(&lobes, &product(&[&[1.0, 1.5, 2.42]]));
    vec![
        Twin::new("microfacets", "half_value_sine_squared", &[], &[Kind::Number], Kind::Number)
            .expect(|x| vec![half_value_sine_squared(x[0])])
            .random(|s| vec![s.decades(-2.0, 6.0)])
            .corners(
                product(&[&EXPONENTS, &[5.5, 5.545, 5.6]])
                    .iter()
                    .map(|pair| vec![pair[0].max(pair[1] - 5.5)])
                    .collect(),
            )
            .method(|_, expected| SERIES * expected[0])
            .range(0.0, 1.0),
        Twin::new("microfacets", "half_value_angle", &[], &[Kind::Number], Kind::Number)
            .expect(|x| vec![half_value_angle(x[0])])
            .random(|s| vec![s.decades(-2.0, 6.0)])
            .corners(product(&[&EXPONENTS]))
            .method(|_, expected| SERIES * expected[0])
            .range(0.0, 1.571),
        Twin::new("microfacets", "distribution_cosine_power", &[], &[Kind::Number; 3], Kind::Number)
            .expect(|x| vec![distribution_cosine_power(x[0], x[1], x[2])])
            .random(distribution)
            .corners(hard_distributions())
            .method(|_, _| 2e-7 / std::f64::consts::E)
            .range(0.0, 1.0),
        Twin::new("microfacets", "distribution_gaussian", &[], &[Kind::Number; 3], Kind::Number)
            .expect(|x| vec![distribution_gaussian(x[0], x[1], x[2])])
            .random(distribution)
            .corners(hard_distributions())
            .method(|_, _| SERIES)
            .range(0.0, 1.0),
        Twin::new("microfacets", "distribution_trowbridge_reitz", &[], &[Kind::Number; 2], Kind::Number)
            .expect(|x| vec![distribution_trowbridge_reitz(x[0], x[1])])
            .random(|s| distribution(s)[1..].to_vec())
            .corners(hard_distributions().iter().map(|numbers| numbers[1..].to_vec()).collect())
            .method(|_, _| SERIES)
            .range(0.0, 1.0),
        Twin::new("torrance_sparrow", "geometric_attenuation", &[], &[Kind::Number; 4], Kind::Number)
            .expect(|x| vec![geometric_attenuation(x[0], x[1], x[2], x[3])])
            .random(|s| vec![s.next(), s.decades(-4.0, 0.0), s.next(), s.decades(-4.0, 0.0)])
            .corners(product(&[
                &[-1.0, 0.0, 1e-7, 0.5, 1.0],
                &[0.0, 1e-7, 1e-4, 0.5, 1.0],
                &[-1.0, 0.0, 1e-4, 0.5, 1.0],
                &[0.0, 1e-7, 1e-4, 0.5, 1.0],
            ]))
            .range(0.0, 10_000.5),
        Twin::new(
            "torrance_sparrow",
            "torrance_sparrow_geometry",
            &[],
            &[Kind::Vector, Kind::Vector, Kind::Vector, Kind::Number],
            Kind::Number,
        )
        .expect(|x| vec![torrance_sparrow_geometry(vector(x, 0), vector(x, 3), vector(x, 6), x[9])])
        .random(lobe)
        .corners(hard_lobes())
        .method(|_, expected| 2.0 * SERIES * expected[0])
        .range(0.0, 10_000.5),
        Twin::new(
            "torrance_sparrow",
            "torrance_sparrow",
            &[],
            &[Kind::Vector, Kind::Vector, Kind::Vector, Kind::Number, Kind::Number],
            Kind::Number,
        )
        .expect(|x| vec![torrance_sparrow(vector(x, 0), vector(x, 3), vector(x, 6), x[9], x[10])])
        .random(|s| {
            let mut input = lobe(s);
            input.push(s.between(1.0, 3.0));
            input
        })
        .corners(with_ior(hard_lobes()))
        .method(|_, expected| 2.0 * SERIES * expected[0])
        .range(0.0, 10_000.5),
    ]
}
