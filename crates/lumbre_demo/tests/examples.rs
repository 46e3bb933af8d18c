//! The example `generate_level` writes the level in `assets`.

use std::path::Path;
use std::process::Command;

#[test]
fn generate_level_writes_the_shipped_level() {
    let folder = tempfile::tempdir().unwrap();
    let written = folder.path().join("demo.glb");
    // Cargo puts the examples in a folder beside that of the tests.
    let mut example = std::env::current_exe().unwrap();
    example.pop();
    example.set_file_name("examples");
    let example = example.join("generate_level").with_extension(std::env::consts::EXE_EXTENSION);
    let ran = Command::new(example).arg(&written).output().unwrap();
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/demo.glb");
    assert!(
        std::fs::read(&written).unwrap() == std::fs::read(shipped).unwrap(),
        "assets/demo.glb is not what `cargo run -p lumbre_demo --example generate_level` writes: run it"
    );
}
