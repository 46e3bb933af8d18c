//! Runs the shader twins in f32, in wesl's interpreter, and compares them with the f64 functions over random
//! and hard inputs. The interpreter rounds every operation correctly, so what is seen here is the algorithm's
//! error, not a device's.

use std::collections::HashMap;
use std::path::Path;

use glam::{DVec3, Vec3};
use lumbre_optics::*;
use wesl::{CompileResult, Wesl};

/// The rounding of one f32 operation, 2⁻²⁴.
const HALF_ULP: f64 = 5.960_464_477_539_063e-8;

enum Argument {
    Number(f32),
    Vector(Vec3),
    Flag(bool),
}

impl From<f32> for Argument {
    fn from(value: f32) -> Self {
        Self::Number(value)
    }
}

impl From<Vec3> for Argument {
    fn from(value: Vec3) -> Self {
        Self::Vector(value)
    }
}

impl From<bool> for Argument {
    fn from(value: bool) -> Self {
        Self::Flag(value)
    }
}

impl std::fmt::Display for Argument {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(x) => write!(f, "f32({x:?})"),
            Self::Vector(v) => write!(f, "vec3<f32>({:?}, {:?}, {:?})", v.x, v.y, v.z),
            Self::Flag(flag) => write!(f, "{flag}"),
        }
    }
}

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

    fn call(&self, function: &str, arguments: &[Argument]) -> f64 {
        let list: Vec<String> = arguments.iter().map(Argument::to_string).collect();
        f64::from(self.run(&format!("{function}({})", list.join(", "))).unwrap_literal().unwrap_f32())
    }

    fn call_vector(&self, function: &str, arguments: &[Argument]) -> DVec3 {
        let list: Vec<String> = arguments.iter().map(Argument::to_string).collect();
        let vector = self.run(&format!("{function}({})", list.join(", "))).unwrap_vec();
        let component =
            |i| f64::from(vector.get(i).expect("three components").clone().unwrap_literal().unwrap_f32());
        DVec3::new(component(0), component(1), component(2))
    }
}

macro_rules! arguments {
    ($($argument:expr),* $(,)?) => { &[$(Argument::from($argument)),*] };
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

    fn shininess(&mut self) -> f32 {
        10f32.powf(6.0 * self.next())
    }
}

/// Directions that meet at n·l and n·v of either sign, at grazing angles, opposite, equal and mirrored.
fn directions() -> Vec<(Vec3, Vec3, Vec3)> {
    let mut sequence = Sequence(1);
    let mut all: Vec<_> = (0..40).map(|_| (sequence.unit(), sequence.unit(), sequence.unit())).collect();
    // Near the mirror direction, where the highlight is.
    for step in 0..36 {
        let (normal, light) = (sequence.unit(), sequence.unit());
        let light = if normal.dot(light) < 0.0 { -light } else { light };
        let mirror = 2.0 * normal.dot(light) * normal - light;
        let away = 10f32.powi(-(step % 6));
        all.push((normal, light, (mirror + away * sequence.unit()).normalize()));
    }
    let hard = [Vec3::ZERO, Vec3::Y, -Vec3::Y, Vec3::X, Vec3::new(1.0, 1e-3, 0.0).normalize()];
    for light in hard {
        for viewer in [Vec3::ZERO, Vec3::Y, -Vec3::X, -light, light] {
            all.push((Vec3::Y, light, viewer));
        }
    }
    all
}

