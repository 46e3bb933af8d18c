//! Polygon lights: the angles of their edges and their form factors.

use lumbre_optics::polygon_form_factor;
use lumbre_tests::kernel::Type;

use crate::bounds::polygons;
use crate::inputs::{Sequence, product};
use crate::judge::Twin;
use crate::vectors::vector;

/// θ/sin θ - 1 from tan²(θ/2), in f64.
fn arc_excess(square: f64) -> f64 {
    if square < 1e-4 {
        // (1 + x) atan(√x)/√x - 1 = Σ (-1)^k 2 x^(k+1)/((2k + 1)(2k + 3)); the next term is under 10⁻¹⁷.
        return square * (2.0 / 3.0 - square * (2.0 / 15.0 - square * (2.0 / 35.0 - square * 2.0 / 63.0)));
    }
    (1.0 + square) * square.sqrt().atan() / square.sqrt() - 1.0
}

/// Random corner, two edges, whether it is a triangle, point, and normal: aspect ratios up to 100, from a tenth to
/// a hundred thousand sizes away.
fn polygon(sequence: &mut Sequence) -> Vec<f32> {
    let (along, other) = (sequence.unit(), sequence.unit());
    let size = sequence.decades(-1.0, 1.0);
    let across = along.cross(other).normalize_or_zero() * sequence.decades(-2.0, 0.0);
    let (u, v) = (along * size, (across + along * sequence.between(-0.5, 0.5)) * size);
    let middle = (u + v) / 2.0;
    let away = sequence.unit() * size * sequence.decades(-1.0, 5.0);
    // Mostly in front.
    let front = u.cross(v);
    let away = if away.dot(front) < 0.0 && sequence.next() < 0.8 { -away } else { away };
    let corner = sequence.unit() * sequence.between(0.0, 5.0) * size;
    let point = corner + middle + away;
    let mut normal = sequence.unit();
    if normal.dot(away) > 0.0 && sequence.next() < 0.7 {
        normal = -normal;
    }
    let mut input = [corner, u, v].map(|v| v.to_array()).concat();
    input.push(sequence.next().round());
    input.extend([point, normal].map(|v| v.to_array()).concat());
    input
}

/// A unit square with points on the lines of its corners and edges, in its plane, at its middle and at its horizon.
fn hard_polygons() -> Vec<Vec<f32>> {
    let mut all = Vec::new();
    let points = product(&[
        &[-1.0, 0.0, 0.5, 1.0, 7.0],
        &[-1.0, -1e-3, 0.0, 1e-6, 1e-5, 1e-4, 1e-3, 0.5, 100.0],
        &[0.0, 0.5, 1.0, -30.0],
    ]);
    let normals =
        [[0.0, -1.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0; 3], [0.6, -0.8, 0.0], [-0.48, 0.6, 0.64]];
    for point in points {
        for normal in normals {
            for triangle in [0.0, 1.0] {
                // Its front faces up.
                let square = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, triangle];
                all.push([&square[..], &point, &normal].concat());
            }
        }
    }
    all
}

pub fn twins() -> Vec<Twin> {
    let arguments = [Type::Vector, Type::Vector, Type::Vector, Type::Flag, Type::Vector, Type::Vector];
    vec![
        Twin::new("polygon_light", "arc_excess", &[], &[Type::Number], Type::Number)
            .expect(|x| arc_excess(x[0]))
            .within(|x| polygons::arc_excess(arc_excess(x[0])))
            .random(|s| vec![if s.next() < 0.5 { s.next() } else { s.decades(-9.0, 0.0) }])
            .corners(product(&[&[0.0, 1e-38, 1e-20, 1e-8, 1e-4, 0.171_572_9, 0.5, 0.999_999]])),
        Twin::new("polygon_light", "polygon_form_factor", &[], &arguments, Type::Number)
            .expect(|x| {
                polygon_form_factor(
                    vector(x, 0),
                    vector(x, 3),
                    vector(x, 6),
                    x[9] > 0.5,
                    vector(x, 10),
                    vector(x, 13),
                )
            })
            .within(|x| {
                let [corner, u, v] = [0, 3, 6].map(|at| vector(x, at));
                polygons::polygon_form_factor(corner, u, v, x[9] > 0.5, vector(x, 10), vector(x, 13))
            })
            .random(polygon)
            .corners(hard_polygons())
            .range_up_to(0.0, 1.0, 1e6),
    ]
}
