//! A whole light component, angles and all, against the record that the shader is given: run in f32 in wesl's interpreter, without a
//! device. The functions themselves are compared on the GPU, over a million inputs each: tests/twins at the root.

use std::collections::HashMap;
use std::path::Path;

use glam::{DVec3, Vec3};
use lumbre_optics::*;
use wesl::{CompileResult, Wesl};

/// The rounding of one f32 operation, 2⁻²⁴.
const HALF_ULP: f64 = 5.960_464_477_539_063e-8;

struct Twin {
    program: CompileResult,
}

impl Twin {
    fn new(stem: &str, features: &[&str]) -> Self {
        let mut compiler = Wesl::new(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shaders"));
        compiler.use_stripping(false);
        for feature in features {
            compiler.set_feature(feature, true);
        }
        let path = format!("package::optics::{stem}").parse().expect("a module path");
        let program = compiler.compile(&path).unwrap_or_else(|error| panic!("{stem}: {error}"));
        Self { program }
    }

    fn run(&self, expression: &str) -> wesl::eval::Instance {
        let parsed: wesl::syntax::Expression = expression.parse().expect("a WGSL expression");
        let (result, _) = wesl::exec(&parsed, &self.program.syntax, HashMap::new(), HashMap::new());
        result.unwrap_or_else(|error| panic!("{expression}: {error}")).expect("a value")
    }
}

/// A fixed sequence of numbers in [0, 1): splitmix64 of a counter.
struct Sequence(u64);

impl Sequence {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }

    fn unit(&mut self) -> Vec3 {
        let z = 2.0 * f64::from(self.next()) - 1.0;
        let (sine, cosine) = (f64::from(self.next()) * std::f64::consts::TAU).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        DVec3::new(radius * cosine, z, radius * sine).as_vec3()
    }

    fn color(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }
}

#[test]
fn a_light_component_and_its_record_are_the_same_light() {
    let mut sequence = Sequence(7);
    let kinds = ["AMBIENT_LIGHTS", "DIRECTIONAL_LIGHTS", "POINT_LIGHTS", "SPOT_LIGHTS"];
    let evaluate = Twin::new("evaluate_light", &kinds);
    let shade = Twin::new("shade", &["REFLECTION_PHONG"]);
    let cones = [
        None,
        Some(SpotCone::Exponent { cutoff: 1.2, exponent: 4.0 }),
        Some(SpotCone::Smooth { inner: 0.3, outer: 1.4 }),
    ];
    for case in 0..60 {
        let kind = [LightKind::Ambient, LightKind::Directional, LightKind::Point, LightKind::Point][case % 4];
        let [ambient, diffuse, specular] = std::array::from_fn(|_| sequence.color());
        let light = Light {
            kind,
            ambient,
            diffuse: if kind == LightKind::Ambient { Vec3::ZERO } else { diffuse },
            specular: if kind == LightKind::Ambient { Vec3::ZERO } else { specular },
            spot: cones[case % 3],
            ..Light::point(Vec3::ONE)
        };
        let point = 4.0 * sequence.unit();
        let axis = sequence.unit();
        // Every tenth light stands at the point itself.
        let position = if case % 10 == 6 { point } else { 5.0 * sequence.unit() };
        let expected = evaluate_light(&light, position.as_dvec3(), axis.as_dvec3(), point.as_dvec3());
        let vector = |v: Vec3| format!("vec3<f32>({:?}, {:?}, {:?})", v.x, v.y, v.z);
        let cosines = light.spot.map(|cone| cone.cosines());
        let arguments = format!(
            "LightParameters({}, {}u, {}, 0u, {}, {:?}, {}, {}u, {}, {:?}, {}, {:?}), {}",
            vector(light.ambient),
            light.kind as u32,
            vector(light.diffuse),
            vector(light.specular),
            light.attenuation.shader_range(),
            vector(position),
            cosines.map_or(0, |cone| 1 + u32::from(cone.smooth_cone)),
            vector(axis),
            cosines.map_or(0.0, |cone| cone.outer as f32),
            vector(light.attenuation.coefficients()),
            cosines.map_or(0.0, |cone| cone.inner_or_exponent as f32),
            vector(point),
        );
        let field = |name: &str| {
            let value =
                evaluate.run(&format!("evaluate_light({arguments}).{name}")).unwrap_literal().unwrap_f32();
            f64::from(value)
        };
        // The position's rounding is 5 m times 2⁻²⁴ over a distance of a metre or so; the smooth cone divides
        // by .79.
        let relative = |got: f64, expected: f64| (got - expected).abs() <= 1e-5 * expected.abs().max(1e-3);
        assert!(relative(field("attenuation"), expected.attenuation), "{light:?}: {expected:?}");
        assert!(relative(field("spot"), expected.spot), "{light:?}: {} {expected:?}", field("spot"));
        for (name, value) in [
            ("direction.x", expected.direction.x),
            ("direction.z", expected.direction.z),
            ("ambient.y", expected.ambient.y),
            ("diffuse.y", expected.diffuse.y),
            ("specular.z", expected.specular.z),
        ] {
            assert!((field(name) - value).abs() <= 1e-5, "{name} {light:?}: {} {value}", field(name));
        }

        let surface = Surface {
            diffuse: Vec3::splat(0.5),
            specular: Vec3::splat(0.25),
            shininess: 9.0,
            ..Surface::default()
        };
        let (normal, viewer) = (sequence.unit(), sequence.unit());
        let lit = light_contribution(
            ReflectionModel::Phong,
            &surface,
            &expected,
            normal.as_dvec3(),
            viewer.as_dvec3(),
        );
        let uploaded = |v: DVec3| vector(v.as_vec3());
        let call = format!(
            "light_contribution(SurfaceSample({}, {}, {}, 9.0, 1.5), {}({}, {}, {}, {}, {:?}, {:?}), {}, {})",
            vector(surface.ambient),
            vector(surface.diffuse),
            vector(surface.specular),
            light_sample_name(&shade),
            uploaded(expected.ambient),
            uploaded(expected.diffuse),
            uploaded(expected.specular),
            uploaded(expected.direction),
            expected.attenuation as f32,
            expected.spot as f32,
            vector(normal),
            vector(viewer),
        );
        for (part, value) in [("ambient", lit.ambient), ("diffuse", lit.diffuse), ("specular", lit.specular)]
        {
            for (axis, value) in ["x", "y", "z"].into_iter().zip(value.to_array()) {
                let got =
                    f64::from(shade.run(&format!("{call}.{part}.{axis}")).unwrap_literal().unwrap_f32());
                // Products of ten rounded numbers; the cosine to the ninth multiplies its own by nine.
                let bound = HALF_ULP * 100.0 * (expected.attenuation * expected.spot).max(1e-3);
                assert!((got - value).abs() <= bound, "{part}.{axis} of {light:?}: {got} {value}");
            }
        }
    }
}

/// The name that the compiler gave to `LightSample`, which `shade` imports.
fn light_sample_name(twin: &Twin) -> String {
    let source = twin.program.to_string();
    let end = source.find("LightSample").expect("shade uses it") + "LightSample".len();
    let start = source[..end].rfind(|c: char| !c.is_alphanumeric() && c != '_').map_or(0, |i| i + 1);
    source[start..end].to_owned()
}
