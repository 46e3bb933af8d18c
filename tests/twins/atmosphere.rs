//! Fog of the four kinds.

use lumbre_optics::*;

use crate::inputs::{Sequence, product};
use crate::judge::{Kind, Twin};
use crate::vectors::vector;

const DISTANCES: [f32; 10] = [-7.0, 0.0, 1e-30, 0.5, 2.0, 5.0, 11.3, 20.0, 1e6, 1e18];

fn span(sequence: &mut Sequence) -> Vec<f32> {
    let start = sequence.between(0.0, 50.0);
    let end = start + sequence.decades(-2.0, 3.0);
    vec![start, end, start + (end - start) * sequence.between(-0.2, 1.2)]
}

fn depth(sequence: &mut Sequence) -> Vec<f32> {
    let density = sequence.decades(-4.0, 1.0);
    vec![density, sequence.decades(-3.0, 1.5) / density]
}

pub fn twins() -> Vec<Twin> {
    let ends: [f32; 5] = [0.0, 2.0, 5.0, 5.000_001, 1e4];
    vec![
        Twin::new("fog", "fog_linear", &[], &[Kind::Number; 3], Kind::Number)
            .expect(|x| vec![fog_linear(x[0], x[1], x[2])])
            .random(span)
            .corners(product(&[&ends, &ends, &DISTANCES]))
            .range(0.0, 1.0),
        Twin::new("fog", "fog_exponential", &[], &[Kind::Number; 2], Kind::Number)
            .expect(|x| vec![fog_exponential(x[0], x[1])])
            .random(depth)
            .corners(product(&[&[0.0, 1e-30, 0.1, 1.0, 10.0], &DISTANCES]))
            .range(0.0, 1.0),
        Twin::new("fog", "fog_exponential_squared", &[], &[Kind::Number; 2], Kind::Number)
            .expect(|x| vec![fog_exponential_squared(x[0], x[1])])
            .random(depth)
            .corners(product(&[&[0.0, 1e-30, 0.1, 1.0, 10.0], &DISTANCES]))
            .range(0.0, 1.0),
        Twin::new("fog", "fog_depth_cue", &[], &[Kind::Number; 5], Kind::Number)
            .expect(|x| vec![fog_depth_cue(x[0], x[1], x[2], x[3], x[4])])
            .random(|s| {
                let span = span(s);
                vec![span[0], span[1], s.next(), s.next(), span[2]]
            })
            .corners(product(&[&ends, &ends, &[0.0, 0.9, 1.0], &[0.0, 0.1, 1.0], &DISTANCES])),
        Twin::new("fog", "apply_fog", &[], &[Kind::Number, Kind::Vector, Kind::Vector], Kind::Vector)
            .expect(|x| apply_fog(x[0], vector(x, 1), vector(x, 4)).to_array().to_vec())
            .random(|s| (0..7).map(|_| s.next()).collect())
            .corners(product(&[&[0.0, 0.5, 1.0], &[0.0, 1.0], &[1.0], &[1e4], &[0.0, 1.0], &[0.5], &[1e4]])),
    ]
}
