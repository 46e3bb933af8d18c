//! Draws the pictures of docs/baking.md into a folder: the Cornell box by its direct light and by all of it, what the bake states of each
//! texel's error, and the error against the time. The last is drawn from the table that `error_against_time` of `lumbre_bake` prints.
//!
//! `cargo run --release -p lumbre_tests --example bake_pictures -- MODEL.glb TABLE.md docs/images`

#![allow(clippy::print_stdout, reason = "a program whose result is text, too")]

use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::Vec3;
use image::RgbImage;
use lumbre_bake::{Bake, BakeOptions, BakeReport, Density, TexelErrors};
use lumbre_optics::Material;
use lumbre_render::{Display, FrameOptions, Gpu, Offscreen, OffscreenFormat, Renderer};
use lumbre_scene::{Lightmap, LightmapImage, default_camera};
use plotters::prelude::{Color, PathElement, RGBColor, Rectangle, Text};

mod drawing;
mod plot;

use drawing::{Outcome, drawing, text, with_picture};

/// Pixels of a side of a frame.
const SIDE: u32 = 360;
/// Pixels of the strip above a frame, and between two.
const STRIP: u32 = 28;
const GAP: u32 = 8;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<PathBuf> = std::env::args().skip(1).map(PathBuf::from).collect();
    let [model, table, folder] = &arguments[..] else {
        return Err("give a model, the table of error_against_time and a folder".into());
    };
    let gpu = Gpu::headless()?;
    let frames = [(true, "direct light alone"), (false, "with all bounces")].map(|(direct, title)| {
        let (mut world, _) = baked(model, direct)?;
        let options = FrameOptions { multisample: Some(true), ..FrameOptions::default() };
        Ok::<_, Box<dyn Error>>((frame(&gpu, &mut world, &options)?, title))
    });
    let [direct, all] = frames;
    std::fs::write(folder.join("bake-bounces.svg"), beside(&[direct?, all?])?)?;
    std::fs::write(folder.join("bake-sigma.svg"), sigma(&gpu, model)?)?;
    std::fs::write(folder.join("bake-error-time.svg"), plot::draw(&std::fs::read_to_string(table)?)?)?;
    Ok(())
}

/// The model baked at 256 texels a side, with bounces or without: what is black reflects nothing on.
fn baked(model: &Path, direct: bool) -> Result<(World, BakeReport), Box<dyn Error>> {
    let mut world = World::new();
    lumbre_scene::load(&mut world, model)?;
    let mut materials = world.query::<(Entity, &mut Material)>();
    let own: Vec<(Entity, Material)> =
        materials.iter(&world).map(|(entity, material)| (entity, material.clone())).collect();
    if direct {
        materials.iter_mut(&mut world).for_each(|(_, mut material)| material.front.diffuse = Vec3::ZERO);
    }
    let options = BakeOptions { density: Density::MapSize(256), error: 0.02, ..BakeOptions::default() };
    let report = Bake::new(&options).run(&mut world)?;
    for (entity, material) in own {
        world.entity_mut(entity).insert(material);
    }
    let camera = default_camera(&mut world, 1.0);
    world.spawn(camera);
    Ok((world, report))
}

fn frame(gpu: &Gpu, world: &mut World, options: &FrameOptions) -> Result<RgbImage, Box<dyn Error>> {
    let target = Offscreen::new(gpu, SIDE, SIDE, OffscreenFormat::Rgba8)?;
    Renderer::new(gpu).render(world, &target.target(), options)?;
    let rgba = target.read_rgba8(gpu)?;
    let rgb = rgba.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
    RgbImage::from_raw(SIDE, SIDE, rgb).ok_or_else(|| "a frame has a pixel for each place".into())
}

/// Frames beside each other under their titles.
fn beside(frames: &[(RgbImage, &str)]) -> Outcome<String> {
    let count = frames.len() as u32;
    let lefts = (0..count).map(|place| place * (SIDE + GAP));
    let titled = drawing((count * (SIDE + GAP) - GAP, SIDE + STRIP), |root| {
        for ((_, title), left) in frames.iter().zip(lefts.clone()) {
            root.draw(&Text::new((*title).to_owned(), (left as i32 + 4, 8), text()))?;
        }
        Ok(())
    })?;
    let into =
        |svg: String, ((frame, _), left): (&(RgbImage, &str), u32)| with_picture(&svg, frame, (left, STRIP));
    frames.iter().zip(lefts).try_fold(titled, into)
}

/// Viridis by five of its colours.
fn heat(part: f32) -> Vec3 {
    let colors = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]]
        .map(|color: [u8; 3]| Vec3::from(color.map(|code| f32::from(code) / 255.0)));
    let at = part.clamp(0.0, 1.0) * 4.0;
    let low = (at as usize).min(3);
    colors[low].lerp(colors[low + 1], at - low as f32)
}

/// Least and largest error of the legend, of the mean light.
const RANGE: [f32; 2] = [0.002, 0.2];

/// What the bake states of every texel's error, on the surfaces, with a legend.
fn sigma(gpu: &Gpu, model: &Path) -> Outcome<String> {
    let (mut world, report) = baked(model, false)?;
    // A map holds E/π, and so do its errors.
    let mean = (report.mean_irradiance.iter().sum::<f64>() / 3.0 / std::f64::consts::PI) as f32;
    let part = |error: f32| (error / mean / RANGE[0]).ln() / (RANGE[1] / RANGE[0]).ln();
    let mut maps = world.query::<(&mut Lightmap, &TexelErrors, &mut Material)>();
    for (mut map, errors, mut material) in maps.iter_mut(&mut world) {
        let texels =
            errors.0.iter().map(|error| if error.is_nan() { Vec3::ZERO } else { heat(part(*error)) });
        map.image = Arc::new(LightmapImage { texels: texels.collect(), ..(*map.image).clone() });
        *material = Material::matt(Vec3::ONE);
    }
    // A colour is the number that is shown.
    let options = FrameOptions { display: Display::Linear, exposure: Some(1.0), ..FrameOptions::default() };
    let drawn = frame(gpu, &mut world, &options)?;
    let legend = drawing((SIDE + 150, SIDE + STRIP), |root| {
        root.draw(&Text::new("stated error of a texel, of the mean", (4, 8), text()))?;
        let (left, top, height) = (SIDE as i32 + 20, STRIP as i32 + 20, SIDE as i32 - 40);
        for y in 0..height {
            let [red, green, blue] =
                (heat(1.0 - y as f32 / height as f32) * 255.0).to_array().map(|code| code.round() as u8);
            let row = [(left, top + y), (left + 24, top + y + 1)];
            root.draw(&Rectangle::new(row, RGBColor(red, green, blue).filled()))?;
        }
        for percent in [0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0f32] {
            let y = top + ((1.0 - part(percent / 100.0 * mean)) * height as f32) as i32;
            root.draw(&PathElement::new([(left + 24, y), (left + 30, y)], drawing::INK))?;
            root.draw(&Text::new(format!("{percent} %"), (left + 34, y - drawing::FONT as i32 / 2), text()))?;
        }
        Ok(())
    })?;
    let picture = with_picture(&legend, &drawn, (0, STRIP))?;
    println!("stated error of the whole map: {:.2} %", 100.0 * report.estimated_error);
    Ok(picture)
}
