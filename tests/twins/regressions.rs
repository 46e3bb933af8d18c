//! Single inputs: those that showed a weakness, with what is right there, and for each function the one that came nearest to its bound.
//! Bits, so that nothing is lost in writing them down.

#![allow(clippy::approx_constant, reason = "expected values are what they are")]

use glam::DVec3;
use lumbre_optics as optics;

use crate::bounds::{Numbers, U};
use crate::{gpu, twin};

/// The device's result for one input of a function.
fn got(name: &str, input: &[f32]) -> Vec<f64> {
    twin(name).kernel.run(gpu(), input).into_iter().map(f64::from).collect()
}

/// The device and the twin give what is expected, and the bound is still as narrow as it was.
fn holds(name: &str, bits: &[u32], expected: &[f64], bound: &[f64]) {
    let input: Vec<f32> = bits.iter().map(|bits| f32::from_bits(*bits)).collect();
    let (asked, allowed) = twin(name).asked(&input);
    let within = |values: &[f64], expected: &[f64], bound: &dyn Fn(usize) -> f64| {
        values
            .iter()
            .zip(expected)
            .enumerate()
            .all(|(at, (value, expected))| (value - expected).abs() <= bound(at))
    };
    // Other libraries round the last bits of a power otherwise.
    let nearly = |at: usize| 1e-9 * expected[at].abs() + 1e-12 * bound[at];
    let other = allowed.other.as_ref();
    let is_other = |values: &[f64], near: &dyn Fn(usize) -> f64| {
        other.is_some_and(|other| within(values, other, near))
            || other.is_some_and(|_| within(values, &asked, near))
    };
    assert!(
        within(&asked, expected, &nearly) || is_other(expected, &nearly),
        "{name}: the twin gives {asked:?}, not {expected:?}"
    );
    for (allowed, bound) in allowed.error.iter().zip(bound) {
        assert!(*allowed <= 1.01 * bound, "{name}: the bound was {bound:e} and is {allowed:e}");
    }
    let got = got(name, &input);
    let at = |at: usize| bound[at];
    assert!(
        within(&got, expected, &at) || is_other(&got, &at),
        "{name}: the device gives {got:?}, not {expected:?} within {bound:?}"
    );
}

macro_rules! worst {
    ($test:ident, $name:literal, [$($bits:expr),*], [$($expected:expr),*], [$($bound:expr),*]) => {
        #[test]
        fn $test() {
            holds($name, &[$($bits),*], &[$($expected),*], &[$($bound),*]);
        }
    };
}

/// One number within so many u, and the twin nearer.
fn is_near(name: &str, input: &[f32], expected: f64, roundings: f64) {
    let device = got(name, input)[0];
    let (asked, _) = twin(name).asked(input);
    assert!((asked[0] / expected - 1.0).abs() < 1e-7, "{name}: the twin gives {} for {expected}", asked[0]);
    let bound = roundings * U * expected.abs();
    assert!((device - expected).abs() <= bound, "{name}: {device} for {expected} within {bound:e}");
}

#[test]
fn light_that_grazes_equal_media_goes_straight_on() {
    // From the sine the f32 direction was zero here, "totally reflected": an error of 1. From the cosine it is a rounding.
    let normal = DVec3::new(0.48, 0.6, 0.64);
    for height in [1e-2, 1e-4, 1e-6] {
        let light = (normal.cross(DVec3::X).normalize() + height * normal).normalize().as_vec3();
        let normal = normal.as_vec3();
        let input = [&normal.to_array()[..], &light.to_array(), &[1.0]].concat();
        let direction = DVec3::from_slice(&got("transmitted_direction", &input));
        // |n| is off by up to 2 u, which bends the light by as much; the rest is the bound.
        let (_, allowed) = twin("transmitted_direction").asked(&input);
        assert!(
            (direction + light.as_dvec3()).length() <= 2.0 * allowed.error[0] + 4.0 * U,
            "{height}: {direction}"
        );
        assert!(allowed.error[0] < 3e-6);
    }
}

#[test]
fn the_half_value_angle_of_a_lobe_that_is_hardly_one() {
    // acos(2^(-1/n)): from 1 - sin² it was off by 1.7e-4 where cos² is a few roundings.
    for exponent in [0.05f32, 0.08, 0.1, 1.0] {
        let expected = (-std::f64::consts::LN_2 / f64::from(exponent)).exp().acos();
        is_near("half_value_angle", &[exponent], expected, 16.0);
    }
}

