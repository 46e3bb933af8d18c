//! `lumbre explain`: which effects a scene calls for and which it does not, and what each costs.

use std::io::Write;

use anyhow::Context;
use bevy_ecs::world::World;
use lumbre::render::{Display, FrameOptions, Gpu, Renderer, effect_costs, explain, removable_effects};
use lumbre::scene::{add_default_light, is_without_light};

use crate::arguments::{Explain, ExplainFormat, Frame};
use crate::loading::{frame_options, load, load_quietly};

/// Shown below the short text: options for more.
const HINT: &str =
    "\n--all gives the reasons, passes, resources and variants; --measure what each effect costs\n";

/// Runs the command.
pub fn run(asked: &Explain) -> anyhow::Result<()> {
    let (width, height) = asked.size;
    let mut world = load(&asked.input, &asked.reading)?.world;
    let options = options(asked, &asked.frame, &mut world)?;
    let mut explanation = explain(&mut world, &options, width, height)?;
    if let Some(time) = asked.measure {
        let gpu = Gpu::headless()?;
        // Explains the frame of the device that is measured.
        explanation = Renderer::new(&gpu).explain(&mut world, &options, width, height)?;
        let effects = removable_effects(&explanation.census, &options);
        let mut again = || again(asked);
        let cost = effect_costs(&gpu, &mut again, &effects, [width, height], time)
            .with_context(|| format!("{} could not be drawn", asked.input.display()))?;
        explanation.cost = Some(cost);
    }
    let text = match asked.format {
        ExplainFormat::Text if asked.all => explanation.to_text(),
        ExplainFormat::Text => explanation.to_short_text() + HINT,
        ExplainFormat::Json => serde_json::to_string_pretty(&explanation)? + "\n",
        ExplainFormat::Dot => explanation.frame.to_dot(),
    };
    std::io::stdout().lock().write_all(text.as_bytes())?;
    Ok(())
}

fn options(asked: &Explain, frame: &Frame, world: &mut World) -> anyhow::Result<FrameOptions> {
    let (width, height) = asked.size;
    let display = frame.display.unwrap_or(Display::Srgb);
    frame_options(world, frame, display, f64::from(width) / f64::from(height), &asked.input)
}

/// Loads the scene again, with the options of its frame, without repeating notes.
fn again(asked: &Explain) -> anyhow::Result<(World, FrameOptions)> {
    let mut world = load_quietly(&asked.input, &asked.reading)?.world;
    let options = options(asked, &Frame { no_default_light: true, ..asked.frame.clone() }, &mut world)?;
    if let Some(camera) =
        options.camera.filter(|_| !asked.frame.no_default_light && is_without_light(&mut world))
    {
        add_default_light(&mut world, camera);
    }
    Ok((world, options))
}
