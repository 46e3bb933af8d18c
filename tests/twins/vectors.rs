//! Vectors: normalization, half vectors, facing, viewers, Lambert's cosine, emission.

use std::f32::consts::FRAC_1_SQRT_2;

use glam::DVec3;
use lumbre_optics::*;
use lumbre_tests::kernel::Type;

use crate::bounds::{Allowed, FLUSHED, Numbers, U, vectors};
use crate::inputs::{Sequence, hard_directions, product};
use crate::judge::Twin;

/// Returns three numbers of an input as a vector.
pub fn vector(x: &[f64], at: usize) -> DVec3 {
    DVec3::from_slice(&x[at..at + 3])
}

fn any_length(sequence: &mut Sequence) -> Vec<f32> {
    (sequence.unit() * sequence.decades(-12.0, 12.0)).to_array().to_vec()
}

fn pairs() -> Vec<Vec<f32>> {
    hard_directions().iter().map(|numbers| numbers[3..].to_vec()).collect()
}

fn two(sequence: &mut Sequence) -> Vec<f32> {
    let [_, light, viewer] = sequence.directions();
    [light.to_array(), viewer.to_array()].concat()
}

/// Vectors of every length from zero to the largest whose square is finite.
fn lengths() -> Vec<Vec<f32>> {
    let lengths = [0.0, 1e-38, 1e-19, 6e-16, 1e-15, 1.1e-15, 1e-10, 1e-3, 1.0, 1e10, 1e18];
    let directions = [[1.0, 0.0, 0.0], [0.6, -0.8, 0.0], [0.5, 0.5, -FRAC_1_SQRT_2], [1e-7, 1.0, -0.0]];
    lengths.iter().flat_map(|length| directions.map(|v: [f32; 3]| v.map(|c| c * length).to_vec())).collect()
}

fn normalization() -> [Twin; 2] {
    [
        Twin::new("normalization", "squared_length", &[], &[Type::Vector], Type::Number)
            .expect(|x| vector(x, 0).length_squared())
            .within(|x| vectors::dot(vector(x, 0), vector(x, 0)))
            .random(any_length)
            .corners(lengths())
            .range_up_to(0.0, 4e38, 1e19),
        Twin::new("normalization", "safe_normalize", &[], &[Type::Vector], Type::Vector)
            .expect(|x| safe_normalize(vector(x, 0)))
            .within(|x| vectors::safe_normalize(vector(x, 0)))
            .random(any_length)
            .corners(lengths())
            .range(-1.000_001, 1.000_001),
    ]
}

/// Where the interpolated normal is within rounding of having no direction, either of the two normals may be used.
fn shading_normal_bound(x: &[f64]) -> Allowed {
    let interpolated = vector(x, 0);
    let unit = safe_normalize(interpolated);
    let squared = unit.length_squared();
    let error = match squared > 0.4 {
        true => vectors::safe_normalize(interpolated),
        false => DVec3::splat(FLUSHED),
    };
    let other = if squared > 0.5 { vector(x, 3) } else { unit };
    Allowed::from(error).or((squared - 0.5).abs() <= 20.0 * U, || Numbers::from_slice(&other.to_array()))
}

fn facing() -> [Twin; 2] {
    let flagged =
        lengths().iter().flat_map(|v| [0.0, 1.0].map(|flag| [v.as_slice(), &[flag]].concat())).collect();
    let with_face = lengths().iter().map(|v| [v.as_slice(), &[0.0, 1.0, 0.0]].concat()).collect();
    [
        Twin::new("two_sided", "facing_normal", &[], &[Type::Vector, Type::Flag], Type::Vector)
            .expect(|x| facing_normal(vector(x, 0), x[3] > 0.5))
            .within(|_| DVec3::splat(FLUSHED))
            .random(|s| [s.unit().to_array().as_slice(), &[s.next().round()]].concat())
            .corners(flagged)
            .range(-3.5e38, 3.5e38),
        Twin::new("two_sided", "shading_normal", &[], &[Type::Vector, Type::Vector], Type::Vector)
            .expect(|x| shading_normal(vector(x, 0), vector(x, 3)))
            .within(shading_normal_bound)
            .random(|s| [any_length(s), s.unit().to_array().to_vec()].concat())
            .corners(with_face)
            .range_up_to(-1.000_001, 1.000_001, 1.0),
    ]
}

