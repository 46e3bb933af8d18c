//! Writes pictures to files.

use std::path::Path;

use anyhow::{Context, Result};

/// Writes RGBA bytes as a PNG, through a temporary file, so that no partial file is left under its name.
///
/// # Errors
/// The file cannot be written.
pub fn write_png(path: &Path, width: u32, height: u32, rgba: &[u8]) -> Result<()> {
    let beside = path.with_extension("png.unfinished");
    let written = image::save_buffer_with_format(
        &beside,
        rgba,
        width,
        height,
        image::ExtendedColorType::Rgba8,
        image::ImageFormat::Png,
    )
    .map_err(anyhow::Error::from)
    .and_then(|()| Ok(std::fs::rename(&beside, path)?));
    written.with_context(|| format!("cannot write {}; check the folder and the space left", path.display()))
}
