//! Checks that every file of `shaders/optics` compiles under every feature it knows and passes naga's validator,
//! contains nothing that its features did not ask for, and takes its arguments in the order of its Rust twin.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use lumbre_optics::{FogMode, ReflectionModel};
use lumbre_shaders::{Kept, Program, UnnamedFeatures};

fn shaders() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shaders")
}

/// The names of the shader files without their extension, in alphabetical order.
fn stems() -> Vec<String> {
    let mut stems: Vec<String> = std::fs::read_dir(shaders().join("optics"))
        .expect("shaders/optics is part of the source")
        .map(|entry| entry.expect("a readable entry").path())
        .inspect(|path| {
            assert_eq!(path.extension().and_then(|e| e.to_str()), Some("wesl"), "{}", path.display())
        })
        .map(|path| path.file_stem().expect("a name").to_string_lossy().into_owned())
        .collect();
    stems.sort();
    stems
}

/// Compiles one file and everything that it imports to WGSL.
fn compile(stem: &str, features: &[&str]) -> String {
    kept(stem, features, Kept::RootModule)
}

fn kept(stem: &str, features: &[&str], kept: Kept<'_>) -> String {
    let modules: Vec<_> =
        lumbre_shaders::MODULES.iter().map(|(path, source)| (*path, Cow::Borrowed(*source))).collect();
    let on: Vec<_> = features.iter().map(|feature| (*feature, true)).collect();
    let root = &format!("optics/{stem}");
    let program = Program { modules: &modules, root, features: &on, unnamed: UnnamedFeatures::AreOff, kept };
    program.to_wgsl().unwrap_or_else(|error| panic!("{stem} with {features:?}: {error}"))
}

fn validate(name: &str, source: &str) {
    let module = naga::front::wgsl::parse_str(source)
        .unwrap_or_else(|error| panic!("{name}: {}\n{source}", error.emit_to_string(source)));
    let mut validator =
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty());
    validator.validate(&module).unwrap_or_else(|error| panic!("{name}: {error:?}\n{source}"));
}

fn reflection_features() -> Vec<&'static str> {
    ReflectionModel::ALL.iter().map(|model| model.shader_feature()).collect()
}

fn fog_features() -> Vec<&'static str> {
    let modes = [
        FogMode::Linear { start: 0.0, end: 1.0 },
        FogMode::Exponential { density: 1.0 },
        FogMode::ExponentialSquared { density: 1.0 },
        FogMode::DepthCue { start: 0.0, end: 1.0, near_weight: 1.0, far_weight: 0.0 },
    ];
    modes.iter().map(FogMode::shader_feature).collect()
}

/// The kinds of light that `evaluate_light` can be compiled for.
const LIGHT_FEATURES: [&str; 4] = ["AMBIENT_LIGHTS", "DIRECTIONAL_LIGHTS", "POINT_LIGHTS", "SPOT_LIGHTS"];

#[test]
fn every_set_of_light_kinds_compiles_and_holds_nothing_else() {
    for set in 0..1u32 << LIGHT_FEATURES.len() {
        let features: Vec<&str> = (0..LIGHT_FEATURES.len())
            .filter(|bit| set >> bit & 1 == 1)
            .map(|bit| LIGHT_FEATURES[bit])
            .collect();
        let source = kept("evaluate_light", &features, Kept::Declarations(&["evaluate_light"]));
        validate(&format!("evaluate_light {features:?}"), &source);
        for (function, feature) in [("attenuate", "POINT_LIGHTS"), ("spot_factor", "SPOT_LIGHTS")] {
            assert_eq!(source.contains(function), features.contains(&feature), "{features:?}\n{source}");
        }
    }
}

#[test]
fn every_file_compiles_and_validates_for_each_feature() {
    let stems = stems();
    assert!(stems.len() >= 17, "{stems:?}");
    for stem in stems {
        let choices = match stem.as_str() {
            "shade" | "polygon_light" => reflection_features(),
            "fog" => fog_features(),
            "evaluate_light" => LIGHT_FEATURES.to_vec(),
            _ => vec![""],
        };
        for choice in choices {
            for sharp in ["", "SHARP_HIGHLIGHTS"] {
                validate(&format!("{stem} {choice} {sharp}"), &compile(&stem, &[choice, sharp]));
            }
        }
    }
}

#[test]
fn a_shade_variant_holds_no_other_models_functions() {
    let functions: BTreeMap<&str, &[&str]> = BTreeMap::from([
        ("REFLECTION_PHONG", &["reflected_direction"][..]),
        ("REFLECTION_BLINN", &["half_vector"][..]),
        ("REFLECTION_BLINN_4N", &["blinn_phong_4n"][..]),
        ("REFLECTION_BLINN_MATCHED", &["blinn_phong_matched"][..]),
        ("REFLECTION_TORRANCE_SPARROW", &["fresnel_dielectric", "geometric_attenuation"][..]),
    ]);
    for feature in reflection_features() {
        let source = stripped_shade(&[feature]);
        for own in functions[feature] {
            assert!(source.contains(own), "{feature} lacks {own}");
        }
        // The half vector is shared by Blinn's three models; everything else belongs to one model only.
        for foreign in
            ["reflected_direction", "blinn_phong_4n", "blinn_phong_matched", "fresnel", "geometric"]
        {
            let owned = functions[feature].iter().any(|own| own.starts_with(foreign));
            assert_eq!(source.contains(foreign), owned, "{feature}: {foreign}\n{source}");
        }
        assert!(!source.contains("power_of_cosine("), "{feature} pays for sharp highlights\n{source}");
    }
}

