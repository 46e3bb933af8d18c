//! Passes the hash of everything that a baked texel depends on to the crate; the module `sources` computes it.

#[path = "build/sources.rs"]
mod sources;

use std::path::PathBuf;

fn main() -> std::io::Result<()> {
    let crate_folder = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let sources = sources::Sources::of(&crate_folder)?;
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=build");
    for path in &sources.watched {
        println!("cargo::rerun-if-changed={}", path.display());
    }
    println!("cargo::rustc-env=LUMBRE_BAKE_SOURCES={:016x}", sources.hash);
    Ok(())
}
