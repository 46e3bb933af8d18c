//! The lighting equation for one light, in every reflection model.

use glam::DVec3;
use lumbre_optics::*;
use lumbre_tests::kernel::{Kernel, Type};

use crate::bounds::shading;
use crate::highlights::{directions, hard_lobes, lobe};
use crate::inputs::{Sequence, crossed, hard_directions, product};
use crate::judge::Twin;
use crate::vectors::vector;

fn specular(model: ReflectionModel) -> Twin {
    let arguments = [Type::Vector, Type::Vector, Type::Vector, Type::Number, Type::Number];
    let features = [model.shader_feature(), "SHARP_HIGHLIGHTS"];
    Twin::new("shade", "specular_factor", &features, &arguments, Type::Number)
        .named(model.name())
        .expect(move |x| specular_factor(model, vector(x, 0), vector(x, 3), vector(x, 6), x[9], x[10]))
        .within(move |x| shading::specular_factor(model, directions(x), x[9], x[10], true))
        .random(|s| {
            let mut input = lobe(s);
            input.push(s.between(1.0, 3.0));
            input
        })
        .corners(crossed(&hard_lobes(), &product(&[&[1.5]])))
        .range_up_to(0.0, 10_000.02, 1e6)
}

/// Three coefficients, three colours, exponent, index, direction to the light, its two factors, normal, viewer. The
/// channels are rotated from part to part, so that parts and channels cannot be mistaken for each other.
const CALL: &str = "let k = vec3<f32>(x[0], x[1], x[2]);
    let c = vec3<f32>(x[3], x[4], x[5]);
    let surface = SurfaceSample(k, k.yzx, k.zxy, x[6], x[7]);
    let light = LightSample(c, c.yzx, c.zxy, vec3<f32>(x[8], x[9], x[10]), x[11], x[12]);
    let r = light_contribution(surface, light, vec3<f32>(x[13], x[14], x[15]), vec3<f32>(x[16], x[17], x[18]));
    return array<f32, 9>(r.ambient.x, r.ambient.y, r.ambient.z, r.diffuse.x, r.diffuse.y, r.diffuse.z,
        r.specular.x, r.specular.y, r.specular.z);";

fn turned(v: DVec3) -> [DVec3; 3] {
    [v, DVec3::new(v.y, v.z, v.x), DVec3::new(v.z, v.x, v.y)]
}

fn samples(x: &[f64]) -> (SurfaceSample, LightSample, DVec3, DVec3) {
    let [ambient, diffuse, specular] = turned(vector(x, 0));
    let surface = SurfaceSample {
        ambient,
        diffuse,
        specular,
        shininess: x[6],
        ior: x[7],
        ..SurfaceSample::from(&lumbre_optics::Surface::default())
    };
    let [ambient, diffuse, specular] = turned(vector(x, 3));
    let direction = vector(x, 8);
    let light = LightSample { ambient, diffuse, specular, direction, attenuation: x[11], spot: x[12] };
    (surface, light, vector(x, 13), vector(x, 16))
}

fn arranged(colors: [f32; 6], factors: [f32; 2], shininess: f32, directions: &[f32]) -> Vec<f32> {
    let (normal, rest) = directions.split_at(3);
    let (light, viewer) = rest.split_at(3);
    [&colors[..], &[shininess, 1.5], light, &factors, normal, viewer].concat()
}

fn lit(sequence: &mut Sequence) -> Vec<f32> {
    let lobe = lobe(sequence);
    let coefficients = [(); 3].map(|()| sequence.next());
    let colors = [(); 3].map(|()| sequence.decades(-2.0, 4.0));
    let colors = [coefficients, colors].concat().try_into().unwrap_or([0.0; 6]);
    let factors = [sequence.decades(-4.0, 0.0), sequence.next()];
    arranged(colors, factors, lobe[9].min(SHARP_SHININESS), &lobe[..9])
}

fn hard_lit() -> Vec<Vec<f32>> {
    let mut all = Vec::new();
    for directions in hard_directions() {
        for shininess in [0.0, 1e-3, 1.0, 256.0] {
            for factors in [[0.0, 1.0], [1e4, 0.5], [1e-30, 1e-7]] {
                all.push(arranged([0.0, 1.0, 0.5, 1e4, 1e-3, 0.0], factors, shininess, &directions));
            }
        }
    }
    all
}

fn contribution(model: ReflectionModel) -> Twin {
    let imports = ["shade::SurfaceSample", "shade::light_contribution", "evaluate_light::LightSample"];
    let kernel = Kernel::new("shade", &imports, &[model.shader_feature()], 19, 9, CALL);
    Twin::around("light_contribution", kernel)
        .named(model.name())
        .expect(move |x| {
            let (surface, light, normal, viewer) = samples(x);
            let lit = light_contribution(model, surface, &light, normal, viewer);
            let parts = [lit.ambient, lit.diffuse, lit.specular];
            let mut results = [0.0; 9];
            for (at, part) in parts.into_iter().enumerate() {
                results[3 * at..3 * at + 3].copy_from_slice(&part.to_array());
            }
            results
        })
        .within(move |x| {
            let (surface, light, normal, viewer) = samples(x);
            shading::light_contribution(model, &surface, &light, normal, viewer)
        })
        .random(lit)
        .corners(hard_lit())
}

pub fn twins() -> Vec<Twin> {
    let models = || ReflectionModel::ALL.iter().copied();
    models().map(specular).chain(models().map(contribution)).collect()
}
