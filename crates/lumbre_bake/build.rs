//! Hands the crate one number for all that a baked texel depends on: see `sources`.

#[path = "build/sources.rs"]
mod sources;

use std::path::PathBuf;

fn main() -> std::io::Result<()> {
    let own = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let sources = sources::Sources::of(&own)?;
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=build");
    for path in &sources.watched {
        println!("cargo::rerun-if-changed={}", path.display());
    }
    println!("cargo::rustc-env=LUMBRE_BAKE_SOURCES={:016x}", sources.hash);
    Ok(())
}
