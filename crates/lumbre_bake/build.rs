//! One number for the source of everything that a baked texel depends on, so that a checkpoint or a finished map of another baker is
//! told apart without anybody having to remember to count a version up.

use std::path::{Path, PathBuf};

/// This crate, those whose arithmetic goes into a texel, and the one that reads and writes scenes.
const CRATES: [&str; 5] = ["lumbre_bake", "lumbre_rays", "lumbre_mesh", "lumbre_optics", "lumbre_scene"];

fn main() -> std::io::Result<()> {
    let own = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    println!("cargo::rerun-if-changed=build.rs");
    let mut files = Vec::new();
    for name in CRATES {
        // Outside the workspace only the own sources are there.
        let folder = own.with_file_name(name).join("src");
        let folder = if name == "lumbre_bake" { own.join("src") } else { folder };
        if folder.is_dir() {
            println!("cargo::rerun-if-changed={}", folder.display());
            collect(&folder, &folder, name, &mut files)?;
        }
    }
    files.sort();
    // FNV-1a: mistakes are to be told apart here, not attacks.
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for (name, text) in files {
        for byte in name.bytes().chain([0]).chain(text).chain([0]) {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
    println!("cargo::rustc-env=LUMBRE_BAKE_SOURCES={hash:016x}");
    Ok(())
}

fn collect(
    folder: &Path,
    root: &Path,
    name: &str,
    files: &mut Vec<(String, Vec<u8>)>,
) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            collect(&path, root, name, files)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let below = path.strip_prefix(root).unwrap_or(&path).to_string_lossy().replace('\\', "/");
            // Line ends differ between checkouts.
            let text = std::fs::read(&path)?.into_iter().filter(|byte| *byte != b'\r').collect();
            files.push((format!("{name}/{below}"), text));
        }
    }
    Ok(())
}
