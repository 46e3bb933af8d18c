//! Lights: distance, cones, and a light as a point meets it.

use glam::{DVec3, Vec3};
use lumbre_optics::*;

use crate::inputs::{Sequence, product};
use crate::judge::{Kind, Twin};
use crate::vectors::vector;

fn distances(sequence: &mut Sequence) -> Vec<f32> {
    let coefficients =
        [(); 3].map(|()| if sequence.next() < 0.2 { 0.0 } else { sequence.decades(-3.0, 2.0) });
    let range = if sequence.next() < 0.5 { UNLIMITED_RANGE as f32 } else { sequence.decades(-1.0, 2.0) };
    let distance =
        if sequence.next() < 0.5 { range.min(100.0) * sequence.next() } else { sequence.decades(-4.0, 4.0) };
    [&coefficients[..], &[sequence.next().round(), range, distance]].concat()
}

fn cone(sequence: &mut Sequence, smooth: bool) -> Vec<f32> {
    let outer = sequence.next();
    if !smooth {
        // Half of the points near the edge of the cone.
        let near = outer + sequence.decades(-7.0, -1.0) * (2.0 * sequence.next() - 1.0);
        let cosine = if sequence.next() < 0.5 { near } else { sequence.between(-1.0, 1.0) };
        return vec![0.0, outer, sequence.between(0.0, 128.0), cosine];
    }
    let inner = outer + (1.0 - outer) * sequence.next();
    vec![1.0, outer, inner, sequence.between(-1.0, 1.0)]
}

const RECORD: &str =
    "let light = LightParameters(vec3<f32>(0.1, 0.2, 0.3), KIND, vec3<f32>(0.9, 0.8, 0.7), 0u,
    vec3<f32>(0.6, 0.5, 0.4), x[0], vec3<f32>(x[1], x[2], x[3]), SPOT, vec3<f32>(x[4], x[5], x[6]), x[7],
    vec3<f32>(x[8], x[9], x[10]), x[11]);
    let r = evaluate_light(light, vec3<f32>(x[12], x[13], x[14]));
    return array<f32, 5>(r.direction.x, r.direction.y, r.direction.z, r.attenuation, r.spot);";

