//! Plays a level in a window, or draws its tour to pictures if there is no display: `cargo run -p lumbre_demo
//! --example play_level [LEVEL.glb]`.

use std::path::{Path, PathBuf};

use anyhow::Result;
use lumbre_demo::PlayOptions;

fn main() -> Result<()> {
    let ours = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/demo.glb");
    let level = std::env::args_os().nth(1).map_or_else(ours, PathBuf::from);
    if lumbre_demo::has_display() {
        return lumbre_demo::run(&level, PlayOptions::default());
    }
    for picture in lumbre_demo::tour(&level, Path::new("frames"), 24, (960, 540))? {
        eprintln!("{}", picture.display());
    }
    Ok(())
}