#[test]
fn an_exponent_whose_fourfold_overflows() {
    // 4 n was infinite, and infinity times log2(1) no number. At l = v = n the lobe is 1.
    let up = [0.0, 1.0, 0.0];
    for name in ["blinn_phong_4n (plain)", "blinn_phong_4n (sharp)", "blinn_phong_matched (sharp)"] {
        let input = [&up[..], &up, &up, &[2e38]].concat();
        assert_eq!(got(name, &input), [1.0], "{name}");
    }
}

#[test]
fn bases_and_exponents_near_nothing() {
    // 10⁻³⁸ to the power .001 was 10⁻³⁰ to that power in the shader and itself in the twin: .933 and .916.
    for input in [[1e-38, 1e-3], [-0.0, 1e-3], [0.0, 1e-29], [f32::from_bits(1), 0.5]] {
        assert_eq!(got("safe_pow", &input), [0.0]);
        assert_eq!(optics::safe_pow(input[0].into(), input[1].into()), 0.0);
    }
    for input in [[0.0, 0.0], [0.0, f32::from_bits(1)], [-1.0, -1.0], [0.5, 1e-38]] {
        assert_eq!(got("safe_pow", &input), [1.0]);
        assert_eq!(optics::safe_pow(input[0].into(), input[1].into()), 1.0);
    }
    is_near("safe_pow", &[1.1e-30, 1e-3], 1.1e-30f64.powf(1e-3), 30.0);
}

#[test]
fn fog_thinner_than_numbers_divide() {
    // A span among the denormals was divided by: a device that takes it for 0 had 0/0.
    let thin = f32::from_bits(3);
    for (distance, fraction) in [(0.0, 0.0), (1e-20, 1.0), (1.0, 1.0)] {
        assert_eq!(got("fog_fraction", &[0.0, 1e-36, distance]), [fraction], "{distance}");
    }
    assert_eq!(got("fog_fraction", &[0.0, thin, 1.0]), [1.0]);
    assert_eq!(got("fog_linear", &[5.0, 5.0, 4.999]), [1.0]);
}

#[test]
fn a_light_ends_where_its_range_does() {
    // The window is a difference from 1 of a quotient that may be 2.5 units too large: it may not become negative.
    for range in [0.1f32, 0.3, 7.0, 1e-20, 33.3] {
        for distance in [range, range.next_up(), 2.0 * range] {
            let factor = got("attenuate", &[0.0, 0.0, 1.0, 0.0, range, distance])[0];
            let strongest = optics::attenuate(DVec3::Z, false, 1e30, distance.into());
            assert!((0.0..=28.0 * U * strongest).contains(&factor), "{range} {distance}: {factor}");
        }
    }
}

#[test]
fn indices_that_no_medium_has() {
    // At 10⁻⁴ the direction was noise: errors of 2. Indices under .01 count as that.
    let input = [0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 1e-4];
    let (expected, allowed) = twin("transmitted_direction").asked(&input);
    assert_eq!(expected, Numbers::from_slice(&[0.0, -1.0, 0.0]));
    let device = got("transmitted_direction", &input);
    assert!(device.iter().zip(&expected).zip(&allowed.error).all(|((a, b), bound)| (a - b).abs() <= *bound));
    assert!(allowed.error.iter().all(|bound| *bound < 1e-2), "{:?}", allowed.error);
}

// The worst input of each function, as the table printed it (LUMBRE_TWIN_WORST=1).