fn viewer() -> Twin {
    let eyes = lengths();
    let corners = eyes.iter().flat_map(|eye| {
        [0.0, 1.0].into_iter().flat_map(|local| {
            // Points at the origin, at the eye, and next to it.
            let beside: Vec<f32> = eye.iter().map(|c| c * 1.000_001 + 1e-6).collect();
            [vec![0.0; 3], eye.clone(), beside]
                .map(|point| [&[local], eye.as_slice(), &[0.0, 0.6, 0.8], point.as_slice()].concat())
        })
    });
    let arguments = [Type::Flag, Type::Vector, Type::Vector, Type::Vector];
    Twin::new("viewer", "viewer_direction", &[], &arguments, Type::Vector)
        .expect(|x| viewer_direction(x[0] > 0.5, vector(x, 1), vector(x, 4), vector(x, 7)))
        .within(|x| match x[0] > 0.5 {
            true => vectors::normalized_sum(vector(x, 1) - vector(x, 7)),
            false => DVec3::splat(FLUSHED),
        })
        .random(|s| {
            let [eye, point] = [(); 2].map(|()| s.unit() * s.decades(-2.0, 3.0));
            let backward = s.unit();
            [&[s.next().round()], &eye.to_array()[..], &backward.to_array(), &point.to_array()].concat()
        })
        .corners(corners.collect())
        .range_up_to(-1.000_001, 1.000_001, 1.0)
}

fn emission() -> [Twin; 2] {
    [
        Twin::new("emission", "add_emission", &[], &[Type::Vector, Type::Vector], Type::Vector)
            .expect(|x| add_emission(vector(x, 0), vector(x, 3)))
            .within(|x| U * (vector(x, 0) + vector(x, 3)).abs() + DVec3::splat(3.0 * FLUSHED))
            .random(|s| (0..6).map(|_| s.decades(-6.0, 4.0)).collect())
            .corners(product(&[&[0.0, 1.0, 1e30], &[1.0], &[0.5], &[0.0, 1e-30, 1e30], &[2.0], &[3.0]]))
            .range_up_to(-3.5e38, 3.5e38, 1e38),
        Twin::new("emission", "exitance", &[], &[Type::Vector], Type::Vector)
            .expect(|x| exitance(vector(x, 0)))
            .within(|x| 1.5 * U * exitance(vector(x, 0)).abs() + DVec3::splat(4.0 * FLUSHED))
            .random(|s| (0..3).map(|_| s.decades(-6.0, 4.0)).collect())
            .corners(product(&[&[0.0, 1e-30, 1.0, 1e30], &[1.0], &[0.5]]))
            .range_up_to(-3.5e38, 3.5e38, 1e38),
    ]
}

fn pairs_of_directions() -> [Twin; 3] {
    [
        Twin::new("half_vector", "half_vector", &[], &[Type::Vector, Type::Vector], Type::Vector)
            .expect(|x| half_vector(vector(x, 0), vector(x, 3)))
            .within(|x| vectors::normalized_sum(vector(x, 0) + vector(x, 3)))
            .random(two)
            .corners(pairs())
            .range_up_to(-1.000_001, 1.000_001, 1e18),
        Twin::new("lambert", "lambert", &[], &[Type::Vector, Type::Vector], Type::Number)
            .expect(|x| lambert(vector(x, 0), vector(x, 3)))
            .within(|x| vectors::dot(vector(x, 0), vector(x, 3)))
            .random(two)
            .corners(pairs())
            .range_up_to(0.0, 1.0, 1e18),
        Twin::new("phong", "reflected_direction", &[], &[Type::Vector, Type::Vector], Type::Vector)
            .expect(|x| reflected_direction(vector(x, 0), vector(x, 3)))
            .within(|x| vectors::reflected_direction(vector(x, 0), vector(x, 3)))
            .random(|s| s.directions()[..2].iter().flat_map(|v| v.to_array()).collect())
            .corners(hard_directions().iter().map(|numbers| numbers[..6].to_vec()).collect()),
    ]
}

pub fn twins() -> Vec<Twin> {
    normalization()
        .into_iter()
        .chain(facing())
        .chain([viewer()])
        .chain(emission())
        .chain(pairs_of_directions())
        .collect()
}
