//! Compares a whole light component, with its angles, with the record that the shader gets. The function at its
//! corners is tested in `lights`.

use glam::{DVec3, Vec3};
use lumbre_optics::{Light, LightKind, SpotCone, evaluate_light};
use lumbre_tests::kernel::Kernel;

use crate::gpu;
use crate::inputs::Sequence;

const LIGHTS: usize = 10_000;
const NUMBERS: usize = 26;
const RESULTS: usize = 14;

const CALL: &str = "let light = LightParameters(vec3<f32>(x[0], x[1], x[2]), u32(x[3]), vec3<f32>(x[4], x[5], x[6]), 0u,
    vec3<f32>(x[7], x[8], x[9]), x[10], vec3<f32>(x[11], x[12], x[13]), u32(x[14]), vec3<f32>(x[15], x[16], x[17]), x[18],
    vec3<f32>(x[19], x[20], x[21]), x[22]);
    let r = evaluate_light(light, vec3<f32>(x[23], x[24], x[25]));
    return array<f32, 14>(r.attenuation, r.spot, r.direction.x, r.direction.y, r.direction.z, r.ambient.x, r.ambient.y, r.ambient.z,
    r.diffuse.x, r.diffuse.y, r.diffuse.z, r.specular.x, r.specular.y, r.specular.z);";

/// A light, its position, its axis, and the point that it lights.
struct Case {
    light: Light,
    position: Vec3,
    axis: Vec3,
    point: Vec3,
}

impl Case {
    fn random(sequence: &mut Sequence, number: usize) -> Self {
        let kind =
            [LightKind::Ambient, LightKind::Directional, LightKind::Point, LightKind::Point][number % 4];
        let cones = [
            None,
            Some(SpotCone::Exponent { cutoff: 1.2, exponent: 4.0 }),
            Some(SpotCone::Smooth { inner: 0.3, outer: 1.4 }),
        ];
        let mut color = || Vec3::new(sequence.next(), sequence.next(), sequence.next());
        let [ambient, diffuse, specular] = std::array::from_fn(|_| color());
        let direct = if kind == LightKind::Ambient { 0.0 } else { 1.0 };
        let light = Light {
            kind,
            ambient,
            diffuse: direct * diffuse,
            specular: direct * specular,
            spot: cones[number % 3],
            ..Light::point(Vec3::ONE)
        };
        let point = 4.0 * sequence.unit();
        let axis = sequence.unit();
        // Every tenth light is at the point itself.
        let position = if number % 10 == 6 { point } else { 5.0 * sequence.unit() };
        Self { light, position, axis, point }
    }

    fn input(&self) -> [f32; NUMBERS] {
        let light = &self.light;
        let cosines = light.spot.map(|cone| cone.cosines());
        let spot = cosines.map_or(0.0, |cone| if cone.smooth_cone { 2.0 } else { 1.0 });
        let record: [&[f32]; 12] = [
            &light.ambient.to_array(),
            &[light.kind as u32 as f32],
            &light.diffuse.to_array(),
            &light.specular.to_array(),
            &[light.attenuation.shader_range()],
            &self.position.to_array(),
            &[spot],
            &self.axis.to_array(),
            &[cosines.map_or(0.0, |cone| cone.outer as f32)],
            &light.attenuation.coefficients().to_array(),
            &[cosines.map_or(0.0, |cone| cone.inner_or_exponent as f32)],
            &self.point.to_array(),
        ];
        record.concat().try_into().expect("26 numbers")
    }

    fn expected(&self) -> [f64; RESULTS] {
        let [position, axis, point] = [self.position, self.axis, self.point].map(|v| v.as_dvec3());
        let sample = evaluate_light(&self.light, position, axis, point);
        let vectors: [DVec3; 4] = [sample.direction, sample.ambient, sample.diffuse, sample.specular];
        let mut expected = vec![sample.attenuation, sample.spot];
        expected.extend(vectors.iter().flat_map(|v| v.to_array()));
        expected.try_into().expect("14 numbers")
    }
}

#[test]
fn a_light_component_and_its_record_are_the_same_light() {
    let kinds = ["AMBIENT_LIGHTS", "DIRECTIONAL_LIGHTS", "POINT_LIGHTS", "SPOT_LIGHTS"];
    let imports = ["evaluate_light", "LightParameters"];
    let kernel = Kernel::new("evaluate_light", &imports, &kinds, NUMBERS, RESULTS, CALL);
    let mut sequence = Sequence(7);
    let cases: Vec<Case> = (0..LIGHTS).map(|number| Case::random(&mut sequence, number)).collect();
    let input: Vec<f32> = cases.iter().flat_map(Case::input).collect();
    let got = kernel.run(gpu(), &input);
    for (case, got) in cases.iter().zip(got.chunks_exact(RESULTS)) {
        for (place, (got, expected)) in got.iter().zip(case.expected()).enumerate() {
            // The position's rounding is 5 m times 2⁻²⁴, over a distance of a decimetre or more; the smooth cone
            // divides by .79. Attenuation and cone are compared relative to themselves.
            let scale = if place < 2 { expected.abs().max(1e-3) } else { 1.0 };
            let error = (f64::from(*got) - expected).abs();
            assert!(error <= 1e-5 * scale, "result {place}: {got} and {expected} of {:?}", case.light);
        }
    }
}
