//! Normal maps and occlusion textures, and the highlights of glTF's materials.

use glam::DVec4;
use lumbre_optics::*;
use lumbre_tests::kernel::Type;

use crate::bounds::materials as bound;
use crate::bounds::powers::Off;
use crate::highlights::{directions, hard_lobes, lobe};
use crate::inputs::{EXPONENTS, crossed, product};
use crate::judge::Twin;
use crate::vectors::vector;

fn four(x: &[f64], at: usize) -> DVec4 {
    DVec4::from_slice(&x[at..at + 4])
}

fn normal_maps() -> [Twin; 3] {
    let texels =
        product(&[&[0.0, 127.0 / 255.0, 128.0 / 255.0, 1.0], &[0.0, 0.5, 128.0 / 255.0], &[0.0, 0.5, 1.0]]);
    let frames: Vec<Vec<f32>> = [
        [1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0],
        [0.0, 0.0, 0.0, 1.0, 0.6, 0.0, 0.8],
        [0.6, 0.0, -0.8, 0.3, 0.5, 0.1, 0.2],
        [1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0],
        [1e-9, 0.0, 0.0, 1.0, 0.0, 1e-9, 0.0],
    ]
    .map(|frame: [f32; 7]| frame.to_vec())
    .to_vec();
    let scales = product(&[&[-1.0, 0.0, 0.5, 1.0, 100.0]]);
    let arguments = [Type::Vector, Type::Number, Type::Vector4, Type::Vector];
    let rows = product(&[
        &[-1.0, 0.0, 0.5, 2.0],
        &[-1.0, 0.0, 1.0],
        &[0.0, 3.0],
        &[-1.0, 0.0, 1.0],
        &[-2.0, 0.0, 0.7],
        &[5.0],
    ]);
    [
        Twin::new("normal_map", "map_normal", &[], &arguments, Type::Vector)
            .expect(|x| map_normal(vector(x, 0), x[3], four(x, 4), vector(x, 8)))
            .within(|x| bound::map_normal(vector(x, 0), x[3], four(x, 4), vector(x, 8)))
            .random(|s| {
                let texel = [(); 3].map(|()| (s.next() * 255.0).round() / 255.0);
                let [normal, tangent] = [s.unit(), s.unit()].map(|v| v * s.between(0.3, 1.0));
                let scale = s.between(-2.0, 2.0);
                let side = if s.next() < 0.5 { -1.0 } else { 1.0 };
                [&texel[..], &[scale], &tangent.to_array(), &[side], &normal.to_array()].concat()
            })
            .corners(crossed(&crossed(&texels, &scales), &frames))
            .range_up_to(-1.000_001, 1.000_001, 1e3),
        Twin::new(
            "normal_map",
            "transformed_tangent",
            &[],
            &[Type::Vector, Type::Vector, Type::Vector4, Type::Vector],
            Type::Vector4,
        )
        .expect(|x| transformed_tangent(vector(x, 0), vector(x, 3), four(x, 6), vector(x, 10)).to_array())
        .within(|x| bound::transformed_tangent(vector(x, 0), vector(x, 3), four(x, 6), vector(x, 10)))
        .random(|s| {
            let rows = [(); 6].map(|()| s.between(-2.0, 2.0));
            let (tangent, normal) = (s.unit(), s.unit());
            let side = if s.next() < 0.5 { -1.0 } else { 1.0 };
            [&rows[..], &tangent.to_array(), &[side], &normal.to_array()].concat()
        })
        .corners(crossed(&rows, &frames)),
        Twin::new("normal_map", "normal_map_widening", &[], &[Type::Number; 2], Type::Number)
            .expect(|x| normal_map_widening(x[0], x[1]))
            .within(|x| bound::normal_map_widening(x[0], x[1]))
            .random(|s| vec![s.next(), s.between(-4.0, 4.0)])
            .corners(product(&[&[0.0, 1.0 / 255.0, 0.5, 1.0], &[-1e3, -1.0, 0.0, 0.5, 1.0, 2.0]]))
            .range(0.0, 1.0),
    ]
}

