//! Lights: distance attenuation, cones, and a light as it reaches a point.

use std::f32::consts::FRAC_1_SQRT_2;

use glam::{DVec4, Vec3};
use lumbre_optics::*;
use lumbre_tests::kernel::{Kernel, Type};

use crate::bounds::lights::{self, PlacedLight};
use crate::bounds::powers::Off;
use crate::inputs::{Sequence, product};
use crate::judge::Twin;
use crate::vectors::vector;

fn distances(sequence: &mut Sequence) -> Vec<f32> {
    let coefficients =
        [(); 3].map(|()| if sequence.next() < 0.2 { 0.0 } else { sequence.decades(-3.0, 2.0) });
    let range = if sequence.next() < 0.5 { UNLIMITED_RANGE as f32 } else { sequence.decades(-1.0, 2.0) };
    let within = range.min(100.0) * sequence.next();
    let distance = if sequence.next() < 0.5 { within } else { sequence.decades(-4.0, 4.0) };
    [&coefficients[..], &[sequence.next().round(), range, distance]].concat()
}

fn cone(sequence: &mut Sequence, smooth: bool) -> Vec<f32> {
    let outer = sequence.next();
    // Half of the points are near the edge of the cone.
    let near = outer + sequence.decades(-7.0, -1.0) * (2.0 * sequence.next() - 1.0);
    let cosine = if sequence.next() < 0.5 { near.clamp(-1.0, 1.0) } else { sequence.between(-1.0, 1.0) };
    let inner = outer + (1.0 - outer) * sequence.next();
    let second = if smooth { inner } else { sequence.between(0.0, 128.0) };
    vec![if smooth { 1.0 } else { 0.0 }, outer, second, cosine]
}

fn attenuation() -> Twin {
    let coefficients: [f32; 5] = [0.0, 1e-20, 0.5, 1.0, 1e20];
    let arguments = [Type::Vector, Type::Flag, Type::Number, Type::Number];
    Twin::new("attenuation", "attenuate", &[], &arguments, Type::Number)
        .expect(|x| attenuate(vector(x, 0), x[3] > 0.5, x[4], x[5]))
        .within(|x| lights::attenuate(vector(x, 0), x[3] > 0.5, x[4], x[5], 0.0))
        .random(distances)
        .corners(product(&[
            &coefficients,
            &[0.0, 1.0],
            &coefficients,
            &[0.0, 1.0],
            &[1e-20, 1.0, 1e30],
            &[0.0, 1e-30, 0.01, 0.999_999, 1.0, 1e6, 1e18],
        ]))
        .range(0.0, 1.001e30)
}

/// Random constant, 1/range² and squared distance.
fn squares(sequence: &mut Sequence) -> Vec<f32> {
    let range = sequence.decades(-2.0, 4.0);
    let distance = if sequence.next() < 0.7 { range * sequence.next() } else { sequence.decades(-4.0, 4.0) };
    let constant = if sequence.next() < 0.5 { 0.0 } else { sequence.decades(-6.0, 6.0) };
    vec![constant, 1.0 / (range * range), distance * distance]
}

fn attenuation_quadratic() -> Twin {
    Twin::new("attenuation", "attenuate_quadratic", &[], &[Type::Number; 3], Type::Number)
        .expect(|x| attenuate_quadratic(x[0], x[1], x[2]))
        .within(|x| lights::attenuate_quadratic(x[0], x[1], x[2]))
        .random(squares)
        .corners(product(&[
            &[0.0, 1e-30, 1e-4, 0.833_333_3, 1e6],
            &[1e-30, 1e-6, 0.111_111_11, 1.0, 1e18],
            &[0.0, 1e-30, 1e-4, 0.999_999, 1.0, 8.999_999, 9.0, 1e6, 1e36],
        ]))
        .range(0.0, 1.001e4)
}

