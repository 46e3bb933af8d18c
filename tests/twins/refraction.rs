//! Fresnel's reflectance and Snell's law.

use glam::DVec3;
use lumbre_optics::*;
use lumbre_tests::kernel::Type;

use crate::bounds::powers::Off;
use crate::bounds::refraction;
use crate::highlights::{leading, lobe};
use crate::inputs::{Sequence, crossed, hard_directions, product};
use crate::judge::Twin;
use crate::vectors::vector;

const COSINES: [f32; 10] = [-1.0, -0.0, 0.0, 1e-20, 1e-7, 1e-3, 0.5, 0.745_356, 1.0, 1.1];
const INDICES: [f32; 9] = [0.0, 1e-4, 0.4, 0.666_666_7, 0.999_999, 1.0, 1.000_001, 1.5, 1e4];

/// A random index from 1/3 to 3.
fn index(sequence: &mut Sequence) -> f32 {
    let index = sequence.between(1.0, 3.0);
    if sequence.next() < 0.5 { index } else { index.recip() }
}

/// A random sine and index, half of them near the critical angle.
fn sine_and_index(sequence: &mut Sequence) -> Vec<f32> {
    let index = index(sequence);
    let near = index * (1.0 + sequence.decades(-6.0, -1.0) * (2.0 * sequence.next() - 1.0));
    let sine = if sequence.next() < 0.5 { near.min(1.0) } else { sequence.next() };
    vec![sine, index]
}

/// A random cosine and index, a third of them near the critical angle and a third grazing.
fn cosine_and_index(sequence: &mut Sequence) -> Vec<f32> {
    let [sine, index]: [f32; 2] = sine_and_index(sequence).try_into().unwrap_or([0.0, 1.0]);
    let cosine = match sequence.bits() % 3 {
        0 => (1.0 - f64::from(sine).powi(2)).sqrt() as f32,
        1 => sequence.decades(-7.0, 0.0),
        _ => sequence.next(),
    };
    vec![cosine, index]
}

fn ray(sequence: &mut Sequence) -> Vec<f32> {
    let mut ray = lobe(sequence)[..6].to_vec();
    ray.push(index(sequence));
    if sequence.next() < 0.2 {
        // Grazing light.
        let normal = leading(&ray).as_dvec3();
        let aside = normal.cross(sequence.unit().as_dvec3()).normalize_or_zero();
        let light = (aside + f64::from(sequence.decades(-6.0, -1.0)) * normal).normalize_or_zero();
        ray[3..6].copy_from_slice(&light.as_vec3().to_array());
    }
    ray
}

fn hard_rays() -> Vec<Vec<f32>> {
    let pairs: Vec<Vec<f32>> = hard_directions().iter().map(|numbers| numbers[..6].to_vec()).collect();
    crossed(&pairs, &product(&[&INDICES]))
}

fn fresnel() -> [Twin; 4] {
    let optical = crossed(
        &product(&[&COSINES]),
        &product(&[&[0.0, 0.2, 1.0], &[0.5], &[3.11], &[0.0, 1e-6, 3.9], &[0.0, 1e4], &[3.31]]),
    );
    let conductor = [Type::Number, Type::Vector, Type::Vector];
    [
        Twin::new("fresnel", "fresnel_dielectric", &[], &[Type::Number; 2], Type::Number)
            .expect(|x| fresnel_dielectric(x[0], x[1]))
            .within(|x| refraction::fresnel_dielectric(Off::exact(x[0]), Off::exact(x[1])))
            .random(cosine_and_index)
            .corners(product(&[&COSINES, &INDICES]))
            .range(0.0, 1.000_002),
        Twin::new("fresnel", "fresnel_conductor", &[], &conductor, Type::Vector)
            .expect(|x| fresnel_conductor(x[0], vector(x, 1), vector(x, 4)))
            .within(|x| {
                let channel =
                    |at: usize| refraction::fresnel_conductor(Off::exact(x[0]), x[1 + at], x[4 + at]);
                DVec3::new(channel(0), channel(1), channel(2))
            })
            .random(|s| (0..7).map(|at| if at == 0 { s.next() } else { s.decades(-2.0, 1.0) }).collect())
            .corners(optical)
            .range(0.0, 1.000_005),
        Twin::new(
            "microfacet_reflection",
            "fresnel_normal_reflectance",
            &[],
            &[Type::Number, Type::Vector],
            Type::Vector,
        )
        .expect(|x| fresnel_normal_reflectance(x[0], vector(x, 1)))
        .within(|x| {
            let channel = |at: usize| refraction::fresnel_normal_reflectance(Off::exact(x[0]), x[at]);
            DVec3::new(channel(1), channel(2), channel(3))
        })
        .random(|s| vec![s.next(), s.next(), s.decades(-6.0, 0.0), 1.0 - s.decades(-6.0, 0.0)])
        .corners(product(&[&COSINES, &[0.0, 0.04, 1.0], &[1e-38, 1e-6, 0.5], &[0.9, 0.9998, 2.0]]))
        .range(0.0, 1.000_002),
        Twin::new("fresnel", "fresnel_schlick", &[], &[Type::Number, Type::Vector], Type::Vector)
            .expect(|x| fresnel_schlick(x[0], vector(x, 1)))
            .within(|x| refraction::fresnel_schlick(x[0], vector(x, 1)))
            .random(|s| (0..4).map(|_| s.next()).collect())
            .corners(product(&[&COSINES, &[0.0, 0.04, 1.0], &[0.5], &[0.9]])),
    ]
}

