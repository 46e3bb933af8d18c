//! Checks the architecture: crates depend downwards only, modules within a crate too, and only one version each of
//! wgpu, winit and glam is built.

mod module_circles;

use std::collections::BTreeSet;

use cargo_metadata::{DependencyKind, Metadata, MetadataCommand, Package};

/// Each crate with those of our crates that it may use, and the external crates that it must never use, from the
/// lowest crate up.
const ROOMS: &[(&str, &[&str], &[&str])] = &[
    ("lumbre_optics", &[], &["wgpu", "gltf", "image", "winit"]),
    ("lumbre_mesh", &[], &["wgpu", "bevy_ecs", "gltf", "winit"]),
    ("lumbre_rays", &[], &["wgpu", "bevy_ecs", "gltf", "winit"]),
    ("lumbre_scene", &["lumbre_optics", "lumbre_mesh"], &["wgpu", "winit"]),
    ("lumbre_graph", &[], &["bevy_ecs", "gltf", "winit", "glam"]),
    ("lumbre_shaders", &[], &["wgpu", "bevy_ecs", "gltf", "winit", "glam"]),
    (
        "lumbre_render",
        &["lumbre_optics", "lumbre_mesh", "lumbre_scene", "lumbre_graph", "lumbre_shaders"],
        &["winit"],
    ),
    ("lumbre_bake", &["lumbre_optics", "lumbre_mesh", "lumbre_rays", "lumbre_scene"], &["wgpu", "winit"]),
    ("lumbre_trace", &["lumbre_optics", "lumbre_mesh", "lumbre_rays", "lumbre_scene"], &["wgpu", "winit"]),
    (
        "lumbre_cost",
        &[
            "lumbre_optics",
            "lumbre_mesh",
            "lumbre_rays",
            "lumbre_scene",
            "lumbre_graph",
            "lumbre_render",
            "lumbre_bake",
            "lumbre_trace",
        ],
        &["winit"],
    ),
    (
        "lumbre_demo",
        &[
            "lumbre_optics",
            "lumbre_mesh",
            "lumbre_rays",
            "lumbre_scene",
            "lumbre_graph",
            "lumbre_render",
            "lumbre_bake",
            "lumbre_cost",
        ],
        &["clap"],
    ),
];

fn metadata() -> Metadata {
    MetadataCommand::new()
        .manifest_path(concat!(env!("CARGO_MANIFEST_DIR"), "/../Cargo.toml"))
        .other_options(vec!["--offline".into(), "--locked".into()])
        .exec()
        .expect("cargo metadata answers")
}

/// Names of the packages that a package needs to be built, without development dependencies.
fn needs(package: &Package) -> BTreeSet<&str> {
    let shipped = package.dependencies.iter().filter(|needed| needed.kind != DependencyKind::Development);
    shipped.map(|needed| needed.name.as_str()).collect()
}

/// Returns what is wrong with the dependencies of a crate with that name.
fn faults(name: &str, needs: &BTreeSet<&str>) -> Vec<String> {
    let Some((_, may, never)) = ROOMS.iter().find(|(room, ..)| *room == name) else {
        return vec![format!("{name} has no place in the plan of the house: give it one in ROOMS")];
    };
    let upwards = needs
        .iter()
        .filter(|needed| needed.starts_with("lumbre") && !may.contains(needed))
        .map(|needed| format!("{name} uses {needed}, which is not below it"));
    let forbidden = never
        .iter()
        .filter(|never| needs.contains(*never))
        .map(|never| format!("{name} must never use {never}"));
    upwards.chain(forbidden).collect()
}

