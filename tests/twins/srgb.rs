//! sRGB's encoding, whose power is a polynomial in shaders/tone_curve.wesl: it must stay within its stated error, and within
//! [0, 1].

use lumbre_optics::encode_srgb;
use lumbre_tests::kernel::Kernel;

use crate::inputs::Sequence;

/// The stated error, and what rounding adds to it on devices whose square roots are as inaccurate as WGSL allows.
const ERROR: f64 = 1.7e-6 + 1e-6;
const CASES: usize = 100_000;

#[test]
fn srgb_is_encoded_within_its_stated_error() {
    let imports = ["package::tone_curve::encode_srgb"];
    let call = "return array<f32, 1>(encode_srgb(vec3<f32>(x[0])).x);";
    let kernel = Kernel::new("encode_srgb", &imports, &[], 1, 1, call);
    let mut sequence = Sequence(11);
    let mut inputs: Vec<f32> = (0..CASES)
        .map(|number| match number % 2 {
            0 => sequence.between(0.0, 1.0),
            _ => sequence.decades(-5.0, 0.0),
        })
        .collect();
    // The ends, and both sides of the place where the linear part ends.
    inputs.extend([0.0, 1e-30, 0.003_130_7, 0.003_130_8, 0.003_130_9, 0.999_999_9, 1.0]);
    let encoded = kernel.run(crate::gpu(), &inputs);
    let off = |(linear, encoded): (&f32, &f32)| {
        assert!((0.0..=1.0).contains(encoded), "{linear}: {encoded}");
        (f64::from(*encoded) - encode_srgb(f64::from(*linear))).abs()
    };
    let largest = inputs.iter().zip(&encoded).map(off).fold(0.0, f64::max);
    println!("off by {largest:.2e} at most");
    assert!(largest < ERROR && largest > 1e-7, "{largest:e}");
}
