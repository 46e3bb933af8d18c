//! Fresnel's reflectance and Snell's law.

use lumbre_optics::*;

use crate::highlights::lobe;
use crate::inputs::{Sequence, crossed, hard_directions, product};
use crate::judge::{Kind, Twin};
use crate::vectors::vector;

const COSINES: [f32; 9] = [-1.0, 0.0, 1e-20, 1e-7, 1e-3, 0.5, 0.745_356, 1.0, 1.1];
const INDICES: [f32; 9] = [0.0, 1e-4, 0.4, 0.666_666_7, 0.999_999, 1.0, 1.000_001, 1.5, 1e4];

fn index(sequence: &mut Sequence) -> f32 {
    let index = sequence.between(1.0, 3.0);
    if sequence.next() < 0.5 { index } else { index.recip() }
}

/// A sine and an index; half of them near the critical angle.
fn sine_and_index(sequence: &mut Sequence) -> Vec<f32> {
    let index = index(sequence);
    let near = index * (1.0 + sequence.decades(-6.0, -1.0) * (2.0 * sequence.next() - 1.0));
    let sine = if sequence.next() < 0.5 { near.min(1.0) } else { sequence.next() };
    vec![sine, index]
}

fn ray(sequence: &mut Sequence) -> Vec<f32> {
    let index = index(sequence);
    [&lobe(sequence)[..6], &[index]].concat()
}

fn hard_rays() -> Vec<Vec<f32>> {
    let pairs: Vec<Vec<f32>> = hard_directions().iter().map(|numbers| numbers[..6].to_vec()).collect();
    crossed(&pairs, &product(&[&INDICES]))
}

pub fn twins() -> Vec<Twin> {
    vec![
        Twin::new("fresnel", "fresnel_dielectric", &[], &[Kind::Number; 2], Kind::Number)
            .expect(|x| vec![fresnel_dielectric(x[0], x[1])])
            .random(|s| vec![s.next(), index(s)])
            .corners(product(&[&COSINES, &INDICES]))
            .range(0.0, 1.0001),
        Twin::new(
            "fresnel",
            "fresnel_conductor",
            &[],
            &[Kind::Number, Kind::Vector, Kind::Vector],
            Kind::Vector,
        )
        .expect(|x| fresnel_conductor(x[0], vector(x, 1), vector(x, 4)).to_array().to_vec())
        .random(|s| (0..7).map(|at| if at == 0 { s.next() } else { s.decades(-2.0, 1.0) }).collect())
        .corners(crossed(
            &product(&[&COSINES]),
            &product(&[&[0.0, 0.2, 1.0], &[0.5], &[3.11], &[0.0, 1e-6, 3.9], &[0.0, 1e4], &[3.31]]),
        ))
        .range(0.0, 1.0001),
        Twin::new("fresnel", "fresnel_schlick", &[], &[Kind::Number, Kind::Vector], Kind::Vector)
            .expect(|x| fresnel_schlick(x[0], vector(x, 1)).to_array().to_vec())
            .random(|s| (0..4).map(|_| s.next()).collect())
            .corners(product(&[&COSINES, &[0.0, 0.04, 1.0], &[0.5], &[0.9]])),
        Twin::new("snell", "is_totally_reflected", &[], &[Kind::Number; 2], Kind::Flag)
            .expect(|x| vec![f64::from(u8::from(is_totally_reflected(x[0], x[1])))])
            .random(sine_and_index)
            .corners(product(&[&COSINES, &INDICES]))
            .range(0.0, 1.0),
        Twin::new("snell", "transmitted_cosine", &[], &[Kind::Number; 2], Kind::Number)
            .expect(|x| vec![transmitted_cosine(x[0], x[1])])
            .random(sine_and_index)
            .corners(product(&[&COSINES, &INDICES]))
            .range(0.0, 1.0001),
        Twin::new(
            "snell",
            "transmitted_direction",
            &[],
            &[Kind::Vector, Kind::Vector, Kind::Number],
            Kind::Vector,
        )
        .expect(|x| transmitted_direction(vector(x, 0), vector(x, 3), x[6]).to_array().to_vec())
        .random(ray)
        .corners(hard_rays()),
        Twin::new(
            "snell",
            "transmitted_highlight",
            &["SHARP_HIGHLIGHTS"],
            &[Kind::Vector, Kind::Vector, Kind::Vector, Kind::Number, Kind::Number],
            Kind::Number,
        )
        .expect(|x| vec![transmitted_highlight(vector(x, 0), vector(x, 3), vector(x, 6), x[9], x[10])])
        .random(|s| {
            let mut input = lobe(s);
            // Half of the viewers look along the transmitted light.
            let index = index(s);
            let (normal, light) = (glam::Vec3::from_slice(&input), glam::Vec3::from_slice(&input[3..]));
            let through = transmitted_direction(normal.as_dvec3(), light.as_dvec3(), index.into());
            if s.next() < 0.5 {
                let away = f64::from(s.decades(-6.0, 0.0)) * s.unit().as_dvec3();
                let viewer = (through + away).normalize_or_zero().as_vec3();
                input[6..9].copy_from_slice(&viewer.to_array());
            }
            input.push(index);
            input
        })
        .corners(crossed(
            &hard_directions().iter().map(|numbers| numbers.to_vec()).collect::<Vec<_>>(),
            &product(&[&[0.0, 1.0, 128.0, 1e6], &[0.666_666_7, 1.0, 1.5]]),
        ))
        // The logarithm's series.
        .method(|_, _| 2e-7 / std::f64::consts::E)
        .range(0.0, 1.0),
    ]
}
