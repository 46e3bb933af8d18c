//! For each function the input that came nearest to its bound, as printed by `LUMBRE_TWIN_WORST=1`: its exact bits,
//! the correct result, and the bound at that time.

#![allow(clippy::approx_constant, reason = "expected values are what they are")]

use crate::regressions::got;
use crate::twin;

/// Checks that device and twin give the expected results, and that the bound has not become wider.
fn holds(name: &str, bits: &str, expected: &[f64], bound: &[f64]) {
    let input: Vec<f32> =
        bits.split(' ').map(|bits| f32::from_bits(u32::from_str_radix(bits, 16).unwrap())).collect();
    let (asked, allowed) = twin(name).asked(&input);
    let within = |values: &[f64], expected: &[f64], bound: &dyn Fn(usize) -> f64| {
        values
            .iter()
            .zip(expected)
            .enumerate()
            .all(|(at, (value, expected))| (value - expected).abs() <= bound(at))
    };
    // Other math libraries round the last bits of a power differently.
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
    ($test:ident, $name:literal, $bits:literal, [$($expected:expr),*], [$($bound:expr),*]) => {
        #[test]
        fn $test() {
            holds($name, $bits, &[$($expected),*], &[$($bound),*]);
        }
    };
}

worst!(
    squared_length,
    "squared_length",
    "4f352d04 4d1341b3 cd30d389",
    [9.297549085610506e18],
    [1.6625313315887163e12]
);
worst!(
    safe_normalize,
    "safe_normalize",
    "b20643e4 311c096c 2e9dd3f2",
    [-9.602533656991561e-1, 2.7899051450374973e-1, 8.8185305111355e-3],
    [4.0064892529810027e-7, 1.1640391358889629e-7, 3.6793776499002278e-9]
);
worst!(
    shading_normal,
    "shading_normal",
    "35532eba 3515f820 b506ef70 bf517819 be970814 3efca271",
    [7.230905925436263e-1, 5.134958256899137e-1, -4.620195147111661e-1],
    [3.0169690536292694e-7, 2.1424715398725247e-7, 1.9276956337560194e-7]
);
worst!(
    viewer_direction,
    "viewer_direction",
    "3f800000 425839a0 c383166e c20ba794 beca2b87 be87f8a0 bf612840 bfc59819 3e99ce7c 3e395562",
    [2.0548034612329635e-1, -9.700288705805863e-1, -1.296989498693124e-1],
    [1.1022824735103054e-7, 5.203640362754629e-7, 6.957593851231406e-8]
);
worst!(
    add_emission,
    "add_emission",
    "3af736de 423acbd8 3c6bff13 388c92b0 388a94b9 44a22014",
    [1.9531260477378964e-3, 4.669913224265474e1, 1.2970168454824015e3],
    [1.1641538427697995e-10, 2.783485188642427e-6, 7.730822834267626e-5]
);
worst!(
    exitance,
    "exitance",
    "45ad3160 3d869aa0 45a2fc9d",
    [1.7411246447431968e4, 2.064799559646713e-1, 1.6385217319781263e4],
    [1.5566867393939465e-3, 1.84607466427688e-8, 1.4649525868697102e-3]
);
worst!(
    half_vector,
    "half_vector",
    "bf3f8176 3f20f992 be5934ba be8c5c0a bf755a24 3da29b6f",
    [-9.445642958965498e-1, -3.0456301824391047e-1, -1.2263628678174644e-1],
    [5.067037739198773e-7, 1.6338033462734187e-7, 6.578723079179036e-8]
);
worst!(
    lambert,
    "lambert",
    "bf45334d 3f233d00 3b903f61 be2cebc9 3e4ba078 bf772288",
    [2.526312684899572e-1],
    [4.6693782618243205e-8]
);
worst!(
    reflected_direction,
    "reflected_direction",
    "3d235f7a bacb2000 bf7fcbc5 3ef596bc bf0222be bf37173d",
    [-4.2106930490955946e-1, 5.060659349343859e-1, -7.527269603618494e-1],
    [3.9068140586406416e-8, 3.070668518777915e-8, 3.948466869554712e-7]
);
worst!(
    attenuate,
    "attenuate",
    "40cc39bb 3ac6efdb 3e0ad41b 00000000 7149f2ca 42770369",
    [1.9102689202664584e-3],
    [1.4801917054333662e-9]
);
worst!(
    spot_factor_exponent,
    "spot_factor (exponent)",
    "00000000 3eedad84 42f62bee 3efbd52f",
    [1.1753198106921113e-38],
    [1.1755729096235074e-38]
);
worst!(
    spot_factor_smooth,
    "spot_factor (smooth)",
    "3f800000 3efffffd 3f800000 3f7fffff",
    [9.999997615814777e-1],
    [8.940694584680895e-7]
);
worst!(
    evaluate_light_directional,
    "evaluate_light (directional)",
    "7149f2ca bf9e02db 3ff81ee2 3f8544ec bf422452 bf1da1f4 be5af9b2 3f30f1f6 3f663fc0 3eb12296 3d7bebf3 42678390 bfa944ea 3feefae8 3f81a66e",
    [7.583666906371076e-1, 6.157524477329035e-1, 2.1384313326141566e-1, 1e0, 1e0],
    [3.164152404343935e-7, 2.5691194141687895e-7, 8.92223079699224e-8, 0e0, 0e0]
);
worst!(
    evaluate_light_directional_spot,
    "evaluate_light (directional spot)",
    "7149f2ca bf9e02db 3ff81ee2 3f8544ec bf422452 bf1da1f4 be5af9b2 3f30f1f6 3f663fc0 3eb12296 3d7bebf3 42678390 bfa944ea 3feefae8 3f81a66e",
    [7.583666906371076e-1, 6.157524477329035e-1, 2.1384313326141566e-1, 1e0, 1e0],
    [3.164152404343935e-7, 2.5691194141687895e-7, 8.92223079699224e-8, 0e0, 5.398539372376215e-5]
);
worst!(
    evaluate_light_point,
    "evaluate_light (point)",
    "41453c9d 40f7f2f1 40dca9d3 3f6e06ea bdd56a1f 3f7b230e be278d1e 3e99487c 3f013b5b 3d503f23 3f61002e 420e1394 4120a760 41785ecc 4050abac",
    [-2.484769715056077e-1, -9.351160894045416e-1, -2.526204543740645e-1, 9.055012605645802e-3, 1e0],
    [1.3329343459310945e-7, 5.016353609943911e-7, 1.35516172013675e-7, 3.8723559447967024e-8, 0e0]
);
worst!(
    evaluate_light_spot_exponent,
    "evaluate_light (spot, exponent)",
    "7149f2ca c09a6625 bfe23e58 c050975d 3d7e4348 bf7f7038 3cbc8712 3ea19adc 3f2e57f3 3ef4fe02 3f6def74 42e71633 c09a17a0 bfe58807 c05389d0",
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
    "41c0a2f6 41922704 409f1d64 4031ac2f be76883e bf78387a 3d3217dd 3f4133aa 3f06cd95 3f04b6d9 3f36e56b 3f4c1990 418be6fc c2001ff2 c0889536",
    [2.0736316541287686e-2, 9.821465784020347e-1, 1.869708632634388e-1, 0e0, 1e0],
    [
        1.1123827032541583e-8,
        5.268644813071675e-7,
        1.0029898699348863e-7,
        4.380153166411959e-9,
        3.333552895024578e-5
    ]
);
worst!(safe_pow, "safe_pow", "3f23f7bc 43440a25", [1.1747186570513301e-38], [1.1756122973091177e-38]);
worst!(
    logarithm_of_one_minus,
    "logarithm_of_one_minus",
    "3e7e3aab",
    [-2.8537896070418367e-1],
    [5.165580160804435e-7]
);
worst!(
    power_of_cosine,
    "power_of_cosine",
    "3f800000 3e7ffffe 43000003",
    [1.0090649052851769e-8],
    [4.1787472686613614e-13]
);
worst!(
    filtered_lobe,
    "filtered_lobe",
    "40c129a3 3f800000 3c61ceef",
    [5.614638782128988e0, 9.475265838600488e-1],
    [5.973552568670202e-6, 1.1295397089243518e-6]
);
worst!(lobe_widening, "lobe_widening", "3516d330 34d25b3a", [2.384214923267791e-7], [2.842205671391238e-14]);
worst!(
    shininess_from_roughness,
    "shininess_from_roughness",
    "3f373d25",
    [5.619380577142987e0],
    [4.087354254382067e-6]
);
worst!(
    cosine_lobe_plain,
    "cosine_lobe (plain)",
    "3f6fe54b 3e1a1d30 bea143e8 3f3d472f 3f17142a 3ea5f3b7 43622400",
    [1.1572857286060549e-38],
    [1.1756829346503662e-38]
);
worst!(
    phong_plain,
    "phong (plain)",
    "bf255975 3d87f2a0 3f42b258 3dea32dd 3d6e65c0 3f7de240 bdee7163 3f24cb72 3f419fce 42480000",
    [1.1740866128156323e-38],
    [1.1756753200151764e-38]
);
worst!(
    blinn_phong_plain,
    "blinn_phong (plain)",
    "bd93d476 bebc2a70 3f6d5de1 3f13cd37 3f13cd3b 3f13cd3a 3f1e343f 3f48c3bc 3d62db90 3a83126f",
    [9.828925815185072e-1],
    [9.828929459384552e-1]
);
worst!(
    blinn_phong_4n_plain,
    "blinn_phong_4n (plain)",
    "bd93d476 bebc2a70 3f6d5de1 3f13cd37 3f13cd3b 3f13cd3a 3f1e343f 3f48c3bc 3d62db90 3a83126f",
    [9.333063674425623e-1],
    [9.333067502541926e-1]
);
worst!(
    blinn_phong_matched_plain,
    "blinn_phong_matched (plain)",
    "bd93d476 bebc2a70 3f6d5de1 3f13cd37 3f13cd3b 3f13cd3a 3f1e343f 3f48c3bc 3d62db90 3a83126f",
    [9.807599620425956e-1],
    [9.807603272934313e-1]
);
worst!(
    cosine_lobe_sharp,
    "cosine_lobe (sharp)",
    "bec1c885 bdca4560 3f6b9a59 bc1ef7c0 bdc27181 3f7ed4db 44949e61",
    [1.1697508121571803e-38],
    [1.175638796551547e-38]
);
worst!(
    phong_sharp,
    "phong (sharp)",
    "bf42af17 bf190c9c be81c536 bf134f7d bf0d4716 bf1a84f5 bf27c3e2 bee39c4c bf1c5498 43759e48",
    [1.1705239319747051e-38],
    [1.1758815100567108e-38]
);
worst!(
    blinn_phong_sharp,
    "blinn_phong (sharp)",
    "bd93d475 bebc2a70 3f6d5de0 00000000 bf800000 80000000 3d595112 bf3ad8d5 bf2e784a 3a83126f",
    [9.812718394465496e-1],
    [9.812722044982749e-1]
);
worst!(
    blinn_phong_4n_sharp,
    "blinn_phong_4n (sharp)",
    "bd93d475 bebc2a70 3f6d5de0 00000000 bf800000 80000000 3d595112 bf3ad8d5 bf2e784a 3a83126f",
    [9.271656696342356e-1],
    [9.271660545860299e-1]
);
worst!(
    blinn_phong_matched_sharp,
    "blinn_phong_matched (sharp)",
    "bd93d475 bebc2a70 3f6d5de0 00000000 bf800000 80000000 3d595112 bf3ad8d5 bf2e784a 3a83126f",
    [9.725903431996961e-1],
    [9.725907116007594e-1]
);
worst!(quarter_angle, "quarter_angle", "3f36b79b 3f334e2e", [7.948222117012324e-1], [4.2637586029238053e-7]);
worst!(one_minus_exp, "one_minus_exp", "3ea8f1a6", [2.810537144881129e-1], [3.304273077667007e-7]);
worst!(
    half_value_sine_squared,
    "half_value_sine_squared",
    "3db49d77",
    [9.99999850987154e-1],
    [5.9606224960617e-8]
);
worst!(half_value_angle, "half_value_angle", "4193cec0", [2.722108748408903e-1], [4.912656283233071e-7]);
worst!(
    distribution_cosine_power,
    "distribution_cosine_power",
    "3f6d7c16 3e0ec40e 3f21fed9",
    [9.536041984969952e-1],
    [3.827993769626389e-7]
);
worst!(
    distribution_gaussian,
    "distribution_gaussian",
    "3f72f596 3dcb5622 3ec196ba",
    [9.648183384422102e-1],
    [5.116972567098494e-7]
);
worst!(
    distribution_trowbridge_reitz,
    "distribution_trowbridge_reitz",
    "3e7b99ac 4076d64d",
    [5.593563789242744e-1],
    [1.1032156097111503e-6]
);
worst!(
    geometric_attenuation,
    "geometric_attenuation",
    "33d6bf94 00000000 38d1b718 33d6bf95",
    [1.9999999762585446e-3],
    [1.549720745763843e-9]
);
worst!(
    cosine_to_half,
    "cosine_to_half",
    "b9c6f725 bb8140b0 37cd0ada",
    [1.981383922735762e-3],
    [1.4171962185400214e-9]
);
worst!(
    torrance_sparrow_geometry,
    "torrance_sparrow_geometry",
    "bd4aaef6 bf752c60 be9120de 3e015148 3e887264 bf749d60 be0243da be91ad43 3f733fb5 43ed02bd",
    [1.0579951504853895e2],
    [1.274458578281709e-3]
);
worst!(
    torrance_sparrow,
    "torrance_sparrow",
    "3ee73483 bea21144 3f558dfd bccc4dfb bf709ea0 beae5395 3cdcb53f 3f704290 3eb038dc 43f093d1 4003e4b8",
    [4.4713271425429406e2],
    [2.286542050195736e-2]
);
worst!(
    microfacet_lobe_cosine_power,
    "microfacet_lobe (cosine-power)",
    "00000000 3f800003 80000002 3f13cd3a 3f13cd3a 3f13cd39 00000002 00000000 80000001 43000001",
    [6.72600844367153e-31],
    [1.1756052701250808e-30]
);
worst!(
    microfacet_lobe_gaussian,
    "microfacet_lobe (gaussian)",
    "bd93d477 bebc2a73 3f6d5de0 00000002 bf800002 00000001 80000002 00000000 00000000 43000003",
    [1.1596611058274369e-30],
    [1.1760009776523094e-30]
);
worst!(
    microfacet_lobe_trowbridge_reitz,
    "microfacet_lobe (trowbridge-reitz)",
    "bd4aaef6 bf752c60 be9120de 3e015148 3e887264 bf749d60 be0243da be91ad43 3f733fb5 43ed02bd",
    [1.0579951504853895e2],
    [1.274458578281709e-3]
);
worst!(
    microfacet_reflection_dielectric,
    "microfacet_reflection (dielectric)",
    "3f23f8a8 bf35466a be982af6 bececef2 3c87f280 bf6a2605 3ecfb5d7 bc97d6bd 3f69f075 407f85ad 3e903b30 40017a57",
    [2.026163235362087e2, 1.0130816176810436e2, 7.192587790135385e2],
    [1.4852592087861702e-2, 7.426296043930851e-3, 5.2724563667213425e-2]
);
worst!(
    microfacet_reflection_conductor,
    "microfacet_reflection (conductor)",
    "3f661150 be4d5578 3ec7b286 3e1fd6b0 bf2fa1dc bf35e9dd 3f2af1d6 3e642050 bf35d3e6 42ea0000 3e62716c 3fc1cf0d",
    [1.597179375620736e-7, 6.60394105550842e-8, 3.161185592629448e-7],
    [2.6171934239731207e-11, 1.083913124421718e-11, 5.2156335647737616e-11]
);
worst!(
    microfacet_reflection_normal_reflectance,
    "microfacet_reflection (normal-reflectance)",
    "3f23f8a8 bf35466a be982af6 bececef2 3c87f280 bf6a2605 3ecfb5d7 bc97d6bd 3f69f075 407f85ad 3e903b30 40017a57",
    [7.175937206682382e2, 7.190927255290275e2, 6.331952135144147e2],
    [5.263113762343353e-2, 5.272780774091328e-2, 6.9551845873079e-1]
);
worst!(
    fresnel_dielectric,
    "fresnel_dielectric",
    "3f373156 3f32d1ce",
    [9.980555196034677e-1],
    [1.946494995790569e-3]
);
worst!(
    fresnel_conductor,
    "fresnel_conductor",
    "80000000 3f800000 3efffffd 40470a3d 00000001 00000000 4053d70d",
    [2.802596928649634e-15, 1e0, 1e0],
    [1.0000008046631912e0, 5.304828576525896e-6, 6.039983641775071e-6]
);
worst!(
    fresnel_normal_reflectance,
    "fresnel_normal_reflectance",
    "3af19a00 3d179060 3bbc5d43 3f7fffbb",
    [9.892733975604114e-1, 9.855378387757058e-1, 9.023679319887205e-1],
    [9.73386422130745e-7, 9.863358211479153e-7, 7.173707244441294e-4]
);
worst!(
    fresnel_schlick,
    "fresnel_schlick",
    "3f5f679f 3edaf63c 3f001898 3f0b97a7",
    [4.276790216568573e-1, 5.003919899997162e-1, 5.452979975210831e-1],
    [2.550307192117707e-8, 2.9835652206052515e-8, 3.251136311833644e-8]
);
worst!(
    transmitted_cosine,
    "transmitted_cosine",
    "3f2ad148 3f2ad149",
    [4.2267719492567347e-4],
    [5.838624256510894e-4]
);
worst!(
    transmitted_direction,
    "transmitted_direction",
    "00000001 00000000 00000000 bd93d478 bebc2a72 3f6d5ddf 461c4000",
    [7.218259632819773e-2, 3.6751133508161216e-1, -9.272136169048918e-1],
    [1.4932621564253474e-7, 2.7254696760006455e-7, 5.060729574164297e-7]
);
worst!(
    transmitted_highlight_plain,
    "transmitted_highlight (plain)",
    "3e8ffabc 3e3b45f0 bf712ac1 3ee43c27 3eefc5b8 bf434bc3 3d820b3c 3e84e010 3f76b199 43800000 3fe0945c",
    [1.1542862916711649e-38],
    [1.176810002298131e-38]
);
worst!(
    transmitted_highlight_sharp,
    "transmitted_highlight (sharp)",
    "bd7b96d4 3f21197a bf465510 bee28a04 3f517658 bebbf3e7 3ecec3cc bf5bf275 3ea0e3b3 4681687b 3f605b95",
    [1.1705683023393792e-38],
    [1.1837388225302302e-38]
);
worst!(
    light_contribution_phong,
    "light_contribution (phong)",
    "3e428c28 3f47e7fd 3f554b69 3eba2598 4600a40e 411d06be 43800000 3fc00000 bf7fa23f bcbd13c0 3d458f94 3e4b5862 3f23b682 bf75c193 be4808f0 be4d7c84 bf54ffc0 beb2e7c4 bedc988b",
    [
        8.771794621046403e-3,
        8.164361050390739e2,
        1.0384113113663103e0,
        7.784240748222531e2,
        9.900644512733756e-1,
        8.363393130552541e-3,
        1.0384110951396817e0,
        8.771792794510463e-3,
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
    "3e428c28 3f47e7fd 3f554b69 3eba2598 4600a40e 411d06be 43800000 3fc00000 bf7fa23f bcbd13c0 3d458f94 3e4b5862 3f23b682 bf75c193 be4808f0 be4d7c84 bf54ffc0 beb2e7c4 bedc988b",
    [
        8.771794621046403e-3,
        8.164361050390739e2,
        1.0384113113663103e0,
        7.784240748222531e2,
        9.900644512733756e-1,
        8.363393130552541e-3,
        4.3732496243438446e-2,
        3.694224736519672e-4,
        3.4384052355563746e1
    ],
    [
        1.5685191072904593e-9,
        1.4599015206797253e-4,
        1.856824120342094e-7,
        3.2760986868703856e-4,
        4.166814662655947e-7,
        3.519842479054928e-9,
        4.973763232849862e-7,
        4.2014979126975506e-9,
        3.9105505080366164e-4
    ]
);
worst!(arc_excess, "arc_excess", "3f71b331", [5.426970463556644e-1], [2.7548814496544813e-7]);
worst!(
    polygon_form_factor,
    "polygon_form_factor",
    "00000000 00000000 00000000 80000002 80000001 3f800003 3f800000 80000001 00000000 3f800000 3f7ffffe 00000000 00000000 00000000 bf800002 00000003",
    [0e0],
    [2.000024e0]
);
worst!(
    fog_linear,
    "fog_linear",
    "420e8245 420ea1eb 420e8247",
    [9.997531473710195e-1],
    [5.969292615496415e-8]
);
worst!(
    fog_fraction,
    "fog_fraction",
    "41674dce 43895d3a 423e0e98",
    [1.2701242199387924e-1],
    [5.299371206505028e-8]
);
worst!(
    fog_exponential,
    "fog_exponential",
    "3f636d86 3d523624",
    [9.554305466924834e-1],
    [3.572673350838659e-7]
);
worst!(
    fog_exponential_squared,
    "fog_exponential_squared",
    "3bab1554 422b706d",
    [9.511586805501934e-1],
    [3.628720430957129e-7]
);
worst!(
    fog_depth_cue,
    "fog_depth_cue",
    "41b2cffd 41b3853c 3f0511c0 3dc43508 41b2d296",
    [5.137252696536914e-1],
    [9.475889204611888e-8]
);
worst!(
    apply_fog,
    "apply_fog",
    "3f7fffff 3f800001 3f800000 461c4000 3f800000 3f000001 461c3fff",
    [1.0000001192092824e0, 9.999999701976812e-1, 9.999999999999942e3],
    [1.192093073143488e-7, 1.1920928777442505e-7, 1.1920929310349389e-3]
);
worst!(
    phong_normalization,
    "phong_normalization",
    "447f8001",
    [5.120000305175781e2],
    [3.0517579943989404e-5]
);
worst!(
    blinn_phong_normalization,
    "blinn_phong_normalization",
    "41f4176f",
    [4.5967010119712395e0],
    [2.4658779621704407e-6]
);
worst!(
    normalized_phong_plain,
    "normalized_phong (plain)",
    "2 3f800003 0 0 3f800000 0 bc1cf720 3f7ffcfe b991a84c 43800000",
    [1.2749199548959072e2],
    [8.212280835868546e-2]
);
worst!(
    normalized_blinn_phong_plain,
    "normalized_blinn_phong (plain)",
    "bd93d478 bebc2a6f 3f6d5de0 80000001 bf800002 80000003 3d595115 bf3ad8d5 bf2e784a 3a83126f",
    [3.611614693828435e-1],
    [3.6116246426652615e-1]
);
worst!(
    normalized_phong_sharp,
    "normalized_phong (sharp)",
    "3f7368b7 3e194198 be8ada7a 3f65e552 3e69e6b8 bec08156 3f7d2b15 3e0dac7b 3d5b0010 45538000",
    [1.9167955835568595e-35],
    [3.962100539768824e-35]
);
worst!(
    normalized_blinn_phong_sharp,
    "normalized_blinn_phong (sharp)",
    "bd93d475 bebc2a70 3f6d5de0 0 bf800000 80000000 3d595112 bf3ad8d5 bf2e784a 3a83126f",
    [3.6066329016556037e-1],
    [3.606642840558283e-1]
);
worst!(
    ambient_cube,
    "ambient_cube",
    "bf4a9803 bd94ffe0 3f1b62dd 3771d981 41d00d73 3d9fd2c7 3c822995 3b043e17 4100948a 3d602d56 3c822995 3c090e0b 3a263599 3a088296 3c822995",
    [1.9520553788961312e-1, 1.0277763321900961e3, 3.106311253442415e0],
    [1.512570376732928e-7, 7.963831614536792e-4, 2.406957524702036e-6]
);
worst!(
    probe_grid_cell,
    "probe_grid_cell",
    "4594511c c3168bcb 40319f85 bd748945 c0609499 c2243138 438f6ca4 c0d278c0 42fee1e8 41e80000 44130000 41c80000",
    [3.498471993698331e0, 5.216993968266288e2, 1.3518011608604866e1],
    [6.970155689381679e-5, 9.880708179558486e-5, 3.0262998900468067e-5]
);
worst!(
    probe_grid_texel,
    "probe_grid_texel",
    "3f800000 40100000 3f000002 45000000 3f7fffff 3f800001 3fffffff 3f7ffffe",
    [4.8828125e-4, 1.6250000670552294e0, 8.333333134651161e-1],
    [2.3283064365386963e-10, 7.748604140545031e-7, 3.973642890286999e-7]
);
