//! Draws the two tables of pictures of document [M], 2.1 and 1.1, into a folder.
//!
//! `cargo run --release -p lumbre_tests --example documents_tables -- docs/images`

use std::path::PathBuf;

use bevy_ecs::prelude::World;
use image::{Rgb, RgbImage};
use lumbre_optics::Shading;
use lumbre_render::{FrameOptions, Gpu, Offscreen, OffscreenFormat, Renderer};
use lumbre_tests::scenes::documents::{table_1_1, table_2_1};

/// White space between the cells, in pixels.
const GAP: u32 = 4;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".into()));
    let gpu = Gpu::headless()?;
    let rows = (0..3).map(|row| (0..3).map(|column| table_2_1(row, column)).collect()).collect();
    table(&gpu, rows, 200)?.save(folder.join("table-2.1.png"))?;
    let shadings = Shading::ALL.iter().map(|shading| table_1_1(*shading)).collect();
    table(&gpu, vec![shadings], 300)?.save(folder.join("table-1.1.png"))?;
    Ok(())
}

/// Draws all scenes as one picture with these rows, all of the same length.
fn table(gpu: &Gpu, rows: Vec<Vec<World>>, cell: u32) -> Result<RgbImage, Box<dyn std::error::Error>> {
    let frame = Offscreen::new(gpu, cell, cell, OffscreenFormat::Rgba8)?;
    let mut renderer = Renderer::new(gpu);
    let options = FrameOptions { multisample: Some(true), ..FrameOptions::default() };
    let across = |count: usize| count as u32 * (cell + GAP) - GAP;
    let columns = rows.first().map_or(0, Vec::len);
    let mut table = RgbImage::from_pixel(across(columns), across(rows.len()), Rgb([255; 3]));
    for (row, worlds) in (0u32..).zip(rows) {
        for (column, mut world) in (0u32..).zip(worlds) {
            renderer.render(&mut world, &frame.target(), &options)?;
            for (index, pixel) in (0u32..).zip(frame.read_rgba8(gpu)?.chunks_exact(4)) {
                let (x, y) = (column * (cell + GAP) + index % cell, row * (cell + GAP) + index / cell);
                table.put_pixel(x, y, Rgb([pixel[0], pixel[1], pixel[2]]));
            }
        }
    }
    Ok(table)
}