fn snell() -> [Twin; 3] {
    [
        Twin::new("snell", "is_totally_reflected", &[], &[Type::Number; 2], Type::Flag)
            .expect(|x| is_totally_reflected(x[0], x[1]))
            .within(|_| 0.0)
            .random(sine_and_index)
            .corners(product(&[&COSINES, &INDICES]))
            .range(0.0, 1.0),
        Twin::new("snell", "transmitted_cosine", &[], &[Type::Number; 2], Type::Number)
            .expect(|x| transmitted_cosine(x[0], x[1]))
            .within(|x| refraction::transmitted_cosine(x[0], x[1]))
            .random(sine_and_index)
            .corners(product(&[&COSINES, &INDICES]))
            .range(0.0, 1.000_001),
        Twin::new(
            "snell",
            "transmitted_direction",
            &[],
            &[Type::Vector, Type::Vector, Type::Number],
            Type::Vector,
        )
        .expect(|x| transmitted_direction(vector(x, 0), vector(x, 3), x[6]))
        .within(|x| refraction::transmitted_direction(vector(x, 0), vector(x, 3), x[6]))
        .random(ray)
        .corners(hard_rays())
        .range_up_to(-1.000_001, 1.000_001, 1e6),
    ]
}

fn through(sequence: &mut Sequence, sharp: bool) -> Vec<f32> {
    let mut input = lobe(sequence);
    if !sharp {
        input[9] = input[9].min(SHARP_SHININESS);
    }
    let index = index(sequence);
    input.push(index);
    // Half of the viewers look along the transmitted light.
    if sequence.next() < 0.5 {
        let (normal, light) = (leading(&input).as_dvec3(), leading(&input[3..]).as_dvec3());
        let direction = transmitted_direction(normal, light, index.into());
        let away = f64::from(sequence.decades(-6.0, 0.0)) * sequence.unit().as_dvec3();
        let viewer = (direction + away).normalize_or_zero().as_vec3();
        input[6..9].copy_from_slice(&viewer.to_array());
    }
    input
}

fn transmitted(sharp: bool) -> Twin {
    let arguments = [Type::Vector, Type::Vector, Type::Vector, Type::Number, Type::Number];
    let features: &[&str] = if sharp { &["SHARP_HIGHLIGHTS"] } else { &[] };
    let directions: Vec<Vec<f32>> = hard_directions().iter().map(|numbers| numbers.to_vec()).collect();
    let exponents: &[f32] = if sharp { &[0.0, 1.0, 128.0, 1e6] } else { &[0.0, 1.0, 128.0] };
    Twin::new("snell", "transmitted_highlight", features, &arguments, Type::Number)
        .named(if sharp { "sharp" } else { "plain" })
        .expect(|x| transmitted_highlight(vector(x, 0), vector(x, 3), vector(x, 6), x[9], x[10]))
        .within(move |x| {
            refraction::transmitted_highlight(vector(x, 0), vector(x, 3), vector(x, 6), x[9], x[10], sharp)
        })
        .random(move |s| through(s, sharp))
        .corners(crossed(&directions, &product(&[exponents, &[0.666_666_7, 1.0, 1.5]])))
        .range_up_to(0.0, 1.0, 1e6)
}

pub fn twins() -> Vec<Twin> {
    fresnel().into_iter().chain(snell()).chain([transmitted(false), transmitted(true)]).collect()
}
