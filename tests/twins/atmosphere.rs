//! Twins of the four kinds of fog.

use lumbre_optics::*;
use lumbre_tests::kernel::{Kernel, Type};

use crate::bounds::Allowed;
use crate::bounds::atmosphere;
use crate::inputs::{Sequence, product};
use crate::judge::Twin;
use crate::vectors::vector;

const DISTANCES: [f32; 10] = [-7.0, 0.0, 1e-30, 0.5, 2.0, 5.0, 11.3, 20.0, 1e6, 1e18];
const ENDS: [f32; 5] = [0.0, 2.0, 5.0, 5.000_001, 1e4];
const DENSITIES: [f32; 5] = [0.0, 1e-30, 0.1, 1.0, 10.0];

fn span(sequence: &mut Sequence) -> Vec<f32> {
    let start = sequence.between(0.0, 50.0);
    let end = start + sequence.decades(-2.0, 3.0);
    vec![start, end, start + (end - start) * sequence.between(-0.2, 1.2)]
}

fn depth(sequence: &mut Sequence) -> Vec<f32> {
    let density = sequence.decades(-4.0, 1.0);
    vec![density, sequence.decades(-3.0, 1.5) / density]
}

fn cue(sequence: &mut Sequence) -> Vec<f32> {
    let span = span(sequence);
    vec![span[0], span[1], sequence.next(), sequence.next(), span[2]]
}

fn hard_cues() -> Vec<Vec<f32>> {
    product(&[&ENDS, &ENDS, &[0.0, 0.9, 1.0], &[0.0, 0.1, 1.0], &DISTANCES])
}

fn linear(twin: Twin) -> Twin {
    twin.expect(|x| fog_linear(x[0], x[1], x[2]))
        .within(|x| atmosphere::fog_linear(x[0], x[1], x[2]))
        .random(span)
        .corners(product(&[&ENDS, &ENDS, &DISTANCES]))
        .range(0.0, 1.0)
}

fn exponential(twin: Twin) -> Twin {
    twin.expect(|x| fog_exponential(x[0], x[1]))
        .within(|x| atmosphere::fog_exponential(x[0], x[1]))
        .random(depth)
        .corners(product(&[&DENSITIES, &DISTANCES]))
        .range(0.0, 1.0)
}

fn squared(twin: Twin) -> Twin {
    twin.expect(|x| fog_exponential_squared(x[0], x[1]))
        .within(|x| atmosphere::fog_exponential_squared(x[0], x[1]))
        .random(depth)
        .corners(product(&[&DENSITIES, &DISTANCES]))
        .range(0.0, 1.0)
}

fn depth_cue(twin: Twin) -> Twin {
    twin.expect(|x| fog_depth_cue(x[0], x[1], x[2], x[3], x[4]))
        .within(|x| atmosphere::fog_depth_cue(x[0], x[1], x[2], x[3], x[4]))
        .random(cue)
        .corners(hard_cues())
}

/// `fog_weight` under one feature, with the parameters in the order of `FogMode::parameters`.
fn weight(mode: &FogMode, inputs: usize, parameters: &str) -> Twin {
    let call = format!("return array<f32, 1>(fog_weight({parameters}, x[{}]));", inputs - 1);
    let kernel = Kernel::new("fog", &["fog_weight"], &[mode.shader_feature()], inputs, 1, &call);
    Twin::around("fog_weight", kernel).named(mode.shader_feature())
}

pub fn twins() -> Vec<Twin> {
    let number = [Type::Number; 5];
    let (start, end, near_weight, far_weight) = (1.0, 2.0, 1.0, 0.0);
    vec![
        linear(Twin::new("fog", "fog_linear", &[], &number[..3], Type::Number)),
        linear(weight(&FogMode::Linear { start, end }, 3, "vec4<f32>(x[0], x[1], 0.0, 0.0)")),
        // The fraction is 1 minus the linear weight; its bound is one rounding smaller.
        Twin::new("fog", "fog_fraction", &[], &number[..3], Type::Number)
            .expect(|x| fog_fraction(x[0], x[1], x[2]))
            .within(|x| atmosphere::fog_fraction(x[0], x[1], x[2]))
            .random(span)
            .corners(product(&[&ENDS, &ENDS, &DISTANCES[1..]]))
            .range(0.0, 1.0),
        exponential(Twin::new("fog", "fog_exponential", &[], &number[..2], Type::Number)),
        exponential(weight(&FogMode::Exponential { density: 1.0 }, 2, "vec4<f32>(x[0], 0.0, 0.0, 0.0)")),
        squared(Twin::new("fog", "fog_exponential_squared", &[], &number[..2], Type::Number)),
        squared(weight(&FogMode::ExponentialSquared { density: 1.0 }, 2, "vec4<f32>(x[0], 0.0, 0.0, 0.0)")),
        depth_cue(Twin::new("fog", "fog_depth_cue", &[], &number, Type::Number)),
        depth_cue(weight(
            &FogMode::DepthCue { start, end, near_weight, far_weight },
            5,
            "vec4<f32>(x[0], x[1], x[2], x[3])",
        )),
        Twin::new("fog", "apply_fog", &[], &[Type::Number, Type::Vector, Type::Vector], Type::Vector)
            .expect(|x| apply_fog(x[0], vector(x, 1), vector(x, 4)))
            .within(|x| Allowed::from(atmosphere::apply_fog(x[0], vector(x, 1), vector(x, 4))))
            .random(|s| (0..7).map(|_| s.next()).collect())
            .corners(product(&[&[0.0, 0.5, 1.0], &[0.0, 1.0], &[1.0], &[1e4], &[0.0, 1.0], &[0.5], &[1e4]])),
    ]
}