#[test]
fn attenuate_equals_its_twin() {
    let twin = Twin::new("attenuation", &[]);
    let mut sequence = Sequence(2);
    let mut cases: Vec<(Vec3, f32, f32)> = (0..200)
        .map(|_| {
            let coefficients = sequence.color();
            (coefficients, 100.0 * sequence.next() + 0.1, 120.0 * sequence.next())
        })
        .collect();
    for coefficients in
        [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z, Vec3::splat(1e-20), Vec3::splat(1e20), -Vec3::ONE]
    {
        for range in [1e30, 1.0, 1e-20, 0.0, -1.0] {
            for distance in [0.0, 1e-30, 0.01, 1.0, 1e6, 1e18, 1e30, f32::MAX] {
                cases.push((coefficients, range, distance));
            }
        }
    }
    for (coefficients, range, distance) in cases {
        for clamp in [false, true] {
            let expected = attenuate(coefficients.as_dvec3(), clamp, range.into(), distance.into());
            let got = twin.call("attenuate", arguments![coefficients, clamp, range, distance]);
            // Eight roundings; the window's difference from 1 adds eight of its own, absolute. Below 1e-37
            // f32 has denormals.
            let strongest = attenuate(coefficients.as_dvec3(), clamp, 1e30, distance.into());
            let bound = HALF_ULP * 20.0 * strongest + 1e-37;
            assert!(
                (got - expected).abs() <= bound,
                "{coefficients} {clamp} {range} {distance}: {got} {expected}"
            );
        }
    }
}

#[test]
fn spot_factor_equals_its_twin() {
    let twin = Twin::new("spot", &[]);
    let cones = [
        SpotCone::Exponent { cutoff: 0.0, exponent: 1.0 },
        SpotCone::Exponent { cutoff: 0.7, exponent: 0.0 },
        SpotCone::Exponent { cutoff: std::f32::consts::FRAC_PI_2, exponent: 128.0 },
        SpotCone::Exponent { cutoff: std::f32::consts::PI, exponent: 3.0 },
        SpotCone::Smooth { inner: 0.2, outer: 0.9 },
        SpotCone::Smooth { inner: 0.5, outer: 0.5 },
        SpotCone::Smooth { inner: 0.0, outer: std::f32::consts::FRAC_PI_2 },
    ];
    for cone in cones {
        let SpotCosines { smooth_cone, outer, inner_or_exponent } = cone.cosines();
        // What is uploaded is f32; both sides see that.
        let (outer, second) = (outer as f32, inner_or_exponent as f32);
        for step in -100..=100 {
            let cosine = step as f32 / 100.0 + 1e-4;
            let expected = spot_factor(smooth_cone, outer.into(), second.into(), cosine.into());
            let got = twin.call("spot_factor", arguments![smooth_cone, outer, second, cosine]);
            // pow is correctly rounded here; the smooth edge divides a rounded difference by a width of at
            // least .001.
            let bound = if smooth_cone { HALF_ULP * 4.0 / 0.001 } else { HALF_ULP * 4.0 };
            assert!((got - expected).abs() <= bound, "{cone:?} {cosine}: {got} {expected}");
        }
    }
}

#[test]
fn specular_models_equal_their_twins() {
    let models = [
        (ReflectionModel::Phong, 1.0),
        (ReflectionModel::Blinn, 1.0),
        (ReflectionModel::Blinn4n, 4.0),
        (ReflectionModel::BlinnMatched, 4.0),
    ];
    let mut sequence = Sequence(3);
    for (model, scale) in models {
        let plain = Twin::new("shade", &[model.shader_feature()]);
        let sharp = Twin::new("shade", &[model.shader_feature(), "SHARP_HIGHLIGHTS"]);
        for (normal, light, viewer) in directions() {
            let cosine = f64::from(normal.dot(light));
            if cosine != 0.0 && cosine.abs() < 1e-6 {
                continue; // the gate's sign is within rounding
            }
            let (n, l, v) = (normal.as_dvec3(), light.as_dvec3(), viewer.as_dvec3());
            for shininess in [0.0, 1.0, 128.0, sequence.shininess()] {
                let expected = specular_factor(model, n, l, v, shininess.into(), 1.5);
                let arguments = arguments![normal, light, viewer, shininess, 1.5f32];
                let exponent = f64::from(shininess) * scale;
                // A vector's error δ ≤ 5 roundings moves cosⁿ by at most sqrt(n/e) δ; near the peak the
                // series adds 10⁻⁷, and where pow takes over, at a cosine of .9, n · cosⁿ · δ stays below δ /
                // (e ln(1/.9)) = 3.5 δ.
                let error = (sharp.call("specular_factor", arguments) - expected).abs();
                let bound = HALF_ULP * 5.0 * (4.0 + exponent.sqrt()) + 2e-7;
                assert!(
                    error <= bound,
                    "{model:?} n = {shininess} {normal} {light} {viewer}: {error} > {bound}"
                );
                // Without it, the cosine's five roundings are multiplied by n.
                if shininess <= SHARP_SHININESS {
                    let error = (plain.call("specular_factor", arguments) - expected).abs();
                    let bound = HALF_ULP * 5.0 * (1.0 + exponent);
                    assert!(
                        error <= bound,
                        "{model:?} n = {shininess} {normal} {light} {viewer}: {error} > {bound}"
                    );
                }
            }
        }
    }
}

