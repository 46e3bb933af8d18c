//! The hash of the baker's sources, which is part of the content hash: it covers every crate whose change may change a
//! baked bit, and nothing else.

#[path = "../../build/sources.rs"]
mod sources;

use std::fs;
use std::path::{Path, PathBuf};

use sources::Sources;

/// A workspace on disk in which the baker depends on another project crate and that on an external one; further crates
/// are unrelated to the baker. Returns its folder and the baker's.
fn workspace() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("there is room for a few files");
    let baker = folder.path().join("crates/lumbre_bake");
    for (path, text) in [
        ("crates/lumbre_bake/src/lib.rs", "mod deep;\n"),
        ("crates/lumbre_bake/src/deep/mod.rs", "// 1\n"),
        ("crates/lumbre_bake/Cargo.toml", "[package]\n"),
        ("crates/lumbre_rays/src/lib.rs", "// rays\n"),
        ("crates/lumbre_demo/src/lib.rs", "// demo\n"),
        ("Cargo.lock", LOCK),
    ] {
        let path = folder.path().join(path);
        fs::create_dir_all(path.parent().expect("it lies in a folder")).expect("a folder can be made");
        fs::write(path, text).expect("a file can be written");
    }
    (folder, baker)
}

const LOCK: &str = r#"version = 4

[[package]]
name = "glam"
version = "0.34.2"
source = "registry"
checksum = "aaaa"

[[package]]
name = "lumbre_bake"
version = "0.1.0"
dependencies = [
 "lumbre_rays",
]

[[package]]
name = "lumbre_demo"
version = "0.1.0"
dependencies = [
 "winit",
]

[[package]]
name = "lumbre_rays"
version = "0.1.0"
dependencies = [
 "glam 0.34.2",
]

[[package]]
name = "winit"
version = "0.30.0"
checksum = "bbbb"
"#;

fn hash(baker: &Path) -> u64 {
    Sources::of(baker).expect("the sources can be read").hash
}

#[test]
fn what_may_change_a_bit_changes_the_hash_and_nothing_else_does() {
    let (folder, baker) = workspace();
    let before = hash(&baker);
    assert_eq!(hash(&baker), before);
    let with = |path: &str, from: &str, to: &str| {
        let path = folder.path().join(path);
        let text = fs::read_to_string(&path).expect("it was written");
        assert!(text.contains(from), "{text}");
        fs::write(&path, text.replace(from, to)).expect("a file can be written");
        let changed = hash(&baker);
        fs::write(&path, text).expect("a file can be written");
        changed
    };
    for (path, from, to) in [
        ("crates/lumbre_bake/src/deep/mod.rs", "1", "2"),
        ("crates/lumbre_bake/Cargo.toml", "package", "package]\n["),
        ("crates/lumbre_rays/src/lib.rs", "rays", "other rays"),
        ("Cargo.lock", "0.34.2\"\nsource", "0.34.3\"\nsource"),
        ("Cargo.lock", "aaaa", "aaab"),
    ] {
        assert_ne!(with(path, from, to), before, "{path}: {from} became {to}");
    }
    for (path, from, to) in [
        ("crates/lumbre_demo/src/lib.rs", "demo", "game"),
        ("crates/lumbre_rays/src/lib.rs", "\n", "\r\n"),
        ("Cargo.lock", "bbbb", "cccc"),
    ] {
        assert_eq!(with(path, from, to), before, "{path}: {from} became {to}");
    }
    assert_eq!(hash(&baker), before);
}

#[test]
fn a_package_outside_the_workspace_is_hashed_by_its_manifest() {
    let (folder, baker) = workspace();
    fs::remove_file(folder.path().join("Cargo.lock")).expect("it was there");
    fs::remove_dir_all(folder.path().join("crates/lumbre_rays")).expect("it was there");
    let before = hash(&baker);
    fs::write(baker.join("Cargo.toml"), "[package]\n[dependencies]\nlumbre_rays = \"0.2\"\n")
        .expect("it can be");
    assert_ne!(hash(&baker), before);
}

#[test]
fn all_project_crates_that_the_baker_depends_on_are_hashed() {
    let sources = Sources::of(Path::new(env!("CARGO_MANIFEST_DIR"))).expect("the sources can be read");
    let counts = |name: &str| sources.watched.iter().any(|path| path.ends_with(format!("{name}/src")));
    for name in ["lumbre_bake", "lumbre_mesh", "lumbre_optics", "lumbre_rays", "lumbre_scene"] {
        assert!(counts(name), "{name} is not among {:?}", sources.watched);
    }
    assert!(!counts("lumbre_render"), "{:?}", sources.watched);
    // Cargo runs the build script again when one of them changes.
    assert!(sources.watched.iter().all(|path| path.exists()), "{:?}", sources.watched);
}