/// Smooth cones around random axes, and directions of which half are near the cone's edge.
fn smooth_cones(sequence: &mut Sequence) -> Vec<f32> {
    let outer = f64::from(sequence.next());
    let inner = outer + (1.0 - outer) * f64::from(sequence.next());
    let cosines = SpotCosines { smooth_cone: true, outer, inner_or_exponent: inner };
    let axis = sequence.unit().as_dvec3();
    let beside = safe_normalize(axis.cross(sequence.unit().as_dvec3()));
    let near = outer + f64::from(sequence.decades(-7.0, -1.0) * (2.0 * sequence.next() - 1.0));
    let cosine = if sequence.next() < 0.5 { near } else { f64::from(sequence.between(-1.0, 1.0)) };
    let cosine = cosine.clamp(-1.0, 1.0);
    let to_light = -(axis * cosine + beside * (1.0 - cosine * cosine).sqrt());
    let cone = cosines.smooth_cone_about(axis).unwrap_or_default();
    [cone.x, cone.y, cone.z, cone.w, to_light.x, to_light.y, to_light.z].map(|number| number as f32).to_vec()
}

fn smooth_spot() -> Twin {
    let cone = |x: &[f64]| DVec4::new(x[0], x[1], x[2], x[3]);
    Twin::new("spot", "smooth_spot_factor", &[], &[Type::Vector4, Type::Vector], Type::Number)
        .expect(move |x| smooth_spot_factor(cone(x), vector(x, 4)))
        .within(move |x| lights::smooth_spot_factor(cone(x), vector(x, 4)))
        .random(smooth_cones)
        .corners(product(&[
            &[0.0, 1e-3],
            &[0.0],
            &[0.0, 1.0, 1e3],
            &[1.0, 0.0, -0.5, -999.0],
            &[0.0, 1e-30],
            &[0.0],
            &[-1.0, -0.999_5, 0.0, 1.0],
        ]))
        .range(0.0, 1.0)
}

fn spots() -> [Twin; 2] {
    let arguments = [Type::Flag, Type::Number, Type::Number, Type::Number];
    let twin = |name: &str, smooth: bool| {
        Twin::new("spot", "spot_factor", &[], &arguments, Type::Number)
            .named(name)
            .expect(|x| spot_factor(x[0] > 0.5, x[1], x[2], x[3]))
            .within(|x| lights::spot_factor(x[0] > 0.5, x[1], x[2], Off::exact(x[3])))
            .random(move |s| cone(s, smooth))
            .range(0.0, 1.0)
    };
    [
        twin("exponent", false).corners(product(&[
            &[0.0],
            &[-2.0, 0.0, 0.5, 0.999_999, 1.0],
            &[0.0, 1e-3, 1.0, 128.0],
            &[-1.0, -1e-7, 0.0, 1e-30, 1e-7, 0.5, 0.500_000_06, 0.999_999, 1.0],
        ])),
        twin("smooth", true).corners(product(&[
            &[1.0],
            &[0.0, 0.5, 0.999, 1.0],
            &[0.0, 0.5, 0.500_5, 0.999_999, 1.0],
            &[-1.0, -1e-7, 0.0, 0.5, 0.500_000_06, 0.999_999, 1.0],
        ])),
    ]
}

/// Random range, position, axis, cosine of the cone's edge, attenuation, exponent or inner cosine, and point.
fn placed(sequence: &mut Sequence, directional: bool, smooth: bool) -> Vec<f32> {
    let position = sequence.unit() * sequence.between(0.0, 20.0);
    let axis = sequence.unit();
    let cone = cone(sequence, smooth);
    let attenuation = [(); 3].map(|()| sequence.next() + 1e-3);
    // Points in and around the cone.
    let aside = sequence.unit() * sequence.next();
    let point = position + (axis + aside) * sequence.decades(-2.0, 1.5);
    let range = if directional || sequence.next() < 0.5 { 1e30 } else { sequence.between(1.0, 40.0) };
    let mut input = vec![range];
    input.extend(position.to_array());
    input.extend(axis.to_array());
    input.push(cone[1]);
    input.extend(attenuation);
    input.push(cone[2]);
    input.extend(point.to_array());
    input
}