#[test]
fn torrance_sparrow_equals_its_twin() {
    let twin = Twin::new("torrance_sparrow", &[]);
    let mut sequence = Sequence(4);
    for (normal, light, viewer) in directions() {
        let (n, l, v) = (normal.as_dvec3(), light.as_dvec3(), viewer.as_dvec3());
        let least = n.dot(l).abs().min(n.dot(v).abs());
        if least != 0.0 && least < 1e-6 {
            continue; // the gate's sign is within rounding
        }
        for shininess in [0.0, 1e6, sequence.shininess()] {
            for ior in [1.0f32, 1.5] {
                let expected = torrance_sparrow(n, l, v, shininess.into(), ior.into());
                let got = twin.call("torrance_sparrow", arguments![normal, light, viewer, shininess, ior]);
                // D: 2 δ sqrt(n/3.3) relative for an angle's error δ ≤ 5 roundings; the two cosines: 3
                // roundings over their value; F of an index near 1 is a difference of nearly equal squares:
                // absolute.
                let relative = HALF_ULP * (40.0 + 10.0 * f64::from(shininess).sqrt() + 6.0 / least.max(1e-6));
                let without_fresnel = torrance_sparrow_geometry(n, l, v, shininess.into());
                let bound = relative * expected + HALF_ULP * 20.0 * without_fresnel;
                assert!(
                    (got - expected).abs() <= bound,
                    "n = {shininess}, {ior}, {normal} {light} {viewer}: {got} {expected}, bound {bound}"
                );
            }
        }
    }
}

#[test]
fn microfacets_equal_their_twins() {
    let twin = Twin::new("microfacets", &[]);
    let mut sequence = Sequence(5);
    let mut exponents = vec![0.0, 0.5, 1.0, 5.0, 5.6, 128.0, 1e6];
    exponents.extend((0..60).map(|_| sequence.shininess()));
    for shininess in exponents {
        let expected = half_value_sine_squared(shininess.into());
        let got = twin.call("half_value_sine_squared", arguments![shininess]);
        // Twelve roundings; at x = 1/4 the exponential's form loses two bits to its difference from 1.
        assert!((got - expected).abs() <= HALF_ULP * 16.0 * expected, "{shininess}: {got} {expected}");
        let sine = f64::from(sequence.next()) * expected.sqrt().min(0.5) * 2.0;
        let (sine_squared, cosine) = ((sine * sine) as f32, (1.0 - sine * sine).max(0.0).sqrt() as f32);
        for (name, value) in [
            (
                "distribution_cosine_power",
                distribution_cosine_power(cosine.into(), sine_squared.into(), shininess.into()),
            ),
            (
                "distribution_gaussian",
                distribution_gaussian(cosine.into(), sine_squared.into(), shininess.into()),
            ),
        ] {
            let got = twin.call(name, arguments![cosine, sine_squared, shininess]);
            // Within two half widths the exponent is at most 4 ln 2, so ten roundings and the series' 2e-7
            // are multiplied by 3.
            assert!(
                (got - value).abs() <= 30.0 * HALF_ULP + 1e-6,
                "{name} {shininess} {sine_squared}: {got} {value}"
            );
        }
        let value = distribution_trowbridge_reitz(sine_squared.into(), shininess.into());
        let got = twin.call("distribution_trowbridge_reitz", arguments![sine_squared, shininess]);
        assert!((got - value).abs() <= 50.0 * HALF_ULP, "D3 {shininess} {sine_squared}: {got} {value}");
    }
}

