//! The polygon light's shader in f32, in wesl's interpreter, against its f64 twin: near, far, thin, cut by the horizon. The interpreter
//! rounds every operation correctly, so what is seen here is the algorithm's error, not a device's.

use std::collections::HashMap;
use std::path::Path;

use glam::{DVec3, Vec3};
use lumbre_optics::polygon_form_factor;
use wesl::{CompileResult, Wesl};

/// A fixed sequence of numbers in [0, 1): splitmix64 of a counter.
struct Sequence(u64);

impl Sequence {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (x >> 11) as f64 / (1u64 << 53) as f64
    }

    fn unit(&mut self) -> DVec3 {
        let z = 2.0 * self.next() - 1.0;
        let (sine, cosine) = (self.next() * std::f64::consts::TAU).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        DVec3::new(radius * cosine, z, radius * sine)
    }
}

fn program() -> CompileResult {
    let mut compiler = Wesl::new(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shaders"));
    compiler.use_stripping(false).set_feature("REFLECTION_PHONG", true);
    let path = "package::optics::polygon_light".parse().expect("a module path");
    compiler.compile(&path).unwrap_or_else(|error| panic!("{error}"))
}

fn call(program: &CompileResult, function: &str, arguments: &[String]) -> f64 {
    let expression = format!("{function}({})", arguments.join(", "));
    let parsed: wesl::syntax::Expression = expression.parse().expect("a WGSL expression");
    let (result, _) = wesl::exec(&parsed, &program.syntax, HashMap::new(), HashMap::new());
    let value = result.unwrap_or_else(|error| panic!("{expression}: {error}")).expect("a value");
    f64::from(value.unwrap_literal().unwrap_f32())
}

fn vector(v: Vec3) -> String {
    format!("vec3<f32>({:?}, {:?}, {:?})", v.x, v.y, v.z)
}

#[test]
fn the_form_factor_keeps_its_digits_at_every_distance() {
    let program = program();
    let mut sequence = Sequence(7);
    for aspect in [1.0, 10.0, 100.0] {
        for distance in [0.01, 0.1, 1.0, 10.0, 1e3, 1e5] {
            let mut largest = 0.0f64;
            for case in 0..12 {
                let edge_u = sequence.unit();
                let across = edge_u.cross(sequence.unit()).normalize();
                let edge_v = across / aspect + edge_u * if case % 2 == 0 { 0.0 } else { 0.3 };
                let mut away = sequence.unit();
                if away.dot(edge_u.cross(edge_v)) > 0.0 {
                    away = -away;
                }
                let mut normal = sequence.unit();
                // Every fourth polygon may lie below the horizon, and many are cut by it.
                if case % 4 != 0 && normal.dot(away) < 0.0 {
                    normal = -normal;
                }
                let corner = away * distance - 0.5 * (edge_u + edge_v);
                let triangle = case % 3 == 0;
                let [corner, edge_u, edge_v, normal] = [corner, edge_u, edge_v, normal].map(|v| v.as_vec3());
                let point = Vec3::ZERO;
                let list = [
                    vector(corner),
                    vector(edge_u),
                    vector(edge_v),
                    triangle.to_string(),
                    vector(point),
                    vector(normal),
                ];
                let got = call(&program, "polygon_form_factor", &list);
                let [corner, edge_u, edge_v, normal] = [corner, edge_u, edge_v, normal].map(|v| v.as_dvec3());
                let expected =
                    polygon_form_factor(corner, edge_u, edge_v, triangle, point.as_dvec3(), normal);
                let area = edge_u.cross(edge_v).length() * if triangle { 0.5 } else { 1.0 };
                let face_on = (area / (std::f64::consts::PI * distance * distance)).min(1.0);
                largest = largest.max((got - expected).abs() / face_on);
            }
            println!("1:{aspect:4} at {distance:7} sizes: {largest:.1e} of the value face on");
            // A few roundings (2⁻²⁴ each) times the aspect ratio, as the twin explains; closer than a hundredth of the size the
            // directions to the corners turn fast.
            let bound = if distance < 0.1 { 2e-5 } else { 1e-6 + 3e-7 * aspect };
            assert!(largest < bound, "1:{aspect} at {distance}: {largest:e}");
        }
    }
}

#[test]
fn the_polynomial_of_the_arc_is_as_good_as_it_says() {
    let program = program();
    for step in 0..=200 {
        let x = if step < 20 { 10f32.powi(step - 20) } else { (step - 20) as f32 / 180.0 };
        let got = call(&program, "arc_excess", &[format!("f32({x:?})")]);
        let (square, tangent) = (f64::from(x), f64::from(x).sqrt());
        // θ/sin θ - 1 for θ = 2 atan t; below 10⁻⁴ by its series, 2/3 t² - 2/15 t⁴ + 2/35 t⁶.
        let expected = if square < 1e-4 {
            square * (2.0 / 3.0 - square * (2.0 / 15.0 - square * 2.0 / 35.0))
        } else {
            (1.0 + square) * tangent.atan() / tangent - 1.0
        };
        // The fit's 1.5e-7, and rounded coefficients and products.
        assert!((got - expected).abs() <= 4e-7 * expected, "{x}: {got:e} {expected:e}");
    }
}
