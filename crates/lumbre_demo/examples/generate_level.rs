//! Writes the level as ordinary glTF: `cargo run -p lumbre_demo --example generate_level [OUT.glb]`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use bevy_ecs::world::World;

fn main() -> Result<()> {
    let ours = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/demo.glb");
    let path = std::env::args_os().nth(1).map_or_else(ours, PathBuf::from);
    let mut world = World::new();
    lumbre_demo::level::build(&mut world);
    let report = lumbre_scene::save(&mut world, &path).context("the level cannot be written")?;
    for note in &report.notes {
        eprintln!("{note:?}");
    }
    eprintln!("{}: {} bytes", path.display(), report.bytes);
    Ok(())
}