/// Range, position, axis, cosine of the cone's edge, attenuation, exponent or inner cosine, point.
fn placed(sequence: &mut Sequence, directional: bool, smooth: bool) -> Vec<f32> {
    let position = sequence.unit() * sequence.between(0.0, 20.0);
    let axis = sequence.unit();
    let cone = cone(sequence, smooth);
    let attenuation = [(); 3].map(|()| sequence.next() + 1e-3);
    // In and around the cone.
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

fn light(name: &str, kind: LightKind, spot: u32) -> Twin {
    let features: &[&str] = match (kind, spot) {
        (LightKind::Directional, 0) => &["DIRECTIONAL_LIGHTS"],
        (LightKind::Directional, _) => &["DIRECTIONAL_LIGHTS", "SPOT_LIGHTS"],
        (_, 0) => &["POINT_LIGHTS"],
        _ => &["POINT_LIGHTS", "DIRECTIONAL_LIGHTS", "SPOT_LIGHTS"],
    };
    let call = RECORD.replace("KIND", &format!("{}u", kind as u32)).replace("SPOT", &format!("{spot}u"));
    let (directional, smooth) = (kind == LightKind::Directional, spot == 2);
    let mut corners = Vec::new();
    let positions =
        [Vec3::ZERO, Vec3::Y, Vec3::new(1e-20, 0.0, 0.0), Vec3::splat(1e5), Vec3::new(0.0, -0.005, 0.0)];
    for position in positions {
        for axis in [Vec3::NEG_Y, Vec3::X, Vec3::ZERO] {
            for (outer, second) in
                [(0.0, 0.0), (0.5, 128.0), (1.0, 1.0), (0.707_106_8, 0.707_106_8), (-2.0, 0.0)]
            {
                for attenuation in [Vec3::Z, Vec3::X, Vec3::splat(0.5), Vec3::ZERO] {
                    for range in [1e30, 1.0] {
                        let mut input = vec![range];
                        input.extend(position.to_array());
                        input.extend(axis.to_array());
                        input.push(outer);
                        input.extend(attenuation.to_array());
                        input.push(second);
                        input.extend([0.0, 0.0, 0.0]);
                        corners.push(input);
                    }
                }
            }
        }
    }
    Twin::with_call(name, "evaluate_light", &["evaluate_light", "LightParameters"], features, (15, 5), &call)
        .expect(move |x| {
            let (position, axis, point) = (vector(x, 1), vector(x, 4), vector(x, 12));
            let (direction, attenuation) = if directional {
                (safe_normalize(-axis), 1.0)
            } else {
                // The twin itself takes a component; its parts are what the shader is given as numbers here.
                let half_way = position * 0.5 - point * 0.5;
                let distance = 2.0 * safe_length(half_way);
                (safe_normalize(position - point), attenuate(vector(x, 8), false, x[0], distance))
            };
            let cosine = -direction.dot(axis);
            let factor = if spot == 0 { 1.0 } else { spot_factor(smooth, x[7], x[11], cosine) };
            vec![direction.x, direction.y, direction.z, attenuation, factor]
        })
        .random(move |s| placed(s, directional, smooth))
        .corners(corners)
}

/// The whole component against the whole record: what is uploaded of a light is the light.
pub fn component_agrees(
    kind: LightKind,
    cone: Option<SpotCone>,
    position: DVec3,
    point: DVec3,
) -> (f64, f64) {
    let light = Light { kind, spot: cone, ..Light::point(Vec3::ONE) };
    let axis = DVec3::NEG_Y;
    let sample = evaluate_light(&light, position, axis, point);
    (sample.attenuation, sample.spot)
}

pub fn twins() -> Vec<Twin> {
    let coefficients: [f32; 5] = [0.0, 1e-20, 0.5, 1.0, 1e20];
    vec![
        Twin::new(
            "attenuation",
            "attenuate",
            &[],
            &[Kind::Vector, Kind::Flag, Kind::Number, Kind::Number],
            Kind::Number,
        )
        .expect(|x| vec![attenuate(vector(x, 0), x[3] > 0.5, x[4], x[5])])
        .random(distances)
        .corners(product(&[
            &coefficients,
            &[0.0, 1.0],
            &coefficients,
            &[0.0, 1.0],
            &[1e-20, 1.0, 1e30],
            &[0.0, 1e-30, 0.01, 0.999_999, 1.0, 1e6, 1e18],
        ])),
        Twin::new(
            "spot",
            "spot_factor",
            &[],
            &[Kind::Flag, Kind::Number, Kind::Number, Kind::Number],
            Kind::Number,
        )
        .named("exponent")
        .expect(|x| vec![spot_factor(x[0] > 0.5, x[1], x[2], x[3])])
        .random(|s| cone(s, false))
        .corners(product(&[
            &[0.0],
            &[-2.0, 0.0, 0.5, 0.999_999, 1.0],
            &[0.0, 1e-3, 1.0, 128.0],
            &[-1.0, -1e-7, 0.0, 1e-30, 1e-7, 0.5, 0.500_000_06, 0.999_999, 1.0],
        ]))
        .range(0.0, 1.0),
        Twin::new(
            "spot",
            "spot_factor",
            &[],
            &[Kind::Flag, Kind::Number, Kind::Number, Kind::Number],
            Kind::Number,
        )
        .named("smooth")
        .expect(|x| vec![spot_factor(x[0] > 0.5, x[1], x[2], x[3])])
        .random(|s| cone(s, true))
        .corners(product(&[
            &[1.0],
            &[0.0, 0.5, 0.999, 1.0],
            &[0.0, 0.5, 0.500_5, 0.999_999, 1.0],
            &[-1.0, -1e-7, 0.0, 0.5, 0.500_000_06, 0.999_999, 1.0],
        ]))
        .range(0.0, 1.0),
        light("evaluate_light (directional)", LightKind::Directional, 0),
        light("evaluate_light (directional spot)", LightKind::Directional, 1),
        light("evaluate_light (point)", LightKind::Point, 0),
        light("evaluate_light (spot, exponent)", LightKind::Point, 1),
        light("evaluate_light (spot, smooth)", LightKind::Point, 2),
    ]
}
