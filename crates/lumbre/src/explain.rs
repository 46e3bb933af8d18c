//! `lumbre explain`: what a scene calls for, and what it does not.

use std::io::Write;

use lumbre::render::{Display, explain};

use crate::arguments::{Explain, ExplainFormat};
use crate::loading::{frame_options, load};

/// Runs the command.
pub fn run(asked: &Explain) -> anyhow::Result<()> {
    let mut world = load(&asked.input, &asked.reading)?.world;
    let (width, height) = (1280, 720);
    let display = asked.frame.display.unwrap_or(Display::Srgb);
    let aspect = f64::from(width) / f64::from(height);
    let options = frame_options(&mut world, &asked.frame, display, aspect, &asked.input)?;
    let explanation = explain(&mut world, &options, width, height)?;
    let text = match asked.format {
        ExplainFormat::Text => explanation.to_text(),
        ExplainFormat::Json => serde_json::to_string_pretty(&explanation)? + "\n",
        ExplainFormat::Dot => explanation.frame.to_dot(),
    };
    std::io::stdout().lock().write_all(text.as_bytes())?;
    Ok(())
}