worst!(
    squared_length,
    "squared_length",
    [0x4f352d04, 0x4d1341b3, 0xcd30d389],
    [9.297549085610506e18],
    [1.6625313315887163e12]
);
worst!(
    safe_normalize,
    "safe_normalize",
    [0xb20643e4, 0x311c096c, 0x2e9dd3f2],
    [-9.602533656991561e-1, 2.7899051450374973e-1, 8.8185305111355e-3],
    [4.0064892529810027e-7, 1.1640391358889629e-7, 3.6793776499002278e-9]
);
worst!(
    shading_normal,
    "shading_normal",
    [0x35532eba, 0x3515f820, 0xb506ef70, 0xbf517819, 0xbe970814, 0x3efca271],
    [7.230905925436263e-1, 5.134958256899137e-1, -4.620195147111661e-1],
    [3.0169690536292694e-7, 2.1424715398725247e-7, 1.9276956337560194e-7]
);
worst!(
    viewer_direction,
    "viewer_direction",
    [
        0x3f800000, 0x425839a0, 0xc383166e, 0xc20ba794, 0xbeca2b87, 0xbe87f8a0, 0xbf612840, 0xbfc59819,
        0x3e99ce7c, 0x3e395562
    ],
    [2.0548034612329635e-1, -9.700288705805863e-1, -1.296989498693124e-1],
    [1.1022824735103054e-7, 5.203640362754629e-7, 6.957593851231406e-8]
);
worst!(
    add_emission,
    "add_emission",
    [0x3af736de, 0x423acbd8, 0x3c6bff13, 0x388c92b0, 0x388a94b9, 0x44a22014],
    [1.9531260477378964e-3, 4.669913224265474e1, 1.2970168454824015e3],
    [1.1641538427697995e-10, 2.783485188642427e-6, 7.730822834267626e-5]
);
worst!(
    exitance,
    "exitance",
    [0x45ad3160, 0x3d869aa0, 0x45a2fc9d],
    [1.7411246447431968e4, 2.064799559646713e-1, 1.6385217319781263e4],
    [1.5566867393939465e-3, 1.84607466427688e-8, 1.4649525868697102e-3]
);
worst!(
    half_vector,
    "half_vector",
    [0xbf3f8176, 0x3f20f992, 0xbe5934ba, 0xbe8c5c0a, 0xbf755a24, 0x3da29b6f],
    [-9.445642958965498e-1, -3.0456301824391047e-1, -1.2263628678174644e-1],
    [5.067037739198773e-7, 1.6338033462734187e-7, 6.578723079179036e-8]
);
worst!(
    lambert,
    "lambert",
    [0xbf45334d, 0x3f233d00, 0x3b903f61, 0xbe2cebc9, 0x3e4ba078, 0xbf772288],
    [2.526312684899572e-1],
    [4.6693782618243205e-8]
);
worst!(
    reflected_direction,
    "reflected_direction",
    [0x3d235f7a, 0xbacb2000, 0xbf7fcbc5, 0x3ef596bc, 0xbf0222be, 0xbf37173d],
    [-4.2106930490955946e-1, 5.060659349343859e-1, -7.527269603618494e-1],
    [3.9068140586406416e-8, 3.070668518777915e-8, 3.948466869554712e-7]
);
worst!(
    attenuate,
    "attenuate",
    [0x40cc39bb, 0x3ac6efdb, 0x3e0ad41b, 0x00000000, 0x7149f2ca, 0x42770369],
    [1.9102689202664584e-3],
    [1.4801917054333662e-9]
);
worst!(
    spot_factor_exponent,
    "spot_factor (exponent)",
    [0x00000000, 0x3eedad84, 0x42f62bee, 0x3efbd52f],
    [1.1753198106921113e-38],
    [1.1755729096235074e-38]
);
worst!(
    spot_factor_smooth,
    "spot_factor (smooth)",
    [0x3f800000, 0x3efffffd, 0x3f800000, 0x3f7fffff],
    [9.999997615814777e-1],
    [8.940694584680895e-7]
);
worst!(
    evaluate_light_directional,
    "evaluate_light (directional)",
    [
        0x7149f2ca, 0xbf9e02db, 0x3ff81ee2, 0x3f8544ec, 0xbf422452, 0xbf1da1f4, 0xbe5af9b2, 0x3f30f1f6,
        0x3f663fc0, 0x3eb12296, 0x3d7bebf3, 0x42678390, 0xbfa944ea, 0x3feefae8, 0x3f81a66e
    ],
    [7.583666906371076e-1, 6.157524477329035e-1, 2.1384313326141566e-1, 1e0, 1e0],
    [3.164152404343935e-7, 2.5691194141687895e-7, 8.92223079699224e-8, 0e0, 0e0]
);
worst!(
    evaluate_light_directional_spot,
    "evaluate_light (directional spot)",
    [
        0x7149f2ca, 0xbf9e02db, 0x3ff81ee2, 0x3f8544ec, 0xbf422452, 0xbf1da1f4, 0xbe5af9b2, 0x3f30f1f6,
        0x3f663fc0, 0x3eb12296, 0x3d7bebf3, 0x42678390, 0xbfa944ea, 0x3feefae8, 0x3f81a66e
    ],
    [7.583666906371076e-1, 6.157524477329035e-1, 2.1384313326141566e-1, 1e0, 1e0],
    [3.164152404343935e-7, 2.5691194141687895e-7, 8.92223079699224e-8, 0e0, 5.398539372376215e-5]
);
worst!(
    evaluate_light_point,
    "evaluate_light (point)",
    [
        0x41453c9d, 0x40f7f2f1, 0x40dca9d3, 0x3f6e06ea, 0xbdd56a1f, 0x3f7b230e, 0xbe278d1e, 0x3e99487c,
        0x3f013b5b, 0x3d503f23, 0x3f61002e, 0x420e1394, 0x4120a760, 0x41785ecc, 0x4050abac
    ],
    [-2.484769715056077e-1, -9.351160894045416e-1, -2.526204543740645e-1, 9.055012605645802e-3, 1e0],
    [1.3329343459310945e-7, 5.016353609943911e-7, 1.35516172013675e-7, 3.8723559447967024e-8, 0e0]
);
worst!(
    evaluate_light_spot_exponent,
    "evaluate_light (spot, exponent)",
    [
        0x7149f2ca, 0xc09a6625, 0xbfe23e58, 0xc050975d, 0x3d7e4348, 0xbf7f7038, 0x3cbc8712, 0x3ea19adc,
        0x3f2e57f3, 0x3ef4fe02, 0x3f6def74, 0x42e71633, 0xc09a17a0, 0xbfe58807, 0xc05389d0
    ],
    [
        -1.7885084978408158e-1,
        4.792942074253252e-1,
        8.592377064934017e-1,
        1.4097562250364082e0,
        1.167462388946967e-38
    ],
    [
        9.594307232241238e-8,
        2.571134487884001e-7,
        4.6093102445844504e-7,
        3.109036703488058e-6,
        1.175677010597541e-38
    ]
);
worst!(
    evaluate_light_spot_smooth,
    "evaluate_light (spot, smooth)",
    [
        0x41c0a2f6, 0x41922704, 0x409f1d64, 0x4031ac2f, 0xbe76883e, 0xbf78387a, 0x3d3217dd, 0x3f4133aa,
        0x3f06cd95, 0x3f04b6d9, 0x3f36e56b, 0x3f4c1990, 0x418be6fc, 0xc2001ff2, 0xc0889536
    ],
    [2.0736316541287686e-2, 9.821465784020347e-1, 1.869708632634388e-1, 0e0, 1e0],
    [
        1.1123827032541583e-8,
        5.268644813071675e-7,
        1.0029898699348863e-7,
        4.380153166411959e-9,
        3.333552895024578e-5
    ]
);
worst!(safe_pow, "safe_pow", [0x3f23f7bc, 0x43440a25], [1.1747186570513301e-38], [1.1756122973091177e-38]);
worst!(
    logarithm_of_one_minus,
    "logarithm_of_one_minus",
    [0x3e7e3aab],
    [-2.8537896070418367e-1],
    [5.165580160804435e-7]
);
worst!(
    power_of_cosine,
    "power_of_cosine",
    [0x3f800000, 0x3e7ffffe, 0x43000003],
    [1.0090649052851769e-8],
    [4.1787472686613614e-13]
);
worst!(
    filtered_lobe,
    "filtered_lobe",
    [0x40c129a3, 0x3f800000, 0x3c61ceef],
    [5.614638782128988e0, 9.475265838600488e-1],
    [5.973552568670202e-6, 1.1295397089243518e-6]
);
worst!(
    lobe_widening,
    "lobe_widening",
    [0x3516d330, 0x34d25b3a],
    [2.384214923267791e-7],
    [2.842205671391238e-14]
);
worst!(
    shininess_from_roughness,
    "shininess_from_roughness",
    [0x3f373d25],
    [5.619380577142987e0],
    [4.087354254382067e-6]
);
worst!(
    cosine_lobe_plain,
    "cosine_lobe (plain)",
    [0x3f6fe54b, 0x3e1a1d30, 0xbea143e8, 0x3f3d472f, 0x3f17142a, 0x3ea5f3b7, 0x43622400],
    [1.1572857286060549e-38],
    [1.1756829346503662e-38]
);
worst!(
    phong_plain,
    "phong (plain)",
    [
        0xbf255975, 0x3d87f2a0, 0x3f42b258, 0x3dea32dd, 0x3d6e65c0, 0x3f7de240, 0xbdee7163, 0x3f24cb72,
        0x3f419fce, 0x42480000
    ],
    [1.1740866128156323e-38],
    [1.1756753200151764e-38]
);
worst!(
    blinn_phong_plain,
    "blinn_phong (plain)",
    [
        0xbd93d476, 0xbebc2a70, 0x3f6d5de1, 0x3f13cd37, 0x3f13cd3b, 0x3f13cd3a, 0x3f1e343f, 0x3f48c3bc,
        0x3d62db90, 0x3a83126f
    ],
    [9.828925815185072e-1],
    [9.828929459384552e-1]
);
worst!(
    blinn_phong_4n_plain,
    "blinn_phong_4n (plain)",
    [
        0xbd93d476, 0xbebc2a70, 0x3f6d5de1, 0x3f13cd37, 0x3f13cd3b, 0x3f13cd3a, 0x3f1e343f, 0x3f48c3bc,
        0x3d62db90, 0x3a83126f
    ],
    [9.333063674425623e-1],
    [9.333067502541926e-1]
);
worst!(
    blinn_phong_matched_plain,
    "blinn_phong_matched (plain)",
    [
        0xbd93d476, 0xbebc2a70, 0x3f6d5de1, 0x3f13cd37, 0x3f13cd3b, 0x3f13cd3a, 0x3f1e343f, 0x3f48c3bc,
        0x3d62db90, 0x3a83126f
    ],
    [9.807599620425956e-1],
    [9.807603272934313e-1]
);
worst!(
    cosine_lobe_sharp,
    "cosine_lobe (sharp)",
    [0xbec1c885, 0xbdca4560, 0x3f6b9a59, 0xbc1ef7c0, 0xbdc27181, 0x3f7ed4db, 0x44949e61],
    [1.1697508121571803e-38],
    [1.175638796551547e-38]
);
worst!(
    phong_sharp,
    "phong (sharp)",
    [
        0xbf42af17, 0xbf190c9c, 0xbe81c536, 0xbf134f7d, 0xbf0d4716, 0xbf1a84f5, 0xbf27c3e2, 0xbee39c4c,
        0xbf1c5498, 0x43759e48
    ],
    [1.1705239319747051e-38],
    [1.1758815100567108e-38]
);
worst!(
    blinn_phong_sharp,
    "blinn_phong (sharp)",
    [
        0xbd93d475, 0xbebc2a70, 0x3f6d5de0, 0x00000000, 0xbf800000, 0x80000000, 0x3d595112, 0xbf3ad8d5,
        0xbf2e784a, 0x3a83126f
    ],
    [9.812718394465496e-1],
    [9.812722044982749e-1]
);
worst!(
    blinn_phong_4n_sharp,
    "blinn_phong_4n (sharp)",
    [
        0xbd93d475, 0xbebc2a70, 0x3f6d5de0, 0x00000000, 0xbf800000, 0x80000000, 0x3d595112, 0xbf3ad8d5,
        0xbf2e784a, 0x3a83126f
    ],
    [9.271656696342356e-1],
    [9.271660545860299e-1]
);
worst!(
    blinn_phong_matched_sharp,
    "blinn_phong_matched (sharp)",
    [
        0xbd93d475, 0xbebc2a70, 0x3f6d5de0, 0x00000000, 0xbf800000, 0x80000000, 0x3d595112, 0xbf3ad8d5,
        0xbf2e784a, 0x3a83126f
    ],
    [9.725903431996961e-1],
    [9.725907116007594e-1]
);
worst!(
    quarter_angle,
    "quarter_angle",
    [0x3f36b79b, 0x3f334e2e],
    [7.948222117012324e-1],
    [4.2637586029238053e-7]
);
worst!(one_minus_exp, "one_minus_exp", [0x3ea8f1a6], [2.810537144881129e-1], [3.304273077667007e-7]);
worst!(
    half_value_sine_squared,
    "half_value_sine_squared",
    [0x3db49d77],
    [9.99999850987154e-1],
    [5.9606224960617e-8]
);
worst!(half_value_angle, "half_value_angle", [0x4193cec0], [2.722108748408903e-1], [4.912656283233071e-7]);
worst!(
    distribution_cosine_power,
    "distribution_cosine_power",
    [0x3f6d7c16, 0x3e0ec40e, 0x3f21fed9],
    [9.536041984969952e-1],
    [3.827993769626389e-7]
);
worst!(
    distribution_gaussian,
    "distribution_gaussian",
    [0x3f72f596, 0x3dcb5622, 0x3ec196ba],
    [9.648183384422102e-1],
    [5.116972567098494e-7]
);
worst!(
    distribution_trowbridge_reitz,
    "distribution_trowbridge_reitz",
    [0x3e7b99ac, 0x4076d64d],
    [5.593563789242744e-1],
    [1.1032156097111503e-6]
);
worst!(
    geometric_attenuation,
    "geometric_attenuation",
    [0x33d6bf94, 0x00000000, 0x38d1b718, 0x33d6bf95],
    [1.9999999762585446e-3],
    [1.549720745763843e-9]
);
worst!(
    cosine_to_half,
    "cosine_to_half",
    [0xb9c6f725, 0xbb8140b0, 0x37cd0ada],
    [1.981383922735762e-3],
    [1.4171962185400214e-9]
);
worst!(
    torrance_sparrow_geometry,
    "torrance_sparrow_geometry",
    [
        0xbd4aaef6, 0xbf752c60, 0xbe9120de, 0x3e015148, 0x3e887264, 0xbf749d60, 0xbe0243da, 0xbe91ad43,
        0x3f733fb5, 0x43ed02bd
    ],
    [1.0579951504853895e2],
    [1.274458578281709e-3]
);
worst!(
    torrance_sparrow,
    "torrance_sparrow",
    [
        0x3ee73483, 0xbea21144, 0x3f558dfd, 0xbccc4dfb, 0xbf709ea0, 0xbeae5395, 0x3cdcb53f, 0x3f704290,
        0x3eb038dc, 0x43f093d1, 0x4003e4b8
    ],
    [4.4713271425429406e2],
    [2.2838791091637233e-2]
);
worst!(
    fresnel_dielectric,
    "fresnel_dielectric",
    [0x3f373156, 0x3f32d1ce],
    [9.980555196034677e-1],
    [1.946494995790569e-3]
);
worst!(
    fresnel_conductor,
    "fresnel_conductor",
    [0x80000000, 0x3f800000, 0x3efffffd, 0x40470a3d, 0x00000001, 0x00000000, 0x4053d70d],
    [2.802596928649634e-15, 1e0, 1e0],
    [1.0000008046631912e0, 5.304828576525896e-6, 6.039983641775071e-6]
);
worst!(
    fresnel_schlick,
    "fresnel_schlick",
    [0x3f5f679f, 0x3edaf63c, 0x3f001898, 0x3f0b97a7],
    [4.276790216568573e-1, 5.003919899997162e-1, 5.452979975210831e-1],
    [2.550307192117707e-8, 2.9835652206052515e-8, 3.251136311833644e-8]
);
worst!(
    transmitted_cosine,
    "transmitted_cosine",
    [0x3f2ad148, 0x3f2ad149],
    [4.2267719492567347e-4],
    [5.838624256510894e-4]
);
worst!(
    transmitted_direction,
    "transmitted_direction",
    [0x00000001, 0x00000000, 0x00000000, 0xbd93d478, 0xbebc2a72, 0x3f6d5ddf, 0x461c4000],
    [7.218259632819773e-2, 3.6751133508161216e-1, -9.272136169048918e-1],
    [1.4932621564253474e-7, 2.7254696760006455e-7, 5.060729574164297e-7]
);
worst!(
    transmitted_highlight_plain,
    "transmitted_highlight (plain)",
    [
        0x3e8ffabc, 0x3e3b45f0, 0xbf712ac1, 0x3ee43c27, 0x3eefc5b8, 0xbf434bc3, 0x3d820b3c, 0x3e84e010,
        0x3f76b199, 0x43800000, 0x3fe0945c
    ],
    [1.1542862916711649e-38],
    [1.176810002298131e-38]
);
worst!(
    transmitted_highlight_sharp,
    "transmitted_highlight (sharp)",
    [
        0xbd7b96d4, 0x3f21197a, 0xbf465510, 0xbee28a04, 0x3f517658, 0xbebbf3e7, 0x3ecec3cc, 0xbf5bf275,
        0x3ea0e3b3, 0x4681687b, 0x3f605b95
    ],
    [1.1705683023393792e-38],
    [1.1837388225302302e-38]
);
worst!(
    light_contribution_phong,
    "light_contribution (phong)",
    [
        0x3e428c28, 0x3f47e7fd, 0x3f554b69, 0x3eba2598, 0x4600a40e, 0x411d06be, 0x43800000, 0x3fc00000,
        0xbf7fa23f, 0xbcbd13c0, 0x3d458f94, 0x3e4b5862, 0x3f23b682, 0xbf75c193, 0xbe4808f0, 0xbe4d7c84,
        0xbf54ffc0, 0xbeb2e7c4, 0xbedc988b
    ],
    [
        8.771794621046403e-3,
        8.164361050390739e2,
        1.0384113113663103e0,
        7.784240748222531e2,
        9.900644512733756e-1,
        8.363393130552541e-3,
        1.0384110951396817e0,
        8.771792794510465e-3,
        8.164359350339664e2
    ],
    [
        1.5685191072904593e-9,
        1.4599015206797253e-4,
        1.856824120342094e-7,
        3.2760986868703856e-4,
        4.166814662655947e-7,
        3.519842479054928e-9,
        2.7992625429647505e-4,
        2.364627180819778e-6,
        2.2008803087408868e-1
    ]
);
worst!(
    light_contribution_torrance_sparrow,
    "light_contribution (torrance-sparrow)",
    [
        0x3e428c28, 0x3f47e7fd, 0x3f554b69, 0x3eba2598, 0x4600a40e, 0x411d06be, 0x43800000, 0x3fc00000,
        0xbf7fa23f, 0xbcbd13c0, 0x3d458f94, 0x3e4b5862, 0x3f23b682, 0xbf75c193, 0xbe4808f0, 0xbe4d7c84,
        0xbf54ffc0, 0xbeb2e7c4, 0xbedc988b
    ],
    [
        8.771794621046403e-3,
        8.164361050390739e2,
        1.0384113113663103e0,
        7.784240748222531e2,
        9.900644512733756e-1,
        8.363393130552541e-3,
        4.373249624343845e-2,
        3.6942247365196715e-4,
        3.4384052355563746e1
    ],
    [
        1.5685191072904593e-9,
        1.4599015206797253e-4,
        1.856824120342094e-7,
        3.2760986868703856e-4,
        4.166814662655947e-7,
        3.519842479054928e-9,
        4.94770385693275e-7,
        4.179484718985631e-9,
        3.890061694846088e-4
    ]
);
worst!(
    fog_linear,
    "fog_linear",
    [0x420e8245, 0x420ea1eb, 0x420e8247],
    [9.997531473710195e-1],
    [5.969292615496415e-8]
);
worst!(
    fog_fraction,
    "fog_fraction",
    [0x41674dce, 0x43895d3a, 0x423e0e98],
    [1.2701242199387924e-1],
    [5.299371206505028e-8]
);
worst!(
    fog_exponential,
    "fog_exponential",
    [0x3f636d86, 0x3d523624],
    [9.554305466924834e-1],
    [3.572673350838659e-7]
);
worst!(
    fog_exponential_squared,
    "fog_exponential_squared",
    [0x3bab1554, 0x422b706d],
    [9.511586805501934e-1],
    [3.628720430957129e-7]
);
worst!(
    fog_depth_cue,
    "fog_depth_cue",
    [0x41b2cffd, 0x41b3853c, 0x3f0511c0, 0x3dc43508, 0x41b2d296],
    [5.137252696536914e-1],
    [9.475889204611888e-8]
);
worst!(
    apply_fog,
    "apply_fog",
    [0x3f7fffff, 0x3f800001, 0x3f800000, 0x461c4000, 0x3f800000, 0x3f000001, 0x461c3fff],
    [1.0000001192092824e0, 9.999999701976812e-1, 9.999999999999942e3],
    [1.192093073143488e-7, 1.1920928777442505e-7, 1.1920929310349389e-3]
);