/// `shade` compiled with these features, without what `light_contribution` does not reach.
fn stripped_shade(features: &[&str]) -> String {
    kept("shade", features, Kept::Declarations(&["light_contribution"]))
}

#[test]
fn a_microfacet_variant_holds_its_own_choices_only() {
    let distributions = [
        ("", "distribution_trowbridge_reitz"),
        ("DISTRIBUTION_COSINE_POWER", "distribution_cosine_power"),
        ("DISTRIBUTION_GAUSSIAN", "distribution_gaussian"),
    ];
    let fresnels = [
        ("", "fresnel_dielectric"),
        ("FRESNEL_CONDUCTOR", "fresnel_conductor"),
        ("FRESNEL_NORMAL_REFLECTANCE", "fresnel_normal_reflectance"),
    ];
    for (distribution, own_distribution) in distributions {
        for (fresnel, own_fresnel) in fresnels {
            let features = ["REFLECTION_TORRANCE_SPARROW", "MICROFACETS", distribution, fresnel];
            let source = stripped_shade(&features);
            validate(&format!("shade {features:?}"), &source);
            for (_, function) in distributions {
                assert_eq!(
                    source.contains(function),
                    function == own_distribution,
                    "{features:?}: {function}"
                );
            }
            for (_, function) in fresnels {
                // The reflectance at normal incidence calls the dielectric's.
                let called = fresnel == "FRESNEL_NORMAL_REFLECTANCE" && function == "fresnel_dielectric";
                let own = function == own_fresnel || called;
                assert_eq!(source.contains(function), own, "{features:?}: {function}");
            }
        }
    }
    // A matt surface contains no model at all.
    for model in reflection_features() {
        let matt = stripped_shade(&[model, "MICROFACETS", "MATT"]);
        validate(&format!("matt shade, {model}"), &matt);
        for foreign in ["phong", "half", "fresnel", "microfacet_lobe", "pow("] {
            assert!(!matt.contains(foreign), "{model}: {foreign}\n{matt}");
        }
    }
    // With the default choices the plain model is compiled.
    let plain = stripped_shade(&["REFLECTION_TORRANCE_SPARROW"]);
    for foreign in ["microfacet_lobe", "conductor", "absorption", "gaussian"] {
        assert!(!plain.contains(foreign), "{foreign}\n{plain}");
    }
}

/// Returns the text up to the bracket that closes the one opened before it, without the contents of inner brackets.
fn up_to_its_bracket(text: &str) -> Option<String> {
    let mut depth = 0;
    let mut outer = String::new();
    for character in text.chars() {
        match character {
            '(' => depth += 1,
            ')' if depth == 0 => return Some(outer),
            ')' => depth -= 1,
            _ if depth == 0 => outer.push(character),
            _ => {}
        }
    }
    None
}

/// The functions of a source file and the names of their arguments.
fn signatures(source: &str) -> BTreeMap<String, Vec<String>> {
    let mut found = BTreeMap::new();
    // Tests come last in every file and have no twins.
    let source = source.split("#[cfg(test)]").next().unwrap_or_default();
    for piece in source.split("fn ").skip(1) {
        let Some((name, rest)) = piece.split_once('(') else { continue };
        let Some(arguments) = up_to_its_bracket(rest) else { continue };
        if !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
            continue;
        }
        let names = arguments
            .split(',')
            .filter_map(|argument| argument.split_once(':').map(|(name, _)| name.trim().to_owned()))
            .collect();
        found.insert(name.to_owned(), names);
    }
    found
}

#[test]
fn twins_have_the_same_names_and_arguments() {
    // Choices that Rust takes as arguments and WESL as features or in a struct.
    let choices = [
        "model",
        "mode",
        "lobe",
        "parameters",
        "light_position",
        "light_axis",
        "kind",
        "distribution",
        "eta",
        "absorption",
    ];
    // Helpers of a public twin that in f64 are a library function, a closure or an operator.
    let helpers = [
        "is_point_light",
        "squared_length",
        "logarithm_of_one_minus",
        "one_minus_exp",
        "fog_fraction",
        "fresnel_conductor_channel",
        "fresnel_normal_reflectance_channel",
    ];
    let mut twins = 0;
    for stem in stems() {
        let read = |path: PathBuf| {
            std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
        };
        let shader = signatures(&read(shaders().join("optics").join(format!("{stem}.wesl"))));
        let rust = signatures(&read(Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("src/{stem}.rs"))));
        for (name, arguments) in shader {
            if helpers.contains(&name.as_str()) {
                continue;
            }
            let twin = rust.get(&name).unwrap_or_else(|| panic!("{stem}.rs has no {name}"));
            let plain = |names: &[String]| -> Vec<String> {
                names.iter().filter(|name| !choices.contains(&name.as_str())).cloned().collect()
            };
            assert_eq!(plain(&arguments), plain(twin), "{stem}: {name}");
            twins += 1;
        }
    }
    assert!(twins >= 40, "only {twins} twins were found: the reader of signatures is broken");
}