fn occlusions() -> [Twin; 1] {
    [Twin::new("occlusion", "occlusion", &[], &[Type::Number; 2], Type::Number)
        .expect(|x| occlusion(x[0], x[1]))
        .within(|x| bound::occlusion(x[0], x[1]))
        .random(|s| vec![s.next(), s.next()])
        .corners(product(&[&[0.0, 0.25, 1.0], &[0.0, 0.5, 1.0]]))]
}

fn energy_conserving() -> [Twin; 4] {
    let alphas = [2e-6, 1e-3, 0.25, 0.5, 1.0];
    let arguments = [Type::Vector, Type::Vector, Type::Vector, Type::Number, Type::Vector];
    [
        Twin::new("energy_conserving", "lobe_peak", &[], &[Type::Number], Type::Number)
            .expect(|x| lobe_peak(x[0]))
            .within(|x| bound::lobe_peak(x[0]))
            .random(|s| vec![s.decades(-3.0, 6.0)])
            .corners(product(&[&[&EXPONENTS[..], &[-1.0]].concat()])),
        Twin::new("energy_conserving", "distribution_ggx", &[], &[Type::Number; 2], Type::Number)
            .expect(|x| distribution_ggx(x[0], x[1]))
            .within(|x| bound::distribution_ggx(Off::exact(x[0]), Off::exact(x[1])))
            .random(|s| {
                let alpha = s.decades(-5.7, 0.0);
                vec![(alpha * s.decades(-2.0, 3.0)).min(1.0), alpha]
            })
            .corners(product(&[&[0.0, 1e-12, 1e-6, 0.25, 1.0], &alphas]))
            .range(0.0, 1.0),
        Twin::new("energy_conserving", "smith_attenuation", &[], &[Type::Number; 3], Type::Number)
            .expect(|x| smith_attenuation(x[0], x[1], x[2]))
            .within(|x| bound::smith_attenuation(Off::exact(x[0]), Off::exact(x[1]), Off::exact(x[2])))
            .random(|s| vec![s.decades(-6.0, 0.0), s.decades(-6.0, 0.0), s.decades(-5.7, 0.0)])
            .corners(product(&[&[-1.0, 0.0, 1e-7, 0.5, 1.0], &[-1.0, 0.0, 1e-7, 0.5, 1.0], &alphas]))
            .range(0.0, 1415.0),
        Twin::new("energy_conserving", "gltf_reflection", &[], &arguments, Type::Vector)
            .expect(|x| gltf_reflection(vector(x, 0), vector(x, 3), vector(x, 6), x[9], vector(x, 10)))
            .within(|x| bound::gltf_reflection(directions(x), x[9], vector(x, 10)))
            .random(|s| [lobe(s), vec![s.next(), s.next(), s.next()]].concat())
            .corners(crossed(&hard_lobes(), &product(&[&[0.0, 0.04], &[0.5], &[1.0]]))),
    ]
}

fn metals() -> [Twin; 2] {
    let arguments = [Type::Vector, Type::Vector, Type::Number];
    [
        Twin::new("metal_reflectance", "lobe_albedo", &[], &[Type::Number], Type::Number)
            .expect(|x| lobe_albedo(x[0]))
            .within(|_| bound::lobe_albedo())
            .random(|s| vec![s.decades(-3.0, 6.0)])
            .corners(product(&[&[&EXPONENTS[..], &[-1.0]].concat()]))
            .range(0.4, 1.0),
        Twin::new("metal_reflectance", "metal_reflectance", &[], &arguments, Type::Vector)
            .expect(|x| metal_reflectance(vector(x, 0), vector(x, 3), x[6]))
            .within(|x| bound::metal_reflectance(vector(x, 3), x[6]))
            .random(|s| {
                let unit: Vec<f32> = (0..6).map(|_| s.next()).collect();
                [unit, vec![s.decades(-3.0, 6.0)]].concat()
            })
            .corners(crossed(
                &product(&[&[0.0, 0.9, 2.0], &[0.0], &[0.5], &[0.0, 0.04], &[0.5], &[1.0, 1000.0]]),
                &product(&[&EXPONENTS[..]]),
            )),
    ]
}

pub fn twins() -> Vec<Twin> {
    normal_maps().into_iter().chain(occlusions()).chain(energy_conserving()).chain(metals()).collect()
}