#[test]
fn fresnel_equals_its_twin() {
    let twin = Twin::new("fresnel", &[]);
    let mut sequence = Sequence(6);
    let cosines: Vec<f32> =
        [0.0, 1e-20, 1e-3, 0.5, 1.0, 1.1, -1.0].into_iter().chain((0..40).map(|_| sequence.next())).collect();
    for &cosine in &cosines {
        for eta in [0.0f32, 0.4, 2.0 / 3.0, 1.0, 1.33, 2.42, 1e6] {
            let expected = fresnel_dielectric(cosine.into(), eta.into());
            let got = twin.call("fresnel_dielectric", arguments![cosine, eta]);
            // g is a root: its error is three roundings of g² over g, and F's slope in g at most 4/eta² of a
            // cosine near 1.
            let index = f64::from(eta).clamp(1e-4, 1e4);
            let cosine = f64::from(cosine).clamp(0.0, 1.0);
            let g = (index * index - (1.0 - cosine * cosine)).max(0.0).sqrt();
            let bound = HALF_ULP * 10.0 * (1.0 + 4.0 / (g * index.min(1.0).powi(2)).max(1e-4));
            assert!((got - expected).abs() <= bound, "{cosine} {eta}: {got} {expected}");
        }
        let (eta, absorption) = (Vec3::new(0.2, 3.11, 0.0), Vec3::new(3.9, 3.31, 1e5));
        let expected = fresnel_conductor(cosine.into(), eta.as_dvec3(), absorption.as_dvec3());
        let got = twin.call_vector("fresnel_conductor", arguments![cosine, eta, absorption]);
        // No difference cancels in it: twenty roundings of a number up to 1.
        assert!((got - expected).abs().max_element() <= 20.0 * HALF_ULP, "{cosine}: {got} {expected}");
        let f0 = Vec3::new(0.04, 0.5, 1.0);
        let got = twin.call_vector("fresnel_schlick", arguments![cosine, f0]);
        let expected = fresnel_schlick(cosine.into(), f0.as_dvec3());
        assert!((got - expected).abs().max_element() <= 10.0 * HALF_ULP, "{cosine}: {got} {expected}");
    }
}

#[test]
fn snell_equals_its_twin() {
    let twin = Twin::new("snell", &[]);
    for (normal, light, _) in directions() {
        for eta in [0.0f32, 0.7, 1.0, 1.5] {
            let (n, l) = (normal.as_dvec3(), light.as_dvec3());
            let sine = n.cross(l).length();
            let root = (1.0 - (sine / f64::from(eta).max(1e-4)).powi(2)).abs().sqrt();
            if root < 1e-3 {
                continue; // within rounding of the critical angle, which side is chance
            }
            let expected = transmitted_direction(n, l, eta.into());
            let got = twin.call_vector("transmitted_direction", arguments![normal, light, eta]);
            // Ten roundings over the index, and those of the cosine's square over the cosine. Where eta is
            // refused (0) all is reflected.
            let bound = HALF_ULP * 20.0 * (1.0 + 1.0 / root);
            let scale = if f64::from(eta) < 1e-4 && sine == 0.0 { 1e4 } else { 1.0 };
            assert!((got - expected).length() <= bound * scale, "{normal} {light} {eta}: {got} {expected}");
        }
    }
}

