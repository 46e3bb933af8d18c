//! Checks that every lighting function has a twin in the table.

use std::collections::BTreeSet;

/// Functions that are in the table under another name or not at all, and why.
const ELSEWHERE: &[(&str, &str)] = &[
    ("fresnel_conductor_channel", "three times in fresnel_conductor"),
    ("fresnel_normal_reflectance_channel", "three times in fresnel_normal_reflectance"),
    ("is_point_light", "in every evaluate_light"),
    ("specular_reflection", "in every light_contribution; its microfacets are microfacet_reflection"),
    ("model_exponent", "a power of two, in every light_contribution"),
    ("contour_term", "five times in polygon_form_factor"),
    ("polygon_light_contribution", "polygon_form_factor, and polygon_highlight"),
    (
        "polygon_highlight",
        "a sum of light_contribution over points; against its f64 twin in lumbre_optics and in frames",
    ),
    ("lobe_width", "where polygon_highlight puts its points"),
    ("lobe_axis", "where polygon_highlight puts its points"),
    ("axis_sample", "where polygon_highlight puts its points"),
];

#[test]
fn every_function_of_the_shaders_is_in_the_table() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../shaders/optics");
    let mut functions = BTreeSet::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let text = std::fs::read_to_string(entry.unwrap().path()).unwrap();
        let names = text.lines().filter_map(|line| line.strip_prefix("fn ")?.split('(').next());
        functions.extend(names.map(str::to_owned));
    }
    assert!(functions.len() >= 50, "only {} functions were found", functions.len());
    // A name may be followed by a case in brackets.
    let in_table: BTreeSet<&str> =
        crate::all().iter().map(|twin| twin.name.split(' ').next().unwrap_or_default()).collect();
    let missing: Vec<&String> = functions
        .iter()
        .filter(|name| !in_table.contains(name.as_str()))
        .filter(|name| ELSEWHERE.iter().all(|(other, _)| other != name))
        .collect();
    assert!(missing.is_empty(), "shaders/optics has functions without a twin in the table: {missing:?}");
    let gone: Vec<_> = ELSEWHERE.iter().filter(|(name, _)| !functions.contains(*name)).collect();
    assert!(gone.is_empty(), "these are excused and do not exist: {gone:?}");
}