#[test]
fn crates_depend_downwards_only() {
    let metadata = metadata();
    let ours = metadata.workspace_packages();
    assert!(ours.len() >= 10, "only {} packages found", ours.len());
    let faults: Vec<String> = ours
        .iter()
        .filter(|package| !["lumbre", "lumbre_tests"].contains(&package.name.as_str()))
        .flat_map(|package| faults(&package.name, &needs(package)))
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn an_upward_or_forbidden_dependency_is_seen() {
    assert_eq!(faults("lumbre_optics", &BTreeSet::from(["glam", "lumbre_scene"])).len(), 1);
    assert_eq!(faults("lumbre_bake", &BTreeSet::from(["wgpu", "lumbre_render"])).len(), 2);
    assert_eq!(faults("lumbre_new", &BTreeSet::new()).len(), 1);
    assert!(faults("lumbre_scene", &BTreeSet::from(["lumbre_mesh", "gltf"])).is_empty());
}

#[test]
fn one_wgpu_one_winit_one_glam_are_built() {
    // `cargo metadata` and the lock file also list crates that no feature enables; `cargo tree` lists what is
    // built.
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let arguments = ["tree", "--offline", "--locked", "--workspace", "--target", "all", "--prefix", "none"];
    let output = std::process::Command::new(cargo)
        .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
        .args(arguments)
        .args(["--edges", "normal,build,dev", "--format", "{p}"])
        .output()
        .expect("cargo tree runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let tree = String::from_utf8_lossy(&output.stdout);
    for name in ["wgpu", "winit", "glam"] {
        let found: BTreeSet<&str> = tree
            .lines()
            .filter_map(|line| line.strip_prefix(name)?.strip_prefix(" v")?.split(' ').next())
            .collect();
        assert_eq!(found.len(), 1, "{name} is built in these versions: {found:?}");
    }
}

/// Returns the targets of the links of a Markdown page, each with the inline code that follows it up to the next
/// link or the end of the line.
fn links(page: &str) -> Vec<(String, Vec<String>)> {
    let mut found = Vec::new();
    for line in page.lines() {
        let mut parts = line.split("](");
        parts.next();
        for part in parts {
            let Some((target, rest)) = part.split_once(')') else { continue };
            // The text before the next link's text.
            let rest = rest.rsplit_once('[').map_or(rest, |(before, _)| before);
            let code = rest.split('`').skip(1).step_by(2).map(str::to_owned).collect();
            found.push((target.to_owned(), code));
        }
    }
    found
}

#[test]
fn what_the_documentation_names_exists() {
    let root = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let mut tests = 0;
    let pages = [
        "README.md",
        "CHANGELOG.md",
        "docs/documents.md",
        "docs/decisions.md",
        "docs/testing.md",
        "docs/hard-cases.md",
        "docs/baking.md",
        "docs/walks.md",
        "docs/accuracy.md",
    ];
    for page in pages {
        let page = root.join(page);
        let text = std::fs::read_to_string(&page).unwrap();
        for (target, code) in links(&text) {
            let local = !target.contains("://");
            let path = page.parent().unwrap().join(target.split('#').next().unwrap_or_default());
            assert!(!local || path.exists(), "{} names {target}, which is not there", page.display());
            // A link to a test's file is followed by the names of tests.
            let is_name = |code: &&String| {
                code.contains('_') && code.bytes().all(|c| c == b'_' || c.is_ascii_alphanumeric())
            };
            let by_name = page.ends_with("documents.md") || page.ends_with("hard-cases.md");
            if !by_name || !target.ends_with(".rs") {
                continue;
            }
            let source = std::fs::read_to_string(&path).unwrap();
            for name in code.iter().filter(is_name) {
                assert!(source.contains(&format!("fn {name}(")), "{target} has no test `{name}`");
                tests += 1;
            }
        }
    }
    // Rows 1 to 23 of the documents, most with a named test, and those of the hard cases of baking.
    assert!(tests > 80, "only {tests} tests are named");
    let rows = std::fs::read_to_string(root.join("docs/documents.md")).unwrap();
    for row in 1..=23 {
        assert!(rows.contains(&format!("\n| {row} | ")), "row {row} is missing");
    }
    // Control of the parser.
    let sample = "see [a](../x/a.rs) `one_test`, `two` and [b](b.md#part) or ![c](c.png)";
    let expected = [("../x/a.rs", vec!["one_test", "two"]), ("b.md#part", vec![]), ("c.png", vec![])];
    let found = links(sample);
    assert_eq!(found.len(), expected.len());
    for ((target, code), (path, names)) in found.iter().zip(&expected) {
        assert_eq!(
            (target.as_str(), code.iter().map(String::as_str).collect::<Vec<_>>()),
            (*path, names.clone())
        );
    }
}

/// Returns the first column of each table of a page, without its heading.
fn first_columns(page: &str) -> Vec<Vec<&str>> {
    let mut tables = Vec::new();
    for line in page.lines() {
        match line.strip_prefix("| ").and_then(|row| row.split(" | ").next()) {
            Some("file") => tables.push(Vec::new()),
            Some(cell) => tables.last_mut().into_iter().for_each(|table: &mut Vec<&str>| table.push(cell)),
            None => {}
        }
    }
    tables
}

#[test]
fn a_light_and_a_feature_pass_few_files() {
    let root = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let page = std::fs::read_to_string(root.join("docs/walks.md")).unwrap();
    let walks = first_columns(&page);
    assert_eq!(walks.len(), 4, "a light in a frame, a lamp in a bake, a feature, an effect");
    for (walk, (subject, most)) in
        walks.iter().zip([("light", 12), ("light", 14), ("fog", 12), ("shadow", 12)])
    {
        assert!((4..=most).contains(&walk.len()), "{} files about {subject}", walk.len());
        for file in walk {
            let source =
                std::fs::read_to_string(root.join(file)).unwrap_or_else(|error| panic!("{file}: {error}"));
            assert!(source.to_lowercase().contains(subject), "{file} has no word about {subject}");
        }
    }
    assert_eq!(
        first_columns("| file | what |\n|---|---|\n| a.rs | b |\n\n| file | c |\n"),
        [vec!["a.rs"], vec![]]
    );
}
