//! Vectors: unit lengths, half vectors, facing, viewers, Lambert's cosine.

use glam::DVec3;
use lumbre_optics::*;

use crate::inputs::{Sequence, hard_directions};
use crate::judge::{Kind, Twin};

/// Three numbers of an input as a vector.
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

pub fn twins() -> Vec<Twin> {
    let lengths = [0.0, 1e-19, 9e-16, 1.1e-15, 1e-10, 1e-3, 1.0, 1e10, 1e18];
    let vectors: Vec<Vec<f32>> = lengths
        .iter()
        .flat_map(|length| {
            [[1.0, 0.0, 0.0], [0.6, -0.8, 0.0], [0.5, 0.5, -0.7], [1e-7, 1.0, 0.0]]
                .map(|v: [f32; 3]| v.map(|c| c * length).to_vec())
        })
        .collect();
    let flagged = |vectors: &[Vec<f32>]| -> Vec<Vec<f32>> {
        vectors.iter().flat_map(|v| [0.0, 1.0].map(|flag| [v.as_slice(), &[flag]].concat())).collect()
    };
    let normal_and_face: Vec<Vec<f32>> =
        vectors.iter().map(|v| [v.as_slice(), &[0.0, 1.0, 0.0]].concat()).collect();
    let viewers: Vec<Vec<f32>> = vectors
        .iter()
        .flat_map(|eye| {
            [0.0, 1.0].map(|local| {
                let backward_and_point = [0.0, 0.0, 1.0, 0.5, 0.25, -0.125];
                [&[local], eye.as_slice(), &backward_and_point].concat()
            })
        })
        .collect();
    vec![
        Twin::new("normalization", "safe_normalize", &[], &[Kind::Vector], Kind::Vector)
            .expect(|x| safe_normalize(vector(x, 0)).to_array().to_vec())
            .random(any_length)
            .corners(vectors.clone()),
        Twin::new("half_vector", "half_vector", &[], &[Kind::Vector, Kind::Vector], Kind::Vector)
            .expect(|x| half_vector(vector(x, 0), vector(x, 3)).to_array().to_vec())
            .random(two)
            .corners(pairs()),
        Twin::new("lambert", "lambert", &[], &[Kind::Vector, Kind::Vector], Kind::Number)
            .expect(|x| vec![lambert(vector(x, 0), vector(x, 3))])
            .random(two)
            .corners(pairs()),
        Twin::new("two_sided", "facing_normal", &[], &[Kind::Vector, Kind::Flag], Kind::Vector)
            .expect(|x| facing_normal(vector(x, 0), x[3] > 0.5).to_array().to_vec())
            .random(|s| [s.unit().to_array().as_slice(), &[s.next().round()]].concat())
            .corners(flagged(&vectors)),
        Twin::new("two_sided", "shading_normal", &[], &[Kind::Vector, Kind::Vector], Kind::Vector)
            .expect(|x| shading_normal(vector(x, 0), vector(x, 3)).to_array().to_vec())
            .random(|s| [any_length(s), s.unit().to_array().to_vec()].concat())
            .corners(normal_and_face),
        Twin::new(
            "viewer",
            "viewer_direction",
            &[],
            &[Kind::Flag, Kind::Vector, Kind::Vector, Kind::Vector],
            Kind::Vector,
        )
        .expect(|x| {
            viewer_direction(x[0] > 0.5, vector(x, 1), vector(x, 4), vector(x, 7)).to_array().to_vec()
        })
        .random(|s| {
            let [eye, point] = [(); 2].map(|()| s.unit() * s.decades(-2.0, 3.0));
            let backward = s.unit();
            [&[s.next().round()], &eye.to_array()[..], &backward.to_array(), &point.to_array()].concat()
        })
        .corners(viewers),
        Twin::new("emission", "add_emission", &[], &[Kind::Vector, Kind::Vector], Kind::Vector)
            .expect(|x| add_emission(vector(x, 0), vector(x, 3)).to_array().to_vec())
            .random(|s| (0..6).map(|_| s.decades(-6.0, 4.0)).collect())
            .corners(crate::inputs::product(&[
                &[0.0, 1.0, 1e30],
                &[1.0],
                &[0.5],
                &[0.0, 1e-30, 1e30],
                &[2.0],
                &[3.0],
            ])),
        Twin::new("emission", "exitance", &[], &[Kind::Vector], Kind::Vector)
            .expect(|x| exitance(vector(x, 0)).to_array().to_vec())
            .random(|s| (0..3).map(|_| s.decades(-6.0, 4.0)).collect())
            .corners(crate::inputs::product(&[&[0.0, 1e-30, 1.0, 1e30], &[1.0], &[0.5]])),
    ]
}