#[test]
fn fog_equals_its_twin() {
    let modes = [
        FogMode::Linear { start: 1.0, end: 20.0 },
        FogMode::Linear { start: 5.0, end: 5.0 },
        FogMode::Exponential { density: 0.1 },
        FogMode::ExponentialSquared { density: 0.1 },
        FogMode::DepthCue { start: 2.0, end: 30.0, near_weight: 0.9, far_weight: 0.1 },
    ];
    for mode in modes {
        let twin = Twin::new("fog", &[mode.shader_feature()]);
        let [a, b, c, d] = mode.parameters();
        for distance in [0.0f32, 1e-30, 0.5, 2.0, 5.0, 11.3, 20.0, 100.0, 1e18, f32::MAX, -7.0] {
            let expected = fog_weight(&mode, distance.into());
            let call = format!("fog_weight(vec4<f32>({a:?}, {b:?}, {c:?}, {d:?}), f32({distance:?}))");
            let got = f64::from(twin.run(&call).unwrap_literal().unwrap_f32());
            // The exponent x has three roundings: x e⁻ˣ ≤ 1/e of them.
            assert!((got - expected).abs() <= 5.0 * HALF_ULP, "{mode:?} {distance}: {got} {expected}");
        }
    }
}

#[test]
fn vectors_equal_their_twins() {
    let (normalization, half) = (Twin::new("normalization", &[]), Twin::new("half_vector", &[]));
    let two_sided = Twin::new("two_sided", &[]);
    for v in
        [Vec3::ZERO, Vec3::splat(1e-18), Vec3::splat(1e-10), Vec3::new(3.0, -4.0, 12.0), Vec3::splat(1e18)]
    {
        let got = normalization.call_vector("safe_normalize", arguments![v]);
        // Five roundings and the root.
        assert!((got - safe_normalize(v.as_dvec3())).length() <= 5.0 * HALF_ULP, "{v}: {got}");
        let expected = shading_normal(v.as_dvec3(), DVec3::Z);
        let got = two_sided.call_vector("shading_normal", arguments![v, Vec3::Z]);
        assert!((got - expected).length() <= 5.0 * HALF_ULP, "{v}: {got} {expected}");
    }
    for (_, light, viewer) in directions() {
        let expected = half_vector(light.as_dvec3(), viewer.as_dvec3());
        let got = half.call_vector("half_vector", arguments![light, viewer]);
        // The sum's rounding over its length; directions() holds no pair nearer to opposite than 1e-3 that is
        // not exactly so.
        let sum = (light + viewer).length().max(1e-3);
        assert!(
            (got - expected).length() <= HALF_ULP * (5.0 + 4.0 / f64::from(sum)),
            "{light} {viewer}: {got}"
        );
    }
}

#[test]
fn evaluate_light_and_light_contribution_equal_their_twins() {
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
        let vector = |v: Vec3| Argument::from(v).to_string();
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

#[test]
fn shininess_from_roughness_equals_its_twin() {
    let twin = Twin::new("roughness", &[]);
    for step in -1..=65 {
        let roughness = step as f32 / 64.0;
        let expected = f64::from(shininess_from_roughness(roughness));
        let got = twin.call("shininess_from_roughness", arguments![roughness]);
        // Both in f32: four roundings of 2/α², which is n + 2.
        assert!((got - expected).abs() <= HALF_ULP * 4.0 * (expected + 2.0), "{roughness}: {got} {expected}");
    }
}

#[test]
fn power_of_cosine_equals_its_twin() {
    let twin = Twin::new("power", &[]);
    for step in 0..=95 {
        let sine_squared = step as f32 / 500.0;
        let cosine = (1.0 - sine_squared).sqrt();
        for scale in [0.0f32, 0.1, 2.0, 10.0] {
            // The exponent at which the power is about exp(-scale/2).
            let exponent = (scale / sine_squared.max(1e-6)).min(1e6);
            let expected = power_of_cosine(cosine.into(), sine_squared.into(), exponent.into());
            let got = twin.call("power_of_cosine", arguments![cosine, sine_squared, exponent]);
            // The series stops at 2e-7 of the logarithm x, and it and the product take twelve roundings; x
            // e⁻ˣ ≤ 1/e.
            let bound = (2e-7 + 12.0 * HALF_ULP) / std::f64::consts::E + HALF_ULP;
            assert!((got - expected).abs() <= bound, "{sine_squared} {exponent}: {got} {expected}");
        }
    }
}