/// Lights at, near and far from the origin, which is the point; without an axis; with every kind of edge.
fn hard_lights() -> Vec<Vec<f32>> {
    let near =
        [Vec3::ZERO, Vec3::Y, Vec3::new(1e-20, 0.0, 0.0), Vec3::splat(1e5), Vec3::new(0.0, -0.005, 0.0)];
    let cones =
        [[0.0, 0.0], [0.5, 128.0], [1.0, 1.0], [FRAC_1_SQRT_2, FRAC_1_SQRT_2], [-2.0, 0.0], [0.0, 1.0]];
    let heads: Vec<Vec<f32>> = near.iter().map(|position| position.to_array().to_vec()).collect();
    let axes: Vec<Vec<f32>> = [Vec3::NEG_Y, Vec3::X, Vec3::ZERO].map(|v| v.to_array().to_vec()).to_vec();
    let laws: Vec<Vec<f32>> =
        [Vec3::Z, Vec3::X, Vec3::splat(0.5), Vec3::ZERO].map(|v| v.to_array().to_vec()).to_vec();
    let placed = crossed_all(&[product(&[&[1e30, 1.0]]), heads, axes]);
    let mut all = Vec::new();
    for head in placed {
        for [outer, second] in cones {
            for law in &laws {
                all.push([head.as_slice(), &[outer], law, &[second], &[0.0; 3]].concat());
            }
        }
    }
    all
}

fn crossed_all(lists: &[Vec<Vec<f32>>]) -> Vec<Vec<f32>> {
    lists.iter().fold(vec![Vec::new()], |sofar, list| crate::inputs::crossed(&sofar, list))
}

const CALL: &str = "let light = LightParameters(vec3<f32>(0.1, 0.2, 0.3), KIND, vec3<f32>(0.9, 0.8, 0.7), 0u,
    vec3<f32>(0.6, 0.5, 0.4), x[0], vec3<f32>(x[1], x[2], x[3]), SPOT, vec3<f32>(x[4], x[5], x[6]), x[7],
    vec3<f32>(x[8], x[9], x[10]), x[11]);
    let r = evaluate_light(light, vec3<f32>(x[12], x[13], x[14]));
    return array<f32, 5>(r.direction.x, r.direction.y, r.direction.z, r.attenuation, r.spot);";

fn light(kind: LightKind, spot: u32) -> Twin {
    let (features, name): (&[&str], &str) = match (kind, spot) {
        (LightKind::Directional, 0) => (&["DIRECTIONAL_LIGHTS"], "directional"),
        (LightKind::Directional, _) => (&["DIRECTIONAL_LIGHTS", "SPOT_LIGHTS"], "directional spot"),
        (_, 0) => (&["POINT_LIGHTS"], "point"),
        (_, 1) => (&["POINT_LIGHTS", "DIRECTIONAL_LIGHTS", "SPOT_LIGHTS"], "spot, exponent"),
        _ => (&["POINT_LIGHTS", "DIRECTIONAL_LIGHTS", "SPOT_LIGHTS"], "spot, smooth"),
    };
    let call = CALL.replace("KIND", &format!("{}u", kind as u32)).replace("SPOT", &format!("{spot}u"));
    let imports = ["evaluate_light", "LightParameters"];
    let kernel = Kernel::new("evaluate_light", &imports, features, 15, 5, &call);
    let (directional, smooth) = (kind == LightKind::Directional, spot == 2);
    let placed_light = move |x: &[f64]| PlacedLight {
        directional,
        range: x[0],
        position: vector(x, 1),
        axis: vector(x, 4),
        attenuation: vector(x, 8),
        cone: (spot > 0).then_some((smooth, x[7], x[11])),
    };
    Twin::around("evaluate_light", kernel)
        .named(name)
        .expect(move |x| placed_light(x).expected(vector(x, 12)))
        .within(move |x| lights::evaluate_light(&placed_light(x), vector(x, 12)))
        .random(move |s| placed(s, directional, smooth))
        .corners(hard_lights())
        .range_up_to(-1.000_001, 1.001e30, 1e18)
}

pub fn twins() -> Vec<Twin> {
    let mut all = vec![attenuation(), attenuation_quadratic(), smooth_spot()];
    all.extend(spots());
    all.push(light(LightKind::Directional, 0));
    all.push(light(LightKind::Directional, 1));
    all.extend([0, 1, 2].map(|spot| light(LightKind::Point, spot)));
    all
}
